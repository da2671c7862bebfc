/* Mitsuba's scene files: what they mean, and broken ones. */
#include "soup_files.h"

#define HEAD "<?xml version=\"1.0\"?>\n<scene version=\"2.1.0\">\n" /* the next line is line 3 */
#define END "</scene>\n"

static KellerSoup read_scene(const char *body)
{
    char text[20000];
    assert_true((size_t)snprintf(text, sizeof text, HEAD "%s" END, body) < sizeof text);
    return read_text_soup("s.xml", text);
}

static void expect_scene(const char *body, const char *place, const char *words)
{
    char text[20000];
    assert_true((size_t)snprintf(text, sizeof text, HEAD "%s" END, body) < sizeof text);
    expect_failure("s.xml", text, place, words);
}

static void assert_near_point(KellerVec3 p, double x, double y, double z)
{
    if (fabs(p.x - x) > 1e-14 || fabs(p.y - y) > 1e-14 || fabs(p.z - z) > 1e-14)
        fail_msg("(%.17g, %.17g, %.17g) instead of (%.17g, %.17g, %.17g)", p.x, p.y, p.z, x, y, z);
}

static void shapes(void **state)
{
    (void)state;
    write_text("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\no one\nusemtl itu_nonsense\nf 1 2 3\no two\nf 1 2 4\n");
    assert_int_equal(mkdir(path_of("m"), 0700), 0);
    write_text("m/b.ply", "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n"
                          "element face 1\nproperty list uchar int vertex_index\nend_header\n0 0 0\n1 0 0\n0 17.3 0\n3 0 1 2\n");
    write_text("m/c.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n"
                          "endsolid\n");
    char text[3000];
    snprintf(text, sizeof text,
             "<bsdf type=\"diffuse\" id=\"paint\"/>\n"
             "<shape type=\"obj\" id=\"mesh-house\"><string name=\"filename\" value=\"a.obj\"/><ref id=\"paint\" name=\"bsdf\"/></shape>\n"
             "<shape type=\"ply\" id=\"mesh-house\"><string name=\"filename\" value=\"m/b.ply\"/><ref id=\"paint\"/></shape>\n"
             "<shape type=\"stl\"><string name=\"filename\" value=\"%s/m/c.stl\"/></shape>\n" /* absolute; neither id nor bsdf */
             "<shape type=\"ply\" id=\"elm__5\"><string name=\"filename\" value=\"m/b.ply\"/></shape>\n"
             "<shape type=\"rectangle\" id=\"mesh-house_2\"/>\n"
             "<shape type=\"cube\"/>\n<shape type=\"sphere\" id=\"ball\"><float name=\"radius\" value=\"2\"/></shape>\n"
             "<integrator type=\"path\"><integer name=\"max_depth\" value=\"$unset\"/></integrator><emitter type=\"constant\"/>\n"
             "<sensor type=\"perspective\"><transform name=\"to_world\"><nonsense/></transform></sensor>\n", folder);
    KellerSoup s = read_scene(text);
    static const char *const objects[] = {"house", "house_2", "c", "elm__5", "house_2_2", "cube"};
    static const size_t counts[] = {2, 1, 1, 1, 2, 12};
    assert_int_equal(s.object_count, 6);
    assert_int_equal(s.triangle_count, 19);
    size_t t = 0;
    for (size_t o = 0; o < 6; o++) { /* the groups within the OBJ are one object */
        assert_string_equal(s.objects[o], objects[o]);
        for (size_t i = 0; i < counts[o]; i++, t++) {
            assert_int_equal(s.object[t], o);
            assert_int_equal(s.material[t], o < 2 ? 0 : KELLER_NO_MATERIAL);
        }
    }
    assert_int_equal(s.material_count, 1); /* the shape's material, not the OBJ's */
    assert_string_equal(s.materials[0].name, "paint");
    assert_int_equal(s.materials[0].kind, KELLER_MATERIAL_NAMED);
    assert_point(s.vertices[6], 0, 17.3, 0);
    assert_int_equal(s.files, 5);
    assert_int_equal(s.polygons_split, 0);
    assert_non_null(strstr(s.notes, "s.xml:10: shape `ball` of type `sphere` is left out"));
    assert_true(fabs(area_of(&s) / 2 - (1 + 17.3 / 2 + 0.5 + 17.3 / 2 + 4 + 24)) < 1e-12);
    /* The cube is closed: its faces' normals all point outwards, so that the volumes of the cones to the centre sum to 8. */
    double volume = 0;
    for (size_t i = 7; i < 19; i++) {
        KellerVec3 a = s.vertices[s.triangles[i][0]], b = s.vertices[s.triangles[i][1]], c = s.vertices[s.triangles[i][2]];
        volume += v3_dot(a, v3_cross(b, c)) / 6;
    }
    assert_true(volume == 8);
    keller_soup_free(&s);
    delete_file("a.obj");
    delete_file("m/b.ply");
    delete_file("m/c.stl");
    assert_int_equal(rmdir(path_of("m")), 0);
}

