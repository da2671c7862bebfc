/* keller/drape.h -- maps that follow the ground: grids whose cells lie at a height over a surface of the scene.
 *
 *     status = keller_config_drape(&config, &scene, &error);          // after keller_scene_build, before keller_simulate
 *
 * The surface under a cell is the highest point, straight above or below the cell's (x, y), of what the grid counts as surface: the objects
 * and materials that it names, or, where it names none, everything. Triangles are closed, so that a cell on the border of two finds the
 * higher of the two numbers, which differ by rounding at most; vertical ones do not count. A cell that misses all of them by no more than
 * the contact tolerance (keller_scene_contact), as in a crack of a mesh, takes the nearest point of one. */
#ifndef KELLER_DRAPE_H
#define KELLER_DRAPE_H
#include "keller/config.h"
#include "keller/error.h"
#include "keller/scene.h"

/* Sets the z of all cells of the configuration's draped grids; NaN where there is no surface, and of how many cells that is so
 * (KellerReceiverSet.nowhere). Heights are good to some rounding units of the triangles' coordinates, over the sine of their steepness.
 * Other sets are left alone.
 * Errors: KELLER_BAD_INPUT with FILE:LINE (an object or material that the scene does not have), KELLER_FAILED (memory). */
KellerStatus keller_config_drape(KellerConfig *config, const KellerScene *scene, KellerError *error);
#endif
