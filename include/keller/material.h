/* keller/material.h -- what a surface is made of, as a configuration or a scene file says it.
 * The constants at a frequency come from keller/wave.h. */
#ifndef KELLER_MATERIAL_H
#define KELLER_MATERIAL_H
#include <stdbool.h>
#include <stdint.h>

typedef enum {
    KELLER_MATERIAL_NAMED,    /* only a name so far: to be found in the configuration, or the default material */
    KELLER_MATERIAL_ITU,      /* a row of ITU-R P.2040-4, by name */
    KELLER_MATERIAL_CONSTANT, /* relative permittivity and conductivity given outright */
    KELLER_MATERIAL_CONDUCTOR, /* perfect electric conductor */
    KELLER_MATERIAL_LAYERS    /* a slab of several layers in air */
} KellerMaterialKind;

/* One layer of a slab. */
typedef struct {
    KellerMaterialKind kind;  /* ITU or CONSTANT */
    char itu[32];
    double permittivity, conductivity; /* as of a material */
    double thickness;         /* m, > 0 */
} KellerLayer;

enum { KELLER_MAX_LAYERS = 8 };

typedef struct {
    char *name;               /* owned; UTF-8 */
    KellerMaterialKind kind;
    char itu[32];             /* kind ITU: the table's name, e.g. "concrete" */
    double permittivity;      /* kind CONSTANT: relative, real part, >= 1 */
    double conductivity;      /* kind CONSTANT: S/m, >= 0 */
    double thickness;         /* m, > 0: a slab in air; 0: a half-space (SPEC 6); kind LAYERS: of all layers together */
    double roughness;         /* m, rms height of the surface, >= 0 */
    uint32_t layer_count;     /* kind LAYERS: 1 to KELLER_MAX_LAYERS; waves meet layer 0 first, from whichever side */
    KellerLayer layers[KELLER_MAX_LAYERS];
} KellerMaterial;

/* The air between surfaces, and rain in it. All zero: neither takes anything. */
typedef struct {
    bool gases;               /* absorption by oxygen and water vapour; the next three count */
    double temperature;       /* K */
    double pressure;          /* Pa, of dry air and vapour together */
    double vapour;            /* Pa, of water vapour */
    double rain;              /* m/s; 1 mm/h is 2.8e-7 */
} KellerAir;

/* How an edge between finitely conducting faces diffracts: which reflection coefficients go to which of the four terms of
 * the uniform theory (docs/theory.md; docs/accuracy.md has their errors). Perfect conductors need none. */
typedef enum {
    KELLER_WEDGE_RECIPROCAL, /* Holm's with a choice of terms and angles that does not change when the ends are exchanged */
    KELLER_WEDGE_LUEBBERS,   /* Luebbers, IEEE Trans. AP-32 (1984) 70-76, and ITU-R P.526 */
    KELLER_WEDGE_HOLM        /* Holm, IEEE Trans. AP-48 (2000) 1211-1219 */
} KellerWedgeModel;
#endif