/* Where a transform takes corner (1, 1, 0) of a rectangle (vertex 3). */
static KellerVec3 moved(const char *name, const char *steps)
{
    char text[2000];
    snprintf(text, sizeof text, "<shape type=\"rectangle\"><transform name=\"%s\">%s</transform></shape>", name, steps);
    KellerSoup s = read_scene(text);
    KellerVec3 p = s.vertices[3];
    keller_soup_free(&s);
    return p;
}

static void transforms(void **state)
{
    (void)state;
    assert_point(moved("to_world", "<translate x=\"1\" z=\"-2.5\"/>"), 2, 1, -2.5);
    assert_point(moved("toWorld", "<translate value=\"1, 2, 3\"/>"), 2, 3, 3);
    assert_point(moved("to_uv", "<translate value=\"1, 2, 3\"/>"), 1, 1, 0); /* of the texture */
    assert_point(moved("to_world", "<scale value=\"2\"/>"), 2, 2, 0);
    assert_point(moved("to_world", "<scale value=\"2 3 4\"/>"), 2, 3, 0);
    assert_point(moved("to_world", "<scale y=\"3\"/>"), 1, 3, 0);
    /* In the order of the document: scaled first, or moved first. */
    assert_point(moved("to_world", "<scale value=\"2\"/><translate x=\"1\"/>"), 3, 2, 0);
    assert_point(moved("to_world", "<translate x=\"1\"/><scale value=\"2\"/>"), 4, 2, 0);
    /* Right angles are exact: x turns y into z, y turns z into x, z turns x into y. */
    assert_point(moved("to_world", "<rotate x=\"1\" angle=\"90\"/>"), 1, 0, 1);
    assert_point(moved("to_world", "<rotate y=\"1\" angle=\"90\"/>"), 0, 1, -1);
    assert_point(moved("to_world", "<rotate z=\"1\" angle=\"90\"/>"), -1, 1, 0);
    assert_point(moved("to_world", "<rotate z=\"1\" angle=\"-90\"/>"), 1, -1, 0);
    assert_point(moved("to_world", "<rotate z=\"5\" angle=\"540\"/>"), -1, -1, 0);
    assert_near_point(moved("to_world", "<rotate value=\"0 0 1\" angle=\"45\"/>"), 0, sqrt(2), 0);
    /* A third of a turn about (1, 1, 1) takes x to y, y to z, z to x. */
    assert_near_point(moved("to_world", "<rotate x=\"1\" y=\"1\" z=\"1\" angle=\"120\"/>"), 0, 1, 1);
    assert_point(moved("to_world", "<matrix value=\"1 2 3 4  5 6 7 8  9 10 11 12  0 0 0 1\"/>"), 7, 19, 31);
    assert_point(moved("to_world", "<matrix value=\"1 2 3  5 6 7  9 10 11\"/>"), 3, 11, 19);
    /* From (10, 0, 0) towards +x with z up: local z is +x, local y is z, local x is up x forward = z x x = y. */
    assert_point(moved("to_world", "<lookat origin=\"10,0,0\" target=\"20,0,0\" up=\"0,0,1\"/>"), 10, 1, 1);
    assert_point(moved("to_world", ""), 1, 1, 0);
}

