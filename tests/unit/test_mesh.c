/* The half-edge adjacency and the box tree, each against the slow and obvious way. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include <cmocka.h>
#include "geom/boxtree.h"
#include "mesh/adjacency.h"

static uint64_t seed = 88172645463325252u;

static uint32_t pick(uint32_t count)
{
    seed ^= seed << 13;
    seed ^= seed >> 7;
    seed ^= seed << 17;
    return (uint32_t)(seed >> 33) % count;
}

static double real(double low, double high)
{
    return low + (high - low) * pick(1u << 30) * 0x1p-30;
}

/* Every side of every triangle is in the list of its edge, every list is complete and ascending. */
static void assert_complete(size_t count, uint32_t (*triangles)[3], const KellerAdjacency *adjacency)
{
    assert_int_equal(adjacency->begin[adjacency->edge_count], 3 * count);
    for (uint32_t e = 0; e < adjacency->edge_count; e++) {
        uint32_t a = adjacency->vertices[e][0], b = adjacency->vertices[e][1], at = adjacency->begin[e];
        assert_true(a < b);
        if (e) {
            const uint32_t *last = adjacency->vertices[e - 1];
            assert_true(last[0] < a || (last[0] == a && last[1] < b));
        }
        for (uint32_t t = 0; t < count; t++)
            for (int i = 0; i < 3; i++) {
                uint32_t c = triangles[t][i], d = triangles[t][(i + 1) % 3];
                if (!((c == a && d == b) || (c == b && d == a))) continue;
                assert_true(at < adjacency->begin[e + 1]);
                assert_int_equal(adjacency->triangles[at++], t);
                assert_int_equal(adjacency->edge[t][i], e);
            }
        assert_int_equal(at, adjacency->begin[e + 1]);
    }
}

static size_t build_quietly(size_t vertices, size_t count, uint32_t (*triangles)[3])
{
    KellerVec3 *points = calloc(vertices + 1, sizeof *points);
    assert_non_null(points);
    for (size_t i = 0; i < vertices; i++) points[i] = v3(real(0, 1), real(0, 1), real(0, 1));
    KellerAdjacency adjacency;
    KellerError error;
    assert_int_equal(
        keller_adjacency_build(vertices, points, count, (const uint32_t(*)[3])triangles, &adjacency, &error),
        KELLER_OK);
    assert_complete(count, triangles, &adjacency);
    size_t cuts = adjacency.cuts;
    keller_adjacency_free(&adjacency);
    assert_null(adjacency.triangles);
    free(points);
    return cuts;
}

/* Triangles at random over few vertices: complex edges and vertices, both orientations, repeated triangles. */
static void random_soup(void **state)
{
    (void)state;
    for (int round = 0; round < 400; round++) {
        uint32_t vertices = 3 + pick(12), triangles[60][3];
        size_t count = pick(61);
        for (size_t t = 0; t < count; t++)
            do
                for (int i = 0; i < 3; i++) triangles[t][i] = pick(vertices);
            while (triangles[t][0] == triangles[t][1] || triangles[t][1] == triangles[t][2] ||
                   triangles[t][2] == triangles[t][0]);
        build_quietly(vertices, count, triangles);
    }
}

/* A manifold needs no cut, however its triangles are turned; two tetrahedra that share a vertex, or three leaves at an
 * edge, do; a Moebius band is cut along one edge. */
static void manifolds(void **state)
{
    (void)state;
    uint32_t tetrahedron[4][3] = {{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}};
    assert_int_equal(build_quietly(4, 4, tetrahedron), 0);
    uint32_t two[8][3] = {{0, 1, 2}, {0, 1, 3}, {0, 2, 3}, {1, 2, 3}, {0, 4, 5}, {0, 4, 6}, {0, 5, 6}, {4, 5, 6}};
    assert_int_equal(build_quietly(7, 8, two), 1);
    uint32_t leaves[3][3] = {{0, 1, 2}, {0, 1, 3}, {1, 0, 4}};
    assert_int_equal(build_quietly(5, 3, leaves), 4);
    uint32_t band[5][3] = {{0, 1, 2}, {1, 2, 3}, {2, 3, 4}, {3, 4, 0}, {4, 0, 1}};
    assert_int_equal(build_quietly(5, 5, band), 2);
}

/* OpenMesh prints what it refuses; here nothing may reach standard error. */
static void silence(void **state)
{
    FILE *file = tmpfile();
    assert_non_null(file);
    fflush(stderr);
    int keep = dup(2);
    assert_true(keep >= 0 && dup2(fileno(file), 2) == 2);
    random_soup(state);
    fflush(stderr);
    assert_int_equal(dup2(keep, 2), 2);
    close(keep);
    fseek(file, 0, SEEK_END);
    assert_int_equal(ftell(file), 0);
    fclose(file);
}

enum { BOXES = 500 };

static void mark(void *context, uint32_t item)
{
    ((int *)context)[item]++;
}

/* Every box near the segment is visited, no box twice, and few of all. Near is measured at 33 points of the
 * segment, which can only find fewer boxes. */
static void box_tree(void **state)
{
    (void)state;
    static KellerVec3 lower[BOXES], upper[BOXES];
    size_t near = 0, all = 0;
    for (uint32_t count = 0; count <= BOXES; count += count < 10 ? 1 : 70) {
        for (uint32_t i = 0; i < count; i++) {
            lower[i] = v3(real(-10, 10), real(-10, 10), pick(3) ? real(-1, 1) : 0);
            upper[i] = pick(5) ? v3_add(lower[i], v3(real(0, 1), real(0, 1), real(0, 1))) : lower[i];
        }
        KellerBoxTree *tree = keller_boxtree_build(count, lower, upper);
        assert_non_null(tree);
        for (int round = 0; round < 50; round++) {
            KellerVec3 a = v3(real(-12, 12), real(-12, 12), real(-2, 2)),
                       b = v3(real(-12, 12), real(-12, 12), real(-2, 2));
            if (round % 3 == 0) b = v3(a.x, a.y, b.z);
            if (round % 7 == 0) b = a;
            double margin = round % 2 ? 0 : real(0, 0.5);
            int hits[BOXES] = {0};
            keller_boxtree_segment(tree, a, b, margin, mark, hits);
            for (uint32_t i = 0; i < count; i++) {
                assert_true(hits[i] <= 1);
                near += (size_t)hits[i];
                for (int s = 0; s <= 32; s++) {
                    KellerVec3 p = v3_madd(a, v3_sub(b, a), s / 32.0);
                    if (p.x >= lower[i].x - margin && p.x <= upper[i].x + margin && p.y >= lower[i].y - margin &&
                        p.y <= upper[i].y + margin && p.z >= lower[i].z - margin && p.z <= upper[i].z + margin)
                        assert_int_equal(hits[i], 1);
                }
            }
        }
        keller_boxtree_free(tree);
        all += 50 * count;
    }
    assert_true(near * 5 < all);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(random_soup),
        cmocka_unit_test(manifolds),
        cmocka_unit_test(silence),
        cmocka_unit_test(box_tree),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests_name("mesh", tests, NULL, NULL);
}
