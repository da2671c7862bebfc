/* Broken scene files of one mesh: each with its status, its place and what the message says. */
#include "soup_files.h"

typedef struct {
    const char *file, *text, *place, *words;
} Broken;

static void run(const Broken *cases, size_t count)
{
    for (size_t i = 0; i < count; i++) expect_failure(cases[i].file, cases[i].text, cases[i].place, cases[i].words);
}
#define RUN(cases) run(cases, sizeof cases / sizeof *cases)

#define TRI "v 0 0 0\nv 1 0 0\nv 0 1 0\n" /* three lines */

static void obj(void **state)
{
    (void)state;
    static const Broken cases[] = {
        {"b.obj", "v 1 2\n", ":1: ", "the line ends before z; expected a finite number"},
        {"b.obj", "\nv 1 nan 2\n", ":2: ", "y is `nan`; expected a finite number"},
        {"b.obj", "v 1 2 inf\n", ":1: ", "z is `inf`"},
        {"b.obj", "v 1e999 2 3\n", ":1: ", "x is `1e999`"},
        {"b.obj", "v 1,5 2 3\n", ":1: ", "x is `1,5`"},
        {"b.obj", "v 0x1 2 3\n", ":1: ", "x is `0x1`"},
        {"b.obj", "v 1 2 3 4 5\n", ":1: ", "a vertex with 5 values"},
        {"b.obj", "v 1 2 3 4 5 6 7 8\n", ":1: ", "more than 7 values"},
        {"b.obj", "v 1 2 3 x\n", ":1: ", "is `x`"},
        {"b.obj", "v 1 \\\n 2 \\\n 3q\n", ":3: ", "z is `3q`"},
        {"b.obj", TRI "f 1 2 4\n", ":4: ", "vertex 4 in a face; expected 1 to 3"},
        {"b.obj", TRI "f 1 2 0\n", ":4: ", "vertex 0 in a face"},
        {"b.obj", TRI "f -1 -2 -4\n", ":4: ", "vertex -4 in a face; expected -1 to -3"},
        {"b.obj", "f -1 -2 -3\n" TRI, ":1: ", "vertex -1 in a face"}, /* negative ones count back from here */
        {"b.obj", TRI "f 1 2 99999999999999999999\n", ":4: ", "expected v, v/vt"},
        {"b.obj", TRI "f 1 2 4294967297\n", ":4: ", "vertex 4294967297"}, /* 2^32 + 1 is not 1 */
        {"b.obj", TRI "f 1 2\n", ":4: ", "a face with 2 corners; expected at least 3"},
        {"b.obj", TRI "f\n", ":4: ", "a face with 0 corners"},
        {"b.obj", TRI "f 1 2 a\n", ":4: ", "corner is `a`"},
        {"b.obj", TRI "f 1/2/3/4 2 3\n", ":4: ", "corner is `1/2/3/4`"},
        {"b.obj", TRI "f 1.0 2 3\n", ":4: ", "corner is `1.0`"},
        {"b.obj", TRI "f /1 2 3\n", ":4: ", "corner is `/1`"},
        {"b.obj", TRI "face 1 2 3\n", ":4: ", "unknown statement `face`"},
        {"b.obj", "\x7f" "ELF\x02\x01", ":1: ", "unknown statement `?ELF??`"},
        {"b.obj", TRI "usemtl itu_unobtainium\n\nf 1 2 3\n", ":4: ",
         "material `unobtainium` is not in the ITU-R P.2040 table; expected one of "},
        {"b.obj", TRI "usemtl itu_unobtainium\n\nf 1 2 3\n", ":4: ", "concrete"}};
    RUN(cases);
}

#define PLY "ply\nformat ascii 1.0\n"                                                          /* lines 1, 2 */
#define VERTICES "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n"    /* 3 to 6 */
#define FACES "element face 1\nproperty list uchar int vertex_indices\n"                       /* 7, 8 */
#define POINTS "end_header\n0 0 0\n1 0 0\n0 1 0\n"                                             /* 9 to 12 */

