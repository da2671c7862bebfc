#include "plates.h"
#include <math.h>

enum { MOST_PLATES = 5, MOST_CORNERS = 4 };

typedef struct {
    size_t corners; /* 3 or 4 */
    KellerVec3 corner[MOST_CORNERS];
} Plate;

typedef struct {
    Random random;
    size_t count;
    Plate plate[MOST_PLATES];
} Builder;

static const double turn = 6.283185307179586;

static double draw(Builder *b, double lower, double upper) { return random_range(&b->random, lower, upper); }

static KellerVec3 draw_place(Builder *b, double reach)
{
    double x = draw(b, -reach, reach), y = draw(b, -reach, reach);
    return v3(x, y, draw(b, -reach, reach));
}

/* Of all directions alike. */
static KellerVec3 draw_direction(Builder *b)
{
    double z = draw(b, -1, 1), angle = draw(b, 0, turn), r = sqrt(1 - z * z);
    return v3(r * cos(angle), r * sin(angle), z);
}

static void add_quad(Builder *b, KellerVec3 a, KellerVec3 u, KellerVec3 v)
{
    KellerVec3 far = v3_add(a, u);
    b->plate[b->count++] = (Plate){4, {a, far, v3_add(far, v), v3_add(a, v)}};
}

/* A wing on the edge from a to a + u, at an angle about it. Slanted: its far edge is shifted along. */
static void add_wing(Builder *b, KellerVec3 a, KellerVec3 u, double angle)
{
    KellerVec3 axis = v3_unit(u), x = v3_perpendicular(axis), y = v3_cross(axis, x);
    KellerVec3 out = v3_madd(v3_scale(x, cos(angle)), y, sin(angle));
    double width = draw(b, 2.5, 7), shift = random_below(&b->random, 2) ? draw(b, -2, 2) : 0;
    add_quad(b, a, u, v3_madd(v3_scale(out, width), axis, shift));
}

static void add_screen(Builder *b)
{
    KellerVec3 u = v3_scale(draw_direction(b), draw(b, 3, 8));
    add_wing(b, v3_madd(draw_place(b, 3), u, -0.5), u, draw(b, 0, turn));
}

/* Two wings on one edge: sectors of any angle and its complement; one in four opens by pi/m, where no wave is diffracted. */
static void add_wedge(Builder *b)
{
    KellerVec3 u = v3_scale(draw_direction(b), draw(b, 3, 8)), a = v3_madd(draw_place(b, 3), u, -0.5);
    double first = draw(b, 0, turn), open = draw(b, 0.05, turn / 2 - 0.05);
    if (random_below(&b->random, 4) == 0) open = turn / 2 / (2 + random_below(&b->random, 3));
    add_wing(b, a, u, first);
    add_wing(b, a, u, first + open);
}

static void add_tetrahedron(Builder *b)
{
    KellerVec3 middle = draw_place(b, 3), corner[4];
    double size = draw(b, 2, 4);
    static const double regular[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
    for (int i = 0; i < 4; i++) {
        KellerVec3 to = v3(regular[i][0], regular[i][1], regular[i][2]);
        corner[i] = v3_madd(v3_madd(middle, to, size / sqrt(3)), draw_direction(b), 0.4 * size);
    }
    for (int i = 0; i < 4; i++)
        b->plate[b->count++] = (Plate){3, {corner[i == 0], corner[1 + (i <= 1)], corner[2 + (i <= 2)]}};
}

/* A plate that touches the last one: it stands on it with a rim, or hangs on one of its edges, all along or shifted. */
static void add_touching(Builder *b)
{
    const Plate *p = &b->plate[b->count - 1];
    KellerVec3 a = p->corner[0], u = v3_sub(p->corner[1], a), v = v3_sub(p->corner[p->corners - 1], a);
    uint32_t kind = random_below(&b->random, 3);
    if (kind == 0) {
        KellerVec3 from = v3_madd(v3_madd(a, u, draw(b, 0.1, 0.4)), v, draw(b, 0.1, 0.4));
        KellerVec3 to = v3_madd(v3_madd(a, u, draw(b, 0.5, 0.6)), v, draw(b, 0.1, 0.4));
        add_wing(b, from, v3_sub(to, from), draw(b, 0, turn));
    } else {
        add_wing(b, kind == 1 ? a : v3_madd(a, u, draw(b, 0.2, 0.6)), u, draw(b, 0, turn));
    }
}

static void add_bodies(Builder *b)
{
    switch (random_below(&b->random, 6)) {
    case 0: /* plates that may pass through each other */
        for (uint32_t i = 3 + random_below(&b->random, 2); i > 0; i--) add_screen(b);
        break;
    case 1:
        add_tetrahedron(b);
        if (random_below(&b->random, 2)) add_screen(b);
        break;
    case 2:
        add_wedge(b);
        add_wedge(b);
        break;
    case 3:
        add_wedge(b);
        add_touching(b);
        add_screen(b);
        break;
    case 4:
        add_screen(b);
        add_touching(b);
        add_screen(b);
        break;
    default:
        add_screen(b);
        add_wedge(b);
        break;
    }
}

/* Not within 0.1 m of the plate's plane, next to the plate or not. */
static bool is_free(const Builder *b, KellerVec3 p)
{
    for (size_t i = 0; i < b->count; i++) {
        const KellerVec3 *c = b->plate[i].corner;
        KellerVec3 normal = v3_unit(v3_cross(v3_sub(c[1], c[0]), v3_sub(c[2], c[0])));
        if (fabs(v3_dot(normal, v3_sub(p, c[0]))) < 0.1) return false;
    }
    return true;
}

PlatesScene plates_random(uint64_t seed, PlatesTriangulation triangulation)
{
    static const uint32_t materials[] = {CONDUCTOR, CONCRETE, PARTITION, PARTITION, PARTITION, GLASS, GLASS, GLASS};
    Builder b = {.random = random_seeded(seed)};
    PlatesScene scene = {.soup = soup_new()};
    add_bodies(&b);
    for (size_t i = 0; i < b.count; i++) {
        const Plate *p = &b.plate[i];
        KellerVec3 corner[MOST_CORNERS];
        size_t first = triangulation == PLATES_OTHER_DIAGONAL; /* the diagonal is drawn from there */
        for (size_t k = 0; k < p->corners; k++) corner[k] = p->corner[(k + first) % p->corners];
        soup_object(&scene.soup, "plate");
        uint32_t material = materials[random_below(&b.random, sizeof materials / sizeof *materials)];
        soup_polygon(&scene.soup, p->corners, corner, material);
    }
    do scene.tx = draw_place(&b, 5);
    while (!is_free(&b, scene.tx));
    do scene.rx = draw_place(&b, 5);
    while (!is_free(&b, scene.rx));
    Random other = random_seeded(~seed);
    if (triangulation == PLATES_REFINED) soup_refine(&scene.soup, &other);
    if (triangulation != PLATES_AS_BUILT) soup_shuffle(&scene.soup, &other);
    return scene;
}
