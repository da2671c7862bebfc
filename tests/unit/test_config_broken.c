/* Broken and hostile configurations: each is refused with its status, the line, and words that help. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/inotify.h>
#include <sys/stat.h>

#include <cmocka.h>

#include "config_files.h"
#include "io/config_read.h"
#include "io/xml.h"
#include "keller/config.h"

static int setup(void **state)
{
    TestFiles *files = calloc(1, sizeof *files);
    *state = files;
    if (!files || test_files_make(files) != 0) return -1;
    test_files_write(files, "walk.csv", "x,y,z\n1,2,3\n", 12);
    return 0;
}

static int teardown(void **state)
{
    static const char *const names[] = {"walk.csv", "c.xml", "secret.txt", "evil.dtd", "pipe", NULL};
    test_files_remove(*state, names);
    free(*state);
    return 0;
}

/* Reads c.xml, which must be refused. `line` > 0: the message starts with FILE:line. */
static void expect_refused(TestFiles *files, const char *label, size_t count, const KellerVariable *variables,
                           KellerStatus status, int line, const char *words, const char *more_words)
{
    char start[300];
    const char *path = test_files_path(files, "c.xml");
    if (line)
        snprintf(start, sizeof start, "%s:%d: ", path, line);
    else
        snprintf(start, sizeof start, "%s: ", path);
    KellerConfig config;
    KellerError error = {KELLER_OK, "(none)"};
    KellerStatus got = keller_config_read(path, count, variables, &config, &error);
    if (got != status || error.status != status || strncmp(error.message, start, strlen(start)) != 0 ||
        !strstr(error.message, words) || (more_words && !strstr(error.message, more_words)))
        fail_msg("%s: expected status %d at line %d with \"%s\" and \"%s\"; got %d: %s", label, status, line, words,
                 more_words ? more_words : "", got, error.message);
    if (strchr(error.message, '\n')) fail_msg("%s: the message has more than one line", label);
    assert_null(config.text); /* nothing is left to free */
    assert_null(config.receivers);
}

/* The base configuration with one thing replaced. `schema` says that data/keller.rng refuses it too, by itself. */
typedef struct {
    int line;
    const char *find, *replace, *words, *more_words;
    bool schema;
} Broken;

