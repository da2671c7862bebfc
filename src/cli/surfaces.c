#include <math.h>
#include <stdio.h>
#include <string.h>
#include "cli/cli.h"

static void print_surface(const KellerConfig *config, const KellerReceiverSet *set)
{
    double low = INFINITY, high = -INFINITY;
    for (uint32_t i = 0; i < set->count; ++i) {
        double z = config->receivers[set->first + i].station.position.z;
        low = fmin(low, z);
        high = fmax(high, z);
    }
    char over[200] = "whatever is highest";
    if (set->surface_count > 0)
        snprintf(over, sizeof over, "%s \"%.100s\"", set->surfaces[0].is_object ? "object" : "material", set->surfaces[0].name);
    if (set->surface_count > 1) snprintf(over + strlen(over), 40, " and %zu more", set->surface_count - 1);
    if (low <= high) keller_row(set->id, "%g m over %s, z from %g to %g m", set->height, over, low, high);
    else keller_row(set->id, "%g m over %s, which is nowhere below", set->height, over);
    if (set->nowhere > 0) keller_row("", "%u of %u cells have no surface below them: NaN in the maps", set->nowhere, set->count);
}

void keller_print_surfaces(const KellerConfig *config)
{
    bool any = false;
    for (size_t s = 0; s < config->set_count; ++s) {
        if (!config->sets[s].draped) continue;
        if (!any) printf("maps over a surface\n");
        any = true;
        print_surface(config, &config->sets[s]);
    }
}
