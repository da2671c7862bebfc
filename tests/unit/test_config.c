/* What a good configuration becomes: every element, defaults, variables, routes and grids. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>

#include <cmocka.h>

#include "config_files.h"
#include "io/sha256.h"
#include "keller/config.h"

#define PI 3.14159265358979323846

static const char walk[] = "# a walk\r\nz, x ,y\r\n1.5,10,-2\r\n\r\n  # half way\r\n1.5 , 11 , -2.25\r\n1.5,1.2e1,-2.5";

static int setup(void **state)
{
    TestFiles *files = calloc(1, sizeof *files);
    *state = files;
    if (!files || test_files_make(files) != 0) return -1;
    test_files_write(files, "walk.csv", walk, sizeof walk - 1);
    return 0;
}

static int teardown(void **state)
{
    static const char *const names[] = {"walk.csv", "geo.csv", "c.xml", "sector.msi", NULL};
    test_files_remove(*state, names);
    free(*state);
    return 0;
}

static void read_text(TestFiles *files, const char *text, size_t count, const KellerVariable *variables,
                      KellerConfig *config)
{
    test_files_write(files, "c.xml", text, strlen(text));
    KellerError error = {0};
    if (keller_config_read(test_files_path(files, "c.xml"), count, variables, config, &error) != KELLER_OK)
        fail_msg("refused: %s", error.message);
}

static void test_everything(void **state)
{
    TestFiles *files = *state;
    KellerConfig c;
    read_text(files, base_config, 0, NULL, &c);
    assert_string_equal(c.file, test_files_path(files, "c.xml"));
    assert_string_equal(c.scene_file, test_files_path(files, "street.obj"));
    assert_int_equal(c.scene_line, 3);
    assert_true(c.scene_scale == 2);
    assert_true(c.has_origin && c.origin.latitude == 48.137154 && c.origin.longitude == 11.576124 &&
                c.origin.height == 519);
    assert_int_equal(c.frequency_count, 1);
    assert_true(c.frequencies[0] == 3.5e9);

    assert_int_equal(c.material_count, 3);
    assert_string_equal(c.materials[0].name, "wall");
    assert_int_equal(c.materials[0].kind, KELLER_MATERIAL_ITU);
    assert_string_equal(c.materials[0].itu, "concrete");
    assert_true(c.materials[0].thickness == 0.3);
    assert_int_equal(c.materials[1].kind, KELLER_MATERIAL_CONSTANT);
    assert_true(c.materials[1].permittivity == 6.31 && c.materials[1].conductivity == 0.0036 &&
                c.materials[1].thickness == 0.006);
    assert_int_equal(c.materials[2].kind, KELLER_MATERIAL_CONDUCTOR);
    assert_true(c.materials[2].thickness == 0);
    assert_int_equal(c.material_lines[2], 8);
    assert_string_equal(c.default_material, "wall");
    assert_int_equal(c.default_material_line, 9);
    assert_int_equal(c.assignment_count, 1);
    assert_string_equal(c.assignments[0].object, "building_1");
    assert_string_equal(c.assignments[0].material, "glass");
    assert_int_equal(c.assignment_lines[0], 10);

    assert_int_equal(c.transmitter_count, 1);
    const KellerTransmitter *tx = &c.transmitters[0];
    assert_string_equal(tx->id, "tx1");
    assert_true(tx->station.position.x == 1 && tx->station.position.y == -2 && tx->station.position.z == 10);
    assert_int_equal(tx->station.antenna.pattern, KELLER_ANTENNA_TR38901);
    assert_int_equal(tx->station.antenna.polarization, KELLER_POLARIZATION_H);
    assert_true(tx->station.orientation[0] == PI / 2 && tx->station.orientation[1] == 0.1);
    assert_true(tx->station.velocity.x == 10);
    assert_true(tx->power == 1); /* 30 dBm */

    assert_int_equal(c.reflections, 3);
    assert_int_equal(c.diffractions, 1);
    assert_int_equal(c.transmissions, 0);
    assert_int_equal(c.interactions, 4);
    assert_true(c.dynamic_range == 120);
    assert_int_equal(c.wedge_model, KELLER_WEDGE_HOLM);
    assert_string_equal(c.accelerator, "bvh");
    assert_true(c.cone == 2 * PI / 180);
    assert_int_equal(c.threads, 2);
    assert_true(c.output_paths && !c.output_coverage && c.output_scene);
    keller_config_free(&c);
    assert_null(c.text);
}

