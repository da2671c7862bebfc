/* The text of the listings, without an include guard: listings.c defines REAL, NAME, ROOT and SPLIT and includes it
 * for each precision. `line n` is the listing's. */

typedef struct {
    REAL x, y, z;
} NAME(V);

typedef struct {
    NAME(V) o, axis[3];
    REAL e, T, x0, near, far; /* near, far: rng, with the cone's own clip planes */
} NAME(Cone);

typedef struct {
    REAL near, far; /* near > far: none */
    NAME(V) nearest, farthest;
} NAME(Hit);

static NAME(V) NAME(v)(REAL x, REAL y, REAL z) { return (NAME(V)){x, y, z}; }
static REAL NAME(dot)(NAME(V) a, NAME(V) b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static NAME(V) NAME(minus)(NAME(V) a, NAME(V) b) { return NAME(v)(a.x - b.x, a.y - b.y, a.z - b.z); }
static NAME(V) NAME(real)(KellerVec3 a) { return NAME(v)((REAL)a.x, (REAL)a.y, (REAL)a.z); }
static bool NAME(finite)(REAL a) { return a - a == 0; }

static NAME(Cone) NAME(cone_of)(const KellerCone *c, KellerRange clip)
{
    REAL near = (REAL)(c->z_near > clip.near ? c->z_near : clip.near),
         far = (REAL)(c->z_far < clip.far ? c->z_far : clip.far);
    return (NAME(Cone)){NAME(real)(c->origin),
                        {NAME(real)(c->major), NAME(real)(c->minor), NAME(real)(c->directrix)},
                        (REAL)c->e,
                        (REAL)c->tan_alpha,
                        (REAL)c->x0,
                        near,
                        far};
}

static NAME(V) NAME(turn)(const NAME(Cone) * c, NAME(V) q)
{
    return NAME(v)(NAME(dot)(q, c->axis[0]), NAME(dot)(q, c->axis[1]), NAME(dot)(q, c->axis[2]));
}

static NAME(V) NAME(local)(const NAME(Cone) * c, KellerVec3 p)
{
    return NAME(turn)(c, NAME(minus)(NAME(real)(p), c->o));
}

/* Equation 2. */
static bool NAME(in_cone)(const NAME(Cone) * c, NAME(V) p)
{
    REAL R = p.z * c->T + c->x0, y = c->e * p.y;
    return p.x * p.x + y * y <= R * R && p.z >= c->near && p.z <= c->far;
}

static REAL NAME(apex)(const NAME(Cone) * c) { return c->x0 > 0 && c->T > 0 ? -c->x0 / c->T : -(REAL)INFINITY; }

static const NAME(Hit) NAME(nothing) = {(REAL)INFINITY, -(REAL)INFINITY, {0, 0, 0}, {0, 0, 0}};

static void NAME(take)(NAME(Hit) * h, NAME(V) p)
{
    if (!NAME(finite)(p.z)) return;
    if (p.z < h->near) {
        h->near = p.z;
        h->nearest = p;
    }
    if (p.z > h->far) {
        h->far = p.z;
        h->farthest = p;
    }
}

/* ---- listing 1: the plane n.p = d of the local frame ------------------------------------------------------------- */

/* A point of the plane at z inside the cone, if there is one: the nearest to the axis. */
static NAME(V) NAME(at_z)(NAME(V) n, REAL d, REAL z)
{
    REAL nn = n.x * n.x + n.y * n.y, s = nn > 0 ? (d - n.z * z) / nn : 0;
    return NAME(v)(n.x * s, n.y * s, z);
}

static NAME(Hit) NAME(isect_plane)(const NAME(Cone) * c, NAME(V) n, REAL d)
{
    REAL e2 = c->e * c->e, g = ROOT(n.x * n.x + n.y * n.y / e2), apex = NAME(apex)(c), z[2];
    NAME(V) u = NAME(v)(n.x / g, n.y / e2 / g, 0), p[2];
    if (!(u.x == u.x && u.y == u.y)) u = NAME(v)(0, 0, 0); /* line 6 */
    REAL nu = NAME(dot)(n, u);
    for (int i = 0; i < 2; i++) {
        REAL sign = i ? -1 : 1, R;
        z[i] = (d - sign * c->x0 * nu) / (sign * c->T * nu + n.z);
        if (z[i] <= apex || z[i] != z[i]) z[i] = (REAL)INFINITY; /* lines 12, 13 */
        R = sign * (z[i] * c->T + c->x0);
        p[i] = NAME(v)(R * u.x, R * u.y, z[i]);
    }
    int first = z[0] > z[1];
    NAME(Hit) h = {z[first], z[!first], p[first], p[!first]};
    if (h.near == (REAL)INFINITY) return NAME(nothing); /* the text: no intersection occurs when z is infinite */
    if (h.near < c->near) {
        h.near = c->near;
        h.nearest = NAME(at_z)(n, d, h.near);
    }
    if (h.far > c->far) {
        h.far = c->far;
        h.farthest = NAME(at_z)(n, d, h.far);
    }
    return h.near <= h.far ? h : NAME(nothing);
}

/* ---- listing 2 --------------------------------------------------------------------------------------------------- */

/* a b + c d + s f g in twice the working precision (Dekker's product, Ogita, Rump and Oishi's sum); s = 1 or -1. */
static REAL NAME(product)(REAL a, REAL b, REAL *low)
{
    REAL p = a * b, ah = SPLIT * a, bh = SPLIT * b;
    ah -= ah - a;
    bh -= bh - b;
    *low = ((ah * bh - p) + ah * (b - bh) + (a - ah) * bh) + (a - ah) * (b - bh);
    return p;
}

static REAL NAME(sum)(REAL a, REAL b, REAL c, REAL d, REAL f, REAL g)
{
    REAL l1, l2, l3, p1 = NAME(product)(a, b, &l1), p2 = NAME(product)(c, d, &l2), p3 = NAME(product)(f, g, &l3);
    REAL s = p1 + p2, k = s - p1, e1 = (p1 - (s - k)) + (p2 - k), r = s + p3;
    k = r - s;
    return r + (((s - (r - k)) + (p3 - k)) + e1 + (l1 + l2 + l3));
}

/* The points where the edge crosses the envelope, clamped to rng. */
static NAME(Hit) NAME(isect_edge)(const NAME(Cone) * c, NAME(V) a, NAME(V) b)
{
    const REAL infinity = (REAL)INFINITY;
    NAME(V) l = NAME(minus)(b, a);
    REAL R = a.z * c->T + c->x0, Rl = l.z * c->T, ay = c->e * a.y, ly = c->e * l.y, apex = NAME(apex)(c), t[2];
    REAL A = NAME(sum)(l.x, l.x, ly, ly, -Rl, Rl), B = NAME(sum)(a.x, l.x, ay, ly, -R, Rl),
         C = NAME(sum)(a.x, a.x, ay, ay, -R, R), D = NAME(sum)(B, B, -A, C, 0, 0);
    if (!(D >= 0)) return NAME(nothing);
    REAL q = B >= 0 ? -(B + ROOT(D)) : ROOT(D) - B;
    t[0] = q / A;
    t[1] = C / q;
    for (int i = 0; i < 2; i++) {
        if (!NAME(finite)(t[i])) t[i] = infinity;
        if (i ? a.z + t[i] * l.z <= apex : a.z + t[i] * l.z < apex) t[i] = infinity; /* lines 10, 11 */
    }
    if (t[0] * l.z > t[1] * l.z) { /* line 13 */
        REAL first = t[0];
        t[0] = t[1];
        t[1] = first;
    }
    if (a.z + t[1] * l.z < c->near || a.z + t[0] * l.z > c->far || t[0] == infinity) return NAME(nothing); /* line 15 */
    if (c->near > apex && a.z + t[0] * l.z < c->near) t[0] = (c->near - a.z) / l.z;
    if (a.z + t[1] * l.z > c->far) t[1] = (c->far - a.z) / l.z;
    NAME(Hit) h = NAME(nothing);
    for (int i = 0; i < 2; i++)
        if (t[i] >= 0 && t[i] <= 1) NAME(take)(&h, NAME(v)(a.x + t[i] * l.x, a.y + t[i] * l.y, a.z + t[i] * l.z));
    return h;
}

static void NAME(unite)(NAME(Hit) * h, NAME(Hit) other)
{
    if (other.near > other.far) return;
    NAME(take)(h, other.nearest);
    NAME(take)(h, other.farthest);
}

/* ---- listing 4, with the triangle's points in the local frame ---------------------------------------------------- */

/* Along the largest component of the normal. */
static bool NAME(in_triangle)(NAME(V) p, const NAME(V) v[3], NAME(V) n)
{
    REAL ax = n.x < 0 ? -n.x : n.x, ay = n.y < 0 ? -n.y : n.y, az = n.z < 0 ? -n.z : n.z;
    int positive = 1, negative = 1;
    for (int i = 0; i < 3; i++) {
        NAME(V) d = NAME(minus)(v[(i + 1) % 3], v[i]), q = NAME(minus)(p, v[i]);
        REAL w = ax >= ay && ax >= az ? d.y * q.z - d.z * q.y
                 : ay >= az           ? d.z * q.x - d.x * q.z
                                      : d.x * q.y - d.y * q.x;
        positive &= w >= 0;
        negative &= w <= 0;
    }
    return positive || negative;
}

static NAME(Hit) NAME(isect_triangle)(const NAME(Cone) * c, const NAME(V) v[3], NAME(V) n)
{
    int low = 0, high = 0;
    for (int i = 1; i < 3; i++) {
        if (v[i].z < v[low].z) low = i;
        if (v[i].z > v[high].z) high = i;
    }
    if (v[high].z < c->near || v[low].z > c->far) return NAME(nothing);
    bool has_near = NAME(in_cone)(c, v[low]), has_far = NAME(in_cone)(c, v[high]);
    NAME(Hit) h = NAME(nothing);
    if (has_near) NAME(take)(&h, v[low]);
    if (has_far) NAME(take)(&h, v[high]);
    if (has_near && has_far) return h;
    NAME(Hit) plane = NAME(isect_plane)(c, n, NAME(dot)(n, v[0]));
    if (plane.near <= plane.far) {
        if (!has_near && NAME(in_triangle)(plane.nearest, v, n)) {
            NAME(take)(&h, plane.nearest);
            has_near = true;
        }
        if (!has_far && NAME(in_triangle)(plane.farthest, v, n)) {
            NAME(take)(&h, plane.farthest);
            has_far = true;
        }
    }
    if (has_near && has_far) return h;
    for (int i = 0; i < 3; i++) {
        NAME(V) a = v[i], b = v[(i + 1) % 3];
        if (!NAME(in_cone)(c, a) || !NAME(in_cone)(c, b)) NAME(unite)(&h, NAME(isect_edge)(c, a, b));
    }
    return h;
}

/* ---- listing 3 --------------------------------------------------------------------------------------------------- */

/* Back in the world's frame; the coordinate along axis `but` need not be looked at. */
static bool NAME(on_face)(const NAME(Cone) * c, NAME(V) p, const REAL bound[3][2], int but)
{
    const REAL *X = &c->axis[0].x, *Y = &c->axis[1].x, *Z = &c->axis[2].x, *o = &c->o.x;
    for (int k = 0; k < 3; k++) {
        REAL w = o[k] + X[k] * p.x + Y[k] * p.y + Z[k] * p.z;
        if (k != but && !(w >= bound[k][0] && w <= bound[k][1])) return false;
    }
    return true;
}

static KellerRange NAME(box)(const KellerCone *cone, KellerVec3 lower, KellerVec3 upper, KellerRange clip)
{
    NAME(Cone) c = NAME(cone_of)(cone, clip);
    NAME(V) lo = NAME(real)(lower), hi = NAME(real)(upper), v[8];
    const REAL bound[3][2] = {{lo.x, hi.x}, {lo.y, hi.y}, {lo.z, hi.z}};
    NAME(Hit) h = NAME(nothing);
    bool in[8], holds_origin =
                    c.o.x >= lo.x && c.o.x <= hi.x && c.o.y >= lo.y && c.o.y <= hi.y && c.o.z >= lo.z && c.o.z <= hi.z;
    int low = 0, high = 0;
    for (int i = 0; i < 8; i++) {
        v[i] = NAME(turn)(&c, NAME(minus)(NAME(v)(bound[0][i & 1], bound[1][i >> 1 & 1], bound[2][i >> 2]), c.o));
        in[i] = NAME(in_cone)(&c, v[i]);
        if (in[i]) NAME(take)(&h, v[i]);
        if (v[i].z < v[low].z) low = i;
        if (v[i].z > v[high].z) high = i;
    }
    REAL near = c.near > v[low].z ? c.near : v[low].z, far = c.far < v[high].z ? c.far : v[high].z;
    if (near > far) return (KellerRange){INFINITY, -INFINITY};
    if (holds_origin) NAME(take)(&h, NAME(v)(0, 0, 0));
    if (!((in[low] || holds_origin) && in[high])) {
        for (int i = 0; i < 8; i++)
            for (int k = 0; k < 3; k++)
                if (!(i >> k & 1) && !(in[i] && in[i | 1 << k]))
                    NAME(unite)(&h, NAME(isect_edge)(&c, v[i], v[i | 1 << k]));
        for (int k = 0; k < 3; k++)
            for (int side = 0; side < 2; side++) {
                NAME(V) n = NAME(v)((&c.axis[0].x)[k], (&c.axis[1].x)[k], (&c.axis[2].x)[k]);
                NAME(Hit) face = NAME(isect_plane)(&c, n, bound[k][side] - (&c.o.x)[k]);
                if (face.near > face.far) continue;
                if (NAME(on_face)(&c, face.nearest, bound, k)) NAME(take)(&h, face.nearest);
                if (NAME(on_face)(&c, face.farthest, bound, k)) NAME(take)(&h, face.farthest);
            }
    }
    if (h.near < near) h.near = near;
    if (h.far > far) h.far = far;
    return (KellerRange){(double)h.near, (double)h.far};
}

/* ---- in the world's frame ---------------------------------------------------------------------------------------- */

static KellerRange NAME(plane)(const KellerCone *cone, KellerVec3 normal, double offset, KellerRange clip)
{
    NAME(Cone) c = NAME(cone_of)(cone, clip);
    NAME(V) n = NAME(real)(normal);
    NAME(Hit) h = NAME(isect_plane)(&c, NAME(turn)(&c, n), (REAL)offset - NAME(dot)(n, c.o));
    return (KellerRange){(double)h.near, (double)h.far};
}

static KellerRange NAME(edge)(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerRange clip)
{
    NAME(Cone) c = NAME(cone_of)(cone, clip);
    NAME(V) la = NAME(local)(&c, a), lb = NAME(local)(&c, b);
    NAME(Hit) h = NAME(nothing);
    if (NAME(in_cone)(&c, la)) NAME(take)(&h, la);
    if (NAME(in_cone)(&c, lb)) NAME(take)(&h, lb);
    NAME(unite)(&h, NAME(isect_edge)(&c, la, lb));
    return (KellerRange){(double)h.near, (double)h.far};
}

static KellerRange NAME(triangle)(const KellerCone *cone, KellerVec3 a, KellerVec3 b, KellerVec3 c, KellerRange clip)
{
    NAME(Cone) k = NAME(cone_of)(cone, clip);
    NAME(V) l = NAME(minus)(NAME(real)(b), NAME(real)(a)), m = NAME(minus)(NAME(real)(c), NAME(real)(a));
    NAME(V) n = NAME(v)(l.y * m.z - l.z * m.y, l.z * m.x - l.x * m.z, l.x * m.y - l.y * m.x);
    REAL norm = ROOT(NAME(dot)(n, n));
    if (norm > 0) n = NAME(v)(n.x / norm, n.y / norm, n.z / norm);
    const NAME(V) v[3] = {NAME(local)(&k, a), NAME(local)(&k, b), NAME(local)(&k, c)};
    NAME(Hit) h = NAME(isect_triangle)(&k, v, NAME(turn)(&k, n));
    return (KellerRange){(double)h.near, (double)h.far};
}

/* ---- listing 5 --------------------------------------------------------------------------------------------------- */

/* As the instruction: the second where either is not a number. */
static REAL NAME(max)(REAL a, REAL b) { return a > b ? a : b; }
static REAL NAME(min)(REAL a, REAL b) { return a < b ? a : b; }

static uint32_t NAME(box8)(const KellerCone *cone, const KellerBox8 *boxes, double max_dist, double distance[8])
{
    const KellerRange all = {0, INFINITY};
    NAME(Cone) c = NAME(cone_of)(cone, all);
    const REAL *d = &c.axis[2].x, *o = &c.o.x;
    uint32_t mask = 0;
    for (int i = 0; i < 8; i++) {
        REAL a[3], b[3], u[3], v[3], zdist = 0;
        bool back[3];
        for (int k = 0; k < 3; k++) {
            REAL lower = (REAL)boxes->lower[k][i] - o[k], upper = (REAL)boxes->upper[k][i] - o[k];
            back[k] = signbit(1 / d[k]);
            a[k] = back[k] ? upper : lower;
            b[k] = back[k] ? lower : upper;
            zdist += d[k] * b[k];
        }
        REAL s = zdist * c.T + c.x0;
        for (int k = 0; k < 3; k++) {
            u[k] = (a[k] - (back[k] ? -s : s)) * (1 / d[k]);
            v[k] = (b[k] + (back[k] ? -s : s)) * (1 / d[k]);
        }
        REAL t_min = NAME(max)(NAME(max)(0, u[0]), NAME(max)(u[1], u[2])),
             t_max = NAME(min)(v[0], NAME(min)(v[1], v[2]));
        distance[i] = (double)t_min;
        if (t_min <= t_max && t_min < (REAL)max_dist) mask |= 1u << i;
    }
    return mask;
}