static const Broken broken[] = {
    /* structure */
    {2, "<simulation version=\"1\"", "<simulation", "no attribute \"version\"", NULL, true},
    {2, "version=\"1\"", "version=\"2\"", "version \"2\"", "expected \"1\"", true},
    {6, "domain=\"rf\"", "domain=\"acoustic\"", "unknown attribute \"itu\"", "it belongs to domain \"rf\"", true},
    {2, "domain=\"rf\"", "domain=\"optics\"", "domain \"optics\"", "\"rf\"", true},
    {2, "domain=\"rf\"", "domain=\"rf\" xmlns=\"http://example.org/\"", "without a namespace", NULL, true},
    {3, "<scene", "<scenery file='a.obj'/><scene", "unknown element <scenery> in <simulation>",
     "did you mean \"scene\"?", true},
    {3, "<scene file=\"street.obj\" scale=\"2\"/>", "<x:scene xmlns:x='u' file='a'/>", "namespace", NULL, true},
    {3, "scale=", "scael=", "unknown attribute \"scael\"", "did you mean \"scale\"?", true},
    {3, "scale=\"2\"", "xml:base=\"/etc\"", "unknown attribute \"xml:base\"", NULL, true},
    {3, "file=\"street.obj\"", "", "<scene> has no attribute \"file\"", NULL, true},
    {3, "file=\"street.obj\"", "file=\"\"", "file of <scene> is empty", NULL, true},
    {3, "scale=\"2\"", "scale=\"0\"", "scale of <scene> is \"0\"", NULL, false},
    {3, "scale=\"2\"", "scale=\"nan\"", "scale of <scene> is \"nan\"", "a finite number", true},
    {2, "<scene file=\"street.obj\" scale=\"2\"/>", "", "<simulation> has no <scene>", NULL, true},
    {4, "<origin", "<scene file='b.obj'/><origin", "a second <scene>", "at most one", true},
    {5, "<frequency", "<origin lat='0' lon='0' height='0 m'/><frequency", "a second <origin>", "at most one", true},
    {27, "<output", "<output/><output", "a second <output>", "at most one", true},
    {27, "<output", "<solver/><output", "a second <solver>", "at most one", true},
    {27, "<output", "<paths/><output", "a second <paths>", "at most one", true},
    {4, "<origin", "stray text<origin", "stray text", NULL, true},
    {4, "lat=\"48.137154\"", "lat=\"91\"", "lat of <origin> is \"91\"", "-90 to 90", false},
    {4, "lon=\"11.576124\"", "lon=\"-180.5\"", "lon of <origin> is \"-180.5\"", "-180 to 180", false},
    {4, "height=\"519 m\"", "height=\"519\"", "height of <origin> is \"519\"", "a length with its unit", true},
    /* frequencies */
    {2, "<frequency>3.5 GHz</frequency>", "", "<simulation> has no <frequency>", "at least one", true},
    {5, "3.5 GHz", "3.5", "<frequency> is \"3.5\"", "a frequency with its unit, such as \"3.5 GHz\"", true},
    {5, "3.5 GHz", "3.5 Ghz", "<frequency> is \"3.5 Ghz\"", "Hz, kHz, MHz, GHz, THz", true},
    {5, "3.5 GHz", "0 Hz", "<frequency> is \"0 Hz\"", "1 Hz to", false},
    {5, "3.5 GHz", "-3.5 GHz", "<frequency> is \"-3.5 GHz\"", "1 Hz to", false},
    {5, "3.5 GHz", "NaN GHz", "<frequency> is \"NaN GHz\"", NULL, true},
    {5, "3.5 GHz", "inf Hz", "<frequency> is \"inf Hz\"", NULL, true},
    {5, "3.5 GHz", "1e999 Hz", "<frequency> is \"1e999 Hz\"", NULL, false},
    {5, "3.5 GHz", "0x10 GHz", "<frequency> is \"0x10 GHz\"", NULL, true},
    {5, "3.5 GHz", "3,5 GHz", "<frequency> is \"3,5 GHz\"", NULL, true},
    {5, "3.5 GHz", "3.5 m", "<frequency> is \"3.5 m\"", NULL, true},
    {5, "3.5 GHz", "", "<frequency> is \"\"", NULL, true},
    {5, "3.5 GHz", "3.5 <b/>GHz", "unknown element <b> in <frequency>", "expected none", true},
    /* materials */
    {6, "itu=\"concrete\"", "itu=\"conrete\"", "itu of <material> is \"conrete\"", "did you mean \"concrete\"?", false},
    {6, "itu=\"concrete\"", "", "without any property", "exactly one of itu=", true},
    {6, "itu=\"concrete\"", "itu=\"concrete\" permittivity=\"5\"", "in more than one way", "exactly one of itu=", true},
    {6, "itu=\"concrete\"", "itu=\"concrete\" conductor=\"perfect\"", "in more than one way", NULL, true},
    {6, "itu=\"concrete\"", "itu=\"concrete\" absorption=\"0.1\"", "unknown attribute \"absorption\"", NULL, true},
    {6, "itu=\"concrete\"", "conductivity=\"1 S/m\"", "has a conductivity but no permittivity", NULL, true},
    {6, "thickness=\"30 cm\"", "thickness=\"0 m\"", "thickness of <material> is \"0 m\"", "more than 0 m", false},
    {6, "thickness=\"30 cm\"", "thickness=\"-1 cm\"", "thickness of <material> is \"-1 cm\"", "more than 0 m", false},
    {6, "thickness=\"30 cm\"", "thickness=\"30\"", "thickness of <material> is \"30\"", "a length with its unit", true},
    {6, "name=\"wall\"", "name=\" \"", "name of <material> is empty", NULL, true},
    {7, "permittivity=\"6.31\"", "permittivity=\"0.5\"", "permittivity of <material> is \"0.5\"", "from 1", false},
    {7, "permittivity=\"6.31\"", "permittivity=\"6.31-0.1j\"", "permittivity of <material>", "a finite number", true},
    {7, "0.0036 S/m", "0.0036", "conductivity of <material>", "\"0.01 S/m\"", true},
    {7, "0.0036 S/m", "-1 S/m", "conductivity of <material> is \"-1 S/m\"", "0 S/m", false},
    {9, "<default-material", "<medium humidity=\"50 %\"/><default-material", "<medium> has a humidity that nothing uses",
     "absorption=\"p676\"", false},
    {9, "<default-material", "<medium absorption=\"p676\" humidity=\"101 %\"/><default-material", "humidity of <medium>",
     "0 % to 100 %", false},
    {9, "<default-material", "<medium absorption=\"p676\" humidity=\"0.5\"/><default-material", "humidity of <medium> is \"0.5\"",
     "a percentage", true},
    {9, "<default-material", "<medium absorption=\"p676\" temperature=\"15 C\"/><default-material", "temperature of <medium>",
     "\"15 degC\"", true},
    {9, "<default-material", "<medium absorption=\"p676\" temperature=\"390 K\" humidity=\"90 %\"/><default-material",
     "the water vapour of <medium>", "lower humidity", false},
    {9, "<default-material", "<medium rain=\"25 mm\"/><default-material", "rain of <medium> is \"25 mm\"", "25 mm/h", true},
    {9, "<default-material", "<medium absorption=\"iso9613\"/><default-material", "absorption of <medium>", "p676", true},
    {5, "3.5 GHz</frequency>", "3.5 GHz</frequency><frequency>900 MHz</frequency><medium rain=\"1 mm/h\"/>",
     "from 1 GHz to 1000 GHz", "the frequency on line 5 is 9e+08 Hz", false},
    {8, "conductor=\"perfect\"/>", "conductor=\"perfect\"><layer itu=\"glass\" thickness=\"1 mm\"/></material>",
     "has layers and conductor=", "in each <layer>", true},
    {8, "conductor=\"perfect\"/>", "thickness=\"1 mm\"><layer itu=\"glass\" thickness=\"1 mm\"/></material>",
     "has layers and thickness=", "in each <layer>", true},
    {8, "conductor=\"perfect\"/>", "><layer itu=\"glass\"/></material>", "<layer> has no attribute \"thickness\"", NULL, true},
    {8, "conductor=\"perfect\"/>", "><layer thickness=\"1 mm\"/></material>", "without any property", NULL, true},
    {8, "conductor=\"perfect\"/>", "><layer itu=\"gless\" thickness=\"1 mm\"/></material>", "itu of <layer> is \"gless\"",
     "did you mean \"glass\"?", false},
    {8, "conductor=\"perfect\"/>", "><layer itu=\"glass\" thickness=\"0 mm\"/></material>", "thickness of <layer>",
     "more than 0 m", false},
    {8, "conductor=\"perfect\"", "conductor=\"perfect\" roughness=\"1\"", "roughness of <material> is \"1\"", NULL, true},
    {8, "conductor=\"perfect\"", "conductor=\"perfect\" roughness=\"-1 mm\"", "roughness of <material> is \"-1 mm\"",
     "0 m to 1 km", false},
    {8, "conductor=\"perfect\"", "conductor=\"perfect\" scattering=\"1.1\"", "scattering of <material> is \"1.1\"", "from 0 to 1", false},
    {8, "conductor=\"perfect\"", "conductor=\"perfect\" scattering=\"0.4\" lobe=\"1001\"", "lobe of <material> is \"1001\"", "from 0 to 1000",
     false},
    {8, "conductor=\"perfect\"", "conductor=\"perfect\" scattering=\"0.4\" lobe=\"4.5\"", "lobe of <material> is \"4.5\"", "a whole number",
     true},
    {8, "conductor=\"perfect\"", "conductor=\"perfect\" lobe=\"4\"", "has lobe=\"...\" but does not scatter", "scattering=", true},
    {8, "conductor=\"perfect\"", "conductor=\"perfect\" scattering=\"0.4\" lobe=\"4\" back-lobe=\"3\"", "half a lobe back", "lobe-share",
     false},
    {8, "conductor=\"perfect\"", "conductor=\"perfect\" scattering=\"0.4\" back-lobe=\"3\" lobe-share=\"0.5\"", "half a lobe back",
     "(both 1 or more)", false},
    {8, "conductor=\"perfect\"", "conductor=\"perfect\" scattering=\"0.4\" cross-polarization=\"-0.1\"", "cross-polarization of <material>",
     "from 0 to 1", false},
    {25, "wedge=\"holm\"", "scattering=\"2\"", "scattering of <paths> is \"2\"", "from 0 to 1", false},
    {25, "wedge=\"holm\"", "patch=\"1 m\"", "<paths> has a patch that nothing uses", "scattering=\"1\"", false},
    {25, "wedge=\"holm\"", "with-scattering=\"1\"", "<paths> has a with-scattering that nothing uses", "scattering=\"1\"", false},
    {25, "wedge=\"holm\"", "scattering=\"1\" with-scattering=\"16\"", "with-scattering of <paths> is \"16\"", "from 0 to 15", false},
    {25, "wedge=\"holm\"", "scattering=\"1\" patch=\"1\"", "patch of <paths> is \"1\"", "a length with its unit", true},
    {25, "wedge=\"holm\"", "scattering=\"1\" patch=\"0.1 mm\"", "patch of <paths> is \"0.1 mm\"", "1 mm to", false},
    {8, "conductor=\"perfect\"", "conductor=\"good\"", "conductor of <material> is \"good\"", "\"perfect\"", true},
    {8, "name=\"steel\"", "name=\"wall\"", "material \"wall\" appears already on line 6", NULL, false},
    {10, "<assign", "<default-material name='glass'/><assign", "a second <default-material>", NULL, true},
    {11, "<transmitter", "<assign object='building_1' material='wall'/><transmitter",
     "\"building_1\" appears already on line 10", NULL, false},
    /* stations */
    {11, "id=\"tx1\"", "id=\"a/b\"", "id of <transmitter> is \"a/b\"", "letters, digits", true},
    {11, "id=\"tx1\"", "id=\"..\"", "id of <transmitter> is \"..\"", NULL, true},
    {11, "id=\"tx1\"", "", "<transmitter> has no attribute \"id\"", NULL, true},
    {11, "<position x=\"1 m\" y=\"-2 m\" z=\"10 m\"/>", "", "neither <position> nor <geodetic>", NULL, true},
    {11, "<position x=\"1 m\"", "<geodetic lat='0' lon='0' height='0 m'/><position x=\"1 m\"",
     "both <position> and <geodetic>", NULL, true},
    {12, "x=\"1 m\"", "x=\"1\"", "x of <position> is \"1\"", "a length with its unit, such as \"2.5 m\"", true},
    {12, "x=\"1 m\"", "x=\"1 deg\"", "x of <position> is \"1 deg\"", "(m, km, cm, mm, um)", true},
    {12, "x=\"1 m\"", "x=\"NaN m\"", "x of <position> is \"NaN m\"", NULL, true},
    {12, "x=\"1 m\"", "x=\"-inf m\"", "x of <position> is \"-inf m\"", NULL, true},
    {12, "x=\"1 m\"", "x=\"1e300 m\"", "x of <position> is \"1e300 m\"", "within 1e6 km", false},
    {12, "x=\"1 m\"", "", "<position> has no attribute \"x\"", NULL, true},
    {13, "pattern=\"tr38901\"", "pattern=\"tr38900\"", "pattern of <antenna> is \"tr38900\"",
     "did you mean \"tr38901\"?", true},
    {13, "pattern=\"tr38901\"", "file=\"\"", "file of <antenna> is empty", "the name of a file", true},
    {13, "pattern=\"tr38901\"", "pattern=\"dipole\" file=\"a.msi\"", "an antenna from a file has no pattern", "alone", true},
    {13, "pattern=\"tr38901\"", "pattern=\"file=a.msi\"", "an antenna from a file has no pattern", "file=\"...\"", true},
    {13, "polarization=\"H\"", "polarization=\"v\"", "polarization of <antenna> is \"v\"", "\"V\" or \"H\"", true},
    {13, "polarization=\"H\"/>", "><element x=\"4\"/></antenna>", "x of <element> is \"4\"", NULL, true},
    {13, "polarization=\"H\"/>", "><element y=\"2 km\"/></antenna>", "y of <element> is \"2 km\"", "within 1000 m", false},
    {13, "polarization=\"H\"/>", "><element gain=\"3 dB\"/></antenna>", "<element> has an unknown attribute \"gain\"", NULL, true},
    {14, "yaw=\"90 deg\"", "yaw=\"90\"", "yaw of <orientation> is \"90\"", "\"45 deg\"", true},
    {15, "36 km/h", "36 kmh", "x of <velocity> is \"36 kmh\"", "\"1.5 m/s\"", true},
    {15, "36 km/h", "3e8 m/s", "x of <velocity> is \"3e8 m/s\"", "speed of light", false},
    {16, "30 dBm", "30 dB", "<power> is \"30 dB\"", "\"30 dBm\"", true},
    {16, "30 dBm", "-1 W", "<power> is \"-1 W\"", "from 0 W", false},
    {16, "30 dBm", "30 dBm</power><power>30 dBm", "a second <power>", NULL, true},
    {18, "<receiver id=\"rx1\">", "<receiver id=\"rx1\"><power>1 W</power>", "unknown element <power> in <receiver>",
     NULL, true},
    {18, "<receiver id=\"rx1\">",
     "<transmitter id=\"tx1\"><position x='0 m' y='0 m' z='0 m'/></transmitter><receiver id=\"rx1\">",
     "id \"tx1\" is taken already by line 11", "each transmitter", false},
    {20, "id=\"street\"", "id=\"rx1\"", "id \"rx1\" is taken already by line 18", NULL, false},
    {20, "z=\"1.5 m\">", ">", "<grid> has neither z=\"...\" nor height=\"...\"", "exactly one of them", true},
    {20, "z=\"1.5 m\">", "z=\"1.5 m\" height=\"1 m\">", "<grid> has both z=\"...\" and height=\"...\"", "exactly one", true},
    {20, "z=\"1.5 m\">", "height=\"0 m\">", "height", "1 mm", false},
    {20, "z=\"1.5 m\">", "height=\"2\">", "height", "a length with its unit", true},
    {20, "z=\"1.5 m\">", "height=\"1 m\"><over/>", "<over> has neither object=\"...\" nor material=\"...\"", "exactly one", true},
    {20, "z=\"1.5 m\">", "z=\"1.5 m\"><over object=\"a\"/>", "<over> in a grid at one z", "height", false},
    {20, "<step>1 m</step>", "", "<grid> has no <step>", NULL, true},
    {22, "x=\"5 m\" y=\"1 m\"", "x=\"-6 m\" y=\"1 m\"", "below <from> in x", NULL, false},
    {23, "<step>1 m</step>", "<step>0 m</step>", "<step> is \"0 m\"", "from 1 um", false},
    {23, "<step>1 m</step>", "<step>-1 m</step>", "<step> is \"-1 m\"", NULL, false},
    {23, "<step>1 m</step>", "<step>1</step>", "<step> is \"1\"", "a length with its unit", true},
    /* 10 m by 2 m at 4.47 um: 10^12 points */
    {20, "<step>1 m</step>", "<step>4.4721 um</step>", "the grid makes 1e+12 points", "at most 10000000", false},
    /* 10^15 by 10^15 */
    {20, "<from x=\"-5 m\" y=\"-1 m\"/>\n<to x=\"5 m\" y=\"1 m\"/>\n<step>1 m</step>",
     "<from x='-1e9 m' y='-1e9 m'/><to x='1e9 m' y='1e9 m'/><step>1 um</step>", "the grid makes 4e+30 points", NULL,
     false},
    /* what to compute */
    {25, "reflections=\"3\"", "reflections=\"-1\"", "reflections of <paths> is \"-1\"", "from 0 to 16", true},
    {25, "reflections=\"3\"", "reflections=\"3.0\"", "reflections of <paths> is \"3.0\"", "a whole number", true},
    {25, "reflections=\"3\"", "reflections=\"99999999999999999999\"", "reflections of <paths>", "from 0 to 16", false},
    {25, "reflections=\"3\" diffractions=\"1\" transmissions=\"0\" interactions=\"4\"",
     "reflections=\"16\" diffractions=\"1\"", "add up to 17", "interactions=", false},
    {25, "reflections=\"3\" diffractions=\"1\" transmissions=\"0\" interactions=\"4\"",
     "reflections=\"12\" diffractions=\"1\" transmissions=\"52\"", "add up to 65 interactions", "at most 64", false},
    {25, "interactions=\"4\"", "interactions=\"65\"", "interactions of <paths> is \"65\"", "from 0 to 64", false},
    {25, "transmissions=\"0\"", "transmissions=\"65\"", "transmissions of <paths> is \"65\"", "from 0 to 64", false},
    {25, "transmissions=\"0\"", "transmissions=\"some\"", "transmissions of <paths> is \"some\"", "a whole number", true},
    {25, "wedge=\"holm\"", "wedge=\"kouyoumjian\"", "wedge of <paths> is \"kouyoumjian\"", "\"luebbers\"", true},
    {25, "120 dB", "120", "dynamic-range of <paths> is \"120\"", "\"150 dB\"", true},
    {25, "120 dB", "0 dB", "dynamic-range of <paths> is \"0 dB\"", "more than 0 dB", false},
    {26, "accelerator=\"bvh\"", "accelerator=\"octree\"", "accelerator of <solver> is \"octree\"", "\"auto\"", true},
    {26, "accelerator=\"bvh\"", "accelerator=\"kdtree+mask\"", "accelerator of <solver> is \"kdtree+mask\"", "\"bvh8+mask\"", false},
    {26, "cone=\"2 deg\"", "cone=\"0 deg\"", "cone of <solver> is \"0 deg\"", "at most 45 deg", false},
    {26, "cone=\"2 deg\"", "cone=\"45.1 deg\"", "cone of <solver> is \"45.1 deg\"", "at most 45 deg", false},
    {26, "cone=\"2 deg\"", "cone=\"2\"", "cone of <solver> is \"2\"", "an angle with its unit", true},
    {26, "threads=\"2\"", "threads=\"many\"", "threads of <solver> is \"many\"", NULL, true},
    {27, "coverage=\"no\"", "coverage=\"maybe\"", "coverage of <output> is \"maybe\"", "\"no\" or \"yes\"", true},
    /* variables */
    {12, "x=\"1 m\"", "x=\"$X\"", "$X is not set", "-D X=VALUE", true},
    {5, "3.5 GHz", "${F", "a $ without the name", "$$", true},
    {5, "3.5 GHz", "3.5 $ GHz", "a $ without the name", NULL, true},
    /* XML */
    {12, "y=\"-2 m\"", "y=\"-2 m", "not well-formed XML", NULL, false},
    {17, "</transmitter>", "</transmiter>", "not well-formed XML", "transmiter", false},
    {12, "y=\"-2 m\"", "x=\"-2 m\"", "not well-formed XML", "x", false},
    {12, "y=\"-2 m\"", "y=\"&undeclared;\"", "not well-formed XML", "undeclared", false},
    {5, "3.5 GHz", "3.5 \x01 GHz", "not well-formed XML", NULL, false},
    {5, "3.5 GHz", "3.5 \xff GHz", "not well-formed XML", NULL, false},
    {5, "3.5 GHz", "3.5 x:<x:b/>GHz", "not well-formed XML", NULL, false},
};