static void test_receivers(void **state)
{
    KellerConfig c;
    read_text(*state, base_config, 0, NULL, &c);
    assert_int_equal(c.set_count, 3);
    assert_int_equal(c.sets[0].kind, KELLER_SET_POINT);
    assert_int_equal(c.sets[1].kind, KELLER_SET_ROUTE);
    assert_int_equal(c.sets[2].kind, KELLER_SET_GRID);
    /* x -5..5 and y -1..1 by 1 m, both ends included: 11 by 3 */
    assert_int_equal(c.sets[2].nx, 11);
    assert_int_equal(c.sets[2].ny, 3);
    assert_true(c.sets[2].x0 == -5 && c.sets[2].y0 == -1 && c.sets[2].z == 1.5 && c.sets[2].step == 1);
    assert_int_equal(c.receiver_count, 1 + 3 + 33);
    uint32_t at = 0;
    for (uint32_t s = 0; s < 3; s++) {
        assert_int_equal(c.sets[s].first, at);
        for (uint32_t i = 0; i < c.sets[s].count; i++, at++) {
            assert_int_equal(c.receivers[at].set, s);
            assert_int_equal(c.receivers[at].index, i);
            assert_int_equal(c.receivers[at].station.antenna.pattern, KELLER_ANTENNA_ISOTROPIC);
            assert_int_equal(c.receivers[at].station.antenna.polarization, KELLER_POLARIZATION_V);
        }
    }
    /* the route's columns come in the order z, x, y */
    KellerVec3 p = c.receivers[1].station.position;
    assert_true(p.x == 10 && p.y == -2 && p.z == 1.5);
    p = c.receivers[3].station.position;
    assert_true(p.x == 12 && p.y == -2.5 && p.z == 1.5);
    /* x runs fastest: the 13th grid point is the second of the second row */
    p = c.receivers[4 + 12].station.position;
    assert_true(p.x == -4 && p.y == 0 && p.z == 1.5);
    keller_config_free(&c);
}

static void test_defaults(void **state)
{
    KellerConfig c;
    read_text(*state,
              "<simulation version='1' domain='rf'><scene file='/data/a.obj'/><frequency>28 GHz</frequency>"
              "<frequency>700 MHz</frequency><transmitter id='t'><position x='0 m' y='0 m' z='0 m'/></transmitter>"
              "<receiver id='t'><position x='0 m' y='0 m' z='0 m'/></receiver></simulation>",
              0, NULL, &c);
    assert_string_equal(c.scene_file, "/data/a.obj");
    assert_true(c.scene_scale == 1 && !c.has_origin && !c.default_material);
    assert_int_equal(c.frequency_count, 2); /* in the order given */
    assert_true(c.frequencies[0] == 28e9 && c.frequencies[1] == 700e6);
    assert_true(c.transmitters[0].power == 1e-3); /* 0 dBm */
    assert_int_equal(c.transmitters[0].station.antenna.pattern, KELLER_ANTENNA_ISOTROPIC);
    assert_int_equal(c.transmitters[0].station.antenna.polarization, KELLER_POLARIZATION_V);
    assert_true(c.transmitters[0].station.orientation[0] == 0 && c.transmitters[0].station.velocity.x == 0);
    assert_int_equal(c.reflections + c.diffractions + c.transmissions + c.interactions, 0);
    assert_true(c.dynamic_range == 150 && c.scattering == 0 && c.with_scattering == 0);
    assert_int_equal(c.wedge_model, KELLER_WEDGE_RECIPROCAL);
    assert_string_equal(c.accelerator, "auto");
    assert_true(c.cone == PI / 180);
    assert_int_equal(c.threads, 0);
    assert_true(c.output_paths && c.output_coverage && c.output_scene);
    keller_config_free(&c);

    char *text = replaced(base_config, " transmissions=\"0\" interactions=\"4\"", " transmissions=\"2\"");
    read_text(*state, text, 0, NULL, &c);
    assert_int_equal(c.interactions, 3 + 1 + 2);
    keller_config_free(&c);
    free(text);
}

