/* Scene files of one mesh: what they mean, in PLY, OBJ, STL and OFF. Broken ones: test_soup_broken.c. */
#include <locale.h>

#include "io/text.h"
#include "soup_files.h"

/* ---- numbers ---- */

static void numbers(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        double value;
        const char *rest;
    } good[] = {{"17.3", 17.3, ""},          {"-0.1e1x", -1, "x"},       {"+.5", .5, ""},     {"5.", 5, ""},
                {"1e", 1, "e"},              {"2.5e+2 m", 250, " m"},    {"1e-5", 1e-5, ""},  {"1,5", 1, ",5"},
                {"0x10", 0, "x10"},          {"1.2.3", 1.2, ".3"},       {"1e22", 1e22, ""},  {"1e23", 1e23, ""},
                {"9007199254740993", 9007199254740992.0, ""}, /* 2^53 + 1 lies half-way: to even */
                {"5330000.7", 5330000.7, ""}, {"2.2250738585072014e-308", 2.2250738585072014e-308, ""},
                {"4.9e-324", 4.9e-324, ""},  {"0.000000000000000000000001", 1e-24, ""}, {"1e-999", 0, ""},
                {"17.299999999999999999999999999999999999999", 17.3, ""}};
    /* The locale must not matter: with a decimal comma, strtod would stop at the point. */
    const char *locales[] = {"C", "de_DE.UTF-8"};
    for (int l = 0; l < 2; l++) {
        setlocale(LC_ALL, locales[l]);
        for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
            const char *p = good[i].text;
            double value = -77;
            assert_true(keller_text_double(&p, p + strlen(p), &value));
            assert_true(value == good[i].value);
            assert_string_equal(p, good[i].rest);
        }
    }
    setlocale(LC_ALL, "C");
    static const char *const bad[] = {"", "-", ".", "e5", "nan", "inf", "-inf", " 1", "1e999", "+-1", "--1"};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        const char *p = bad[i];
        double value = -77;
        assert_false(keller_text_double(&p, p + strlen(p), &value));
        assert_ptr_equal(p, bad[i]);
        assert_true(value == -77);
    }
    /* The end is where the caller says. */
    const char *p = "1234";
    double value;
    assert_true(keller_text_double(&p, p + 2, &value));
    assert_true(value == 12);
}

/* Every finite double survives printing with 17 digits: the fast way and the slow way both round to nearest. */
static void numbers_round_trip(void **state)
{
    (void)state;
    uint64_t seed = 1;
    for (int i = 0; i < 200000; i++) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        uint64_t bits = seed ^ seed >> 29;
        double x, y;
        char text[64];
        memcpy(&x, &bits, sizeof x);
        if (!isfinite(x)) continue;
        if (i & 1) x = floor(fmod(x, 1e9)) / 1000; /* such as files have */
        snprintf(text, sizeof text, i & 1 ? "%.3f" : "%.17g", x);
        const char *p = text;
        assert_true(keller_text_double(&p, text + strlen(text), &y));
        assert_int_equal(*p, 0);
        if (i & 1) assert_true(y == strtod(text, NULL));
        else assert_true(x == y);
    }
}

/* ---- OBJ ---- */

static void obj_forms(void **state)
{
    (void)state;
    KellerSoup s = read_text_soup("a.obj", "# comment\r\nmtllib x.mtl\n"
                                           "v 0 0 0\nv 17.3 0 0 1.0\nv 1 1 0 0.5 0.5 0.5\n" /* with w; with a colour */
                                           "vt 0 0\nvn 0 0 1\ns off\n"
                                           "f 1 2 3 # comment\n"
                                           "f 1/1 2/1 3/1\nf 1//1 2//1 3//1\nf 1/1/1 \\\n 2/1/1 \\\r\n\t3/1/1\nf -3 -2/-1/-1 -1//-1\n"
                                           "o wall of  brick \nusemtl mat-itu_brick\nf 1 2 4\ng\nusemtl steel\nf 1 2 3\n"
                                           "v 0 1 5330000.7"); /* behind the face that names it */
    assert_int_equal(s.vertex_count, 4);
    assert_point(s.vertices[1], 17.3, 0, 0);
    assert_point(s.vertices[3], 0, 1, 5330000.7);
    assert_int_equal(s.triangle_count, 7);
    for (size_t i = 0; i < 5; i++) {
        assert_corners(&s, i, 0, 1, 2);
        assert_int_equal(s.object[i], 0);
        assert_int_equal(s.material[i], KELLER_NO_MATERIAL);
    }
    assert_corners(&s, 5, 0, 1, 3);
    /* An object before any name, and after an empty one, has the file's. */
    assert_int_equal(s.object_count, 2);
    assert_string_equal(s.objects[0], "a");
    assert_string_equal(s.objects[1], "wall of  brick");
    assert_int_equal(s.object[5], 1);
    assert_int_equal(s.object[6], 0);
    assert_int_equal(s.material_count, 2);
    assert_string_equal(s.materials[0].name, "mat-itu_brick");
    assert_int_equal(s.materials[0].kind, KELLER_MATERIAL_ITU);
    assert_string_equal(s.materials[0].itu, "brick");
    assert_true(s.materials[0].thickness == 0);
    assert_int_equal(s.materials[1].kind, KELLER_MATERIAL_NAMED);
    assert_string_equal(s.materials[1].name, "steel");
    assert_int_equal(s.material[5], 0);
    assert_int_equal(s.material[6], 1);
    assert_non_null(strstr(s.notes, "a.obj:2: mtllib"));
    assert_int_equal(s.files, 1);
    keller_soup_free(&s);
    assert_null(s.vertices);
}

