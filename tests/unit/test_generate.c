/* Scenes that are made by rule and chance hold what their header says, and scenes that are written are read back. */
#include "soup_files.h"

#include <locale.h>
#include <math.h>

#include "io/generate.h"
#include "io/generate_emit.h"
#include "io/scene_write.h"
#include "keller/scene.h"

static KellerSoup made(const KellerGenerate *def)
{
    KellerSoup soup;
    KellerError error = {0};
    if (keller_generate(def, &soup, &error) != KELLER_OK) fail_msg("%s", error.message);
    return soup;
}

static KellerSoup city(uint64_t seed, bool star, uint64_t blocks)
{
    KellerGenerate def = keller_generate_defaults(KELLER_GENERATE_CITY);
    def.seed = seed;
    def.star = star;
    def.blocks = blocks;
    return made(&def);
}

static KellerVec3 corner(const KellerSoup *soup, size_t triangle, int i)
{
    return soup->vertices[soup->triangles[triangle][i]];
}

static void assert_same(const KellerSoup *a, const KellerSoup *b)
{
    assert_int_equal(a->vertex_count, b->vertex_count);
    assert_int_equal(a->triangle_count, b->triangle_count);
    assert_memory_equal(a->vertices, b->vertices, a->vertex_count * sizeof *a->vertices);
    assert_memory_equal(a->triangles, b->triangles, a->triangle_count * sizeof *a->triangles);
}

static void assert_same_names(const KellerSoup *a, const KellerSoup *b)
{
    assert_int_equal(a->object_count, b->object_count);
    for (size_t i = 0; i < a->object_count; i++) assert_string_equal(a->objects[i], b->objects[i]);
    assert_memory_equal(a->object, b->object, a->triangle_count * sizeof *a->object);
    for (size_t t = 0; t < a->triangle_count; t++) {
        bool none = a->material[t] == KELLER_NO_MATERIAL;
        assert_true(none == (b->material[t] == KELLER_NO_MATERIAL));
        if (!none) assert_string_equal(a->materials[a->material[t]].name, b->materials[b->material[t]].name);
    }
}

/* ---- chance and angles ---- */

static void test_chance_is_the_published_generator(void **state)
{
    (void)state;
    /* The first numbers of SplitMix64 for the seed 1234567, as its author's C source prints them. */
    KellerChance chance = {1234567};
    assert_true(keller_chance_bits(&chance) == 6457827717110365317u);
    assert_true(keller_chance_bits(&chance) == 3203168211198807973u);
    assert_true(keller_chance_bits(&chance) == 9817491932198370423u);
}

static void test_directions_are_those_of_libm(void **state)
{
    (void)state;
    for (int i = -800; i <= 800; i++) {
        double angle = i / 100.0, c, s;
        keller_emit_direction(angle, &c, &s);
        if (fabs(c - cos(angle)) > 1e-14 || fabs(s - sin(angle)) > 1e-14) fail_msg("%g: (%.17g, %.17g)", angle, c, s);
    }
}

/* ---- all kinds ---- */

static void test_the_same_definition_makes_the_same_scene(void **state)
{
    (void)state;
    for (int kind = KELLER_GENERATE_CITY; kind <= KELLER_GENERATE_TERRAIN; kind++)
        for (int star = 0; star < (kind == KELLER_GENERATE_CITY ? 2 : 1); star++) {
            KellerGenerate def = keller_generate_defaults((KellerGenerateKind)kind);
            def.star = star;
            KellerSoup a = made(&def), b = made(&def);
            assert_same(&a, &b);
            assert_same_names(&a, &b);
            def.seed = 2;
            KellerSoup other = made(&def);
            size_t least = a.vertex_count < other.vertex_count ? a.vertex_count : other.vertex_count, moved = 0;
            for (size_t i = 0; i < least; i++) moved += v3_distance(a.vertices[i], other.vertices[i]) > 0;
            assert_true(moved > least / 4);
            keller_soup_free(&a);
            keller_soup_free(&b);
            keller_soup_free(&other);
        }
}

