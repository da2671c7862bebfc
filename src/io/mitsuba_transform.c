#include "io/mitsuba.h"

#include <stdlib.h>
#include <string.h>

#include "io/text.h"

static const KellerTransform identity = {{{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}}};

KellerVec3 keller_transform_point(const KellerTransform *t, KellerVec3 p)
{
    const double(*m)[4] = t->m;
    return v3(m[0][0] * p.x + m[0][1] * p.y + m[0][2] * p.z + m[0][3],
              m[1][0] * p.x + m[1][1] * p.y + m[1][2] * p.z + m[1][3],
              m[2][0] * p.x + m[2][1] * p.y + m[2][2] * p.z + m[2][3]);
}

/* a after b. */
static KellerTransform compose(const KellerTransform *a, const KellerTransform *b)
{
    KellerTransform c;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++)
            c.m[i][j] = a->m[i][0] * b->m[0][j] + a->m[i][1] * b->m[1][j] + a->m[i][2] * b->m[2][j] + (j == 3 ? a->m[i][3] : 0);
    return c;
}

/* The numbers of an attribute, separated by blanks or commas; *count is their number (0: no such attribute). */
static KellerStatus numbers(const KellerMitsuba *scene, xmlNodePtr node, const char *name, double *values, size_t most,
                            size_t *count, KellerError *error)
{
    char *text;
    *count = 0;
    KellerStatus status = keller_mitsuba_attribute(scene, node, name, &text, error);
    if (status != KELLER_OK || !text) return status;
    const char *p = text, *end = text + strlen(text);
    for (;;) {
        p += strspn(p, " \t\r\n,");
        if (p == end) break;
        const char *from = p;
        size_t length = strcspn(p, " \t\r\n,");
        if (*count < most && keller_text_double(&p, end, &values[*count]) && p == from + length) {
            ++*count;
            continue;
        }
        status = keller_bad(keller_mitsuba_place(node), error, "%s of <%s> has `%s`; expected %zu finite number%s", name,
                            node->name, keller_token_quote((KellerToken){from, from + length}).text, most, most == 1 ? "" : "s");
        break;
    }
    if (status == KELLER_OK && !*count)
        status = keller_bad(keller_mitsuba_place(node), error, "%s of <%s> is empty; expected %zu number%s", name, node->name,
                            most, most == 1 ? "" : "s");
    free(text);
    return status;
}

/* A vector as value="x y z" (also "s" where `one` allows it) or as attributes x, y, z, each `otherwise` where absent. */
static KellerStatus vector(const KellerMitsuba *scene, xmlNodePtr node, bool one, double otherwise, double v[3],
                           KellerError *error)
{
    size_t count;
    KellerStatus status = numbers(scene, node, "value", v, 3, &count, error);
    if (status != KELLER_OK || count == 3) return status;
    if (count == 1 && one) {
        v[1] = v[2] = v[0];
        return KELLER_OK;
    }
    if (count)
        return keller_bad(keller_mitsuba_place(node), error, "value of <%s> has %zu numbers; expected %s3", node->name, count,
                          one ? "1 or " : "");
    static const char *const names[] = {"x", "y", "z"};
    for (int i = 0; i < 3; i++) {
        v[i] = otherwise;
        status = numbers(scene, node, names[i], &v[i], 1, &count, error);
        if (status != KELLER_OK) return status;
    }
    return KELLER_OK;
}

static KellerStatus rotation(const KellerMitsuba *scene, xmlNodePtr node, KellerTransform *t, KellerError *error)
{
    double axis[3], angle;
    size_t count;
    KellerStatus status = vector(scene, node, false, 0, axis, error);
    if (status == KELLER_OK) status = numbers(scene, node, "angle", &angle, 1, &count, error);
    if (status != KELLER_OK) return status;
    if (!count) return keller_bad(keller_mitsuba_place(node), error, "<rotate> has no angle; expected one, in degrees");
    KellerVec3 u = v3_unit(v3(axis[0], axis[1], axis[2]));
    if (!(fabs(v3_norm(u) - 1) < 1e-6))
        return keller_bad(keller_mitsuba_place(node), error, "the axis of <rotate> is (%g, %g, %g); expected one with a length",
                          axis[0], axis[1], axis[2]);
    /* Right angles exactly: what stands upright in the file has to stay so. */
    angle = fmod(angle, 360);
    double quarter = fmod(angle + 360, 360) / 90, c, s;
    if (quarter == floor(quarter)) {
        c = quarter == 0 ? 1 : quarter == 2 ? -1 : 0;
        s = quarter == 1 ? 1 : quarter == 3 ? -1 : 0;
    } else {
        c = cos(angle * (M_PI / 180));
        s = sin(angle * (M_PI / 180));
    }
    double x = u.x, y = u.y, z = u.z, d = 1 - c; /* Rodrigues */
    *t = (KellerTransform){{{x * x * d + c, x * y * d - z * s, x * z * d + y * s, 0},
                            {y * x * d + z * s, y * y * d + c, y * z * d - x * s, 0},
                            {z * x * d - y * s, z * y * d + x * s, z * z * d + c, 0}}};
    return KELLER_OK;
}

