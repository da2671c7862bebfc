#include "accel/ray8.h"

#include "base/number.h"

#define UNIT 0x1p-24
/* In units of M = size + max |o_k|, which no coordinate relative to the origin exceeds. Boxes are grown by 8 (cone_lanes.c asks
 * for 6). Sheared coordinates x' = x - Sx z, y' = y - Sy z with |Sx|, |Sy| <= 1 are off by less than 12 each: vertex and
 * origin rounded, two differences, Sx and a product (9), the vertex's shares (2). An edge function b x c is off by
 * error (|b| + |c| + error), error being 2 x 12 for the coordinates and the rest for its own roundings. t of a corner is off
 * by 8 |1/d|, and the mean of three t with weights of one sign by 7 more (sum, inverse, two products, two sums), its ends by 2.
 * The last two bounds have 1e-4 of themselves to spare for being rounded to nearest.
 *
 * Nothing of it may underflow: no M counts as less than FLOOR, so that what is surely hit has areas of 1e-30 m^2 or more. */
#define BOX_ERROR (8 * UNIT)
#define EDGE_ERROR (1.0001 * 24 * UNIT)
#define T_ERROR (1.0001 * 20 * UNIT)
#define FLOOR 1e-9

void ray8_make(const KellerAccel *a, KellerVec3 origin, KellerVec3 direction, KellerRange clip, Ray8 *q, KellerConeLanes *l)
{
    KellerVec3 from = v3_sub(origin, a->middle);
    const double o[3] = {from.x, from.y, from.z}, d[3] = {direction.x, direction.y, direction.z};
    double x = fabs(d[0]), y = fabs(d[1]), z = fabs(d[2]), most = greater(x, greater(y, z));
    int last = z >= most ? 2 : y >= most ? 1 : 0;
    double reach = a->size + greater(fabs(o[0]), greater(fabs(o[1]), fabs(o[2]))) + FLOOR, width = BOX_ERROR * reach;
    d4 D = d4_set(d[0], d[1], d[2], d[last]), sign = d4_or(d4_set1(1), d4_and(d4_set1(-0.0), D)), at = d4_set(o[0], o[1], o[2], 0);
    d4 rate = d4_div(sign, d4_max(d4_abs(D), d4_set1(0x1p-26 * most)));
    double rates[4];
    d4_store(rates, rate);
    d4_store_floats(l->enter, d4_add(at, d4_mul(sign, d4_set1(width))));
    d4_store_floats(l->leave, d4_sub(at, d4_mul(sign, d4_set1(width))));
    d4_store_floats(l->enter_rate, rate);
    d4_store_floats(l->leave_rate, rate);
    l->tan_alpha = l->x0 = 0;
    l->slack = (float)width; /* beside which x0 is not wide */
    l->near = float_down(clip.near);
    l->far = float_up(clip.far);
    q->origin = origin;
    q->direction = direction;
    q->axis[0] = last == 0;
    q->axis[1] = last == 2 ? 1 : 2;
    q->axis[2] = last;
    for (int k = 0; k < 3; k++) q->from[k] = (float)o[q->axis[k]];
    q->rate = (float)rates[3];
    q->shear[0] = (float)(d[q->axis[0]] * rates[3]);
    q->shear[1] = (float)(d[q->axis[1]] * rates[3]);
    q->edge_error = (float)(EDGE_ERROR * reach);
    q->t_error = (float)(T_ERROR * reach * fabs(rates[3]));
}

void ray8_origin(const KellerAccel *a, const Ray8 *q, KellerConeLanes *l)
{
    KellerVec3 o = v3_sub(q->origin, a->middle);
    const double from[3] = {o.x, o.y, o.z}, d[3] = {q->direction.x, q->direction.y, q->direction.z};
    double least = 0x1p-26 * greater(fabs(d[0]), greater(fabs(d[1]), fabs(d[2])));
    for (int k = 0; k < 3; k++) {
        l->origin[k] = (float)from[k];
        /* off by as much as a rounding, and along no side of a box that is along the axes */
        l->axis[2][k] = (float)(fabs(d[k]) < least ? copysign(least, d[k]) : d[k]);
    }
    l->slack *= (float)((double)KELLER_CONE_SLACK_FLOAT / BOX_ERROR);
}
