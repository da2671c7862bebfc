/* Which material each triangle ends up with. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

#include "keller/resolve.h"

/* A soup of one triangle an object; only what resolving looks at is filled. */
typedef struct {
    KellerSoup soup;
    uint32_t material[8], object[8];
    char *objects[8];
} Scene;

static KellerMaterial material(const char *name, KellerMaterialKind kind, const char *itu)
{
    KellerMaterial m = {.name = strdup(name), .kind = kind, .permittivity = kind == KELLER_MATERIAL_CONSTANT ? 3 : 0};
    assert_non_null(m.name);
    if (itu) strcpy(m.itu, itu);
    return m;
}

/* Objects: wall_1 (brick: named), wall_2 (mat-glass: ITU glass), roof (no material), box (brick), sign (mat-foo: an ITU
 * name that does not exist), door (tin: constants). */
static void make(Scene *s)
{
    static const char *const names[] = {"wall_1", "wall_2", "roof", "box", "sign", "door"};
    static const uint32_t materials[] = {2, 1, KELLER_NO_MATERIAL, 2, 0, 3};
    *s = (Scene){0};
    for (uint32_t i = 0; i < 6; i++) {
        s->objects[i] = strdup(names[i]);
        s->object[i] = i;
        s->material[i] = materials[i];
    }
    KellerMaterial *list = calloc(4, sizeof *list);
    assert_non_null(list);
    list[0] = material("mat-foo", KELLER_MATERIAL_ITU, "conrete");
    list[1] = material("mat-glass", KELLER_MATERIAL_ITU, "glass");
    list[2] = material("brick", KELLER_MATERIAL_NAMED, NULL);
    list[3] = material("tin", KELLER_MATERIAL_CONSTANT, NULL);
    s->soup = (KellerSoup){.triangle_count = 6,
                           .material = s->material,
                           .object = s->object,
                           .material_count = 4,
                           .materials = list,
                           .object_count = 6,
                           .objects = s->objects};
}

static void done(Scene *s)
{
    for (size_t i = 0; i < s->soup.material_count; i++) free(s->soup.materials[i].name);
    free(s->soup.materials);
    for (size_t i = 0; i < 6; i++) free(s->objects[i]);
}

static const KellerMaterial *of(const Scene *s, size_t triangle)
{
    assert_true(s->soup.material[triangle] < s->soup.material_count);
    return &s->soup.materials[s->soup.material[triangle]];
}

static char file[] = "c.xml", brick[] = "brick", spare[] = "spare", tin[] = "tin", wall[] = "wall", foo[] = "mat-foo";

static void test_order_of_rules(void **state)
{
    (void)state;
    /* two materials in use and one that is not, a default, an assignment to the scene's own glass */
    KellerMaterial materials[] = {
        {.name = wall, .kind = KELLER_MATERIAL_ITU, .itu = "concrete", .thickness = 0.3},
        {.name = spare, .kind = KELLER_MATERIAL_CONDUCTOR},
        {.name = tin, .kind = KELLER_MATERIAL_CONDUCTOR},
    };
    KellerAssignment assignments[] = {{(char[]){"box"}, (char[]){"mat-glass"}}};
    int lines[] = {10};
    KellerConfig config = {.file = file,
                           .scene_line = 3,
                           .material_count = 3,
                           .materials = materials,
                           .default_material = wall,
                           .default_material_line = 9,
                           .assignment_count = 1,
                           .assignments = assignments,
                           .assignment_lines = lines};
    Scene s;
    make(&s);
    KellerError error;
    if (keller_config_resolve(&config, &s.soup, &error) != KELLER_OK) fail_msg("%s", error.message);
    assert_string_equal(of(&s, 0)->name, "wall");      /* brick is only a name: default */
    assert_string_equal(of(&s, 1)->name, "mat-glass"); /* the scene says what it is */
    assert_string_equal(of(&s, 1)->itu, "glass");
    assert_string_equal(of(&s, 2)->name, "wall");      /* no material: default */
    assert_string_equal(of(&s, 3)->name, "mat-glass"); /* assigned */
    assert_string_equal(of(&s, 4)->name, "wall");      /* an ITU name that does not exist: default */
    assert_string_equal(of(&s, 5)->name, "tin");       /* the configuration's tin, not the scene's */
    assert_int_equal(of(&s, 5)->kind, KELLER_MATERIAL_CONDUCTOR);
    assert_true(of(&s, 0)->thickness == 0.3);
    /* one material for all that fell to the default; sorted by name; nothing unused, nothing of kind NAMED */
    assert_int_equal(s.soup.material_count, 3);
    assert_string_equal(s.soup.materials[0].name, "mat-glass");
    assert_string_equal(s.soup.materials[1].name, "tin");
    assert_string_equal(s.soup.materials[2].name, "wall");
    done(&s);
}

