/* embree_peer.h -- Embree's hits of a ray, to compare with: fast or robust mode, medium build quality, one thread. */
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
/* All or many hits of a ray, by Embree's means; hits has room for `most`. */
typedef struct {
    float t;
    uint32_t triangle;
} PeerHit;
/* Has every hit filtered from now on (for peer_filter alone); false: cannot. */
bool peer_set_filter(Peer *peer);
/* The multi-hit kernel of Amstutz et al. 2015: an intersection filter collects each hit and rejects it; then they are sorted. */
size_t peer_filter(Peer *peer, KellerVec3 origin, KellerVec3 direction, PeerHit *hits, size_t most);
/* The nearest hit, again and again, each time from nextafter of the last t on, `most` times at most: where a step makes no progress, it
 * is not the last such. */
size_t peer_restart(Peer *peer, KellerVec3 origin, KellerVec3 direction, PeerHit *hits, size_t most);
void peer_free(Peer *peer);
#endif
