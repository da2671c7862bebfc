#include <stdlib.h>

#include "io/config_read.h"
#include "io/xml.h"

static KellerStatus read_name(const KellerConfigReader *reader, const xmlNode *node, KellerSurfaceName *surface)
{
    *surface = (KellerSurfaceName){.is_object = keller_config_attribute(node, "object"), .line = keller_xml_line(node)};
    return keller_config_name(reader, node, surface->is_object ? "object" : "material", &surface->name);
}

KellerStatus keller_config_read_over(const KellerConfigReader *reader, const xmlNode *node, KellerReceiverSet *set)
{
    static const KellerConfigRange range = {1e-3, KELLER_MAX_COORDINATE, "a height from 1 mm to 1e6 km over the surface"};
    const xmlNode *first = keller_config_child(node, "over");
    set->draped = keller_config_attribute(node, "height");
    if (!set->draped && first)
        return keller_config_fail(reader, first, "<over> in a grid at one z; expected height=\"...\" in place of z, or no <over>");
    if (!set->draped) return KELLER_OK;
    size_t capacity = 0;
    KellerStatus status = keller_config_quantity(reader, node, "height", "length", &range, &set->height);
    for (const xmlNode *child = first; child && status == KELLER_OK; child = child->next) {
        if (!keller_config_is(child, "over")) continue;
        if (!keller_config_grow((void **)&set->surfaces, &capacity, set->surface_count, 1, sizeof *set->surfaces))
            return keller_error_memory(reader->error, sizeof *set->surfaces);
        status = read_name(reader, child, &set->surfaces[set->surface_count]);
        set->surface_count += status == KELLER_OK;
    }
    return status;
}