static void ply(void **state)
{
    (void)state;
    static const Broken cases[] = {
        {"b.ply", "", ":1: ", "does not begin with a line `ply`"},
        {"b.ply", "plyx\n", ":1: ", "does not begin with a line `ply`"},
        {"b.ply", "ply\n", ":2: ", "ends within the header"},
        {"b.ply", "ply\nformat ascii 2.0\nend_header\n", ":2: ", "version `2.0`; expected 1.0"},
        {"b.ply", "ply\nformat binary 1.0\nend_header\n", ":2: ", "format `binary`; expected ascii"},
        {"b.ply", "ply\n" VERTICES "end_header\n", ":6: ", "the header has no format"},
        {"b.ply", PLY "element vertex\n", ":3: ", "is no number of elements"},
        {"b.ply", PLY "element vertex -3\n", ":3: ", "`-3` is no number of elements"},
        {"b.ply", PLY "property float x\n", ":3: ", "a property before any element"},
        {"b.ply", PLY "element vertex 3\nproperty real x\n", ":4: ", "`real` is no type"},
        {"b.ply", PLY "element vertex 3\nproperty float\n", ":4: ", "a property without a name"},
        {"b.ply", PLY "element vertex 3\nproperty float x\nproperty float x\n", ":5: ", "a second property `x`"},
        {"b.ply", PLY "element vertex 3\nproperty list int float x\n", ":4: ", "property `x` is a list"},
        {"b.ply", PLY VERTICES "element vertex 3\n", ":7: ", "a second element `vertex`"},
        {"b.ply", PLY "element vertex 3\nproperty float x\nproperty float y\nend_header\n0 0\n0 0\n0 0\n", ":3: ", "lacks x, y or z"},
        {"b.ply", PLY "element face 0\nend_header\n", ":4: ", "no vertex element"},
        {"b.ply", PLY "element vertex 0\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nend_header\n", ":7: ",
         "no list vertex_indices"},
        {"b.ply", PLY "elephant 3\n", ":3: ", "`elephant` in the header"},
        {"b.ply", PLY "element vertex 1000000000000\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n", ":3: ",
         "1000000000000 entries; expected at most 1, as many as the file could hold"},
        {"b.ply", PLY "element vertex 9223372036854775807\nproperty float x\nproperty float y\nproperty float z\nend_header\n", ":3: ",
         "expected at most 0"},
        {"b.ply", PLY VERTICES FACES "end_header\n0 0 0\n1 0 nan\n0 1 0\n3 0 1 2\n", ":11: ", "found `nan`; expected a finite number"},
        {"b.ply", PLY VERTICES FACES "end_header\n0 0 0\n1 0\n0 1 0 \n3 0 1 2\n", ":11: ", "ends within entry 2 of element `vertex`"},
        {"b.ply", PLY VERTICES FACES "end_header\n0 0 0\n1 0 0 0\n0 1 0\n3 0 1 2\n", ":11: ", "`0` follows the last value"},
        {"b.ply", PLY VERTICES FACES POINTS "3 0 1 3\n", ":13: ", "vertex 3 in a face; expected a whole number from 0 and below 3"},
        {"b.ply", PLY VERTICES FACES POINTS "3 0 1 -1\n", ":13: ", "vertex -1 in a face"},
        {"b.ply", PLY VERTICES FACES POINTS "3 0 1 1.5\n", ":13: ", "vertex 1.5 in a face"},
        {"b.ply", PLY VERTICES FACES POINTS "2 0 1\n", ":13: ", "a face with 2 corners; expected at least 3"},
        {"b.ply", PLY VERTICES FACES POINTS "-3 0 1 2\n", ":13: ", "a list of -3 values"},
        {"b.ply", PLY VERTICES FACES POINTS "4 0 1 2\n", ":13: ", "a face with 4 corners; expected at most 3"},
        {"b.ply", PLY VERTICES FACES POINTS "3 0 1\n\n", ":13: ", "the line ends within entry 1 of element `face`"},
        {"b.ply", PLY VERTICES "element face 2\nproperty list uchar int vertex_indices\n" POINTS "3 0 1 2\n  ", ":14: ",
         "ends before entry 2 of element `face`"}};
    RUN(cases);
}

/* A header of a binary PLY, little-endian, with three vertices of three floats. */
static size_t binary_ply(unsigned char *bytes, const char *faces)
{
    size_t size = (size_t)sprintf((char *)bytes, "ply\nformat binary_little_endian 1.0\n" VERTICES "%send_header\n", faces);
    memset(bytes + size, 0, 36);
    return size + 36;
}

