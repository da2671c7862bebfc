/* io/scene_write.h -- a scene as its file gives it, written to a file of another format. */
#ifndef KELLER_IO_SCENE_WRITE_H
#define KELLER_IO_SCENE_WRITE_H
#include <stdbool.h>
#include <stddef.h>
#include "keller/soup.h"

typedef enum {
    KELLER_WRITE_OBJ, /* a text: vertices to the last bit (17 digits), objects, names of materials */
    KELLER_WRITE_PLY, /* binary, little-endian: vertices to the last bit (double); no objects, no materials */
    KELLER_WRITE_STL  /* binary: corners in single precision, three a triangle; no objects, no materials */
} KellerWriteFormat;

/* By the file's extension, case ignored. False: it is none of .obj, .ply, .stl. */
bool keller_write_format(const char *file, KellerWriteFormat *format);

/* What a format could not hold. */
typedef struct {
    size_t objects, materials; /* lost: their names */
    size_t constants;          /* OBJ: materials whose name stays but says less than the scene did */
    size_t renamed;            /* OBJ: materials that got a `_` before their name, since it would say something else */
    double moved;              /* STL: m, the farthest that a corner was moved by rounding */
} KellerWriteLoss;

/* Writes the soup to `path`, an existing file that is filled from its start. Vertices, triangles and their corners keep
 * their order. `comment` (may be NULL, one line) goes into the file's header; `file` is the name for messages. The same
 * soup gives the same bytes; the locale does not matter.
 * Errors: KELLER_IO (cannot be written), KELLER_BAD_INPUT (STL: a coordinate beyond single precision). */
KellerStatus keller_scene_write(const KellerSoup *soup, KellerWriteFormat format, const char *path, const char *file,
                                const char *comment, KellerWriteLoss *loss, KellerError *error);
#endif
