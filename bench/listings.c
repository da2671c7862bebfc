/* The same text for both precisions. */
#include "listings.h"

#define REAL float
#define NAME(f) f##_float
#define ROOT sqrtf
#define SPLIT 4097.0f /* 2^12 + 1 (Dekker) */
#include "listings_body.h"
#undef REAL
#undef NAME
#undef ROOT
#undef SPLIT

#define REAL double
#define NAME(f) f##_double
#define ROOT sqrt
#define SPLIT 134217729.0 /* 2^27 + 1 */
#include "listings_body.h"

const Listings listings_float = {"listings float", plane_float, edge_float, box_float, triangle_float, box8_float};
const Listings listings_double = {"listings double", plane_double,    edge_double,
                                  box_double,        triangle_double, box8_double};