static int by_bytes(const void *a, const void *b) { return memcmp(a, b, 3 * sizeof(uint32_t)); }

/* How many edges of an object are not those of a closed, consistently turned surface: once in each direction. */
static size_t open_edges(const KellerSoup *soup, uint32_t skipped_object)
{
    uint32_t (*sides)[3] = malloc(3 * soup->triangle_count * sizeof *sides);
    size_t count = 0, open = 0;
    for (size_t t = 0; t < soup->triangle_count; t++)
        for (int i = 0; i < 3 && soup->object[t] != skipped_object; i++, count++) {
            sides[count][0] = soup->object[t];
            sides[count][1] = soup->triangles[t][i];
            sides[count][2] = soup->triangles[t][(i + 1) % 3];
        }
    qsort(sides, count, sizeof *sides, by_bytes);
    for (size_t i = 0; i < count; i++) {
        uint32_t back[3] = {sides[i][0], sides[i][2], sides[i][1]};
        open += i > 0 && by_bytes(sides[i - 1], sides[i]) == 0;   /* twice in one direction */
        open += !bsearch(back, sides, count, sizeof *sides, by_bytes);
    }
    free(sides);
    return open;
}

/* The volume of each object; positive where triangles face outwards. */
static double *volumes(const KellerSoup *soup)
{
    double *volume = calloc(soup->object_count, sizeof *volume);
    for (size_t t = 0; t < soup->triangle_count; t++)
        volume[soup->object[t]] +=
            v3_dot(corner(soup, t, 0), v3_cross(corner(soup, t, 1), corner(soup, t, 2))) / 6;
    return volume;
}

/* ---- cities ---- */

static void test_buildings_are_closed_solids_on_the_ground(void **state)
{
    (void)state;
    for (uint64_t n = 0; n < 8; n++) {
        KellerSoup soup = city(n, n % 2, 10 + 40 * n);
        assert_string_equal(soup.objects[0], "ground");
        assert_int_equal(open_edges(&soup, 0), 0);
        double *volume = volumes(&soup), *low = calloc(soup.object_count, sizeof *low);
        for (size_t i = 0; i < soup.object_count; i++) low[i] = INFINITY;
        for (size_t t = 0; t < soup.triangle_count; t++)
            for (int i = 0; i < 3; i++) low[soup.object[t]] = fmin(low[soup.object[t]], corner(&soup, t, i).z);
        for (size_t i = 1; i < soup.object_count; i++) {
            assert_true(low[i] == 0);
            assert_true(volume[i] > 4 * 4 * 6 && volume[i] < 110 * 80 * 130);
        }
        free(low);
        free(volume);
        keller_soup_free(&soup);
    }
}

/* Seen from above, the border included. */
static bool in_triangle(KellerVec3 p, KellerVec3 a, KellerVec3 b, KellerVec3 c)
{
    KellerVec3 v[3] = {a, b, c};
    int left = 0, right = 0;
    for (int i = 0; i < 3; i++) {
        KellerVec3 e = v3_sub(v[(i + 1) % 3], v[i]), d = v3_sub(p, v[i]);
        double side = e.x * d.y - e.y * d.x;
        left += side >= 0;
        right += side <= 0;
    }
    return left == 3 || right == 3;
}

