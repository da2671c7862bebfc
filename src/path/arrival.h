/* Can the wave that arrives at one edge go on to another? Conservative, and cheap enough for millions of pairs. */
#ifndef KELLER_PATH_ARRIVAL_H
#define KELLER_PATH_ARRIVAL_H
#include "base/number.h"
#include "path/sieve.h"
#include "path/trie.h"

/* How a wave from the end of a search arrives at the last wedge of a sequence, conservatively. */
typedef struct {
    float lit[2];               /* part of the edge, m from its start */
    float z[2], rho[2];         /* m: where the wave's source is, along the edge from its start, and away from its line */
} Arrival;

/* How the wave from the end comes to the last wedge of a sequence of the trie. */
Arrival arrival_of(const KellerScene *scene, const Trie *trie, uint32_t node, KellerVec3 end);
/* What holds for any of these, one at least. */
Arrival arrival_of_all(const Arrival *arrival, uint32_t count);

/* An edge, or its mirror image. */
typedef struct {
    KellerVec3 origin, direction, normal[2];    /* of the wedge's faces, into its sector */
    double length, rounding;    /* m */
    bool convex;                /* n > 1 */
} EdgeImage;

/* The wedge's edge mirrored in `count` faces, face[0] first. */
EdgeImage edge_image(const KellerScene *scene, uint32_t wedge, uint32_t count, const uint32_t *face);

/* Two edges, each in the frame of the other. */
typedef struct {
    double turn;                /* cosine of the angle between them */
    double rounding;            /* m, of positions */
    struct {                    /* the other edge's point at t: z = z0 + turn t, rho^2 = a + t (b + c t) */
        double z0, a, b, c;
    } seen[2];                  /* by the first and by the second */
} EdgePair;

/* False where no diffracted wave goes from the one to the other: they lie in one line, or one is outside the other's sector. */
bool edge_pair(const EdgeImage *first, const EdgeImage *second, EdgePair *pair);

/* Of cotangents and of lengths along an edge, relative and in m: far above single precision. */
static const double arrival_pad = 1e-5;

/* Between places za[0] .. za[1] along a line, ra[0] .. ra[1] away from it, and places zb at distances rb the shortest way over the line meets
 * it at their mean, with the weights rb and ra. Narrows `on` to where that may be; on[0] > on[1]: nowhere. */
static inline void narrow_between(const double za[2], const double ra[2], const double zb[2], const double rb[2], double on[2])
{
    const double tiny = 1e-300; /* of nothing and nothing the weights are 0 and 1 */
    const double w[2] = {ra[0] / (ra[0] + rb[1] + tiny), (ra[1] + tiny) / (ra[1] + rb[0] + tiny)};
    const double low = lesser(za[0] + w[0] * (zb[0] - za[0]), za[0] + w[1] * (zb[0] - za[0]));
    const double high = greater(za[1] + w[0] * (zb[1] - za[1]), za[1] + w[1] * (zb[1] - za[1]));
    on[0] = greater(on[0], low - arrival_pad * (1 + fabs(low)));
    on[1] = lesser(on[1], high + arrival_pad * (1 + fabs(high)));
}

/* Keller's law at both: can a ray that arrives at the first edge as `one` says go on to where the second is lit, and back? lit[i]: in
 * which parts of the edges (m) it meets them then. */
bool edges_agree(const EdgePair *pair, const Arrival *one, const Arrival *other, double lit[2][2]);

/* How long the wave's way from its source to the edge is at most, m. */
double arrival_reach(const Arrival *arrival);

/* Can rays from these parts of the two edges be mirrored in the faces between them, each within the face's box? beyond: how long the path is
 * on the far sides of the two, m, about: what counts as a face's border grows with all of it. */
bool faces_between(const KellerScene *scene, const FaceBox *boxes, uint32_t first, uint32_t second, uint32_t count, const uint32_t *face,
                   const double lit[2][2], double beyond);

/* Keller's law at one: the wave's source is z[0] .. z[1] (m) along the edge from edge[0], and rho[0] .. rho[1] away from its line. on: the part
 * of the edge, m from edge[0], that rays leave for points zb[0] .. zb[1] along it and rb[0] .. rb[1] away; false: there is none. An edge too
 * short to tell is not cut. */
bool edge_part_to(const KellerScene *scene, const KellerVec3 edge[2], const double z[2], const double rho[2], const double zb[2],
                  const double rb[2], double on[2]);

/* Can a ray leave the edge for a point between a and b? */
bool edge_leads_to(const KellerScene *scene, const KellerVec3 edge[2], const double z[2], const double rho[2], KellerVec3 a, KellerVec3 b);
#endif
