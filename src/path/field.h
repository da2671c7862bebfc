/* Fields along paths. */
#ifndef KELLER_PATH_FIELD_H
#define KELLER_PATH_FIELD_H
#include "keller/sound.h"
#include "path/internal.h"

/* The speed (m/s) of the scene's waves. */
static inline double path_wave_speed(const KellerScene *scene)
{
    return scene->sound.speed > 0 ? scene->sound.speed : KELLER_LIGHT_SPEED;
}

/* The gain of a path between stations (SPEC 1), its transfer matrix beside it: antennas times transfer, and, of paths over edges, what
 * the change of the antennas' patterns across the first and the last edge adds (docs/theory.md). */
double complex path_gain(const KellerScene *scene, const KellerPath *path, const KellerStation *tx, const KellerStation *rx,
                         double frequency, const KellerMedium *media, double complex transfer[4]);

/* The pressure at the end of a path over the free-field pressure at 1 m, in a scene of sound: weight, spreading, air and phase
 * included, directivities not. */
double complex path_pressure(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double frequency,
                             const KellerMedium *media);
/* The same without the phase e^{-jkr} of the path's length: it changes slowly with frequency. Without `edges` the diffraction, and all
 * spreading with it, is left out. */
double complex path_pressure_slow(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double frequency,
                                  const KellerMedium *media, bool edges);
/* The ways of a scattered path to its patch, in step *at, and from there on, each a path of its own; false: it is not scattered. */
bool path_halves(const KellerPath *path, KellerVec3 tx, KellerPath half[2], uint32_t *at);
/* True where three or more edges of the path in a row lie in each other's transition zones and are not parallel: its field is then
 * some tenths of a dB off, or more (docs/accuracy.md). k in rad/m. */
bool path_crowded(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double k);
/* True where the path is diffracted at an edge by Biot, Tolstoy and Medwin: that edge, which keller_btm takes with all spreading. */
bool path_rigid_edge(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, const KellerMedium *media,
                     KellerRigidEdge *edge);
/* The error of a material that is for the other domain: KELLER_BAD_INPUT. `sound`: the scene is one of sound. */
KellerStatus path_other_domain(const KellerMaterial *material, bool sound, KellerError *error);
/* What domain "acoustic" cannot do: transmissions; with Biot, Tolstoy and Medwin's edges a second diffraction, or a wedge that is
 * not rigid. */
KellerStatus path_sound_check(const KellerConfig *config, const KellerScene *scene, KellerError *error);
#endif