static void test_broken(void **state)
{
    TestFiles *files = *state;
    for (size_t i = 0; i < sizeof broken / sizeof *broken; i++) {
        char *text = replaced(base_config, broken[i].find, broken[i].replace);
        test_files_write(files, "c.xml", text, strlen(text));
        free(text);
        expect_refused(files, broken[i].replace, 0, NULL, KELLER_BAD_INPUT, broken[i].line, broken[i].words,
                       broken[i].more_words);
    }
}

/* The schema on its own is a gate, not an ornament: it passes the good configuration and refuses the bad ones that a
 * grammar can tell. */
static void test_schema_alone(void **state)
{
    TestFiles *files = *state;
    KellerError error;
    for (size_t i = 0; i <= sizeof broken / sizeof *broken; i++) {
        bool good = i == sizeof broken / sizeof *broken;
        if (!good && !broken[i].schema) continue;
        char *text = good ? strdup(base_config) : replaced(base_config, broken[i].find, broken[i].replace);
        test_files_write(files, "c.xml", text, strlen(text));
        free(text);
        xmlDocPtr doc = NULL;
        const char *path = test_files_path(files, "c.xml");
        if (keller_xml_read(path, &doc, &error) != KELLER_OK) fail_msg("%s", error.message);
        KellerStatus status = keller_config_check_schema(path, doc, &error);
        xmlFreeDoc(doc);
        if (good && status != KELLER_OK) fail_msg("the schema refuses a good configuration: %s", error.message);
        if (!good && status != KELLER_BAD_INPUT) fail_msg("the schema accepts \"%s\"", broken[i].replace);
    }
}

