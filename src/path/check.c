/* Can this configuration be simulated in this scene? */
#include <stdlib.h>

#include "path/field.h"
#include "path/internal.h"

uint32_t path_longest_sequence(const KellerConfig *config)
{
    const uint32_t asked = config->reflections + config->diffractions;
    return asked < config->interactions ? asked : config->interactions;
}

KellerStatus keller_simulation_check(const KellerConfig *config, const KellerScene *scene, KellerError *error)
{
    const char *file = config->file;
    int line = config->paths_line;
    if (config->interactions > KELLER_MAX_INTERACTIONS)
        return keller_error(error, KELLER_BAD_INPUT, "%s:%d: interactions=\"%u\" is too many; expected at most %d", file,
                            line, config->interactions, KELLER_MAX_INTERACTIONS);
    uint32_t bends = path_longest_sequence(config);
    if (bends > KELLER_MAX_BENDS)
        return keller_error(error, KELLER_BAD_INPUT,
                            "%s:%d: up to %u reflections and diffractions on one path are too many; expected at most %d, or "
                            "interactions=\"...\" to bound them",
                            file, line, bends, KELLER_MAX_BENDS);
    if (scene->sound.speed > 0 && path_sound_check(config, scene, error) != KELLER_OK) return KELLER_BAD_INPUT;
    for (size_t f = 0; f < config->frequency_count; f++) {
        KellerMedium *media;
        KellerError inner;
        KellerStatus status = keller_media_table(scene, 1, &config->frequencies[f], &media, &inner);
        if (status != KELLER_OK)
            return keller_error(error, status, "%s:%d: %s", file,
                                config->frequency_lines ? config->frequency_lines[f] : 0, inner.message);
        free(media);
    }
    return KELLER_OK;
}
