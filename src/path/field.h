/* What fields of all kinds need of a wedge on a path. */
#ifndef KELLER_PATH_FIELD_H
#define KELLER_PATH_FIELD_H
#include "keller/sound.h"
#include "path/internal.h"

/* The wedge with the media of its faces; `media` as for keller_path_transfer. */
KellerWedgeWave path_wave_at(const KellerScene *scene, uint32_t wedge, const KellerMedium *media);
/* Along a screen from one of its rims to another the azimuth is 0 or 2 pi by rounding: the direction, from the edge outwards, is
 * taken to be on the side of the face's normal, which both rims and both directions agree on. */
KellerVec3 path_on_one_side(const KellerScene *scene, uint32_t wedge, KellerVec3 outwards);

/* The speed (m/s) of the scene's waves. */
static inline double path_wave_speed(const KellerScene *scene)
{
    return scene->sound.speed > 0 ? scene->sound.speed : KELLER_LIGHT_SPEED;
}

/* The pressure at the end of a path over the free-field pressure at 1 m, in a scene of sound: weight, spreading, air and phase
 * included, directivities not. */
double complex path_pressure(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double frequency,
                             const KellerMedium *media);
/* The same without the phase e^{-jkr} of the path's length: it changes slowly with frequency. Without `edges` the diffraction, and all
 * spreading with it, is left out. */
double complex path_pressure_slow(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, double frequency,
                                  const KellerMedium *media, bool edges);
/* True where the path is diffracted at an edge by Biot, Tolstoy and Medwin: that edge, which keller_btm takes with all spreading. */
bool path_rigid_edge(const KellerScene *scene, const KellerPath *path, KellerVec3 tx, const KellerMedium *media, KellerRigidEdge *edge);
/* What domain "acoustic" cannot do: transmissions; with Biot, Tolstoy and Medwin's edges a second diffraction, or a wedge that is
 * not rigid. */
KellerStatus path_sound_check(const KellerConfig *config, const KellerScene *scene, KellerError *error);
#endif
