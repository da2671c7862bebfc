/* A quick look at a candidate before its exact solution: most are no paths, and most of those for one plain reason. */
#ifndef KELLER_PATH_SIEVE_H
#define KELLER_PATH_SIEVE_H
#include "path/internal.h"

typedef struct {
    KellerVec3 lower, upper;    /* m */
} FaceBox;

/* The boxes of a scene's faces, [face_count]; NULL: out of memory. Free with free(). */
FaceBox *face_boxes(const KellerScene *scene);

/* One sequence from one transmitter, for many receivers: where its mirror images are. */
typedef struct {
    const KellerScene *scene;
    const FaceBox *boxes;
    uint32_t count, wedge;      /* steps; place of the only diffraction, or count */
    KellerStep step[KELLER_MAX_BENDS];
    KellerVec3 image[KELLER_MAX_BENDS + 1]; /* the transmitter mirrored in all faces before step i, up to the wedge */
    double rounding;            /* m */
    double lit[2];              /* m: part of the edge in which the path can meet it */
    double z, rho;              /* m: of the last image, along the edge and away from its line */
} Sieve;

/* False if the sequence is no path for any receiver. Sequences of two diffractions or more are not sifted: then *useful is
 * false. lit: as above, NULL for the whole edge. */
bool sieve_make(Sieve *sieve, const KellerScene *scene, const FaceBox *boxes, KellerVec3 tx, uint32_t count,
                const KellerStep *steps, const double lit[2], bool *useful);

/* False only if there is surely no path of this sequence to rx: a point of it outside its face's box, or off the edge. With a
 * diffraction *place (may be NULL) is where on the edge, m. */
bool sieve_passes(const Sieve *sieve, KellerVec3 rx, double *place);
#endif
