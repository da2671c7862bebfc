/* io/result_sums.h -- sums over the paths of a pair in the result file: maps of grids, and rows of /pairs. */
#ifndef KELLER_IO_RESULT_SUMS_H
#define KELLER_IO_RESULT_SUMS_H
#include "io/hdf.h"
#include "keller/path.h"

/* A map of /coverage/ID. */
typedef struct {
    const char *name, *unit;
    bool by_frequency;          /* f8[T,F,ny,nx], else f8[T,ny,nx] */
    bool sound;                 /* only with domain "acoustic" */
} KellerMapKind;
enum { KELLER_MAP_KINDS = 6 + KELLER_ANGLES };
extern const KellerMapKind keller_map_kinds[KELLER_MAP_KINDS];
/* "departure_azimuth_spread" and so on: the name of an angle's spread in /coverage/ID and /pairs. */
extern const char *const keller_spread_names[KELLER_ANGLES];

/* The maps of one grid; -1 where the set is none, or where the domain has no such map. */
typedef struct {
    hid_t dataset[KELLER_MAP_KINDS];
} KellerMaps;

/* The group of one grid: axes, and maps filled with NaN. KELLER_FAILED: memory. */
KellerStatus keller_maps_create(KellerHdf *hdf, const KellerConfig *config, const KellerReceiverSet *set, KellerMaps *maps,
                                KellerError *error);
void keller_maps_write(KellerHdf *hdf, const KellerMaps *maps, const KellerCoverage *coverage);
void keller_maps_close(const KellerMaps *maps);

typedef struct {
    KellerColumn tx, rx, paths, path_gain, path_gain_incoherent, delay_spread, strongest_delay, spread[KELLER_ANGLES];
} KellerPairColumns;

/* Closed columns, which keller_pairs_close leaves alone. */
void keller_pairs_none(KellerPairColumns *columns);
void keller_pairs_open(KellerHdf *hdf, KellerPairColumns *columns, size_t frequency_count);
void keller_pairs_append(KellerHdf *hdf, KellerPairColumns *columns, const KellerPairSums *sums);
void keller_pairs_close(KellerHdf *hdf, KellerPairColumns *columns);
#endif