static void obj_material_names(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        KellerMaterialKind kind;
    } names[] = {{"itu_concrete", KELLER_MATERIAL_ITU}, {"itu-concrete", KELLER_MATERIAL_ITU},
                 {"mat-itu_concrete", KELLER_MATERIAL_ITU}, {"mat-itu_concrete.001", KELLER_MATERIAL_ITU},
                 {"concrete", KELLER_MATERIAL_NAMED}, {"itu_", KELLER_MATERIAL_NAMED}, {"my itu_concrete", KELLER_MATERIAL_NAMED}};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char text[200];
        snprintf(text, sizeof text, "v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl %s\nf 1 2 3\n", names[i].name);
        KellerSoup s = read_text_soup("m.obj", text);
        assert_int_equal(s.material_count, 1);
        assert_string_equal(s.materials[0].name, names[i].name);
        assert_int_equal(s.materials[0].kind, names[i].kind);
        assert_string_equal(s.materials[0].itu, names[i].kind == KELLER_MATERIAL_ITU ? "concrete" : "");
        keller_soup_free(&s);
    }
    /* Latin-1 becomes UTF-8, so that a result file holds text only. */
    KellerSoup s = read_text_soup("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\no Stra\xdf" "e\nf 1 2 3\no Stra\xc3\x9f" "e\nf 1 2 3\n");
    assert_int_equal(s.object_count, 1);
    assert_string_equal(s.objects[0], "Stra\xc3\x9f" "e");
    keller_soup_free(&s);
    /* No triangles is no error; lines end as on an old Macintosh. */
    s = read_text_soup("m.obj", "# nothing\rv 1 2 3\r");
    assert_int_equal(s.vertex_count, 1);
    assert_int_equal(s.triangle_count, 0);
    assert_string_equal(s.notes, "");
    keller_soup_free(&s);
    s = read_text_soup("m.obj", "");
    assert_int_equal(s.vertex_count, 0);
    keller_soup_free(&s);
}