static void defaults(void **state)
{
    (void)state;
    /* The first value stands; values may use earlier ones. $where is "1 2 12". */
    KellerSoup s = read_scene("<default name=\"size\" value=\"2\"/><default name=\"size\" value=\"5\"/>\n"
                              "<default name=\"where\" value=\"1 $size 1$size\"/><default name=\"kind\" value=\"rect\"/>\n"
                              "<shape type=\"rectangle\" id=\"$kind-a\"><transform name=\"to_world\"><translate value=\"$where\"/>"
                              "</transform></shape>");
    assert_point(s.vertices[3], 2, 3, 12);
    assert_string_equal(s.objects[0], "rect-a");
    keller_soup_free(&s);
    expect_scene("\n<shape type=\"$kind\"/>", ":4: ", "`$kind` has no value; expected a <default>");
    expect_scene("<default name=\"a\" value=\"$\"/>", ":3: ", "`$` has no value");
    expect_scene("<default name=\"a\"/>", ":3: ", "<default> lacks name or value");
    /* Each doubles the last: 2^40 characters. */
    char text[4000], *p = text;
    p += sprintf(p, "<default name=\"v0\" value=\"xxxxxxxx\"/>\n");
    for (int i = 1; i < 40; i++) p += sprintf(p, "<default name=\"v%d\" value=\"$v%d$v%d\"/>\n", i, i - 1, i - 1);
    expect_scene(text, ":17: ", "a value of more than 65536 characters"); /* 8 * 2^14 in v14, line 17 */
}

#define RECTANGLE(id) "<shape type=\"rectangle\"><ref id=\"" id "\"/></shape>\n"

static void assert_material(const KellerSoup *s, size_t i, const char *name, KellerMaterialKind kind, const char *itu, double thickness)
{
    assert_true(i < s->material_count);
    assert_string_equal(s->materials[i].name, name);
    assert_int_equal(s->materials[i].kind, kind);
    assert_string_equal(s->materials[i].itu, itu);
    assert_true(s->materials[i].thickness == thickness);
}

static void materials(void **state)
{
    (void)state;
    KellerSoup s = read_scene(
        "<bsdf type=\"itu-radio-material\" id=\"box-mat\"><string name=\"type\" value=\"metal\"/>"
        "<float name=\"thickness\" value=\" 0.1 \"/></bsdf>\n"
        "<bsdf type=\"twosided\" id=\"mat-itu_concrete\"><bsdf type=\"diffuse\" name=\"bsdf\"/></bsdf>\n"
        "<bsdf type=\"diffuse\" id=\"itu_glass\"/>\n"
        "<bsdf type=\"twosided\" id=\"elm__5\"><bsdf type=\"diffuse\" id=\"mat-itu_brick\"/></bsdf>\n"
        "<bsdf type=\"radio-material\" id=\"own\"><float name=\"relative_permittivity\" value=\"5.5\"/>"
        "<float name=\"conductivity\" value=\"0.25\"/><float name=\"thickness\" value=\"0.2\"/>"
        "<float name=\"scattering_coefficient\" value=\"0.5\"/></bsdf>\n"
        "<bsdf type=\"twosided\" id=\"Walls\"><bsdf type=\"diffuse\"/></bsdf>\n"
        "<bsdf type=\"mask\" id=\"wrapped\"><ref id=\"box-mat\"/></bsdf>\n"
        "<bsdf type=\"itu-radio-material\" id=\"half\"><string name=\"type\" value=\"itu_wood\"/></bsdf>\n"
        "<bsdf type=\"itu-radio-material\" id=\"unused\"/>\n<alias id=\"own\" as=\"alias\"/>\n"
        "<emitter type=\"area\" id=\"lamp\"/>\n" RECTANGLE("box-mat") RECTANGLE("mat-itu_concrete") RECTANGLE("itu_glass")
            RECTANGLE("elm__5") RECTANGLE("own") RECTANGLE("Walls") RECTANGLE("wrapped") RECTANGLE("half")
                RECTANGLE("mat-itu_marble") RECTANGLE("alias") RECTANGLE("box-mat") RECTANGLE("lamp")
        "<shape type=\"rectangle\"><bsdf type=\"itu-radio-material\"><string name=\"type\" value=\"metal\"/>"
        "<float name=\"thickness\" value=\"0.1\"/></bsdf></shape>\n"
        "<shape type=\"rectangle\"><bsdf type=\"diffuse\"/></shape>\n"
        "<shape type=\"rectangle\"><bsdf type=\"diffuse\" id=\"inner\"/><ref name=\"interior\" id=\"air\"/></shape>\n"
        "<shape type=\"rectangle\"><bsdf type=\"diffuse\"><bsdf type=\"x\" name=\"itu_glass\"/></bsdf></shape>\n");
    assert_int_equal(s.material_count, 11);
    assert_material(&s, 0, "box-mat", KELLER_MATERIAL_ITU, "metal", 0.1);
    assert_material(&s, 1, "mat-itu_concrete", KELLER_MATERIAL_ITU, "concrete", 0);
    assert_material(&s, 2, "itu_glass", KELLER_MATERIAL_ITU, "glass", 0);
    assert_material(&s, 3, "elm__5", KELLER_MATERIAL_ITU, "brick", 0);
    assert_material(&s, 4, "own", KELLER_MATERIAL_CONSTANT, "", 0.2);
    assert_true(s.materials[4].permittivity == 5.5 && s.materials[4].conductivity == 0.25);
    assert_material(&s, 5, "Walls", KELLER_MATERIAL_NAMED, "", 0);
    assert_material(&s, 6, "wrapped", KELLER_MATERIAL_ITU, "metal", 0.1);
    assert_material(&s, 7, "half", KELLER_MATERIAL_ITU, "wood", 0);
    assert_material(&s, 8, "mat-itu_marble", KELLER_MATERIAL_ITU, "marble", 0); /* defined nowhere, but its name says it */
    assert_material(&s, 9, "itu_metal_0.1m", KELLER_MATERIAL_ITU, "metal", 0.1);
    assert_material(&s, 10, "inner", KELLER_MATERIAL_NAMED, "", 0);
    /* A nested one without an id takes its name from what it is, and is the same as the one that has it already. */
    static const uint32_t expected[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 4, 0, KELLER_NO_MATERIAL, 9, KELLER_NO_MATERIAL, 10, 2};
    assert_int_equal(s.triangle_count, 2 * 16);
    for (size_t i = 0; i < 16; i++) assert_int_equal(s.material[2 * i], expected[i]);
    assert_non_null(strstr(s.notes, "s.xml:10: the material has no thickness: taken as a half-space"));
    assert_non_null(strstr(s.notes, "s.xml:7: scattering_coefficient is left out"));
    keller_soup_free(&s);
}