/* Points all over every floor: corners, and places on the sides. None may lie in the floor of another building. */
static void test_buildings_do_not_overlap(void **state)
{
    (void)state;
    for (uint64_t n = 0; n < 4; n++) {
        KellerSoup soup = city(n, n % 2, 30);
        size_t floors = 0, *floor_of = malloc(soup.triangle_count * sizeof *floor_of);
        for (size_t t = 0; t < soup.triangle_count; t++) {
            bool low = soup.object[t] != 0;
            for (int i = 0; i < 3; i++) low &= corner(&soup, t, i).z == 0;
            if (low) floor_of[floors++] = t;
        }
        assert_true(floors > 100);
        for (size_t a = 0; a < floors; a++)
            for (int k = 0; k < 30; k++) {
                size_t t = floor_of[a];
                KellerVec3 from = corner(&soup, t, k % 3), to = corner(&soup, t, (k + 1) % 3);
                KellerVec3 p = v3_madd(from, v3_sub(to, from), k / 3 / 10.0);
                for (size_t b = 0; b < floors; b++) {
                    size_t u = floor_of[b];
                    if (soup.object[t] == soup.object[u]) continue;
                    if (in_triangle(p, corner(&soup, u, 0), corner(&soup, u, 1), corner(&soup, u, 2)))
                        fail_msg("%s meets %s at (%g, %g)", soup.objects[soup.object[t]],
                                 soup.objects[soup.object[u]], p.x, p.y);
                }
            }
        free(floor_of);
        keller_soup_free(&soup);
    }
}

static void test_a_star_leaves_the_roundabout_free(void **state)
{
    (void)state;
    KellerSoup soup = city(3, true, 200);
    double nearest = INFINITY;
    for (size_t t = 0; t < soup.triangle_count; t++)
        for (int i = 0; i < 3 && soup.object[t] != 0; i++)
            nearest = fmin(nearest, hypot(corner(&soup, t, i).x, corner(&soup, t, i).y));
    assert_true(nearest >= 110 && nearest < 220);
    keller_soup_free(&soup);
}

static void test_a_grid_is_exact_in_single_precision(void **state)
{
    (void)state;
    KellerSoup soup = city(1, false, 400);
    for (size_t i = 0; i < soup.vertex_count; i++) {
        KellerVec3 p = soup.vertices[i];
        assert_true((double)(float)p.x == p.x && (double)(float)p.y == p.y && (double)(float)p.z == p.z);
    }
    keller_soup_free(&soup);
}

/* Roofs and walls are plane, nothing needs repair, and only the ground's rim is open. */
static void test_the_model_of_a_city_needs_no_repair(void **state)
{
    (void)state;
    for (int star = 0; star < 2; star++) {
        KellerSoup soup = city(5, star, 40);
        KellerScene scene;
        KellerError error = {0};
        if (keller_scene_build(&soup, &scene, &error) != KELLER_OK) fail_msg("%s", error.message);
        assert_int_equal(scene.report.welded_vertices, 0);
        assert_int_equal(scene.report.degenerate, 0);
        assert_int_equal(scene.report.duplicate, 0);
        assert_int_equal(scene.report.complex_edges, 0);
        assert_int_equal(scene.report.contact_edges, 0);
        assert_string_equal(scene.report.notes, "");
        double width = scene.upper.x - scene.lower.x, depth = scene.upper.y - scene.lower.y;
        assert_int_equal(scene.report.boundary_edges, (size_t)(2 * (width + depth) / 100 + 0.5));
        /* A wedge that opens by nearly pi is a roof or wall with a kink; the flattest real one is a shed's roof. */
        for (size_t w = 0; w < scene.wedge_count; w++)
            if (fabs(scene.wedges[w].n - 1) < 0.01) fail_msg("a wedge of %.6f pi", scene.wedges[w].n);
        keller_scene_free(&scene);
        keller_soup_free(&soup);
    }
}

static void test_blocks_follow_from_triangles(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 20; seed++)
        for (uint64_t wanted = 1000; wanted <= 100000; wanted *= 10) {
            uint64_t blocks = keller_generate_blocks(seed, seed % 2, wanted);
            KellerSoup soup = city(seed, seed % 2, blocks);
            double off = fabs((double)soup.triangle_count - (double)wanted);
            if (off > fmax(0.01 * (double)wanted, 200))
                fail_msg("%zu triangles instead of %llu", soup.triangle_count, (unsigned long long)wanted);
            keller_soup_free(&soup);
        }
    assert_int_equal(keller_generate_blocks(1, false, 1), 1);
}

/* ---- the others ---- */