static void scale(void **state)
{
    (void)state;
    KellerSoup s;
    KellerError error = {0};
    write_text("s.OBJ", "v 1 2 3\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    assert_int_equal(keller_soup_read(path_of("s.OBJ"), 0.001, &s, &error), KELLER_OK);
    assert_point(s.vertices[0], 1 * 0.001, 2 * 0.001, 3 * 0.001);
    keller_soup_free(&s);
    assert_int_equal(keller_soup_read(path_of("s.OBJ"), 1e308, &s, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "overflows"));
    assert_int_equal(keller_soup_read(path_of("s.OBJ"), 0, &s, &error), KELLER_BAD_INPUT);
    assert_int_equal(keller_soup_read(path_of("s.OBJ"), (double)NAN, &s, &error), KELLER_BAD_INPUT);
    delete_file("s.OBJ");
}

/* ---- PLY ---- */

static void ply_ascii(void **state)
{
    (void)state;
    /* Elements and properties of others before, between and behind; comments; the alternative name; a quadrilateral. */
    KellerSoup s = read_text_soup(
        "t.ply", "ply\nformat ascii 1.0\ncomment made by hand\nobj_info x\nelement camera 1\nproperty list uchar float view\n"
                 "property int q\nelement vertex 4\nproperty uchar red\nproperty double x\nproperty float32 z\n"
                 "property list int int extra\nproperty float64 y\nelement face 2\nproperty float quality\n"
                 "property list uint8 int32 vertex_index\nproperty list uchar float texcoord\nelement edge 1\n"
                 "property int a\nend_header\n"
                 "2 0.5 nan 7\n"
                 "255 17.3 0 0 0.1\n"
                 "255 1 0 2 8 9 0\n\n"
                 "255 1 0 0 1\n"
                 "255 0 0 1 5 1\n"
                 "0.5 4 0 1 2 3 0\nnan 3 2 1 0 2 nan 0.5\n9\n");
    assert_int_equal(s.vertex_count, 4);
    assert_point(s.vertices[0], 17.3, 0.1, 0);
    assert_point(s.vertices[1], 1, 0, 0);
    assert_int_equal(s.triangle_count, 3);
    assert_int_equal(s.polygons_split, 1);
    assert_corners(&s, 2, 2, 1, 0);
    assert_string_equal(s.objects[0], "t");
    assert_int_equal(s.material[0], KELLER_NO_MATERIAL);
    assert_non_null(strstr(s.notes, "t.ply:5: element `camera` (1 entries) is left out"));
    assert_non_null(strstr(s.notes, "element `edge`"));
    keller_soup_free(&s);
}

typedef struct {
    unsigned char bytes[1000];
    size_t size;
    bool big;
} Bytes;

/* Appends the low `size` bytes of a number in the byte order. */
static void put(Bytes *b, uint64_t value, size_t size)
{
    for (size_t i = 0; i < size; i++) b->bytes[b->size++] = (unsigned char)(value >> 8 * (b->big ? size - 1 - i : i));
}
static void put_float(Bytes *b, float value)
{
    uint32_t bits;
    memcpy(&bits, &value, 4);
    put(b, bits, 4);
}
static void put_double(Bytes *b, double value)
{
    uint64_t bits;
    memcpy(&bits, &value, 8);
    put(b, bits, 8);
}

static void ply_binary(void **state)
{
    (void)state;
    static const char *const newline[] = {"\n", "\r\n", "\r"};
    for (int k = 0; k < 6; k++) {
        Bytes b = {.big = k & 1};
        const char *n = newline[k / 2];
        b.size = (size_t)snprintf(
            (char *)b.bytes, 700,
            "ply%sformat binary_%s_endian 1.0%selement face 2%sproperty list ushort char flags%s"
            "property list uint short vertex_indices%selement vertex 4%sproperty float x%sproperty double y%sproperty short z%s"
            "property list float double w%selement end 0%send_header%s",
            n, b.big ? "big" : "little", n, n, n, n, n, n, n, n, n, n, n);
        /* The faces come first: 3 flags (-1, 10, 13) and a triangle; no flags and a quadrilateral. */
        put(&b, 3, 2);
        put(&b, 0xff, 1), put(&b, 10, 1), put(&b, 13, 1);
        put(&b, 3, 4), put(&b, 3, 2), put(&b, 2, 2), put(&b, 1, 2);
        put(&b, 0, 2);
        put(&b, 4, 4), put(&b, 0, 2), put(&b, 1, 2), put(&b, 2, 2), put(&b, 3, 2);
        static const double xy[4][2] = {{0.1, 0.1}, {1, 0}, {1, 1}, {0, 1}};
        for (int i = 0; i < 4; i++) {
            put_float(&b, (float)xy[i][0]), put_double(&b, xy[i][1]), put(&b, (uint64_t)(-7), 2);
            put_float(&b, (float)i);
            for (int j = 0; j < i; j++) put_double(&b, 1.5);
        }
        KellerSoup s = read_bytes("b.ply", b.bytes, b.size);
        assert_int_equal(s.vertex_count, 4);
        assert_point(s.vertices[0], (double)0.1f, 0.1, -7);
        assert_point(s.vertices[3], 0, 1, -7);
        assert_int_equal(s.triangle_count, 3);
        assert_corners(&s, 0, 3, 2, 1);
        assert_string_equal(s.notes, "");
        keller_soup_free(&s);
        b.bytes[b.size++] = 0; /* one byte too many is said */
        s = read_bytes("b.ply", b.bytes, b.size);
        assert_non_null(strstr(s.notes, "what follows the last element is left out"));
        keller_soup_free(&s);
    }
}

/* Behind lines that end in CR alone, a LF is the body's first byte: here the x of the only vertex, 10. */
static void ply_carriage_return(void **state)
{
    (void)state;
    static const char text[] = "ply\rformat binary_little_endian 1.0\relement vertex 1\rproperty uchar x\rproperty uchar y\r"
                               "property uchar z\rend_header\r\n\r\n";
    KellerSoup s = read_bytes("r.ply", text, sizeof text - 1);
    assert_point(s.vertices[0], 10, 13, 10);
    keller_soup_free(&s);
}

/* All eight types under both names, with their extreme values. */
static void ply_types(void **state)
{
    (void)state;
    static const struct {
        const char *names[2];
        size_t size;
        uint64_t bits;
        double value;
    } types[] = {{{"char", "int8"}, 1, 0x80, -128},
                 {{"uchar", "uint8"}, 1, 0xff, 255},
                 {{"short", "int16"}, 2, 0x8000, -32768},
                 {{"ushort", "uint16"}, 2, 0xffff, 65535},
                 {{"int", "int32"}, 4, 0x80000000u, -2147483648.0},
                 {{"uint", "uint32"}, 4, 0xffffffffu, 4294967295.0},
                 {{"float", "float32"}, 4, 0x7f7fffffu, 3.4028234663852886e38},
                 {{"double", "float64"}, 8, 0x3fb999999999999au, 0.1}};
    for (size_t i = 0; i < 8; i++)
        for (int k = 0; k < 4; k++) {
            Bytes b = {.big = k & 1};
            b.size = (size_t)snprintf((char *)b.bytes, 500,
                                      "ply\nformat binary_%s_endian 1.0\nelement vertex 1\nproperty %s x\nproperty %s y\n"
                                      "property %s z\nend_header\n",
                                      b.big ? "big" : "little", types[i].names[k / 2], types[i].names[k / 2], types[i].names[k / 2]);
            put(&b, 0, types[i].size), put(&b, types[i].bits, types[i].size), put(&b, 0, types[i].size);
            KellerSoup s = read_bytes("t.ply", b.bytes, b.size);
            assert_point(s.vertices[0], 0, types[i].value, 0);
            keller_soup_free(&s);
        }
}

/* ---- STL ---- */

static const char stl_text[] = "solid wall a\n facet normal nan nan nan\n  outer loop\n   vertex 17.3 0 0\n   vertex 1 0 0\n"
                               "   vertex 0 1 0\n  endloop\n endfacet\nendsolid wall a\n"
                               "SOLID\nFACET NORMAL 0 0 1 OUTER LOOP\nVERTEX 0 0 0\nVERTEX 1 0 0\nVERTEX 0 1 0\nENDLOOP\n"
                               "ENDFACET\nENDSOLID";

static void stl_ascii(void **state)
{
    (void)state;
    KellerSoup s = read_text_soup("a.stl", stl_text);
    assert_int_equal(s.triangle_count, 2);
    assert_int_equal(s.vertex_count, 6);
    assert_point(s.vertices[0], 17.3, 0, 0); /* exactly, not 17.299999237 */
    assert_int_equal(s.object_count, 2);
    assert_string_equal(s.objects[0], "wall a");
    assert_string_equal(s.objects[1], "a");
    assert_int_equal(s.object[1], 1);
    keller_soup_free(&s);
    s = read_text_soup("a.stl", "solid nothing\nendsolid nothing\n");
    assert_int_equal(s.triangle_count, 0);
    keller_soup_free(&s);
}

static void stl_binary(void **state)
{
    (void)state;
    /* A header that begins as a text does: `solid`, even with `facet` in a second line. */
    static const char *const headers[] = {"", "solid", "solid x\nfacet normal 0 0 1\n"};
    for (int k = 0; k < 3; k++) {
        Bytes b = {0};
        memcpy(b.bytes, headers[k], strlen(headers[k]));
        b.size = 80;
        put(&b, 2, 4);
        for (int t = 0; t < 2; t++) {
            for (int i = 0; i < 12; i++) put_float(&b, i == 3 ? 17.3f : (float)(i * i + t));
            put(&b, 0, 2);
        }
        KellerSoup s = read_bytes("b.stl", b.bytes, b.size);
        assert_int_equal(s.triangle_count, 2);
        assert_point(s.vertices[0], (double)17.3f, 16, 25);
        assert_point(s.vertices[5], 82, 101, 122); /* 9^2 + 1, 10^2 + 1, 11^2 + 1 */
        assert_string_equal(s.objects[0], "b");
        assert_string_equal(s.notes, "");
        keller_soup_free(&s);
        b.size += 3; /* padding is said */
        s = read_bytes("b.stl", b.bytes, b.size);
        assert_int_equal(s.triangle_count, 2);
        assert_non_null(strstr(s.notes, "3 bytes behind the last triangle"));
        keller_soup_free(&s);
    }
}

/* ---- OFF ---- */

static void off_forms(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "OFF\n# comment\n4 2 0\n17.3 0 0\n1 0 0\n\n1 1 0 # comment\n0 1 0\n3 0 1 2\n3 0 2 3\n",
        "OFF 4 2 0\r\n17.3 0 0\r\n1 0 0\r\n1 1 0\r\n0 1 0\r\n3 0 1 2 255 0 0\r\n3 0 2 3 0.1 0.2 0.3 1\r\n",
        "COFF\n4 2\n17.3 0 0 255 0 0 255\n1 0 0 0 0 0 255\n1 1 0 1 1 1 1\n0 1 0 1 1 1\n3 0 1 2 7\n3 0 2 3",
        ("STCNOFF\n4 2 5\n17.3 0 0  0 0 1  1 1 1 1  .5 .5\n1 0 0  0 0 1  1 1 1 1  .5 .5\n1 1 0  0 0 1  1 1 1 1  .5 .5\n"
         "0 1 0  0 nan 1  1 1 1 1  .5 .5\n3 0 1 2\n3 0 2 3"),
        "NOFF\n4 2 5\n17.3 0 0  0 0 1\n1 0 0  0 0 1\n1 1 0  0 0 1\n0 1 0  0 0 1\n3 0 1 2\n3 0 2 3"};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        KellerSoup s = read_text_soup("o.off", texts[i]);
        assert_int_equal(s.vertex_count, 4);
        assert_point(s.vertices[0], 17.3, 0, 0);
        assert_point(s.vertices[3], 0, 1, 0);
        assert_int_equal(s.triangle_count, 2);
        assert_corners(&s, 1, 0, 2, 3);
        assert_string_equal(s.objects[0], "o");
        assert_string_equal(s.notes, "");
        keller_soup_free(&s);
    }
    KellerSoup s = read_text_soup("o.off", "OFF\n5 1 0\n0 0 0\n2 0 0\n2 2 0\n1 0.5 0\n0 2 0\n5 0 1 2 3 4\nmore\n");
    assert_int_equal(s.triangle_count, 3);
    assert_int_equal(s.polygons_split, 1);
    /* The square of 2 by 2 without the notch (0,2)-(1,.5)-(2,2) of area 1.5: 2.5. */
    assert_true(fabs(area_of(&s) / 2 - 2.5) < 1e-15);
    assert_non_null(strstr(s.notes, "o.off:9: what follows the last face"));
    keller_soup_free(&s);
    s = read_text_soup("o.off", "OFF\n0 0 0\n");
    assert_int_equal(s.triangle_count, 0);
    keller_soup_free(&s);
}

