/* keller bench acoustics: the two methods of diffraction of sound against each other, as functions of frequency.
 *
 * usage: keller-bench-acoustics [--csv]
 *
 * A row a third octave, 25 Hz to 8 kHz (343 m/s): largest difference of the uniform theory from Biot, Tolstoy and Medwin's solution
 * around long rigid edges of 60, 90 degrees and of a screen, in dB of the free field over the edge (source 3 m from it at 40 degrees,
 * receivers 2 m behind it in steps of 20 degrees; kL as in the second column); and the level of the sound behind a screen of 4 m by 1.5 m
 * on a rigid floor, all paths of this program together, in dB of the free field, by either method. tools/acoustics.sh draws both. */
#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../tests/stability/harness.h"
#include "../tests/stability/scenes.h"
#include "keller/sound.h"

static const double speed = 343, degree = M_PI / 180;

static double difference(double n, double k)
{
    KellerWedgeWave wedge = {.n = n, .direction = v3(0, 0, 1), .tangent0 = v3(1, 0, 0), .normal0 = v3(0, 1, 0),
                             .medium = {{.sound = true, .factor = 1}, {.sound = true, .factor = 1}}};
    double worst = 0, in = 40 * degree;
    for (int i = 1; i < (int)(9 * n); i++) {
        double out = 20 * i * degree;
        KellerVec3 towards = v3(-cos(in), -sin(in), 0), away = v3(cos(out), sin(out), 0);
        KellerRigidEdge e = keller_rigid_edge(&wedge, towards, away, 3, 2, 100, 200);
        double complex uniform = keller_sound_diffraction(&wedge, towards, away, 3, 2, k) / 3;
        worst = fmax(worst, cabs(uniform - keller_btm(&e, k)) * 5);
    }
    return 20 * log10(worst);
}

static KellerScene screen_on_floor(void)
{
    KellerSoup soup = soup_new();
    soup_object(&soup, "floor");
    soup_quad(&soup, v3(-500, -500, 0), v3(500, -500, 0), v3(500, 500, 0), v3(-500, 500, 0), CONCRETE);
    soup_quad(&soup, v3(0, -2, 0), v3(0, 2, 0), v3(0, 2, 1.5), v3(0, -2, 1.5), CONCRETE);
    for (uint32_t i = 0; i < MATERIAL_COUNT; i++)
        soup.materials[i] = (KellerMaterial){.name = soup.materials[i].name, .kind = KELLER_MATERIAL_RIGID};
    KellerScene scene = scene_of(&soup);
    soup_release(&soup);
    scene.sound.speed = speed;
    return scene;
}

static double level_behind(KellerScene *scene, KellerEdgeMethod edges, double frequency)
{
    const KellerVec3 tx = v3(-2, 0.3, 1.2), rx = v3(3, -0.4, 1.2);
    Run run = run_new(&tx, 1, &rx, 2, 1, 3);
    scene->sound.edges = edges;
    run.frequency[0] = frequency;
    FoundPaths found = run_simulation(scene, &run);
    double level = 20 * log10(cabs(found_total(&found, 0, 0)) * v3_distance(tx, rx));
    found_free(&found);
    return level;
}

int main(int argc, char **argv)
{
    bool csv = argc == 2 && strcmp(argv[1], "--csv") == 0;
    if (argc > 1 && !csv) {
        fprintf(stderr, "keller-bench-acoustics: \"%s\" is unknown; usage: keller-bench-acoustics [--csv]\n", argv[1]);
        return 2;
    }
    const double openings[3] = {5.0 / 3, 1.5, 2};
    KellerScene scene = screen_on_floor();
    puts(csv ? "frequency_Hz,kL,wedge60_dB,wedge90_dB,screen_dB,utd_dB,btm_dB"
             : "  frequency/Hz       kL   60 deg   90 deg   screen   behind a screen, UTD      BTM");
    for (int i = -16; i <= 9; i++) {
        double frequency = keller_band_middle(3, 1000 * pow(10, 0.1 * i)), k = 2 * M_PI * frequency / speed;
        double row[7] = {frequency, 1.2 * k};
        for (int w = 0; w < 3; w++) row[2 + w] = difference(openings[w], k);
        row[5] = level_behind(&scene, KELLER_EDGES_UTD, frequency);
        row[6] = level_behind(&scene, KELLER_EDGES_BTM, frequency);
        printf(csv ? "%.2f,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f\n" : "%14.1f %8.2f %8.1f %8.1f %8.1f %22.2f %8.2f\n", row[0], row[1], row[2], row[3],
               row[4], row[5], row[6]);
    }
    keller_scene_free(&scene);
    return 0;
}
