/* What a material's name in a scene file says about it. */
#include <string.h>

#include "io/soup_build.h"
#include "io/text.h"
#include "keller/wave.h"

/* Behind `mat-` and `itu_` or `itu-`; NULL where the name is not of this kind. */
static const char *after_prefix(const char *name)
{
    if (strncmp(name, "mat-", 4) == 0) name += 4;
    if (strncmp(name, "itu_", 4) != 0 && strncmp(name, "itu-", 4) != 0) return NULL;
    return name[4] ? name + 4 : NULL;
}

bool keller_material_is_itu_name(const char *name) { return after_prefix(name) != NULL; }

/* The length without a suffix of digits such as .001. */
static size_t without_copy_number(const char *name)
{
    size_t length = strlen(name), end = length;
    while (end > 0 && name[end - 1] >= '0' && name[end - 1] <= '9') end--;
    return end < length && end > 1 && name[end - 1] == '.' ? end - 1 : length;
}

KellerStatus keller_material_itu(KellerPlace place, const char *x, char itu[32], KellerError *error)
{
    const char *name = after_prefix(x);
    if (!name) name = x;
    size_t length = without_copy_number(name);
    if (length < 32) {
        /* Files write very_dry_ground and very-dry-ground. */
        static const char swap[3][2] = {{'_', '_'}, {'_', '-'}, {'-', '_'}};
        for (int k = 0; k < 3; k++) {
            for (size_t i = 0; i < length; i++) itu[i] = name[i] == swap[k][0] ? swap[k][1] : name[i];
            itu[length] = '\0';
            if (keller_itu_known(itu)) return KELLER_OK;
        }
    }
    char list[500] = "";
    for (const char *const *known = keller_itu_names(); *known; known++) {
        if (strlen(list) + strlen(*known) + 3 > sizeof list) break;
        if (*list) strcat(list, ", ");
        strcat(list, *known);
    }
    return keller_bad(place, error, "material `%s` is not in the ITU-R P.2040 table; expected one of %s",
                      keller_token_quote((KellerToken){name, name + strlen(name)}).text, list);
}

KellerStatus keller_material_of_name(KellerPlace place, const char *name, KellerMaterial *material, KellerError *error)
{
    memset(material, 0, sizeof *material);
    material->name = (char *)(uintptr_t)name;
    material->kind = KELLER_MATERIAL_NAMED;
    if (!after_prefix(name)) return KELLER_OK;
    material->kind = KELLER_MATERIAL_ITU;
    return keller_material_itu(place, name, material->itu, error);
}