static void ply_binary(void **state)
{
    (void)state;
    unsigned char b[1000];
    char place[64];
    size_t n = binary_ply(b, "");
    /* One byte short: the header's count is already too many. */
    expect_failure_bytes("b.ply", b, n - 1, KELLER_BAD_INPUT, ":3: ", "element `vertex` has 3 entries; expected at most 2");
    /* A coordinate that is infinite: the y of vertex 1 is at 12 + 4 in the body. */
    memcpy(b + n - 36 + 16, "\0\0\x80\x7f", 4);
    snprintf(place, sizeof place, ": byte %zu: ", n - 36 + 16);
    expect_failure_bytes("b.ply", b, n, KELLER_BAD_INPUT, place, "y of vertex 1 is inf; expected a finite number");
    n = binary_ply(b, FACES);
    memcpy(b + n, "\3\0\0\0\0\1\0\0\0\2\0\0\0", 13);
    for (size_t cut = 1; cut < 13; cut++) { /* the face stops anywhere */
        snprintf(place, sizeof place, ": byte %zu: ", n);
        expect_failure_bytes("b.ply", b, n + cut, KELLER_BAD_INPUT, place, "a face with 3 corners; expected at most");
    }
    b[n + 9] = 3;
    snprintf(place, sizeof place, ": byte %zu: ", n + 9);
    expect_failure_bytes("b.ply", b, n + 13, KELLER_BAD_INPUT, place, "vertex 3 in a face");
    memset(b + n + 9, 0xff, 4);
    expect_failure_bytes("b.ply", b, n + 13, KELLER_BAD_INPUT, place, "vertex -1 in a face");
    b[n] = 0;
    snprintf(place, sizeof place, ": byte %zu: ", n);
    expect_failure_bytes("b.ply", b, n + 13, KELLER_BAD_INPUT, place, "a face with 0 corners");
    /* A list longer than the file: 4,294,967,295 corners need 16 GiB, which must not be asked for. */
    n = binary_ply(b, "element face 1\nproperty list uint uint vertex_indices\n");
    memset(b + n, 0xff, 8);
    snprintf(place, sizeof place, ": byte %zu: ", n);
    expect_failure_bytes("b.ply", b, n + 8, KELLER_BAD_INPUT, place, "4294967295 corners; expected at most 1, as many as the file");
    /* The same in a list that is skipped. */
    n = binary_ply(b, "element other 1\nproperty list uint double a\n");
    memset(b + n, 0xff, 8);
    snprintf(place, sizeof place, ": byte %zu: ", n + 4);
    expect_failure_bytes("b.ply", b, n + 8, KELLER_BAD_INPUT, place, "the file ends within entry 1 of element `other`");
    /* A list's length may be a float; half a value may not. */
    n = binary_ply(b, "element other 1\nproperty list float uchar a\n");
    memcpy(b + n, "\0\0\x20\x40", 4); /* 2.5 */
    snprintf(place, sizeof place, ": byte %zu: ", n);
    expect_failure_bytes("b.ply", b, n + 4, KELLER_BAD_INPUT, place, "a list of 2.5 values");
}

static void stl(void **state)
{
    (void)state;
    static const Broken cases[] = {
        {"b.stl", "", ": byte 0: ", "ends within the header; expected STL"},
        {"b.stl", "hello\n", ": byte 6: ", "ends within the header"},
        {"b.stl", "solid x\n", ":2: ", "the file ends; expected `facet` or `endsolid`"},
        {"b.stl", "solid x\nfacet\nnormal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0\n", ":6: ", "the line ends before z"},
        {"b.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 inf\n", ":4: ", "z is `inf`"},
        {"b.stl", "solid x\nfacet normal 0 0\nouter loop\n", ":3: ", "found `outer`; expected `a normal`"},
        {"b.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nendloop\n", ":6: ", "found `endloop`; expected `vertex`"},
        {"b.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nvertex 0 1 0\n", ":7: ",
         "found `vertex`; expected `endloop`"},
        {"b.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 1 1 0\nendloop\nendfacet\n", ":9: ",
         "the file ends; expected `facet` or `endsolid`"},
        {"b.stl", "solid x\nendsolid\ntriangle\n", ":3: ", "found `triangle`; expected `solid`"}};
    RUN(cases);
    unsigned char b[300] = "solid binary";
    b[80] = 3;
    expect_failure_bytes("b.stl", b, 84 + 2 * 50, KELLER_BAD_INPUT, ": byte 184: ", "expected 234 bytes for the 3 triangles");
    memset(b + 80, 0xff, 4);
    expect_failure_bytes("b.stl", b, 84, KELLER_BAD_INPUT, ": byte 84: ", "4294967295 triangles");
    memset(b + 80, 0, 4);
    expect_failure_bytes("b.stl", b, 84 + 50, KELLER_BAD_INPUT, ": byte 84: ", "50 more bytes follow");
    b[80] = 1;
    memcpy(b + 84 + 24 + 4, "\0\0\xc0\x7f", 4); /* the y of the second corner: nan */
    expect_failure_bytes("b.stl", b, 84 + 50, KELLER_BAD_INPUT, ": byte 108: ", "expected finite coordinates");
}

#define OFF "OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n"