static void test_random_triangles_fill_their_cube(void **state)
{
    (void)state;
    KellerGenerate def = keller_generate_defaults(KELLER_GENERATE_RANDOM);
    def.triangles = 1000;   /* so each lies in a cube of a tenth of the size */
    def.size = 3;
    KellerSoup soup = made(&def);
    assert_int_equal(soup.triangle_count, 1000);
    KellerVec3 sum = v3(0, 0, 0);
    for (size_t t = 0; t < 1000; t++) {
        sum = v3_add(sum, corner(&soup, t, 0));
        for (int i = 0; i < 3; i++) {
            KellerVec3 p = corner(&soup, t, i), d = v3_sub(corner(&soup, t, (i + 1) % 3), p);
            assert_true(fabs(p.x) <= 1.5 && fabs(p.y) <= 1.5 && fabs(p.z) <= 1.5);
            assert_true(fabs(d.x) <= 0.3 && fabs(d.y) <= 0.3 && fabs(d.z) <= 0.3);
        }
    }
    /* the mean of 1000 uniform numbers of deviation 3 / sqrt(12): 5 sigma are 0.14 */
    assert_true(v3_norm(v3_scale(sum, 1e-3)) < 0.25);
    keller_soup_free(&soup);
}

static void test_the_sphere_of_slivers_is_closed_and_thin(void **state)
{
    (void)state;
    KellerGenerate def = keller_generate_defaults(KELLER_GENERATE_SLIVERS);
    for (uint64_t wanted = 1; wanted <= 100000; wanted *= 10) {
        def.triangles = wanted;
        KellerSoup soup = made(&def);
        assert_int_equal(soup.triangle_count % 14, 0);
        if (wanted >= 100) assert_in_range(soup.triangle_count, wanted - 7, wanted + 7);
        assert_int_equal(open_edges(&soup, UINT32_MAX), 0);
        for (size_t i = 0; i < soup.vertex_count; i++) assert_true(fabs(v3_norm(soup.vertices[i]) - 5) < 1e-14 * 5);
        double *volume = volumes(&soup);
        assert_true(volume[0] > 0);
        /* eight belts, however many meridians: below the ball's 4/3 pi 5^3 = 523.6 by some percent */
        if (wanted >= 1000) assert_true(volume[0] > 480 && volume[0] < 523.6);
        free(volume);
        keller_soup_free(&soup);
    }
}

static void test_hair_has_31_thin_triangles_a_strand(void **state)
{
    (void)state;
    KellerGenerate def = keller_generate_defaults(KELLER_GENERATE_HAIR);
    def.strands = 77;
    KellerSoup soup = made(&def);
    assert_int_equal(soup.triangle_count, 77 * 31);
    for (size_t t = 0; t < soup.triangle_count; t++) {
        KellerVec3 first = corner(&soup, t, 0), a = v3_sub(corner(&soup, t, 1), first);
        KellerVec3 b = v3_sub(corner(&soup, t, 2), first);
        double longest = fmax(fmax(v3_norm(a), v3_norm(b)), v3_norm(v3_sub(a, b)));
        double height = v3_norm(v3_cross(a, b)) / longest;
        assert_true(height > 0 && height < 0.0101 && longest > 8 * height);
    }
    keller_soup_free(&soup);
}

