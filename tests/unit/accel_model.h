/* Models for tests of the accelerators: ordinary, hostile and closed ones, drawn at random. */
#ifndef KELLER_TESTS_ACCEL_MODEL_H
#define KELLER_TESTS_ACCEL_MODEL_H
#include <stdbool.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include "keller/accel.h"
#include "random.h"

typedef enum {
    MODEL_SPREAD,
    MODEL_COPLANAR,
    MODEL_ONE_POINT,
    MODEL_HUGE_AND_TINY,
    MODEL_FAR_AWAY,     /* coordinates at 1e5 m */
    MODEL_DEGENERATE,   /* segments and points */
    MODEL_DUPLICATES,
    MODEL_GRID,         /* welded, in axis-parallel planes */
    MODEL_SPHERE,       /* closed, of slivers */
    MODEL_ROOM,         /* closed, uneven, welded */
    MODEL_EMPTY,
    MODEL_KINDS
} ModelKind;

typedef struct {
    KellerAccelInput in;
    KellerVec3 *vertices;
    uint32_t (*triangles)[3], (*edges)[2];
    KellerVec3 middle;
    uint32_t vertex_count;
    double size;        /* of what rays and cones start in: middle +- size */
} Model;

static inline void model_vertex(Model *m, uint32_t *n, KellerVec3 p)
{
    m->vertices[(*n)++] = p;
    m->vertex_count = *n;
}

static inline void model_triangle(Model *m, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t *t = m->triangles[m->in.triangle_count++];
    t[0] = a, t[1] = b, t[2] = c;
}

/* A sheet of rows x columns vertices from number `first` on, closed around in the columns where `around`. */
static inline void model_sheet(Model *m, uint32_t first, uint32_t rows, uint32_t columns, bool around)
{
    for (uint32_t i = 0; i + 1 < rows; i++)
        for (uint32_t j = 0; j < columns - !around; j++) {
            uint32_t a = first + i * columns + j, b = first + i * columns + (j + 1) % columns;
            model_triangle(m, a, b, b + columns);
            model_triangle(m, a, b + columns, a + columns);
        }
}

/* A closed surface around the middle: rows from pole to pole, of radius size * shape. */
static inline void model_closed(Model *m, uint32_t rows, uint32_t columns, bool room, Random *r)
{
    uint32_t n = 0;
    for (uint32_t i = 1; i <= rows; i++)
        for (uint32_t j = 0; j < columns; j++) {
            double polar = M_PI * i / (rows + 1), azimuth = 2 * M_PI * j / columns;
            if (!room && i > 1 && i < rows) polar += random_in(r, -0.1, 0.1) / rows;
            KellerVec3 d = v3(sin(polar) * cos(azimuth), sin(polar) * sin(azimuth), cos(polar));
            double most = fmax(fabs(d.x), fmax(fabs(d.y), fabs(d.z)));
            if (room) d = v3_scale(v3(d.x, d.y, 0.4 * d.z), 1 / most); /* onto a cuboid: sides are coplanar but for rounding */
            model_vertex(m, &n, v3_madd(m->middle, d, 1.01 * m->size * (room ? 1.0 : 1.8)));
        }
    model_vertex(m, &n, v3_madd(m->middle, v3(0, 0, room ? 0.4 : 1.8), 1.01 * m->size));
    model_vertex(m, &n, v3_madd(m->middle, v3(0, 0, room ? 0.4 : 1.8), -1.01 * m->size));
    model_sheet(m, 0, rows, columns, true);
    for (uint32_t j = 0; j < columns; j++) {
        model_triangle(m, rows * columns, (j + 1) % columns, j);
        model_triangle(m, rows * columns + 1, (rows - 1) * columns + j, (rows - 1) * columns + (j + 1) % columns);
    }
}

static inline void model_soup(Model *m, ModelKind kind, uint32_t count, Random *r)
{
    uint32_t n = 0;
    for (uint32_t i = 0; i < count; i++) {
        KellerVec3 p[3], at = random_point(r, m->size);
        double size = pow(10, random_in(r, -3, 0.5));
        if (kind == MODEL_ONE_POINT) at = v3(0, 0, 0), size = 0;
        if (kind == MODEL_HUGE_AND_TINY) size = i == 0 ? 1e4 : 1e-4;
        for (int k = 0; k < 3; k++) {
            p[k] = v3_add(m->middle, v3_add(at, random_point(r, size)));
            if (kind == MODEL_COPLANAR) p[k].z = m->middle.z;
        }
        if (kind == MODEL_DEGENERATE) {
            p[2] = p[i % 2];
            if (i % 5 == 0) p[1] = p[0];
        }
        bool again = kind == MODEL_DUPLICATES && i >= 20;
        for (uint32_t k = 0; k < 3; k++) model_vertex(m, &n, again ? m->vertices[3 * (i % 20) + k] : p[k]);
        model_triangle(m, n - 3, n - 2, n - 1);
    }
}