static void real_meshes(void **state)
{
    (void)state;
    static const struct {
        const char *file;
        size_t triangles;
    } meshes[] = {{"meshes/legocar.obj", 10992}, {"indoor/steam-audio/boxroom.obj", 12}, {"indoor/steam-audio/sphere.obj", 960},
                  {"indoor/steam-audio/smallbox.obj", 12}, {"indoor/steam-audio/simplescene.obj", 108}};
    for (size_t i = 0; i < sizeof meshes / sizeof *meshes; i++) {
        const char *path = real_scene(meshes[i].file);
        if (!path) skip();
        KellerSoup s;
        KellerError error = {0};
        if (keller_soup_read(path, 1, &s, &error) != KELLER_OK) fail_msg("%s", error.message);
        assert_int_equal(s.triangle_count, meshes[i].triangles);
        if (i == 0) assert_int_equal(s.object_count, 26); /* its different `g` names that have faces */
        keller_soup_free(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(numbers),    cmocka_unit_test(numbers_round_trip), cmocka_unit_test(obj_forms),
        cmocka_unit_test(obj_material_names), cmocka_unit_test(scale),      cmocka_unit_test(ply_ascii),
        cmocka_unit_test(ply_binary), cmocka_unit_test(ply_carriage_return), cmocka_unit_test(ply_types),
        cmocka_unit_test(stl_ascii),  cmocka_unit_test(stl_binary),         cmocka_unit_test(off_forms),
        cmocka_unit_test(real_meshes)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