static void refuse_document(TestFiles *files, const char *text, int line, const char *words)
{
    test_files_write(files, "c.xml", text, strlen(text));
    expect_refused(files, text, 0, NULL, KELLER_BAD_INPUT, line, words, NULL);
}

static void test_other_documents(void **state)
{
    TestFiles *files = *state;
    refuse_document(files, "", 1, "empty");
    refuse_document(files, "   \n\n", 3, "not well-formed XML");
    refuse_document(files, "simulation", 1, "not well-formed XML");
    refuse_document(files, "<simulation version='1' domain='rf'>\n", 2, "not well-formed XML");
    refuse_document(files, "<scene version='2.1.0'/>", 1, "the document's element is <scene>; expected <simulation");
    refuse_document(files, "<?xml version='1.0' encoding='KLINGON'?>\n<simulation/>", 1, "not well-formed XML");
    refuse_document(files, "<simulation version='1' domain='rf'/>\n<simulation/>", 2, "not well-formed XML");
    refuse_document(files,
                    "<simulation version='1' domain='rf'>\n<scene file='a'/><frequency>1 GHz</frequency>"
                    "<transmitter id='t'><position x='0 m' y='0 m' z='0 m'/></transmitter></simulation>",
                    1, "no receivers");
    /* the file stops inside a character of UTF-16 */
    test_files_write(files, "c.xml", "\xff\xfe<\0s\0i", 7);
    expect_refused(files, "UTF-16", 0, NULL, KELLER_BAD_INPUT, 1, "not well-formed XML", NULL);
}

