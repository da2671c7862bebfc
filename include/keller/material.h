/* keller/material.h -- what a surface is made of, as a configuration or a scene file says it.
 * The constants at a frequency come from keller/wave.h. */
#ifndef KELLER_MATERIAL_H
#define KELLER_MATERIAL_H

typedef enum {
    KELLER_MATERIAL_NAMED,    /* only a name so far: to be found in the configuration, or the default material */
    KELLER_MATERIAL_ITU,      /* a row of ITU-R P.2040-4, by name */
    KELLER_MATERIAL_CONSTANT, /* relative permittivity and conductivity given outright */
    KELLER_MATERIAL_CONDUCTOR /* perfect electric conductor */
} KellerMaterialKind;

typedef struct {
    char *name;               /* owned; UTF-8 */
    KellerMaterialKind kind;
    char itu[32];             /* kind ITU: the table's name, e.g. "concrete" */
    double permittivity;      /* kind CONSTANT: relative, real part, >= 1 */
    double conductivity;      /* kind CONSTANT: S/m, >= 0 */
    double thickness;         /* m, > 0: a slab in air; 0: a half-space (SPEC 6) */
} KellerMaterial;
#endif