static inline void model_grid(Model *m, uint32_t side, Random *r)
{
    uint32_t n = 0;
    for (int sheet = 0; sheet < 3; sheet++) {
        double offset = random_in(r, -1, 1) * m->size;
        for (uint32_t i = 0; i < side; i++)
            for (uint32_t j = 0; j < side; j++) {
                double x = m->size * (2.0 * i / (side - 1) - 1), y = m->size * (2.0 * j / (side - 1) - 1);
                KellerVec3 p = sheet == 0 ? v3(x, y, offset) : sheet == 1 ? v3(y, offset, x) : v3(offset, x, y);
                model_vertex(m, &n, v3_add(m->middle, p));
            }
        model_sheet(m, (uint32_t)sheet * side * side, side, side, false);
    }
}

/* The edges: of a soup the first two sides of each triangle, of a welded model each once or twice; then some that are no
 * triangle's side, and some a second time, the other way round. */
static inline Model model_make(ModelKind kind, uint32_t count, Random *r)
{
    Model m = {.size = 10};
    uint32_t most = 3 * count + 1000;
    m.vertices = malloc(most * sizeof *m.vertices);
    m.triangles = malloc(most * sizeof *m.triangles);
    m.edges = malloc(3 * most * sizeof *m.edges);
    if (kind == MODEL_FAR_AWAY) m.middle = v3(1e5, -1e5, 30);
    if (kind == MODEL_ONE_POINT) m.middle = v3(1, 2, 3);
    uint32_t side = 4 + (uint32_t)sqrt(count / 6.0);
    if (kind == MODEL_GRID) model_grid(&m, side, r);
    else if (kind == MODEL_SPHERE) model_closed(&m, 4, 20 + count / 8, false, r);
    else if (kind == MODEL_ROOM) model_closed(&m, 3 + side / 2, 8 * (1 + side / 3), true, r);
    else if (kind != MODEL_EMPTY) model_soup(&m, kind, count, r);
    for (uint32_t i = 0; i < m.in.triangle_count; i++)
        for (uint32_t k = 0; k < 2; k++) {
            uint32_t *e = m.edges[m.in.edge_count++];
            e[0] = m.triangles[i][k], e[1] = m.triangles[i][k + 1];
        }
    for (uint32_t i = 0; i < m.in.triangle_count; i += 9) {
        uint32_t *e = m.edges[m.in.edge_count++], *again = m.edges[m.in.edge_count++];
        e[0] = random_u32(r) % m.vertex_count, e[1] = i % 4 ? random_u32(r) % m.vertex_count : e[0];
        again[0] = m.edges[i][1], again[1] = m.edges[i][0];
    }
    m.in.vertices = m.vertices;
    m.in.triangles = (const uint32_t (*)[3])m.triangles;
    m.in.edges = (const uint32_t (*)[2])m.edges;
    return m;
}

static inline void model_free(Model *m)
{
    free(m->vertices);
    free(m->triangles);
    free(m->edges);
}

static inline KellerVec3 model_corner(const Model *m, uint32_t triangle, int k)
{
    return m->vertices[m->triangles[triangle][k]];
}

/* Rays (tan = x0 = 0), cylinders, thin and wide cones, flat ones; some aimed at a vertex, some along an axis. */
static inline KellerCone model_cone(const Model *m, uint32_t q, Random *r)
{
    KellerVec3 origin = v3_add(m->middle, random_point(r, 1.2 * m->size)), d = random_unit(r);
    if (q % 5 == 2 && m->in.triangle_count) {
        KellerVec3 to = v3_sub(model_corner(m, random_u32(r) % m->in.triangle_count, 0), origin);
        if (v3_norm(to) > 0) d = v3_unit(to);
    }
    if (q % 11 == 4) d = (KellerVec3[]){v3(1, 0, 0), v3(0, -1, 0), v3(0, 0, 1)}[q % 3];
    double half_angle = q % 4 == 0 ? random_in(r, 0.2, 0.8) : q % 4 == 1 ? random_in(r, 0, 0.2) : pow(10, random_in(r, -9, -1));
    double eccentricity = q % 3 == 0 ? 0 : q % 3 == 1 ? random_in(r, 0, 0.99) : 1 - pow(10, random_in(r, -7, -1));
    double x0 = q % 6 == 3 ? random_in(r, 0, 0.3 * m->size) : 0;
    if (q % 7 == 5) half_angle = x0 = 0;
    if (q % 7 == 6) half_angle = 0;
    KellerVec3 major = v3_perpendicular(d);
    return keller_cone_elliptic(origin, d, v3_add(major, v3_scale(v3_cross(d, major), random_in(r, -3, 3))), half_angle,
                                eccentricity, x0);
}
#endif
