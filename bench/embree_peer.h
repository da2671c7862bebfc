/* embree_peer.h -- Embree's nearest hit of a ray, to compare with: fast or robust mode, medium build quality, one thread. */
#ifndef BENCH_EMBREE_PEER_H
#define BENCH_EMBREE_PEER_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "keller/vec.h"

typedef struct Peer Peer;

/* Is it compiled in? */
bool peer_there(void);
/* Builds over triangles in single precision relative to `middle`; *seconds is the time of the commit alone. NULL: cannot. */
Peer *peer_new(size_t triangle_count, const KellerVec3 *vertices, const uint32_t (*triangles)[3], KellerVec3 middle,
               bool robust, double *seconds);
/* Traces the rays one after another; returns how many hit. */
size_t peer_nearest(Peer *peer, size_t count, const KellerVec3 *origins, const KellerVec3 *directions);
void peer_free(Peer *peer);
#endif
