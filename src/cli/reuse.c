#include "cli/reuse.h"

#include "cli/cli.h"

KellerStatus keller_reuse_open(const char *file, const KellerConfig *config, KellerReuse *reuse, KellerError *error)
{
    struct rlimit before;
    *reuse = (KellerReuse){.file = file};
    keller_limit_memory(file, &before);
    KellerStatus status = keller_reader_open(file, &reuse->reader, error);
    if (status == KELLER_OK) status = keller_geometry_check(reuse->reader, file, config, &reuse->dropped, error);
    keller_lift_memory_limit(&before);
    return status;
}

KellerStatus keller_reuse_start(KellerReuse *reuse, const KellerConfig *config, const KellerScene *scene, KellerPathSource *source,
                                KellerError *error)
{
    KellerStatus status = keller_geometry_check_scene(reuse->reader, reuse->file, config, scene, error);
    if (status == KELLER_OK) status = keller_known_open(reuse->reader, reuse->file, scene, &reuse->known, error);
    if (status == KELLER_OK) *source = keller_known_source(reuse->known);
    return status;
}

void keller_reuse_close(KellerReuse *reuse)
{
    keller_known_close(reuse->known);
    keller_reader_close(reuse->reader);
    *reuse = (KellerReuse){0};
}