static void off(void **state)
{
    (void)state;
    static const Broken cases[] = {
        {"b.off", "", ":1: ", "the file begins with ``; expected OFF"},
        {"b.off", "3 1 0\n", ":1: ", "begins with `3`; expected OFF"},
        {"b.off", "4OFF\n1 0 0\n", ":1: ", "begins with `4OFF`"},
        {"b.off", "OFF BINARY\n", ":1: ", "a binary OFF file"},
        {"b.off", "OFF\n", ":2: ", "expected the numbers of vertices, faces and edges"},
        {"b.off", "OFF\n3\n", ":2: ", "one number"},
        {"b.off", "OFF\n3 -1 0\n", ":2: ", "found `-1`"},
        {"b.off", "OFF\n3 1 0 4\n", ":2: ", "found `4`"},
        {"b.off", "OFF\n1000000000 1 0\n0 0 0\n", ":2: ", "1000000000 vertices; expected at most"},
        {"b.off", "OFF\n1 1000000000 0\n0 0 0\n", ":2: ", "1000000000 faces; expected at most"},
        {"b.off", "OFF\n3 1 0\n0 0 0\n1 0 nan\n0 1 0\n3 0 1 2\n", ":4: ", "z is `nan`"},
        {"b.off", "OFF\n3 1 0\n0 0 0\n1 0\n0 1 0\n3 0 1 2\n", ":4: ", "the line ends before z"},
        {"b.off", "OFF\n3 1 0\n0 0 0\n1 0 0 a\n0 1 0\n3 0 1 2\n", ":4: ", "found `a` behind a vertex"},
        {"b.off", "OFF\n3 1 0\n0 0 0 1 2 3 4 5\n1 0 0 a\n0 1 0\n3 0 1 2\n", ":3: ", "more than 4 numbers behind a vertex"},
        {"b.off", "NOFF\n3 1 0\n0 0 0 1\n1 0 0 1\n0 1 0 1\n3 0 1 2\n", ":3: ", "1 numbers behind a vertex; expected at least 3"},
        {"b.off", OFF "3 0 1 3\n", ":6: ", "vertex `3` in a face; expected 0 to 2"},
        {"b.off", OFF "3 0 1 -1\n", ":6: ", "vertex `-1` in a face"},
        {"b.off", OFF "2 0 1    \n", ":6: ", "a face with 2 corners"},
        {"b.off", OFF "999999999 0 1 2\n", ":6: ", "expected at most 3, as many as the file could hold"},
        {"b.off", OFF "3 0 1   \n", ":6: ", "the line ends after 2 corners"},
        {"b.off", OFF "x 0 1 2\n", ":6: ", "found `x`"},
        {"b.off", OFF "3 0 1 2 red\n", ":6: ", "found `red` behind a face"},
        {"b.off", OFF "# that is all\n", ":7: ", "the file ends before face 1"}};
    RUN(cases);
}

static void files(void **state)
{
    (void)state;
    KellerSoup soup;
    KellerError error = {0};
    assert_int_equal(keller_soup_read(path_of("none.obj"), 1, &soup, &error), KELLER_IO);
    assert_non_null(strstr(error.message, "none.obj`: No such file"));
    assert_int_equal(mkdir(path_of("folder.ply"), 0700), 0);
    assert_int_equal(keller_soup_read(path_of("folder.ply"), 1, &soup, &error), KELLER_IO);
    assert_non_null(strstr(error.message, "it is a folder; expected a regular file"));
    assert_int_equal(rmdir(path_of("folder.ply")), 0);
    assert_int_equal(mkfifo(path_of("pipe.stl"), 0600), 0); /* must not wait for a writer */
    assert_int_equal(keller_soup_read(path_of("pipe.stl"), 1, &soup, &error), KELLER_IO);
    delete_file("pipe.stl");
    write_text("big.ply", "");
    if (truncate(path_of("big.ply"), (off_t)1 << 40) == 0) { /* a hole of 1 TiB must not be read */
        assert_int_equal(keller_soup_read(path_of("big.ply"), 1, &soup, &error), KELLER_BAD_INPUT);
        assert_non_null(strstr(error.message, "1099511627776 bytes; expected at most 8589934592"));
    }
    delete_file("big.ply");
    expect_failure("scene.blend", "BLENDER", ": ", "unknown scene format `.blend`; expected a name that ends in .obj, .ply");
    expect_failure("scene", "BLENDER", ": ", "unknown scene format");
}

/* A polygon that would take hours to cut. */
static void too_many_corners(void **state)
{
    (void)state;
    char *text = malloc(400000), *p = text;
    p += sprintf(p, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf");
    for (int i = 0; i < 16385; i++) p += sprintf(p, " %d", i % 3 + 1);
    expect_failure("n.obj", text, ":4: ", "a polygon with 16385 corners; expected at most 16384");
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(obj), cmocka_unit_test(ply),   cmocka_unit_test(ply_binary),
                                       cmocka_unit_test(stl), cmocka_unit_test(off),   cmocka_unit_test(files),
                                       cmocka_unit_test(too_many_corners)};
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
