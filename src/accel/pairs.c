/* Two ways to find pairs (UBVH, section 4.1.2): each triangle with the next, as they come; or, after PLOC (Meister and Bittner 2018),
 * with the one of its neighbours along a space-filling curve with which it has the smallest box, if it is that one's choice too. */
#include "accel/pairs.h"

#include <omp.h>
#include <stdlib.h>
#include <string.h>

#include "accel/wide.h"
#include "base/number.h"

enum {
    RADIUS = 8, ROUNDS = 4,         /* the paper's */
    SMALL = 4096                    /* primitives for which threads cost more to wake than they save */
};

static bool same(KellerVec3 a, KellerVec3 b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

/* Two corners in common become the first two of each; false: there are no two. */
static bool share(KellerVec3 a[3], KellerVec3 b[3])
{
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            KellerVec3 p = a[i], q = a[(i + 1) % 3], c = a[(i + 2) % 3], u = b[j], v = b[(j + 1) % 3], d = b[(j + 2) % 3];
            if (!((same(p, u) && same(q, v)) || (same(p, v) && same(q, u)))) continue;
            a[0] = p, a[1] = q, a[2] = c;
            b[0] = u, b[1] = v, b[2] = d;
            return true;
        }
    return false;
}

/* With a triangle whose corners are at hand. */
static bool box_with(const TreeInput *in, const KellerVec3 corners[3], uint32_t j, double margin, Sobb *box, SobbPlace *place)
{
    KellerVec3 a[3] = {corners[0], corners[1], corners[2]}, b[3];
    if (in->corners(in->clip_context, j, b) != 3) return false;
    return share(a, b) && sobb_around_pair(a, b, margin, box, place);
}

static bool box_of_pair(const TreeInput *in, uint32_t i, uint32_t j, double margin, Sobb *box, SobbPlace *place)
{
    KellerVec3 a[3];
    return in->corners(in->clip_context, i, a) == 3 && box_with(in, a, j, margin, box, place);
}

Sobb pair_box(const TreeInput *in, Pair pair, double margin, SobbPlace *place)
{
    Sobb box;
    KellerVec3 v[3];
    if (pair.second != KELLER_NONE && box_of_pair(in, pair.first, pair.second, margin, &box, place)) return box;
    *place = SOBB_ONE;
    int count = in->corners(in->clip_context, pair.first, v);
    return sobb_around(count, v, margin);
}

static void greedy(const TreeInput *in, double margin, uint32_t *mate)
{
    for (uint32_t i = 0; i + 1 < in->count; i++) {
        Sobb box;
        SobbPlace place;
        if (mate[i] != KELLER_NONE || !box_of_pair(in, i, i + 1, margin, &box, &place)) continue;
        mate[i] = i + 1;
        mate[i + 1] = i;
    }
}

/* ---- along a curve ----------------------------------------------------------------------------------------------- */

typedef struct {
    uint64_t code;
    uint32_t id, best;
} Place;

/* 21 bits, two apart. */
static uint64_t spread(uint64_t x)
{
    x = (x | x << 32) & 0x1f00000000ffffull;
    x = (x | x << 16) & 0x1f0000ff0000ffull;
    x = (x | x << 8) & 0x100f00f00f00f00full;
    x = (x | x << 4) & 0x10c30c30c30c30c3ull;
    return (x | x << 2) & 0x1249249249249249ull;
}

static uint64_t morton(const AccelBox *box, double size)
{
    uint64_t code = 0;
    for (int k = 0; k < 3; k++) {
        double at = 0.5 * ((double)box->lower[k] + (double)box->upper[k]) / size; /* from -1 to 1 */
        code |= spread((uint64_t)(lesser(greater(0.5 + 0.5 * at, 0), 1) * 0x1fffff)) << k;
    }
    return code;
}

static int by_code(const void *a, const void *b)
{
    const Place *p = a, *q = b;
    if (p->code != q->code) return p->code < q->code ? -1 : 1;
    return (p->id > q->id) - (p->id < q->id);
}