/* <a><a><a>... beyond libxml2's limit of 256, far enough that a recursion without limit would overflow the stack. */
static void test_depth(void **state)
{
    const size_t depth = 1000000;
    char *text = malloc(3 * depth + 1);
    assert_non_null(text);
    for (size_t i = 0; i < depth; i++) memcpy(text + 3 * i, "<a>", 3);
    text[3 * depth] = '\0';
    refuse_document(*state, text, 1, "depth");
    free(text);
}

static void test_billion_laughs(void **state)
{
    refuse_document(*state,
                    "<?xml version='1.0'?>\n<!DOCTYPE simulation [\n<!ENTITY a 'ha'>\n<!ENTITY b "
                    "'&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;'>\n"
                    "<!ENTITY c '&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;'>\n<!ENTITY d '&c;&c;&c;&c;&c;&c;&c;&c;&c;&c;'>\n"
                    "<!ENTITY e '&d;&d;&d;&d;&d;&d;&d;&d;&d;&d;'>\n<!ENTITY f '&e;&e;&e;&e;&e;&e;&e;&e;&e;&e;'>\n"
                    "<!ENTITY g '&f;&f;&f;&f;&f;&f;&f;&f;&f;&f;'>\n<!ENTITY h '&g;&g;&g;&g;&g;&g;&g;&g;&g;&g;'>\n]>\n"
                    "<simulation version='1' domain='rf'>&h;</simulation>",
                    2, "<!DOCTYPE");
}