static void includes(void **state)
{
    (void)state;
    assert_int_equal(mkdir(path_of("sub"), 0700), 0);
    write_text("sub/part.xml", "<scene version=\"3.0.0\"><bsdf type=\"diffuse\" id=\"w\"/><default name=\"n\" value=\"x\"/>"
                               "<shape type=\"obj\"><string name=\"filename\" value=\"t.obj\"/></shape></scene>");
    write_text("sub/t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    KellerSoup s = read_scene("<include filename=\"sub/part.xml\"/><shape type=\"rectangle\" id=\"$n\"><ref id=\"w\"/></shape>");
    assert_int_equal(s.files, 3);
    assert_int_equal(s.triangle_count, 3);
    assert_string_equal(s.objects[0], "t");
    assert_string_equal(s.objects[1], "x");
    keller_soup_free(&s);
    delete_file("sub/part.xml");
    delete_file("sub/t.obj");
    assert_int_equal(rmdir(path_of("sub")), 0);
    expect_scene("<include filename=\"s.xml\"/>", ":3: ", "include files without end");
    expect_scene("<include filename=\"s.xml\"/><include filename=\"s.xml\"/>", ":3: ", "include files without end");
    expect_scene("<include/>", ":3: ", "<include> has no filename");
}

static void broken(void **state)
{
    (void)state;
#define TRANSFORM(x) "<shape type=\"cube\">\n<transform name=\"to_world\">\n" x "</transform></shape>"
    static const struct {
        const char *body, *place, *words;
    } cases[] = {
        {"<shape/>", ":3: ", "the shape has no type"},
        {"\n<shape type=\"ply\"/>", ":4: ", "the shape has no filename"},
        {"<shape type=\"ply\"><string name=\"filename\"/></shape>", ":3: ", "has no value"},
        {"<shap type=\"ply\"/>", ":3: ", "<shap> in a scene"},
        {"<shape type=\"cube\">\n<ref id=\"nothing\"/></shape>", ":4: ", "<ref> to `nothing`, which nothing defines"},
        {"<shape type=\"cube\">\n<ref/></shape>", ":4: ", "<ref> has no id"},
        {"<shape type=\"cube\">\n<ref id=\"itu_cheese\"/></shape>", ":4: ", "material `cheese` is not in the ITU-R P.2040 table"},
        {"<bsdf type=\"x\" id=\"itu_cheese\"/>\n" RECTANGLE("itu_cheese"), ":3: ", "expected one of"},
        {"<bsdf type=\"itu-radio-material\" id=\"a\"><string name=\"type\" value=\"cheese\"/></bsdf>\n" RECTANGLE("a"), ":3: ",
         "material `cheese`"},
        {"<bsdf type=\"itu-radio-material\" id=\"a\"/>\n" RECTANGLE("a"), ":3: ", "the itu-radio-material has no type"},
        {"<bsdf type=\"itu-radio-material\" id=\"a\"><string name=\"type\" value=\"wood\"/>"
         "<float name=\"thickness\" value=\"10 cm\"/></bsdf>\n" RECTANGLE("a"), ":3: ", "thickness is `10 cm`; expected a number"},
        {"<bsdf type=\"itu-radio-material\" id=\"a\"><string name=\"type\" value=\"wood\"/>"
         "<float name=\"thickness\" value=\"-1\"/></bsdf>\n" RECTANGLE("a"), ":3: ", "thickness is `-1`; expected a number, 0 or more"},
        {"<bsdf type=\"radio-material\" id=\"a\"><float name=\"relative_permittivity\" value=\"0.5\"/></bsdf>\n" RECTANGLE("a"), ":3: ",
         "relative_permittivity is `0.5`; expected a number, 1 or more"},
        {"<bsdf type=\"radio-material\" id=\"a\"><float name=\"conductivity\" value=\"1\"/></bsdf>\n" RECTANGLE("a"), ":3: ",
         "no relative_permittivity"},
        {"<bsdf type=\"a\" id=\"a\"/>\n<bsdf type=\"b\" id=\"a\"/>", ":4: ", "a second <bsdf> with the id `a` (the first: line 3)"},
        {"<bsdf type=\"a\" id=\"a\"><ref id=\"b\"/></bsdf><bsdf type=\"b\" id=\"b\"><ref id=\"a\"/><ref id=\"a\"/></bsdf>" RECTANGLE("a"),
         ":3: ", "in a circle"},
        {"<shape type=\"cube\"><bsdf type=\"a\"/>\n<bsdf type=\"a\"/></shape>", ":4: ", "a second material of one shape"},
        {"<alias id=\"a\" as=\"b\"/>", ":3: ", "<alias> names nothing defined before"},
        {TRANSFORM("<shear x=\"1\"/>"), ":5: ", "<shear> in a transform; expected translate"},
        {TRANSFORM("<translate value=\"1 2\"/>"), ":5: ", "value of <translate> has 2 numbers; expected 3"},
        {TRANSFORM("<translate value=\"1 2 3 4\"/>"), ":5: ", "value of <translate> has `4`; expected 3 finite numbers"},
        {TRANSFORM("<translate x=\"nan\"/>"), ":5: ", "x of <translate> has `nan`"},
        {TRANSFORM("<translate x=\"\"/>"), ":5: ", "x of <translate> is empty"},
        {TRANSFORM("<scale value=\"1 2\"/>"), ":5: ", "expected 1 or 3"},
        {TRANSFORM("<rotate x=\"1\"/>"), ":5: ", "<rotate> has no angle"},
        {TRANSFORM("<rotate angle=\"90\"/>"), ":5: ", "the axis of <rotate> is (0, 0, 0)"},
        {TRANSFORM("<rotate x=\"1\" angle=\"90deg\"/>"), ":5: ", "has `90deg`"},
        {TRANSFORM("<matrix value=\"1 2 3\"/>"), ":5: ", "<matrix> has 3 numbers; expected 16"},
        {TRANSFORM("<matrix/>"), ":5: ", "<matrix> has 0 numbers; expected 16"},
        {TRANSFORM("<matrix value=\"1 0 0 0 0 1 0 0 0 0 1 0 0 0 1 1\"/>"), ":5: ", "the last row of <matrix> is 0 0 1 1"},
        {TRANSFORM("<lookat origin=\"0 0 0\" target=\"0 0 5\" up=\"0 0 1\"/>"), ":5: ", "looks along `up` or nowhere"},
        {TRANSFORM("<lookat origin=\"0 0 0\" target=\"0 0 5\"/>"), ":5: ", "up of <lookat> has 0 numbers"},
        {TRANSFORM("<scale value=\"1e308\"/><scale value=\"1e308\"/>"), ":3: ", "the transform takes a vertex to"},
        {"<shape type=\"cube\"><transform name=\"to_world\"/>\n<transform name=\"to_world\"/></shape>", ":4: ", "a second transform"},
        {"<shape type=\"cube\">\n<animation name=\"toWorld\"/></shape>", ":4: ", "an animated shape"}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) expect_scene(cases[i].body, cases[i].place, cases[i].words);
    expect_failure("s.xml", "<osm version=\"0.6\"/>", ":1: ", "the root element is <osm>; expected <scene>");
    expect_failure("s.xml", "<scene>\n<shape></scene>", ":2: ", "XML");
    expect_failure("s.xml", "<!DOCTYPE a [<!ENTITY b \"c\">]><scene>&b;</scene>", ":1: ", "document type");
    expect_failure("s.xml", "", ":1: ", "empty");
}

