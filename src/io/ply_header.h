/* io/ply_header.h -- the header of a PLY file. */
#ifndef KELLER_IO_PLY_HEADER_H
#define KELLER_IO_PLY_HEADER_H
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include "io/soup_build.h"
#include "io/text.h"

typedef enum {
    KELLER_PLY_INT8, KELLER_PLY_UINT8, KELLER_PLY_INT16, KELLER_PLY_UINT16, KELLER_PLY_INT32, KELLER_PLY_UINT32,
    KELLER_PLY_FLOAT32, KELLER_PLY_FLOAT64
} KellerPlyType;
size_t keller_ply_size(KellerPlyType type);

/* What a property is to us. */
typedef enum { KELLER_PLY_UNUSED, KELLER_PLY_X, KELLER_PLY_Y, KELLER_PLY_Z, KELLER_PLY_CORNERS } KellerPlyRole;

typedef struct {
    KellerPlyRole role;
    bool list;
    KellerPlyType count_type, type;
} KellerPlyProperty;

typedef enum { KELLER_PLY_OTHER, KELLER_PLY_VERTEX, KELLER_PLY_FACE } KellerPlyKind;

typedef struct {
    KellerPlyKind kind;
    KellerToken name;
    unsigned long line;
    uint64_t count;
    KellerPlyProperty *properties;
    size_t property_count, property_capacity;
} KellerPlyElement;

typedef struct {
    enum { KELLER_PLY_ASCII, KELLER_PLY_LITTLE, KELLER_PLY_BIG } format;
    KellerPlyElement *elements;
    size_t element_count, element_capacity;
    uint64_t vertices;             /* of the vertex element */
} KellerPlyHeader;

/* Reads the header at the text's start and leaves the cursor at the first byte of the body. On success the vertex element
 * has x, y, z, each scalar, a face element with entries has its list of corners, and the elements fit into what is left
 * of the file. keller_ply_header_free frees what *header owns, after a failure as well. */
KellerStatus keller_ply_header_read(KellerText *text, KellerPlyHeader *header, KellerError *error);
void keller_ply_header_free(KellerPlyHeader *header);
#endif