static void test_the_axis_of_the_layers_meets_every_sheet(void **state)
{
    (void)state;
    KellerGenerate def = keller_generate_defaults(KELLER_GENERATE_LAYERS);
    KellerSoup soup = made(&def);
    assert_int_equal(soup.object_count, 64);
    assert_int_equal(soup.triangle_count, 64 * 130);
    /* near the axis, where bars cross; and in the middle of where the windows next to it are, shifted a little */
    static const double places[][2] = {{0, 0}, {0.01, -0.23}, {-0.27, 0.27}, {1.11, 1.11}};
    for (size_t k = 0; k < sizeof places / sizeof *places; k++) {
        KellerVec3 p = v3(places[k][0], places[k][1], 0);
        size_t met = 0;
        bool *hit = calloc(soup.object_count, sizeof *hit);
        for (size_t t = 0; t < soup.triangle_count; t++)
            hit[soup.object[t]] |= in_triangle(p, corner(&soup, t, 0), corner(&soup, t, 1), corner(&soup, t, 2));
        for (size_t i = 0; i < soup.object_count; i++) met += hit[i];
        if (k < 3) assert_int_equal(met, 64);
        else assert_int_equal(met, 0);
        free(hit);
    }
    /* Sheets do not meet: on the four vertical lines at the corners of what all of them cover, and so between them,
     * heights ascend. */
    for (int side = 0; side < 4; side++) {
        double x = side & 1 ? 4.72 : -4.72, y = side & 2 ? 4.72 : -4.72, before = 0;
        for (size_t n = 0; n < 64; n++) {
            const KellerVec3 *v = soup.vertices + 100 * n;   /* [0], [9], [90] are corners of the sheet */
            double i = (x - v[0].x) / (v[9].x - v[0].x), j = (y - v[0].y) / (v[90].y - v[0].y);
            double z = v[0].z + i * (v[9].z - v[0].z) + j * (v[90].z - v[0].z);
            assert_true(z > before + 0.05);
            before = z;
        }
    }
    keller_soup_free(&soup);
}

/* ---- files ---- */

static KellerWriteLoss written(const KellerSoup *soup, const char *name)
{
    KellerWriteFormat format;
    KellerWriteLoss loss;
    KellerError error = {0};
    assert_true(keller_write_format(name, &format));
    if (keller_scene_write(soup, format, path_of(name), name, "a comment", &loss, &error) != KELLER_OK)
        fail_msg("%s", error.message);
    return loss;
}

static KellerSoup round_trip(const KellerSoup *soup, const char *name)
{
    written(soup, name);
    KellerSoup read = read_file_soup(name);
    delete_file(name);
    return read;
}

/* A sheet over the whole square, whose heights are as documented; houses that stand apart, with their feet in the ground. */
static void test_houses_stand_in_the_terrain(void **state)
{
    (void)state;
    KellerGenerate def = keller_generate_defaults(KELLER_GENERATE_TERRAIN);
    def.triangles = 800;
    def.houses = 12;
    KellerSoup soup = made(&def);
    assert_int_equal(soup.object_count, 13);
    assert_string_equal(soup.objects[0], "terrain");
    assert_int_equal(soup.triangle_count, 800 + 12 * 14);
    double area = 0;
    for (size_t t = 0; t < soup.triangle_count; t++) {
        KellerVec3 a = corner(&soup, t, 0), n = v3_cross(v3_sub(corner(&soup, t, 1), a), v3_sub(corner(&soup, t, 2), a));
        if (soup.object[t] > 0) continue;
        assert_true(n.z > 0 && a.z >= 0 && a.z <= 0.225 * def.size);
        area += n.z / 2;
    }
    assert_true(fabs(area - def.size * def.size) < 1e-6 * area);
    for (uint32_t house = 1; house < 13; house++) {
        double low = INFINITY, high = -INFINITY, inside = 0, above = -INFINITY;
        KellerVec3 foot = {0, 0, 0};
        for (size_t t = 0; t < soup.triangle_count; t++)
            for (int i = 0; i < 3 && soup.object[t] == house; i++) {
                KellerVec3 p = corner(&soup, t, i);
                if (p.z < low) low = p.z, foot = p;
                high = fmax(high, p.z);
            }
        for (size_t t = 0; t < soup.triangle_count; t++) {
            KellerVec3 a = corner(&soup, t, 0), b = corner(&soup, t, 1), c = corner(&soup, t, 2), n = v3_cross(v3_sub(b, a), v3_sub(c, a));
            if (soup.object[t] > 0 || !in_triangle(foot, a, b, c)) continue;
            above = fmax(above, a.z - (n.x * (foot.x - a.x) + n.y * (foot.y - a.y)) / n.z);
            inside++;
        }
        assert_true(inside > 0 && low <= above - 0.99 && high > above + 4);
    }
    keller_soup_free(&soup);
}