/* The errors of the files that a scene names say where it names them, or their own place. */
static void broken_files(void **state)
{
    (void)state;
    char text[1000], words[1200];
    snprintf(words, sizeof words, "cannot open `%s/none.ply`: No such file", folder);
    snprintf(text, sizeof text, HEAD "\n<shape type=\"ply\"><string name=\"filename\" value=\"none.ply\"/></shape>" END);
    expect_failure_bytes("s.xml", text, strlen(text), KELLER_IO, ":4: ", words);
    write_text("bad.obj", "v 1 2 3\nf 1 1 2\n");
    write_text("s.xml", HEAD "<shape type=\"obj\"><string name=\"filename\" value=\"bad.obj\"/></shape>" END);
    KellerSoup soup;
    KellerError error = {0};
    assert_int_equal(keller_soup_read(path_of("s.xml"), 1, &soup, &error), KELLER_BAD_INPUT);
    snprintf(words, sizeof words, "%s/bad.obj:2: vertex 2 in a face", folder);
    assert_memory_equal(error.message, words, strlen(words));
    delete_file("s.xml");
    delete_file("bad.obj");
}

static void real_scenes(void **state)
{
    (void)state;
    static const struct {
        const char *file;
        size_t triangles, objects, materials;
    } scenes[] = {{"sionna/munich/munich.xml", 38938, 2367, 5},
                  {"indoor/classroom/scene.xml", 103832, 79, 44},
                  {"sionna/box/box.xml", 12, 1, 1},
                  {"sionna/box_one_screen/box_one_screen.xml", 14, 2, 2},
                  {"sionna/box_two_screens/box_two_screens.xml", 16, 3, 2},
                  {"sionna/double_reflector/double_reflector.xml", 4, 2, 1},
                  {"sionna/floor_wall/floor_wall.xml", 4, 2, 2},
                  {"sionna/simple_reflector/simple_reflector.xml", 2, 1, 1},
                  {"sionna/simple_street_canyon/simple_street_canyon.xml", 74, 7, 5},
                  {"sionna/simple_street_canyon_with_cars/simple_street_canyon_with_cars.xml", 234, 15, 6},
                  {"sionna/simple_wedge/simple_wedge.xml", 4, 1, 1},
                  {"sionna/triple_reflector/triple_reflector.xml", 6, 3, 1}};
    for (size_t i = 0; i < sizeof scenes / sizeof *scenes; i++) {
        const char *path = real_scene(scenes[i].file);
        if (!path) skip();
        KellerSoup s;
        KellerError error = {0};
        if (keller_soup_read(path, 1, &s, &error) != KELLER_OK) fail_msg("%s", error.message);
        assert_int_equal(s.triangle_count, scenes[i].triangles);
        assert_int_equal(s.object_count, scenes[i].objects);
        assert_int_equal(s.material_count, scenes[i].materials);
        for (size_t m = 0; m < s.material_count; m++)
            assert_int_equal(s.materials[m].kind, i == 1 ? KELLER_MATERIAL_NAMED : KELLER_MATERIAL_ITU);
        for (size_t t = 0; t < s.triangle_count; t++) assert_true(s.material[t] < s.material_count);
        if (i == 0) {
            assert_int_equal(s.vertex_count, 42293);
            assert_string_equal(s.objects[0], "Heilig_Geist-itu_marble");
            assert_material(&s, 0, "marble", KELLER_MATERIAL_ITU, "marble", 0.1);
        }
        assert_string_equal(s.notes, "");
        keller_soup_free(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(shapes),    cmocka_unit_test(transforms), cmocka_unit_test(defaults),
                                       cmocka_unit_test(materials), cmocka_unit_test(includes),   cmocka_unit_test(broken),
                                       cmocka_unit_test(broken_files), cmocka_unit_test(real_scenes)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