/* 16 numbers row by row, or the 9 of a linear map. */
static KellerStatus matrix(const KellerMitsuba *scene, xmlNodePtr node, KellerTransform *t, KellerError *error)
{
    double m[16];
    size_t count;
    KellerStatus status = numbers(scene, node, "value", m, 16, &count, error);
    if (status != KELLER_OK) return status;
    if (count != 16 && count != 9)
        return keller_bad(keller_mitsuba_place(node), error, "<matrix> has %zu numbers; expected 16, row by row", count);
    if (count == 16 && (m[12] != 0 || m[13] != 0 || m[14] != 0 || m[15] != 1))
        return keller_bad(keller_mitsuba_place(node), error, "the last row of <matrix> is %g %g %g %g; expected 0 0 0 1", m[12],
                          m[13], m[14], m[15]);
    size_t columns = count == 16 ? 4 : 3;
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 4; j++) t->m[i][j] = j < columns ? m[i * columns + j] : 0;
    return KELLER_OK;
}

/* The camera's frame: z towards the target, y upwards, x to the left. */
static KellerStatus look_at(const KellerMitsuba *scene, xmlNodePtr node, KellerTransform *t, KellerError *error)
{
    static const char *const names[] = {"origin", "target", "up"};
    double v[3][3];
    for (int i = 0; i < 3; i++) {
        size_t count;
        KellerStatus status = numbers(scene, node, names[i], v[i], 3, &count, error);
        if (status != KELLER_OK) return status;
        if (count != 3)
            return keller_bad(keller_mitsuba_place(node), error, "%s of <%s> has %zu numbers; expected 3", names[i], node->name,
                              count);
    }
    KellerVec3 origin = v3(v[0][0], v[0][1], v[0][2]), target = v3(v[1][0], v[1][1], v[1][2]);
    KellerVec3 z = v3_unit(v3_sub(target, origin)), x = v3_unit(v3_cross(v3(v[2][0], v[2][1], v[2][2]), z));
    if (!(v3_norm(x) > 0.5))
        return keller_bad(keller_mitsuba_place(node), error, "<%s> looks along `up` or nowhere; expected three points that give "
                          "a frame", node->name);
    KellerVec3 y = v3_cross(z, x);
    *t = (KellerTransform){{{x.x, y.x, z.x, origin.x}, {x.y, y.y, z.y, origin.y}, {x.z, y.z, z.z, origin.z}}};
    return KELLER_OK;
}

static KellerStatus step(const KellerMitsuba *scene, xmlNodePtr node, KellerTransform *t, KellerError *error)
{
    double v[3];
    KellerStatus status;
    *t = identity;
    if (keller_mitsuba_is(node, "translate")) {
        status = vector(scene, node, false, 0, v, error);
        for (int i = 0; i < 3 && status == KELLER_OK; i++) t->m[i][3] = v[i];
        return status;
    }
    if (keller_mitsuba_is(node, "scale")) {
        status = vector(scene, node, true, 1, v, error);
        for (int i = 0; i < 3 && status == KELLER_OK; i++) t->m[i][i] = v[i];
        return status;
    }
    if (keller_mitsuba_is(node, "rotate")) return rotation(scene, node, t, error);
    if (keller_mitsuba_is(node, "matrix")) return matrix(scene, node, t, error);
    if (keller_mitsuba_is(node, "lookat") || keller_mitsuba_is(node, "lookAt") || keller_mitsuba_is(node, "look_at"))
        return look_at(scene, node, t, error);
    return keller_bad(keller_mitsuba_place(node), error, "<%.100s> in a transform; expected translate, rotate, scale, matrix or "
                      "lookat", node->name);
}

KellerStatus keller_mitsuba_transform(const KellerMitsuba *scene, xmlNodePtr node, KellerTransform *transform,
                                      KellerError *error)
{
    *transform = identity;
    for (xmlNodePtr child = keller_mitsuba_element(node->children); child; child = keller_mitsuba_element(child->next)) {
        KellerTransform t;
        KellerStatus status = step(scene, child, &t, error);
        if (status != KELLER_OK) return status;
        *transform = compose(&t, transform);
    }
    return KELLER_OK;
}
