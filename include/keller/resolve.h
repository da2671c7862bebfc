/* keller/resolve.h -- which material each triangle is made of, once scene and configuration are both read. */
#ifndef KELLER_RESOLVE_H
#define KELLER_RESOLVE_H
#include "keller/config.h"
#include "keller/error.h"
#include "keller/soup.h"

/* Gives every triangle of *soup a material that says what it is made of (none of kind NAMED, ITU names all known), as
 * keller_scene_build wants it. For each triangle, the first of these that there is:
 *   1. the material that an <assign> names for its object;
 *   2. the <material> of the configuration with the name that the scene gives the triangle's material;
 *   3. the scene's own material, where the scene says what it is made of;
 *   4. the <default-material>.
 *
 * <assign> and <default-material> name a <material> of the configuration or, failing that, a material that the scene
 * defines. Afterwards soup->materials holds the materials that some triangle uses, sorted by name; on failure the
 * soup is unchanged.
 * Errors: KELLER_BAD_INPUT with the configuration's FILE:LINE: an unknown object or material (with the nearest name),
 * a triangle for which there is none of the four (naming object and material and what to add); KELLER_FAILED
 * (memory). */
KellerStatus keller_config_resolve(const KellerConfig *config, KellerSoup *soup, KellerError *error);
#endif
