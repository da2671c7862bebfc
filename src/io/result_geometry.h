/* io/result_geometry.h -- what decides which paths there are, as a result file holds it: whoever computes the fields of its paths
 * anew must have the same. */
#ifndef KELLER_IO_RESULT_GEOMETRY_H
#define KELLER_IO_RESULT_GEOMETRY_H
#include "io/hdf.h"
#include "io/result_read.h"
#include "keller/config.h"
#include "keller/scene.h"

/* Writes /geometry: a digest of the scene's model, of each face whether it lets waves through and scatters, orders. KELLER_FAILED:
 * memory. */
KellerStatus keller_result_geometry(KellerHdf *hdf, const KellerConfig *config, const KellerScene *scene, KellerError *error);

/* What the dynamic range had cost a result, and those it was made of. */
typedef struct {
    double paths;               /* how many were dropped */
    double ratio;               /* of a pair's dropped ones the sum of |gain| over its strongest, at most */
} KellerDropped;

/* Do the paths of `file` serve this configuration: of the same domain, orders, patches, kind of edges, stations in the same places? And
 * was nothing dropped that its dynamic range asks for? KELLER_BAD_INPUT: FILE:LINE of the configuration and what differs, or what the
 * result lacks. */
KellerStatus keller_geometry_check(KellerReader *reader, const char *file, const KellerConfig *config, KellerDropped *dropped,
                                   KellerError *error);
/* And this scene, built for the configuration? KELLER_BAD_INPUT likewise. */
KellerStatus keller_geometry_check_scene(KellerReader *reader, const char *file, const KellerConfig *config, const KellerScene *scene,
                                         KellerError *error);
#endif
