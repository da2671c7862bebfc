#include <stdio.h>
#include <string.h>
#include "cli/cli.h"
#include "cli/help.h"

typedef struct {
    const char *verb, *usage, *text;
} Help;

static const char general[] =
    "keller computes radio propagation paths through a triangulated scene.\n"
    "\n"
    "usage: keller VERB ...\n"
    "  run      simulate a configuration, write a result file\n"
    "  check    read and validate a configuration and its scene; simulate nothing\n"
    "  info     summary of a scene, a configuration or a result\n"
    "  paths    list the paths of a result\n"
    "  plot     a picture of a result\n"
    "  scene    make, convert and examine scenes\n"
    "  bench    the measurements of the documentation\n"
    "  help     help on a verb\n"
    "  version  the program's version (also --version)\n"
    "\n"
    "keller help VERB, or keller VERB --help, says more.\n"
    "Exit status: 0 done, 1 the run failed, 2 wrong usage, 3 bad input, 4 input or output failed.\n";

static const Help verbs[] = {
    {"run", "keller run CONFIG.xml [-o OUT.h5] [-j THREADS] [-D NAME=VALUE]... [--reuse RESULT.h5] [--force] [-q | -v]",
     "  -o, --output OUT.h5    the result; default: the configuration's base name with .h5, in the current folder\n"
     "  -j, --threads THREADS  threads (0: all processors); default: what the configuration says\n"
     "  -D NAME=VALUE          put VALUE for $NAME in the configuration\n"
     "      --reuse RESULT.h5  search nothing: take the paths of this result, and compute fields anew for the configuration's\n"
     "                         frequencies, materials, antennas, powers, velocities, air or medium. Scene, positions and orders\n"
     "                         must be those of the result; what it had dropped as too weak is missing, and said so\n"
     "      --force            replace an existing result, but never an input of the run\n"
     "      --resume           not in this version\n"
     "  -q, --quiet            no progress\n"
     "  -v, --verbose          say what is being done, and all notes on the scene\n"},
    {"check", "keller check CONFIG.xml [-D NAME=VALUE]...",
     "Reads and validates everything, and says what would run.\n"
     "  -D NAME=VALUE          put VALUE for $NAME in the configuration\n"},
    {"info", "keller info FILE [-D NAME=VALUE]...",
     "FILE is a result (HDF5), a configuration (XML whose root is <simulation>), or a scene (.obj .ply .stl .off, or\n"
     "Mitsuba XML).\n"
     "  -D NAME=VALUE          put VALUE for $NAME in the configuration\n"},
    {"paths", "keller paths RESULT.h5 [--tx ID] [--rx ID] [--strongest N | --pairs] [--format table|csv|json]",
     "Lists paths: transmitter, receiver, sequence, length, delay, gain and phase at each frequency, angles of "
     "departure\n"
     "and arrival, Doppler shift. A sequence such as R12 D7 names the triangle of each reflection (R) or transmission "
     "(T)\n"
     "and the wedge of each diffraction (D), as rows of /scene; LOS is the line of sight.\n"
     "  --tx ID                only from this transmitter\n"
     "  --rx ID                only to this receiver (\"walk[3]\": a point of a set), or to all receivers of this set\n"
     "  --strongest N          the N strongest of each pair at the first frequency, strongest first\n"
     "  --pairs                not paths but pairs, those with receivers of grids left out: path gain as the sum of fields and as\n"
     "                         that of powers, delay of the strongest path, delay spread, azimuth and zenith spread of departure\n"
     "                         (ASD, ZSD) and of arrival (ASA, ZSA)\n"
     "  --format FORMAT        table (default), csv or json\n"},
    {"plot",
     "keller plot RESULT.h5 [--what WHAT] [--sum coherent|incoherent] [--tx ID] [--rx ID] [--grid ID] [--frequency N]\n"
     "                   -o FILE.png|FILE.svg [--force]",
     "Draws a picture with gnuplot, over the outlines of the scene where the result holds it.\n"
     "  --what coverage        path gain over a grid (default)\n"
     "  --what delay           delay of the strongest path over a grid\n"
     "  --what delay-spread    rms delay spread over a grid\n"
     "  --what departure-azimuth-spread|departure-zenith-spread|arrival-azimuth-spread|arrival-zenith-spread\n"
     "                         angular spread over a grid\n"
     "  --what level           sound level over a grid, all transmitters together unless --tx says otherwise, A-weighted and all\n"
     "                         bands together unless --frequency says otherwise\n"
     "  --what paths           the paths of a transmitter seen from above: those within 60 dB of the strongest\n"
     "  --sum SUM              of coverage: coherent, |sum of fields|^2 (default), or incoherent, the sum of powers\n"
     "  --tx ID                the transmitter; default: the first\n"
     "  --rx ID                maps: the same as --grid; paths: only to this receiver or set\n"
     "  --grid ID              the grid (--set ID does the same); default: the first\n"
     "  --frequency N          which frequency, counted from 1 (default); not for delays and spreads, maps of the first frequency\n"
     "  -o, --output FILE      the picture; .png or .svg says which kind\n"
     "      --force            replace an existing picture\n"},
    {"export", "keller export RESULT.h5 [--grid ID] -o FILE.csv|FILE.json|FILE.xdmf [--force]\n"
     "       keller export RESULT.h5 [--tx ID] [--rx ID] -o FILE.wav [--force]",
     "Writes maps for other programs. .csv: a row a transmitter, frequency and cell; .json: the same as arrays; .xdmf: a description\n"
     "for ParaView of where in the result the scene and all maps are, which it needs at hand.\n"
     "Or writes the impulse response of a pair as a sound file: one channel of 32-bit floats at the rate of <response>, 1 being the\n"
     "free-field pressure at 1 m. What would be beyond 1 is scaled down as a whole, and said so.\n"
     "  --tx ID                the transmitter; default: the first\n"
     "  --rx ID                the receiver (\"walk[3]\": a point of a route); default: the first\n"
     "  --grid ID              the map; default: the first\n"
     "  -o, --output FILE      the file; its ending says which kind\n"
     "      --force            replace an existing file\n"},
    {"scene",
     "keller scene generate city [--seed N] [--blocks N | --triangles N] [--layout grid|star] -o FILE [--force]\n"
     "       keller scene generate random|slivers-sphere [--seed N] [--triangles N] [--size S] -o FILE [--force]\n"
     "       keller scene generate hair [--seed N] [--strands N] [--size S] -o FILE [--force]\n"
     "       keller scene generate layers [--seed N] [--count N] [--size S] -o FILE [--force]\n"
     "       keller scene generate terrain [--seed N] [--triangles N] [--count N] [--size S] -o FILE [--force]\n"
     "       keller scene convert SCENE -o FILE [--force]\n"
     "       keller scene stats SCENE",
     "generate makes a scene, the same for the same options on every machine:\n"
     "  city            street blocks of closed buildings on a ground plane, about 85 triangles a block\n"
     "  random          independent small triangles in a cube\n"
     "  slivers-sphere  a closed sphere of thin triangles\n"
     "  hair            curled strips of 31 thin triangles each\n"
     "  layers          walls behind one another, with windows; 130 triangles each, and the z axis meets them all\n"
     "  terrain         hills over a square, of about N triangles, with houses on them\n"
     "convert writes a scene in another format. SCENE is .obj, .ply, .stl, .off, or Mitsuba XML. stats prints what a\n"
     "mesh consists of and what had to be repaired.\n"
     "  --seed N               of all chance; default: 1\n"
     "  --blocks N             street blocks of a city; default: 100\n"
     "  --triangles N          default: 10000; for a city, as many blocks as have about N triangles\n"
     "  --layout LAYOUT        grid (default), or star: avenues that meet in a roundabout\n"
     "  --strands N            hairs; default: 1000\n"
     "  --count N              walls; default: 64. Houses on a terrain, where they find room; default: 0\n"
     "  --size S               the scene's width in metres; default: 10, of a terrain 500\n"
     "  -o, --output FILE      .obj holds all; .ply (binary, double precision) and .stl (binary, single precision) hold\n"
     "                         neither objects nor materials\n"
     "      --force            replace an existing file, but never the scene to convert\n"},
    {"bench", "keller bench cone|accel|maps|masks|batch|accuracy|acoustics|nexthit|paths|stability [--csv] [options]",
     "Runs a suite of measurements and prints its table; the times are of one thread.\n"
     "  cone: each test of the cone against an exact answer, and its time, by half-angle and eccentricity\n"
     "  --cases N              cases for each test; default: 1e8\n"
     "  --seed N               of the random numbers; default: 1\n"
     "  --threads N            for the comparisons (0, the default: all processors)\n"
     "  --test NAME            only this test, as it is named in the table\n"
     "  --time-only            no comparisons\n"
     "  accel: the accelerators' queries with rays and cones\n"
     "  --scene FILE           a scene; --random N: N random triangles; --hair N: N hairs; each may be given again\n"
     "  --structure NAME       only this one: kdtree, bvh, bvh8, bvh+mask, bvh8+mask, ubvh, dacrt, and\n"
     "                         to compare with ubvh: ubvh-skewed, ubvh-ploc, ubvh-greedy, ubvh-4, sobb, sobb-4, obb, dop14;\n"
     "                         may be given again\n"
     "  --query NAME, --half-angle DEG, --queries N, --seed N\n"
     "                         only these queries; how many; of the random numbers\n"
     "  --spatial SHARE, --cost RATIO\n"
     "                         how to build (keller/accel.h)\n"
     "  --peer embree          also Embree, in the same process, for rays\n"
     "  maps: a map, searched from the transmitter alone, against points at random cells of it\n"
     "  --scene FILE, --tx X,Y,Z, --z Z, --height H, --radius R\n"
     "                         default: munich, 8.5,21,27, cells at 1.5 m; or so high over whatever is highest;\n"
     "                         cells no farther in x and y from the transmitter\n"
     "  --cells N, --points N, --reflections N, --diffractions N, --interactions N, --threads N, --seed N\n"
     "                         default: about 4000, 1000; 2, 1, 2; all processors, 1\n"
     "  masks: what the masks of bvh+mask and bvh8+mask spare and cost, by kind of mask\n"
     "  --scene FILE, --random N, --hair N\n"
     "                         as for accel\n"
     "  --structure NAME       the tree below: bvh, or bvh8, the default\n"
     "  --queries N, --seed N  how many; of the random numbers\n"
     "  batch: so many rays or cones from nothing to the last answer, by dacrt and by building bvh8\n"
     "  --scene FILE, --random N, --hair N\n"
     "                         as for accel\n"
     "  --queries N, --half-angle DEG, --seed N\n"
     "                         at most so many; cones in place of rays; of the random numbers\n"
     "  accuracy: fields against exact solutions\n"
     "  --truth FOLDER         of the tables of exact fields; default: ../shared/truth\n"
     "  --curves FOLDER        also writes the curves behind the pictures of docs/accuracy.md\n"
     "  --transition           instead what the transition function costs, beside the Faddeeva function\n"
     "  acoustics: diffraction of sound by UTD and by BTM, by frequency\n"
     "  nexthit: hits of rays one after another, by method; lost and repeated ones are counted\n"
     "  --scene FILE           a scene, or --layers N: N walls behind one another; both may be given again\n"
     "  --rays N, --seed N     how many; of the random numbers\n"
     "  --half-angle DEG       cones too\n"
     "  --peer embree          also Embree's methods, in the same process\n"
     "  paths: whole runs, each in a process of its own: time, counts and memory by scene, orders, receivers and threads\n"
     "  --scene FILE           a scene, or --city TRIANGLES: a generated one; --orders R,D,I: reflections, diffractions,\n"
     "                         interactions; --receivers N, points over streets, or --cells N, a map; --threads N; each may\n"
     "                         be given again, and all combinations are run\n"
     "  --transmitter X,Y,Z, --step M, --seed N\n"
     "                         in metres; default: near the middle; between cells (2 m); of the random places\n"
     "  --limit S              ends a run that takes longer; default: 600\n"
     "  --keep FOLDER          leaves the last configuration and result there\n"
     "  stability: the paper's formulas as printed beside the tests of this library\n"
     "  --csv                  as CSV\n"},
    {"help", "keller help [VERB]", "Prints this help, or that of a verb.\n"},
    {"version", "keller version", "Prints the program's version.\n"},
};

KellerStatus keller_print_help(const char *verb, KellerError *error)
{
    if (!verb) {
        fputs(general, stdout);
        return KELLER_OK;
    }
    for (size_t i = 0; i < sizeof verbs / sizeof *verbs; ++i) {
        if (strcmp(verbs[i].verb, verb) != 0) continue;
        printf("usage: %s\n%s", verbs[i].usage, verbs[i].text);
        return KELLER_OK;
    }
    return keller_error(error, KELLER_USAGE, "unknown verb \"%.60s\"; see `keller help`", verb);
}

KellerStatus keller_cli_help(int argc, char **argv, KellerError *error)
{
    if (argc > 1) return keller_usage(error, "help", "\"%.60s\" is one verb too many", argv[1]);
    return keller_print_help(argc > 0 ? argv[0] : NULL, error);
}

KellerStatus keller_cli_version(int argc, char **argv, KellerError *error)
{
    if (argc > 0) return keller_usage(error, "version", "\"%.60s\" is not expected", argv[0]);
    printf("keller %s\n", KELLER_VERSION);
    return KELLER_OK;
}