static void test_scattering(void **state)
{
    KellerConfig c;
    char *one = replaced(base_config, "conductor=\"perfect\"",
                         "conductor=\"perfect\" scattering=\"0.4\" lobe=\"4\" back-lobe=\"3\" lobe-share=\"0.7\" cross-polarization=\"0.1\"");
    char *two = replaced(one, "thickness=\"6 mm\"", "thickness=\"6 mm\" scattering=\"0.2\" lobe=\"9\"");
    char *three = replaced(two, "transmissions=\"0\" interactions=\"4\"", "transmissions=\"2\" scattering=\"1\" patch=\"50 cm\" with-scattering=\"2\"");
    read_text(*state, three, 0, NULL, &c);
    KellerScattering s = c.materials[2].diffuse;
    assert_true(s.coefficient == 0.4 && s.lobe == 4 && s.back_lobe == 3 && s.share == 0.7 && s.cross == 0.1);
    s = c.materials[1].diffuse;
    assert_true(s.coefficient == 0.2 && s.lobe == 9 && s.share == 1 && s.cross == 0);
    assert_true(c.materials[0].diffuse.coefficient == 0);
    assert_true(c.scattering == 1 && c.patch == 0.5 && c.with_scattering == 2);
    assert_int_equal(c.interactions, 3 + 1 + 2 + 1);
    keller_config_free(&c);
    free(one);
    free(two);
    free(three);
}

static void test_layers_and_roughness(void **state)
{
    KellerConfig c;
    char *one = replaced(base_config, "<material name=\"glass\" permittivity=\"6.31\" conductivity=\"0.0036 S/m\" thickness=\"6 mm\"/>",
                         "<material name='glass' roughness='0.1 mm'><layer itu='glass' thickness='4 mm'/><layer itu='vacuum' "
                         "thickness='12 mm'/><layer permittivity='6.31' conductivity='0.0036 S/m' thickness='6 mm'/></material>");
    char *two = replaced(one, "conductor=\"perfect\"", "conductor=\"perfect\" roughness=\"2 cm\"");
    read_text(*state, two, 0, NULL, &c);
    const KellerMaterial *m = &c.materials[1];
    assert_int_equal(m->kind, KELLER_MATERIAL_LAYERS);
    assert_int_equal(m->layer_count, 3);
    assert_true(fabs(m->thickness - 0.022) < 1e-15 && m->roughness == 1e-4);
    assert_true(m->layers[0].kind == KELLER_MATERIAL_ITU && m->layers[0].thickness == 0.004);
    assert_string_equal(m->layers[1].itu, "vacuum");
    assert_true(m->layers[2].kind == KELLER_MATERIAL_CONSTANT && m->layers[2].permittivity == 6.31);
    assert_true(m->layers[2].conductivity == 0.0036);
    assert_true(c.materials[2].roughness == 0.02 && c.materials[0].roughness == 0);
    keller_config_free(&c);
    free(one);
    free(two);
}

/* Off unless asked for; relative humidity to a pressure. */
static void test_medium(void **state)
{
    KellerConfig c;
    char *one = replaced(base_config, "<material", "<medium temperature='15 degC' humidity='40 %' pressure='100 kPa' "
                                                   "absorption='p676' rain='36 mm/h'/><material");
    read_text(*state, one, 0, NULL, &c);
    assert_true(c.air.gases && c.air.temperature == 288.15 && c.air.pressure == 1e5 && fabs(c.air.rain - 1e-5) < 1e-20);
    assert_true(fabs(c.air.vapour - keller_vapour_pressure(288.15, 1e5, 0.4)) < 1e-9);
    keller_config_free(&c);
    free(one);
    one = replaced(base_config, "<material", "<medium rain='2 mm/h'/><material");
    read_text(*state, one, 0, NULL, &c);
    assert_true(!c.air.gases && c.air.rain > 0);
    keller_config_free(&c);
    free(one);
    read_text(*state, base_config, 0, NULL, &c);
    assert_true(!c.air.gases && c.air.rain == 0);
    keller_config_free(&c);
}