/* One long entity, many references: quadratic blow-up, below every limit on depth. */
static void test_entity_bomb(void **state)
{
    const size_t half = 100000;
    size_t size = half + 3 * half + 200;
    char *text = malloc(size);
    assert_non_null(text);
    size_t used = (size_t)snprintf(text, size, "<!DOCTYPE s [<!ENTITY x '");
    memset(text + used, 'y', half);
    used += half;
    used += (size_t)snprintf(text + used, size - used, "'>]><simulation version='1' domain='rf'>");
    for (size_t i = 0; i < half; i++, used += 3) memcpy(text + used, "&x;", 3);
    snprintf(text + used, size - used, "</simulation>");
    refuse_document(*state, text, 1, "<!DOCTYPE");
    free(text);
}

/* External entities and DTDs: refused, and the files are not even opened (inotify would tell). */
static void test_external_entities(void **state)
{
    TestFiles *files = *state;
    test_files_write(files, "secret.txt", "hush-hush", 9);
    test_files_write(files, "evil.dtd", "<!ENTITY x 'hush-hush'>", 23);
    int watch = inotify_init1(IN_NONBLOCK);
    assert_true(watch >= 0);
    assert_true(inotify_add_watch(watch, test_files_path(files, "secret.txt"), IN_OPEN | IN_ACCESS) >= 0);
    assert_true(inotify_add_watch(watch, test_files_path(files, "evil.dtd"), IN_OPEN | IN_ACCESS) >= 0);
    static const char *const declarations[] = {
        "<!DOCTYPE s [<!ENTITY x SYSTEM '%s/secret.txt'>]>",
        "<!DOCTYPE s [<!ENTITY x SYSTEM 'secret.txt'>]>",
        "<!DOCTYPE s SYSTEM '%s/evil.dtd'>",
        "<!DOCTYPE s PUBLIC 'p' 'evil.dtd'>",
        "<!DOCTYPE s [<!ENTITY %% y SYSTEM 'file://%s/evil.dtd'> %%y;]>",
        "<!DOCTYPE s [<!ENTITY x SYSTEM 'http://127.0.0.1:9/x'>]>",
    };
    for (size_t i = 0; i < sizeof declarations / sizeof *declarations; i++) {
        char declaration[600], text[1200];
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wformat-nonliteral"
        snprintf(declaration, sizeof declaration, declarations[i], files->folder);
#pragma GCC diagnostic pop
        snprintf(text, sizeof text, "<?xml version='1.0'?>\n\n%s\n<simulation version='1' domain='rf'>&x;</simulation>",
                 declaration);
        refuse_document(files, text, 3, "<!DOCTYPE");
    }
    /* XInclude is not applied either */
    refuse_document(files,
                    "<simulation version='1' domain='rf'>\n<xi:include xmlns:xi='http://www.w3.org/2001/XInclude' "
                    "href='secret.txt' parse='text'/></simulation>",
                    2, "namespace");
    char event[512];
    assert_int_equal(read(watch, event, sizeof event), -1);
    close(watch);
}

