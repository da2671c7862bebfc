/* Real scenes for tests: in $KELLER_SCENES, else ../shared/scenes beside the source. */
#ifndef KELLER_TESTS_REAL_SCENE_H
#define KELLER_TESTS_REAL_SCENE_H
#include <stdio.h>
#include <stdlib.h>
#include "keller/soup.h"

/* Reads the scene of that name, or skips the test where it is absent. Include after cmocka.h. */
static inline KellerSoup real_scene(const char *name)
{
    char path[2048];
    const char *scenes = getenv("KELLER_SCENES"), *source = getenv("KELLER_SOURCE");
    if (scenes && *scenes) snprintf(path, sizeof path, "%s/%s", scenes, name);
    else snprintf(path, sizeof path, "%s/../shared/scenes/%s", source ? source : ".", name);
    FILE *file = fopen(path, "r");
    if (!file) {
        print_message("# %s is absent: skipped (set KELLER_SCENES)\n", path);
        skip();
    } else {
        fclose(file);
    }
    KellerSoup soup;
    KellerError error;
    if (keller_soup_read(path, 1, &soup, &error) != KELLER_OK) fail_msg("%s", error.message);
    return soup;
}
#endif