/* An antenna file is read once, relative to the configuration, however many stations name it. */
static void test_antenna_file(void **state)
{
    TestFiles *files = *state;
    char msi[16384], *at = msi;
    at += sprintf(at, "NAME x\nGAIN 10 dBi\n");
    for (int cut = 0; cut < 2; cut++) {
        at += sprintf(at, "%s 360\n", cut ? "VERTICAL" : "HORIZONTAL");
        for (int i = 0; i < 360; i++) at += sprintf(at, "%d %d\n", i, cut);
    }
    test_files_write(files, "sector.msi", msi, strlen(msi));
    char *one = replaced(base_config, "pattern=\"tr38901\" polarization=\"H\"", "file=\"sector.msi\"");
    char *two = replaced(one, "<step>1 m</step>", "<step>1 m</step><antenna file='sector.msi' polarization='H'/>");
    KellerConfig c;
    read_text(files, two, 0, NULL, &c);
    assert_int_equal(c.antenna_count, 1);
    const KellerAntenna *tx = &c.transmitters[0].station.antenna, *rx = &c.receivers[c.receiver_count - 1].station.antenna;
    assert_true(tx->pattern == KELLER_ANTENNA_CUTS && rx->pattern == KELLER_ANTENNA_CUTS && tx->cuts == rx->cuts);
    assert_true(tx->polarization == KELLER_POLARIZATION_V && rx->polarization == KELLER_POLARIZATION_H);
    assert_true(tx->cuts->gain == 10 && tx->cuts->horizontal[359] == 0 && tx->cuts->vertical[0] == 1);
    keller_config_free(&c);
    /* an error in the file names the file, one in its name the configuration */
    KellerError error;
    test_files_write(files, "sector.msi", "GAIN 10 dBi\nHORIZONTAL 12\n", 26);
    test_files_write(files, "c.xml", two, strlen(two));
    char path[300];
    snprintf(path, sizeof path, "%s", test_files_path(files, "c.xml"));
    assert_int_equal(keller_config_read(path, 0, NULL, &c, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "sector.msi:2: "));
    unlink(test_files_path(files, "sector.msi"));
    assert_int_equal(keller_config_read(path, 0, NULL, &c, &error), KELLER_IO);
    assert_non_null(strstr(error.message, "c.xml:13: "));
    free(one);
    free(two);
}

static void test_array(void **state)
{
    char *text = replaced(base_config, "<antenna pattern=\"tr38901\" polarization=\"H\"/>",
                          "<antenna pattern='dipole'><element y='-2 cm' phase='90 deg'/><element/><element x='1 m' z='3 mm'/></antenna>");
    KellerConfig c;
    read_text(*state, text, 0, NULL, &c);
    const KellerAntenna *a = &c.transmitters[0].station.antenna;
    assert_int_equal(c.array_count, 1);
    assert_int_equal(a->pattern, KELLER_ANTENNA_DIPOLE);
    assert_int_equal(a->element_count, 3);
    assert_true(a->elements[0].position.y == -0.02 && a->elements[0].phase == PI / 2);
    assert_true(v3_norm(a->elements[1].position) == 0 && a->elements[1].phase == 0);
    assert_true(a->elements[2].position.x == 1 && a->elements[2].position.z == 0.003);
    assert_int_equal(c.receivers[0].station.antenna.element_count, 0);
    keller_config_free(&c);
    free(text);
}

/* Orders that this version does not compute are the solver's to refuse. */
static void test_orders_beyond_the_solver(void **state)
{
    char *text =
        replaced(base_config, "diffractions=\"1\" transmissions=\"0\"", "diffractions=\"2\" transmissions=\"1\"");
    KellerConfig c;
    read_text(*state, text, 0, NULL, &c);
    assert_int_equal(c.diffractions, 2);
    assert_int_equal(c.transmissions, 1);
    keller_config_free(&c);
    free(text);
}

static void test_station_of_grid_and_route(void **state)
{
    char *one = replaced(base_config, "<step>1 m</step>",
                         "<step>1 m</step><antenna pattern='half-wave-dipole' polarization='H'/>"
                         "<orientation roll='180 deg'/><velocity z='1 m/s'/>");
    char *two = replaced(one, "file=\"walk.csv\"/>", "file=\"walk.csv\"><antenna pattern='dipole'/></receivers>");
    KellerConfig c;
    read_text(*state, two, 0, NULL, &c);
    assert_int_equal(c.receivers[1].station.antenna.pattern, KELLER_ANTENNA_DIPOLE);
    const KellerStation *last = &c.receivers[c.receiver_count - 1].station;
    assert_int_equal(last->antenna.pattern, KELLER_ANTENNA_HALF_WAVE_DIPOLE);
    assert_int_equal(last->antenna.polarization, KELLER_POLARIZATION_H);
    assert_true(last->orientation[2] == PI && last->velocity.z == 1);
    keller_config_free(&c);
    free(one);
    free(two);
}