static void test_files_that_cannot_be_read(void **state)
{
    TestFiles *files = *state;
    KellerConfig config;
    KellerError error;
    assert_int_equal(keller_config_read(test_files_path(files, "none.xml"), 0, NULL, &config, &error), KELLER_IO);
    assert_non_null(strstr(error.message, "none.xml"));
    assert_non_null(strstr(error.message, "No such file"));
    assert_int_equal(keller_config_read(files->folder, 0, NULL, &config, &error), KELLER_IO);
    assert_non_null(strstr(error.message, files->folder));
    /* would wait for a writer, and deliver without end */
    assert_int_equal(mkfifo(test_files_path(files, "pipe"), 0600), 0);
    assert_int_equal(keller_config_read(test_files_path(files, "pipe"), 0, NULL, &config, &error), KELLER_IO);
    assert_int_equal(keller_config_read("/dev/zero", 0, NULL, &config, &error), KELLER_IO);

    test_files_write(files, "c.xml", base_config, strlen(base_config));
    unlink(test_files_path(files, "walk.csv"));
    expect_refused(files, "missing route", 0, NULL, KELLER_IO, 19, "walk.csv", "No such file");
    /* 64 MiB and a byte, sparse */
    assert_int_equal(truncate(test_files_path(files, "c.xml"), (64 << 20) + 1), 0);
    expect_refused(files, "large", 0, NULL, KELLER_BAD_INPUT, 1, "64 MiB", NULL);
}

static void test_routes(void **state)
{
    static const struct {
        int line;
        const char *csv, *words, *more_words;
    } routes[] = {
        {1, "", "no header line", "x,y,z or lat,lon,height"},
        {1, "# only a comment\n", "no header line", NULL},
        {1, "1,2,3\n", "the header line is \"1,2,3\"", "x,y,z or lat,lon,height"},
        {2, "#\nx;y;z\n1;2;3\n", "the header line is \"x;y;z\"", NULL},
        {1, "x,y\n1,2\n", "the header line is \"x,y\"", NULL},
        {1, "x,y,y\n1,2,3\n", "the header line is", NULL},
        {1, "x,y,z,w\n1,2,3,4\n", "the header line is", NULL},
        {1, "lat,lon,z\n1,2,3\n", "the header line is", NULL},
        {2, "x,y,z\n", "no points", NULL},
        {3, "x,y,z\n1,2,3\n1,2\n", "the line is \"1,2\"", "three numbers"},
        {3, "x,y,z\n1,2,3\n1,2,3,4\n", "the line is \"1,2,3,4\"", NULL},
        {4, "x,y,z\r\n\r\n# c\r\n1,two,3\r\n", "a coordinate is \"two\"", "no unit"},
        {2, "x,y,z\n1,2,nan\n", "a coordinate is \"nan\"", NULL},
        {2, "x,y,z\n1,inf,3\n", "a coordinate is \"inf\"", NULL},
        {2, "x,y,z\n1,,3\n", "a coordinate is \"\"", NULL},
        {2, "x,y,z\n1e10,2,3\n", "a coordinate is \"1e10\"", "within 1e9 m"},
        {2, "x,y,z\n1 m,2,3\n", "a coordinate is \"1 m\"", "no unit"},
        {2, "x,y,z\n\"1\",2,3\n", "a coordinate is \"\"1\"\"", NULL},
        {2, "lat,lon,height\n90.5,0,0\n", "a coordinate is \"90.5\"", "latitude"},
        {2, "height,lon,lat\n0,181,0\n", "a coordinate is \"181\"", "longitude"},
    };
    TestFiles *files = *state;
    test_files_write(files, "c.xml", base_config, strlen(base_config));
    for (size_t i = 0; i < sizeof routes / sizeof *routes; i++) {
        test_files_write(files, "walk.csv", routes[i].csv, strlen(routes[i].csv));
        char start[300];
        snprintf(start, sizeof start, "%s:%d: ", test_files_path(files, "walk.csv"), routes[i].line);
        KellerConfig config;
        KellerError error = {KELLER_OK, "(none)"};
        KellerStatus got = keller_config_read(test_files_path(files, "c.xml"), 0, NULL, &config, &error);
        if (got != KELLER_BAD_INPUT || strncmp(error.message, start, strlen(start)) != 0 ||
            !strstr(error.message, routes[i].words) ||
            (routes[i].more_words && !strstr(error.message, routes[i].more_words)))
            fail_msg("route %zu: expected \"%s\" at line %d; got %d: %s", i, routes[i].words, routes[i].line, got,
                     error.message);
    }
}