static double common_area(const AccelBox *a, const AccelBox *b)
{
    AccelBox both;
    for (int k = 0; k < 3; k++) {
        both.lower[k] = a->lower[k] < b->lower[k] ? a->lower[k] : b->lower[k];
        both.upper[k] = a->upper[k] > b->upper[k] ? a->upper[k] : b->upper[k];
    }
    return wide_area(&both);
}

/* Each one's best neighbour among those that are left; what chooses each other is a pair. Returns how many are left. */
static uint32_t pair_up(const TreeInput *in, double margin, Place *place, uint32_t count, uint32_t *mate)
{
    int threads = in->threads > 0 ? in->threads : omp_get_max_threads();
#pragma omp parallel for schedule(static) num_threads(threads) if (threads > 1 && count >= SMALL)
    for (uint32_t i = 0; i < count; i++) {
        double least = INFINITY;
        place[i].best = KELLER_NONE;
        KellerVec3 corners[3];
        Sobb box;
        SobbPlace in_it;
        if (in->corners(in->clip_context, place[i].id, corners) != 3) continue; /* an edge */
        uint32_t from = i > RADIUS ? i - RADIUS : 0, to = i + RADIUS < count ? i + RADIUS + 1 : count;
        for (uint32_t j = from; j < to; j++) {
            if (j == i) continue;
            double area = common_area(&in->boxes[place[i].id], &in->boxes[place[j].id]);
            if (!(area < least) || !box_with(in, corners, place[j].id, margin, &box, &in_it)) continue;
            least = area;
            place[i].best = j;
        }
    }
    for (uint32_t i = 0; i < count; i++) {
        uint32_t j = place[i].best;
        if (j == KELLER_NONE || j < i || place[j].best != i) continue;
        mate[place[i].id] = place[j].id;
        mate[place[j].id] = place[i].id;
    }
    uint32_t left = 0;
    for (uint32_t i = 0; i < count; i++)
        if (mate[place[i].id] == KELLER_NONE) place[left++] = place[i];
    return left;
}

static void by_curve(const TreeInput *in, double margin, Place *place, uint32_t *mate)
{
    double size = 0;
    uint32_t left = in->count;
    for (uint32_t i = 0; i < in->count; i++)
        for (int k = 0; k < 3; k++)
            size = greater(size, greater(fabs((double)in->boxes[i].lower[k]), fabs((double)in->boxes[i].upper[k])));
    for (uint32_t i = 0; i < in->count; i++) place[i] = (Place){morton(&in->boxes[i], greater(size, 1e-300)), i, KELLER_NONE};
    qsort(place, in->count, sizeof *place, by_code);
    for (int round = 0; round < ROUNDS && left > 1; round++) {
        uint32_t before = left;
        left = pair_up(in, margin, place, left, mate);
        if (left == before) break;
    }
}

KellerStatus pairs_find(const TreeInput *in, KellerPairs how, double margin, Pair **pairs, uint32_t *count, KellerError *error)
{
    size_t n = (size_t)in->count + 1, bytes = n * (sizeof **pairs + sizeof(uint32_t) + sizeof(Place));
    uint32_t *mate = malloc(n * sizeof *mate);
    Place *place = how == KELLER_PAIRS_PLOC ? malloc(n * sizeof *place) : NULL;
    *pairs = malloc(n * sizeof **pairs);
    *count = 0;
    if (!mate || !*pairs || (how == KELLER_PAIRS_PLOC && !place)) {
        free(mate);
        free(place);
        free(*pairs);
        *pairs = NULL;
        return keller_error_memory(error, bytes);
    }
    memset(mate, 0xff, n * sizeof *mate);
    if (how == KELLER_PAIRS_GREEDY) greedy(in, margin, mate);
    if (place) by_curve(in, margin, place, mate);
    for (uint32_t i = 0; i < in->count; i++)
        if (mate[i] == KELLER_NONE || mate[i] > i) (*pairs)[(*count)++] = (Pair){i, mate[i]};
    free(mate);
    free(place);
    return KELLER_OK;
}