/* 0.3 / 0.1 is 2.9999999999999996 in double precision: the last point must not be lost. */
static void test_grid_ends(void **state)
{
    char *one = replaced(base_config, "<to x=\"5 m\" y=\"1 m\"/>", "<to x=\"-4.7 m\" y=\"-1 m\"/>");
    char *two = replaced(one, "<step>1 m", "<step>0.1 m");
    KellerConfig c;
    read_text(*state, two, 0, NULL, &c);
    assert_int_equal(c.sets[2].nx, 4);
    assert_int_equal(c.sets[2].ny, 1);
    assert_true(fabs(c.receivers[c.receiver_count - 1].station.position.x + 4.7) < 1e-12);
    keller_config_free(&c);
    free(one);
    free(two);

    /* a step that does not divide the extent stops short of `to`: -5, -2, 1, 4 */
    one = replaced(base_config, "<step>1 m", "<step>3 m");
    read_text(*state, one, 0, NULL, &c);
    assert_int_equal(c.sets[2].nx, 4);
    assert_int_equal(c.sets[2].ny, 1);
    keller_config_free(&c);
    free(one);
}

/* Over the ground: what counts as ground is kept by name, and no cell has a z before the scene is known. */
static void test_draped_grid(void **state)
{
    char *one = replaced(base_config, "<grid id=\"street\" z=\"1.5 m\">",
                         "<grid id=\"street\" height=\"150 cm\"><over object=\"hill\"/><over material=\" road \"/>");
    KellerConfig c;
    read_text(*state, one, 0, NULL, &c);
    const KellerReceiverSet *set = &c.sets[2];
    assert_true(set->draped && set->height == 1.5 && isnan(set->z) && set->nx == 11);
    assert_int_equal(set->surface_count, 2);
    assert_true(set->surfaces[0].is_object && !set->surfaces[1].is_object);
    assert_string_equal(set->surfaces[0].name, "hill");
    assert_string_equal(set->surfaces[1].name, "road");
    assert_int_equal(set->surfaces[0].line, 20);
    KellerVec3 p = c.receivers[4 + 12].station.position;
    assert_true(p.x == -4 && p.y == 0 && isnan(p.z));
    keller_config_free(&c);
    free(one);
}

/* The origin itself is (0, 0, 0); a point h above it is (0, 0, h); one 1e-5 degrees north is about M 1e-5 pi/180 =
 * 1.112 m north, M the meridian radius of curvature at 48 degrees, 6.371e6 m within 0.2 %. */
static void test_geodetic(void **state)
{
    TestFiles *files = *state;
    static const char csv[] = "\xef\xbb\xbflat,lon,height\n48.137154,11.576124,521.5\n48.137164,11.576124,519\n";
    test_files_write(files, "geo.csv", csv, sizeof csv - 1);
    char *one = replaced(base_config, "walk.csv", "geo.csv");
    char *two = replaced(one, "<position x=\"40 m\" y=\"3 m\" z=\"1.5 m\"/>",
                         "<geodetic lat='48.137154' lon='11.576124' height='519 m'/>");
    KellerConfig c;
    read_text(files, two, 0, NULL, &c);
    assert_true(v3_norm(c.receivers[0].station.position) < 1e-8);
    assert_true(v3_distance(c.receivers[1].station.position, v3(0, 0, 2.5)) < 1e-8);
    assert_true(fabs(c.receivers[2].station.position.y - 1.112) < 0.003);
    assert_true(fabs(c.receivers[2].station.position.x) < 1e-6);
    keller_config_free(&c);
    free(one);
    free(two);
}

static void test_variables(void **state)
{
    static const KellerVariable variables[] = {{"HEIGHT", "12 m"}, {"F", "2.4"}, {"dir_1", "/a&b<\"$F"}};
    char *one = replaced(base_config, "z=\"10 m\"", "z=\"$HEIGHT\"");
    char *two = replaced(one, "3.5 GHz", "${F}<!-- $NOT_USED -->GHz");
    char *three = replaced(two, "street.obj", "${dir_1}x/$$5.obj");
    KellerConfig c;
    read_text(*state, three, 3, variables, &c);
    assert_true(c.transmitters[0].station.position.z == 12);
    assert_true(c.frequencies[0] == 2.4e9);
    /* values are text, not markup, and are not substituted again */
    assert_string_equal(c.scene_file, "/a&b<\"$Fx/$5.obj");
    assert_non_null(strstr(c.text, "z=\"12 m\""));
    assert_non_null(strstr(c.text, "/a&amp;b&lt;"));
    assert_null(strstr(c.text, "$HEIGHT"));
    assert_null(strstr(c.text, "${F}"));
    char hex[65];
    keller_sha256(c.text, strlen(c.text), hex);
    assert_string_equal(c.sha256, hex);
    keller_config_free(&c);
    free(one);
    free(two);
    free(three);
}

