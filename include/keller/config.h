/* keller/config.h -- a simulation configuration, read, substituted, validated, in SI units. */
#ifndef KELLER_CONFIG_H
#define KELLER_CONFIG_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "keller/error.h"
#include "keller/geo.h"
#include "keller/material.h"
#include "keller/sound.h"
#include "keller/vec.h"
#include "keller/wave.h"

typedef struct {
    KellerVec3 position;        /* m, local frame */
    KellerAntenna antenna;      /* radio */
    KellerDirectivity directivity; /* sound */
    double orientation[3];      /* yaw, pitch, roll in radians */
    KellerVec3 velocity;        /* m/s */
} KellerStation;

typedef struct {
    char *id;
    int line;                   /* of its element, for messages */
    KellerStation station;
    double power;               /* W; of sound: of all frequencies together */
    double *level;              /* sound: [frequency_count] dB re 20 uPa, free-field level at 1 m on the source's axis; radio: NULL */
} KellerTransmitter;

typedef enum { KELLER_SET_POINT, KELLER_SET_ROUTE, KELLER_SET_GRID } KellerSetKind;

/* What a grid counts as the surface that it lies over: an object of the scene or a material. */
typedef struct {
    char *name;
    bool is_object;
    int line;                   /* for messages */
} KellerSurfaceName;

/* A named set of receivers: one point, a route from a file, or a grid (row y by row y, x fastest). */
typedef struct {
    char *id;
    KellerSetKind kind;
    uint32_t ny, nx;            /* grid only, else 0 */
    uint32_t first, count;      /* range in receivers */
    double x0, y0, z, step;     /* grid only: centre of the first cell, height, spacing; m */
    bool draped;                /* grid only: each cell lies `height` over the scene's surface at its x, y; z is NaN, and so is that of
                                   all its receivers until keller_config_drape has seen the scene */
    double height;              /* m */
    size_t surface_count;
    KellerSurfaceName *surfaces; /* what counts as surface; none: everything */
    uint32_t nowhere;           /* cells without a surface, by keller_config_drape */
    char *file;                 /* route only: the path of its file, else NULL */
    int line;                   /* of its element, for messages */
} KellerReceiverSet;

typedef struct {
    uint32_t set, index;        /* index within the set */
    KellerStation station;
} KellerReceiver;

typedef struct {
    char *file;                 /* path, resolved against the configuration's folder */
    KellerAntennaCuts *cuts;    /* owned; stations point here */
} KellerAntennaFile;

typedef struct {
    char *object, *material;
} KellerAssignment;

typedef struct {
    char *name, *value;
} KellerVariable;

typedef struct {
    char *file;                 /* path of the configuration */
    int line;                   /* of <simulation>, for messages */
    char *text;                 /* the XML as run, variables substituted; NUL-terminated */
    char sha256[65];            /* of text, lower-case hex */
    char *scene_file;           /* resolved against the configuration's folder */
    int scene_line;             /* line of <scene>, for messages */
    double scene_scale;
    bool has_origin;
    KellerGeodetic origin;
    size_t frequency_count;
    double *frequencies;        /* Hz, as given, each > 0 */
    int *frequency_lines;       /* NULL where the configuration was not read from a file */
    KellerAir air;
    KellerSound sound;          /* speed 0: domain rf */
    uint32_t bands_per_octave;  /* sound: 1 or 3, the frequencies are the middles of bands; 0: pure tones */
    size_t material_count;
    KellerMaterial *materials;
    int *material_lines;
    char *default_material;     /* name, or NULL */
    int default_material_line;
    size_t assignment_count;
    KellerAssignment *assignments;
    int *assignment_lines;
    size_t antenna_count;
    KellerAntennaFile *antennas; /* each file once */
    size_t array_count;
    KellerArrayElement **arrays; /* elements of each array; stations point here */
    size_t transmitter_count;
    KellerTransmitter *transmitters;
    size_t set_count;
    KellerReceiverSet *sets;
    size_t receiver_count;
    KellerReceiver *receivers;
    uint32_t reflections, diffractions, transmissions, interactions;
    uint32_t scattering;        /* 0 or 1: of a path, by a patch of a face whose material scatters diffusely */
    uint32_t with_scattering;   /* most reflections and diffractions together on a path that is scattered, < KELLER_MAX_BENDS */
    double patch;               /* m, > 0: the longest side of such patches */
    int paths_line;             /* line of <paths> */
    double dynamic_range;       /* dB, > 0 */
    KellerWedgeModel wedge_model; /* the caller puts it, air, sound and transmissions into the scene that is simulated */
    char accelerator[32];       /* "auto", "bvh", ... */
    double cone;                /* half-angle of the launched cones, radians, (0, pi/4] */
    uint32_t threads;           /* 0: all */
    uint32_t split_over;        /* cones that meet more faces and wedges than this are split; 0: chosen by the search. Changes
                                   the speed, never the paths; not in the XML */
    double response_rate;       /* sound: Hz, of the impulse responses at points; 0: none are asked for */
    double response_duration;   /* s */
    double response_volume;     /* m^3, of the room: a diffuse tail completes the responses; 0: none is asked for */
    bool output_paths, output_coverage, output_scene;
} KellerConfig;

/* Receivers in one configuration, all sets together. */
#define KELLER_MAX_RECEIVERS 10000000u

/* Reads and validates `file`. `variables` (count of them, names without `$`) replace $NAME in attribute values and text.
 * On success *config is owned by the caller (keller_config_free).
 * Errors: KELLER_IO (cannot open), KELLER_BAD_INPUT with FILE:LINE. */
KellerStatus keller_config_read(const char *file, size_t variable_count, const KellerVariable *variables,
                                KellerConfig *config, KellerError *error);
/* Frees what *config owns and empties it. */
void keller_config_free(KellerConfig *config);

/* A quantity with its unit, e.g. "3.5 GHz" with kind "frequency"; SI value in *value. The whole text must be used.
 * Kinds: length (m), angle (rad), frequency (Hz), speed (m/s), power (W), conductivity (S/m), ratio (dB), and what else
 * config.c needs. Returns NULL on success, else a static text that says what was expected ("a length with its unit, such
 * as \"2.5 m\""). */
const char *keller_parse_quantity(const char *text, const char *kind, double *value);
#endif