static void test_geodetic_without_origin(void **state)
{
    TestFiles *files = *state;
    char *one = replaced(base_config, "<origin lat=\"48.137154\" lon=\"11.576124\" height=\"519 m\"/>", "");
    char *two =
        replaced(one, "<position x=\"1 m\" y=\"-2 m\" z=\"10 m\"/>", "<geodetic lat='0' lon='0' height='0 m'/>");
    test_files_write(files, "c.xml", two, strlen(two));
    expect_refused(files, "geodetic", 0, NULL, KELLER_BAD_INPUT, 12, "<geodetic> needs an origin", NULL);
    test_files_write(files, "c.xml", one, strlen(one));
    test_files_write(files, "walk.csv", "lat,lon,height\n0,0,0\n", 21);
    KellerConfig config;
    KellerError error;
    assert_int_equal(keller_config_read(test_files_path(files, "c.xml"), 0, NULL, &config, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "walk.csv:1: columns lat,lon,height need an origin"));
    free(one);
    free(two);
}

static void test_variables(void **state)
{
    static const struct {
        KellerVariable variables[2];
        size_t count;
        int line;
        const char *words, *more_words;
    } cases[] = {
        {{{"A", "1 m"}, {"B", "2"}}, 2, 0, "-D B is given, but the configuration has no $B", NULL},
        {{{"A", "1 m"}, {"A", "2 m"}}, 2, 0, "-D A is given twice", NULL},
        {{{"", "1 m"}}, 1, 0, "no name of a variable", NULL},
        {{{"1A", "1 m"}}, 1, 0, "-D 1A is no name of a variable", NULL},
        {{{"A-B", "1 m"}}, 1, 0, "-D A-B is no name of a variable", NULL},
        {{{"A", "1\xff m"}}, 1, 0, "not plain text", "UTF-8"},
        {{{"A", "1\x01 m"}}, 1, 0, "not plain text", NULL},
        {{{"A", "1"}}, 1, 12, "x of <position> is \"1\"", "a length with its unit"},
        {{{"A", ""}}, 1, 12, "x of <position> is \"\"", NULL},
        {{{"a", "1 m"}}, 1, 12, "$A is not set", NULL},
    };
    TestFiles *files = *state;
    test_files_write(files, "walk.csv", "x,y,z\n1,2,3\n", 12);
    char *text = replaced(base_config, "x=\"1 m\"", "x=\"${A}\"");
    test_files_write(files, "c.xml", text, strlen(text));
    free(text);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++)
        expect_refused(files, cases[i].variables[0].name, cases[i].count, cases[i].variables, KELLER_BAD_INPUT,
                       cases[i].line, cases[i].words, cases[i].more_words);
}

/* 100,000 references to a value of 100,000 bytes are 10 GB: refused at 64 MiB. */
static void test_variable_bomb(void **state)
{
    const size_t half = 100000;
    char *value = malloc(half + 1), *text = malloc(2 * half + 200);
    assert_true(value && text);
    memset(value, 'v', half);
    value[half] = '\0';
    size_t used = (size_t)snprintf(text, 200, "<simulation version='1' domain='rf'>\n");
    for (size_t i = 0; i < half; i++, used += 2) memcpy(text + used, "$V", 2);
    strcpy(text + used, "</simulation>");
    test_files_write(*state, "c.xml", text, strlen(text));
    KellerVariable variable = {"V", value};
    expect_refused(*state, "variable bomb", 1, &variable, KELLER_BAD_INPUT, 1, "expand to more than 64 MiB", NULL);
    free(value);
    free(text);
}

/* Grids that fit one by one but not together. */
static void test_receivers_in_all(void **state)
{
    /* 3001 * 3001 = 9,006,001 points twice */
    char *text =
        replaced(base_config, "<paths",
                 "<grid id='b' z='0 m'><from x='0 m' y='0 m'/><to x='3 km' y='3 km'/><step>1 m</step></grid>\n"
                 "<grid id='c' z='0 m'><from x='0 m' y='0 m'/><to x='3 km' y='3 km'/><step>1 m</step></grid>\n<paths");
    test_files_write(*state, "walk.csv", "x,y,z\n1,2,3\n", 12);
    test_files_write(*state, "c.xml", text, strlen(text));
    expect_refused(*state, "two grids", 0, NULL, KELLER_BAD_INPUT, 26,
                   "the grid makes 9.01e+06 points, 9006036 receivers "
                   "before it",
                   NULL);
    free(text);
}

static void test_too_many_elements(void **state)
{
    const size_t count = 50001, each = strlen("<output/>");
    char *text = malloc(count * each + 100);
    assert_non_null(text);
    size_t used = (size_t)snprintf(text, 100, "<simulation version='1' domain='rf'>\n");
    for (size_t i = 0; i < count; i++, used += each) memcpy(text + used, "<output/>", each);
    strcpy(text + used, "</simulation>");
    refuse_document(*state, text, 1, "<simulation> holds 50001 elements; expected at most 50000");
    free(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_broken),
        cmocka_unit_test(test_schema_alone),
        cmocka_unit_test(test_other_documents),
        cmocka_unit_test(test_depth),
        cmocka_unit_test(test_billion_laughs),
        cmocka_unit_test(test_entity_bomb),
        cmocka_unit_test(test_external_entities),
        cmocka_unit_test(test_files_that_cannot_be_read),
        cmocka_unit_test(test_routes),
        cmocka_unit_test(test_geodetic_without_origin),
        cmocka_unit_test(test_variables),
        cmocka_unit_test(test_variable_bomb),
        cmocka_unit_test(test_receivers_in_all),
        cmocka_unit_test(test_too_many_elements),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, setup, teardown);
}