static void test_generated_scenes_are_read_back_as_they_were(void **state)
{
    (void)state;
    for (int kind = KELLER_GENERATE_CITY; kind <= KELLER_GENERATE_TERRAIN; kind++) {
        KellerGenerate def = keller_generate_defaults((KellerGenerateKind)kind);
        def.star = true;
        KellerSoup soup = made(&def), obj = round_trip(&soup, "a.obj"), ply = round_trip(&obj, "a.ply");
        assert_same(&soup, &obj);
        assert_same_names(&soup, &obj);
        assert_same(&soup, &ply);
        KellerSoup stl = round_trip(&soup, "a.stl");
        assert_int_equal(stl.triangle_count, soup.triangle_count);
        for (size_t t = 0; t < soup.triangle_count; t++)
            for (int i = 0; i < 3; i++) {
                KellerVec3 p = corner(&soup, t, i);
                assert_point(corner(&stl, t, i), (double)(float)p.x, (double)(float)p.y, (double)(float)p.z);
            }
        keller_soup_free(&soup);
        keller_soup_free(&obj);
        keller_soup_free(&ply);
        keller_soup_free(&stl);
    }
}

/* The most awkward numbers and names that a scene may have, in a locale with decimal commas where there is one. */
static void test_awkward_numbers_and_names_survive(void **state)
{
    (void)state;
    KellerVec3 vertices[] = {{-0.0, 0.1, 1e-310}, {1.0 / 3, -1e300, 4.9406564584124654e-324},
                             {1e22, 123456789.123456789, 2}, {1.7976931348623157e308, 0, 0}};   /* one not used */
    uint32_t triangles[][3] = {{2, 0, 1}, {0, 1, 2}, {1, 2, 0}, {2, 2, 0}};
    uint32_t object[] = {0, 1, 0, 1}, material[] = {0, KELLER_NO_MATERIAL, 1, 2};
    char *objects[] = {(char[]){"a # b"}, (char[]){"h\xc3\xb6he \\ 1"}};
    KellerMaterial materials[] = {{.name = (char[]){"itu_glass"}, .kind = KELLER_MATERIAL_ITU, .itu = "glass"},
                                  {.name = (char[]){"my wall"}},
                                  {.name = (char[]){"steel\\"}, .kind = KELLER_MATERIAL_CONDUCTOR}};
    KellerSoup soup = {.vertex_count = 4, .vertices = vertices, .triangle_count = 4, .triangles = triangles,
                       .material = material, .object = object, .material_count = 3, .materials = materials,
                       .object_count = 2, .objects = objects};
    setlocale(LC_ALL, "de_DE.UTF-8");
    KellerWriteLoss loss = written(&soup, "b.obj");
    assert_int_equal(loss.constants, 1);   /* the conductor's */
    assert_int_equal(loss.renamed + loss.objects + loss.materials, 0);
    KellerSoup obj = read_file_soup("b.obj");
    delete_file("b.obj");
    assert_same(&soup, &obj);
    assert_same_names(&soup, &obj);
    KellerSoup ply = round_trip(&soup, "b.PLY");
    assert_same(&soup, &ply);
    setlocale(LC_ALL, "C");
    keller_soup_free(&obj);
    keller_soup_free(&ply);
}

