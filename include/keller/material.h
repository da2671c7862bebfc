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
    KELLER_MATERIAL_LAYERS,   /* a slab of several layers in air */
    KELLER_MATERIAL_RIGID,    /* for sound: reflects all of it */
    KELLER_MATERIAL_ABSORPTION, /* for sound: an absorption coefficient at each band, the same at every angle */
    KELLER_MATERIAL_IMPEDANCE /* for sound: locally reacting, a specific normal impedance at each band */
} KellerMaterialKind;

/* What a surface scatters diffusely: the effective roughness model (Degli-Esposti, Fuschini, Vitucci and Falciasecca, IEEE Trans. AP-55
 * (2007) 143-153). All zero: nothing. */
typedef struct {
    double coefficient;       /* S, [0, 1]: S^2 of the power that the smooth surface reflects is scattered, 1 - S^2 is left to reflect */
    uint32_t lobe;            /* exponent of the lobe about the direction of reflection, alpha_R; 0: Lambert's law, and the next two
                                 do not count */
    uint32_t back_lobe;       /* exponent of the lobe back to the source, alpha_i, >= 1 where share < 1 */
    double share;             /* of the power in the lobe about the direction of reflection, Lambda, [0, 1]; the rest goes back */
    double cross;             /* share of the scattered power that changes its polarisation, [0, 1] */
} KellerScattering;

/* Exponents of lobes beyond this are as good as mirrors, and refused. */
enum { KELLER_MAX_LOBE = 1000 };

/* One layer of a slab. */
typedef struct {
    KellerMaterialKind kind;  /* ITU or CONSTANT */
    char itu[32];
    double permittivity, conductivity; /* as of a material */
    double thickness;         /* m, > 0 */
} KellerLayer;

enum { KELLER_MAX_LAYERS = 8, KELLER_MAX_BANDS = 64 };

typedef struct {
    char *name;               /* owned; UTF-8 */
    KellerMaterialKind kind;
    char itu[32];             /* kind ITU: the table's name, e.g. "concrete" */
    double permittivity;      /* kind CONSTANT: relative, real part, >= 1 */
    double conductivity;      /* kind CONSTANT: S/m, >= 0 */
    double thickness;         /* m, > 0: a slab in air; 0: a half-space (SPEC 6); kind LAYERS: of all layers together */
    double roughness;         /* m, rms height of the surface, >= 0 */
    KellerScattering diffuse; /* kinds for radio waves */
    uint32_t layer_count;     /* kind LAYERS: 1 to KELLER_MAX_LAYERS; waves meet layer 0 first, from whichever side */
    KellerLayer layers[KELLER_MAX_LAYERS];
    /* kinds ABSORPTION and IMPEDANCE: the values at frequencies (Hz) in rising order; between them linear in the logarithm of
     * the frequency, beyond them the nearest one. ABSORPTION: (alpha, 0), alpha in [0, 1]; IMPEDANCE: real and imaginary part over
     * rho c, real part >= 0, not both 0. */
    uint32_t band_count;
    double band[KELLER_MAX_BANDS], surface[KELLER_MAX_BANDS][2];
    double scattering;        /* kinds for sound: share of the reflected energy that leaves in other directions, [0, 1] */
} KellerMaterial;

/* True for the kinds that say what a surface does to sound, false for those that say it of radio waves. */
static inline bool keller_material_of_sound(KellerMaterialKind kind)
{
    return kind == KELLER_MATERIAL_RIGID || kind == KELLER_MATERIAL_ABSORPTION || kind == KELLER_MATERIAL_IMPEDANCE;
}

/* The air between surfaces, and rain in it. All zero: neither takes anything. */
typedef struct {
    bool gases;               /* absorption by oxygen and water vapour; the next three count */
    double temperature;       /* K */
    double pressure;          /* Pa, of dry air and vapour together */
    double vapour;            /* Pa, of water vapour */
    double rain;              /* m/s; 1 mm/h is 2.8e-7 */
} KellerAir;

/* How edges diffract sound. */
typedef enum {
    KELLER_EDGES_UTD,         /* the uniform theory, as for radio waves */
    KELLER_EDGES_BTM          /* Biot, Tolstoy and Medwin's exact solution by Svensson's line integral: rigid faces, one edge a path */
} KellerEdgeMethod;

/* The air that sound travels through. speed 0: the waves are radio waves, and nothing else here counts. */
typedef struct {
    double speed;             /* m/s */
    bool absorbs;             /* as ISO 9613-1 has it; the next three count */
    double temperature;       /* K */
    double pressure;          /* Pa */
    double humidity;          /* relative, 0 to 1 */
    KellerEdgeMethod edges;
} KellerSound;

/* How an edge between finitely conducting faces diffracts: which reflection coefficients go to which of the four terms of
 * the uniform theory (docs/theory.md; docs/accuracy.md has their errors). Perfect conductors need none. */
typedef enum {
    KELLER_WEDGE_RECIPROCAL, /* Holm's with a choice of terms and angles that does not change when the ends are exchanged */
    KELLER_WEDGE_LUEBBERS,   /* Luebbers, IEEE Trans. AP-32 (1984) 70-76, and ITU-R P.526 */
    KELLER_WEDGE_HOLM        /* Holm, IEEE Trans. AP-48 (2000) 1211-1219 */
} KellerWedgeModel;
#endif