static void expect_refused(const KellerConfig *config, int line, const char *words, const char *more_words)
{
    Scene s;
    make(&s);
    KellerMaterial *before = s.soup.materials;
    KellerError error = {KELLER_OK, "(none)"};
    char start[32];
    snprintf(start, sizeof start, "c.xml:%d: ", line);
    KellerStatus status = keller_config_resolve(config, &s.soup, &error);
    if (status != KELLER_BAD_INPUT || strncmp(error.message, start, strlen(start)) != 0 ||
        !strstr(error.message, words) || !strstr(error.message, more_words))
        fail_msg("expected line %d, \"%s\" and \"%s\"; got %d: %s", line, words, more_words, status, error.message);
    /* the soup is as it was */
    assert_ptr_equal(s.soup.materials, before);
    assert_int_equal(s.soup.material_count, 4);
    assert_int_equal(s.soup.material[0], 2);
    assert_int_equal(s.soup.material[2], KELLER_NO_MATERIAL);
    done(&s);
}

static void test_refused(void **state)
{
    (void)state;
    KellerMaterial materials[] = {
        {.name = brick, .kind = KELLER_MATERIAL_ITU, .itu = "brick"},
        {.name = foo, .kind = KELLER_MATERIAL_CONDUCTOR},
    };
    KellerAssignment assignments[] = {{(char[]){"roof"}, (char[]){"brick"}}};
    int lines[] = {10};
    KellerConfig config = {.file = file,
                           .scene_line = 3,
                           .material_count = 0,
                           .materials = materials,
                           .default_material_line = 9,
                           .assignments = assignments,
                           .assignment_lines = lines};
    expect_refused(&config, 3, "object \"wall_1\" of the scene is of material \"brick\", which is not defined",
                   "<material name=\"brick\" .../> or <default-material");
    config.material_count = 1;
    expect_refused(&config, 3, "object \"roof\" of the scene has no material", "<assign object=\"roof\"");
    config.assignment_count = 1;
    expect_refused(&config, 3, "of object \"sign\" is the ITU-R P.2040 material \"conrete\"",
                   "did you mean \"concrete\"?");
    config.default_material = (char[]){"brik"};
    expect_refused(&config, 9, "<default-material> names material \"brik\"", "did you mean \"brick\"?");
    /* a material of the scene that does not say what it is cannot be the default */
    config.default_material = foo;
    expect_refused(&config, 9, "<default-material> names material \"mat-foo\"", "<material name=\"mat-foo\"");
    config.default_material = NULL;
    assignments[0].object = (char[]){"rof"};
    expect_refused(&config, 10, "<assign> names object \"rof\", which is not in the scene", "did you mean \"roof\"?");
    /* nothing is near: the names themselves */
    assignments[0].object = (char[]){"chimney"};
    expect_refused(&config, 10, "expected one of its 6 objects (wall_1, wall_2, roof, box, sign, door)", "chimney");
    assignments[0].object = (char[]){"roof"};
    assignments[0].material = (char[]){"bricks"};
    expect_refused(&config, 10, "<assign> names material \"bricks\"", "did you mean \"brick\"?");

    /* and with both defined, all is well without a default */
    assignments[0].material = brick;
    config.material_count = 2;
    Scene s;
    make(&s);
    KellerError error;
    if (keller_config_resolve(&config, &s.soup, &error) != KELLER_OK) fail_msg("%s", error.message);
    assert_int_equal(of(&s, 4)->kind, KELLER_MATERIAL_CONDUCTOR);
    done(&s);
}

/* A material that no triangle uses needs no definition; an empty scene needs none at all. */
static void test_unused(void **state)
{
    (void)state;
    KellerConfig config = {.file = file};
    Scene s;
    make(&s);
    KellerError error;
    s.soup.triangle_count = 2;
    s.material[0] = 3;
    if (keller_config_resolve(&config, &s.soup, &error) != KELLER_OK) fail_msg("%s", error.message);
    assert_int_equal(s.soup.material_count, 2);
    s.soup.triangle_count = 0;
    assert_int_equal(keller_config_resolve(&config, &s.soup, &error), KELLER_OK);
    assert_int_equal(s.soup.material_count, 0);
    done(&s);
    KellerSoup empty = {0};
    assert_int_equal(keller_config_resolve(&config, &empty, &error), KELLER_OK);
    free(empty.materials);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_order_of_rules),
        cmocka_unit_test(test_refused),
        cmocka_unit_test(test_unused),
    };
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