/* itu_glass, which is of other stuff, must not become glass; blanks at a name's ends would be lost. */
static void test_a_name_that_would_mislead_is_changed(void **state)
{
    (void)state;
    KellerVec3 vertices[] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    uint32_t triangles[][3] = {{0, 1, 2}}, zero[] = {0};
    char *objects[] = {(char[]){" a "}};
    KellerMaterial materials[] = {{.name = (char[]){"itu_glass"}, .kind = KELLER_MATERIAL_ITU, .itu = "wood"}};
    KellerSoup soup = {.vertex_count = 3, .vertices = vertices, .triangle_count = 1, .triangles = triangles,
                       .material = zero, .object = zero, .material_count = 1, .materials = materials,
                       .object_count = 1, .objects = objects};
    KellerWriteLoss loss = written(&soup, "c.obj");
    assert_int_equal(loss.renamed, 1);
    assert_int_equal(loss.constants, 1);
    KellerSoup obj = read_file_soup("c.obj");
    delete_file("c.obj");
    assert_string_equal(obj.objects[0], "_a_");
    assert_string_equal(obj.materials[0].name, "_itu_glass");
    assert_int_equal(obj.materials[0].kind, KELLER_MATERIAL_NAMED);
    keller_soup_free(&obj);
}

static void test_stl_tells_what_it_rounds_and_refuses_what_it_cannot_hold(void **state)
{
    (void)state;
    KellerVec3 vertices[] = {{16777217, 0, 0}, {1, 0, 0}, {0, 1, 0}};   /* 2^24 + 1 becomes 2^24 */
    uint32_t triangles[][3] = {{0, 1, 2}}, zero[] = {0}, none[] = {KELLER_NO_MATERIAL};
    char *objects[] = {(char[]){"a"}};
    KellerSoup soup = {.vertex_count = 3, .vertices = vertices, .triangle_count = 1, .triangles = triangles,
                       .material = none, .object = zero, .object_count = 1, .objects = objects};
    KellerWriteLoss loss = written(&soup, "d.stl");
    assert_true(loss.moved == 1);
    assert_int_equal(loss.objects, 1);
    delete_file("d.stl");
    vertices[1].y = 1e39;
    KellerError error = {0};
    assert_int_equal(keller_scene_write(&soup, KELLER_WRITE_STL, path_of("d.stl"), "d.stl", NULL, &loss, &error),
                     KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "d.stl: vertex 1"));
    delete_file("d.stl");
}

static void test_formats_follow_from_names(void **state)
{
    (void)state;
    KellerWriteFormat format;
    assert_true(keller_write_format("a.b/c.Stl", &format) && format == KELLER_WRITE_STL);
    assert_true(keller_write_format("x.obj", &format) && format == KELLER_WRITE_OBJ);
    static const char *const bad[] = {"a", "a.off", "a.xml", "a.obj/b", "a.objx", ""};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) assert_false(keller_write_format(bad[i], &format));
}

int main(void)
{
    cmocka_set_message_output(CM_OUTPUT_TAP);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_chance_is_the_published_generator),
        cmocka_unit_test(test_directions_are_those_of_libm),
        cmocka_unit_test(test_the_same_definition_makes_the_same_scene),
        cmocka_unit_test(test_buildings_are_closed_solids_on_the_ground),
        cmocka_unit_test(test_buildings_do_not_overlap),
        cmocka_unit_test(test_a_star_leaves_the_roundabout_free),
        cmocka_unit_test(test_a_grid_is_exact_in_single_precision),
        cmocka_unit_test(test_the_model_of_a_city_needs_no_repair),
        cmocka_unit_test(test_blocks_follow_from_triangles),
        cmocka_unit_test(test_random_triangles_fill_their_cube),
        cmocka_unit_test(test_the_sphere_of_slivers_is_closed_and_thin),
        cmocka_unit_test(test_hair_has_31_thin_triangles_a_strand),
        cmocka_unit_test(test_the_axis_of_the_layers_meets_every_sheet),
        cmocka_unit_test(test_houses_stand_in_the_terrain),
        cmocka_unit_test(test_generated_scenes_are_read_back_as_they_were),
        cmocka_unit_test(test_awkward_numbers_and_names_survive),
        cmocka_unit_test(test_a_name_that_would_mislead_is_changed),
        cmocka_unit_test(test_stl_tells_what_it_rounds_and_refuses_what_it_cannot_hold),
        cmocka_unit_test(test_formats_follow_from_names),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
