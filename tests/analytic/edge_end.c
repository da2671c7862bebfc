#include "edge_end.h"

#include <math.h>

#include "../stability/harness.h"
#include "../stability/scenes.h"
#include "keller/sound.h"

static const double high = 60, before = 9, behind = 12, phi_in = 80 * M_PI / 180, frequency = 3.5e9;

static KellerVec3 around(double r, double phi, double z) { return v3(r * cos(phi), r * sin(phi), z); }

static double complex path_at(double z, double phi)
{
    KellerSoup soup = soup_new();
    soup_object(&soup, "screen");
    soup_quad(&soup, v3(0, 0, 0), v3(80, 0, 0), v3(80, 0, high), v3(0, 0, high), CONDUCTOR);
    KellerScene scene = scene_of(&soup);
    KellerVec3 tx = around(before, phi_in, z), rx = around(behind, phi, z);
    Run run = run_new(&tx, 1, &rx, 0, 1, 1);
    run.frequency[0] = frequency;
    FoundPaths found = run_simulation(&scene, &run);
    double complex sum = 0;
    for (size_t i = 0; i < found.count; i++) {
        const Found *p = &found.path[i];
        if (p->count == 1 && hypot(p->position[0].x, p->position[0].y) < 1e-6) sum += p->transfer[0][3];
    }
    found_free(&found);
    keller_scene_free(&scene);
    soup_release(&soup);
    return sum;
}

static double complex rigid_at(double z, double phi, double z1, double z2)
{
    KellerRigidEdge e = {.n = 2, .phi_in = phi_in, .phi = phi, .r_in = before, .z_in = z, .r = behind, .z = z, .z1 = z1, .z2 = z2};
    return keller_btm(&e, 2 * M_PI * frequency / KELLER_LIGHT_SPEED);
}

EdgeEnd edge_end_whole(double phi) { return (EdgeEnd){path_at(0.5 * high, phi), rigid_at(0, phi, -2 * high, 2 * high)}; }

EdgeEnd edge_end_at(double place, double phi, const EdgeEnd *whole)
{
    double k = 2 * M_PI * frequency / KELLER_LIGHT_SPEED, z = place / sqrt(k * (1 / before + 1 / behind));
    return (EdgeEnd){path_at(z, phi) / whole->program, rigid_at(z, phi, 0, high) / whole->exact};
}