/* Elements may come in any order, and the XML may use what XML offers. */
static void test_xml_features(void **state)
{
    KellerConfig c;
    read_text(*state,
              "<?xml version='1.0' encoding='ISO-8859-1'?>\n<!-- c --><?editor hint?>\n"
              "<simulation domain='rf' version='1'>\n<output/>\n<receiver id='stra\xdf"
              "e'>"
              "<position z='&#49; m' y=' 0 m' x='0&#x20;m'/></receiver>\n"
              "<frequency><![CDATA[1 GHz]]></frequency><transmitter id='t'><power>1 W</power>"
              "<position x='0 m' y='0 m' z='0 m'/></transmitter><scene file='a&amp;b.obj'/></simulation>",
              0, NULL, &c);
    assert_string_equal(c.sets[0].id, "stra\xc3\x9f"
                                      "e");
    assert_true(c.receivers[0].station.position.z == 1);
    assert_true(c.frequencies[0] == 1e9);
    assert_non_null(strstr(c.scene_file, "/a&b.obj"));
    keller_config_free(&c);
}

/* Thousands of everything are read in a blink; quadratic checks would take minutes. */
static void test_many(void **state)
{
    const int count = 5000;
    size_t size = 1 << 22, used = 0;
    char *text = malloc(size);
    assert_non_null(text);
    used += (size_t)snprintf(
        text + used, size - used,
        "<simulation version='1' domain='rf'><scene file='a.obj'/>"
        "<frequency>1 GHz</frequency><transmitter id='t'><position x='0 m' y='0 m' z='0 m'/></transmitter>");
    for (int i = 0; i < count; i++)
        used += (size_t)snprintf(
            text + used, size - used,
            "<material name='m%d' itu='brick'/><assign object='o%d' material='m%d'/><receiver id='r%d'>"
            "<position x='%d m' y='0 m' z='0 m'/></receiver>\n",
            i, i, i, i, i);
    snprintf(text + used, size - used, "</simulation>");
    KellerConfig c;
    read_text(*state, text, 0, NULL, &c);
    assert_int_equal(c.receiver_count, count);
    assert_int_equal(c.material_count, count);
    keller_config_free(&c);
    free(text);
}

/* The configurations that come with the program. */
static void test_shipped(void **state)
{
    (void)state;
    const char *source = getenv("KELLER_SOURCE");
    if (!source) {
        print_message("# KELLER_SOURCE is not set\n");
        skip();
    }
    static const struct {
        const char *name;
        size_t variables, receivers;
    } shipped[] = {{"street_canyon", 0, 3 + 25 + 101 * 21}, {"munich", 1, 1}, {"simple_street_canyon", 1, 93 * 61},
                   {"office", 0, 1 + 48 * 24}};
    for (size_t i = 0; i < sizeof shipped / sizeof *shipped; i++) {
        char path[1024];
        snprintf(path, sizeof path, "%s/configs/%s.xml", source, shipped[i].name);
        KellerConfig c;
        KellerError error;
        KellerVariable scenes = {"SCENES", "/scenes"};
        if (keller_config_read(path, shipped[i].variables, &scenes, &c, &error) != KELLER_OK)
            fail_msg("refused: %s", error.message);
        assert_int_equal(c.receiver_count, shipped[i].receivers);
        keller_config_free(&c);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_everything),
        cmocka_unit_test(test_receivers),
        cmocka_unit_test(test_defaults),
        cmocka_unit_test(test_medium),
        cmocka_unit_test(test_antenna_file),
        cmocka_unit_test(test_layers_and_roughness),
        cmocka_unit_test(test_scattering),
        cmocka_unit_test(test_orders_beyond_the_solver),
        cmocka_unit_test(test_station_of_grid_and_route),
        cmocka_unit_test(test_grid_ends),
        cmocka_unit_test(test_draped_grid),
        cmocka_unit_test(test_geodetic),
        cmocka_unit_test(test_variables),
        cmocka_unit_test(test_xml_features),
        cmocka_unit_test(test_many),
        cmocka_unit_test(test_array),
        cmocka_unit_test(test_shipped),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, setup, teardown);
}
