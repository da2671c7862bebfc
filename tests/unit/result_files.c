#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <dirent.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>
#include "result_files.h"

char result_folder[] = "/tmp/keller-result-XXXXXX", result_target[200];

void result_world(World *w)
{
    memset(w, 0, sizeof *w);
    w->frequencies[0] = 3.5e9;
    w->frequencies[1] = 28e9;
    for (int t = 0; t < TRANSMITTERS; ++t)
        w->transmitters[t] = (KellerTransmitter){
            .id = t ? "tx\xc3\xa9" : "tx1", .power = 0.5 + t,
            .station = {.position = v3(t, 2, 10), .orientation = {0.1, 0.2, 0.3}, .velocity = v3(1, 0, 0)}};
    w->sets[0] = (KellerReceiverSet){.id = "rx1", .kind = KELLER_SET_POINT, .first = 0, .count = 1};
    w->sets[1] = (KellerReceiverSet){.id = "street", .kind = KELLER_SET_GRID, .ny = GRID_NY, .nx = GRID_NX, .first = 1,
                                     .count = GRID_NY * GRID_NX, .x0 = -1, .y0 = 5, .z = 1.5, .step = 0.5};
    w->receivers[0] = (KellerReceiver){.set = 0, .index = 0, .station.position = v3(40, 3, 1.5)};
    for (uint32_t i = 0; i < GRID_NY * GRID_NX; ++i)
        w->receivers[1 + i] = (KellerReceiver){.set = 1, .index = i,
            .station.position = v3(-1 + 0.5 * (i % GRID_NX), 5 + 0.5 * (i / GRID_NX), 1.5)};
    w->config = (KellerConfig){
        .file = "test.xml", .text = "<simulation/>", .frequency_count = FREQUENCIES, .frequencies = w->frequencies,
        .transmitter_count = TRANSMITTERS, .transmitters = w->transmitters, .set_count = 2, .sets = w->sets,
        .receiver_count = RECEIVERS, .receivers = w->receivers,
        .output_paths = true, .output_coverage = true, .output_scene = true};
    memset(w->config.sha256, 'a', 64);
    for (int i = 0; i < 4; ++i) w->vertices[i] = v3(i, i * i, 0.1 * i);
    memcpy(w->triangles, (uint32_t[2][3]){{0, 1, 2}, {1, 2, 3}}, sizeof w->triangles);
    w->face[1] = 1;
    w->sheets[0] = w->sheets[1] = 1;
    w->source[0] = 1;
    w->object[1] = 1;
    w->faces[1].material = 1;
    w->wedges[0] = (KellerWedge){.vertex = {1, 2}, .face = {0, 1}, .n = 1.5};
    w->materials[0] = (KellerMaterial){.name = "wall", .kind = KELLER_MATERIAL_CONSTANT, .permittivity = 5,
                                       .conductivity = 0.25, .thickness = 0.3};
    w->materials[1] = (KellerMaterial){.name = "steel", .kind = KELLER_MATERIAL_CONDUCTOR};
    w->objects[0] = "ground";
    w->objects[1] = "building";
    w->scene = (KellerScene){
        .vertex_count = 4, .vertices = w->vertices, .triangle_count = 2, .triangles = w->triangles,
        .triangle_face = w->face, .triangle_object = w->object, .triangle_source = w->source, .triangle_sheets = w->sheets, .face_count = 2,
        .faces = w->faces, .wedge_count = 1, .wedges = w->wedges, .material_count = 2, .materials = w->materials,
        .object_count = 2, .objects = w->objects};
}

/* clang lacks CMPLX with these headers; for finite parts the sum is exact. */
static double complex complex_of(double re, double im) { return re + I * im; }

double result_value(uint64_t p, unsigned what) { return (double)(p + 1) / 3 + what * 1000 + 1e-9; }

KellerStatus result_append(KellerResult *result, uint64_t first, size_t count, KellerError *error)
{
    enum { MOST = 64 };
    static uint32_t tx[MOST], rx[MOST], triangle[2 * MOST], wedge[2 * MOST];
    static uint64_t offset[MOST + 1];
    static double length[MOST], delay[MOST], departure[MOST][2], arrival[MOST][2], doppler[MOST * FREQUENCIES];
    static double complex gain[MOST * FREQUENCIES], transfer[MOST * FREQUENCIES * 4];
    static uint8_t kind[2 * MOST], free_end[2 * MOST];
    static double weight[MOST], patch[MOST], part[MOST][2];
    static KellerVec3 position[2 * MOST];
    size_t interactions = 0;
    assert_true(count <= MOST);
    for (size_t i = 0; i < count; ++i) {
        uint64_t p = first + i;
        tx[i] = (uint32_t)(p % TRANSMITTERS);
        rx[i] = (uint32_t)(p % RECEIVERS);
        offset[i] = interactions;
        length[i] = result_value(p, 0);
        weight[i] = result_value(p, 40);
        patch[i] = result_value(p, 41);
        part[i][0] = result_value(p, 42);
        part[i][1] = result_value(p, 43);
        delay[i] = result_value(p, 1);
        for (unsigned k = 0; k < 2; ++k) {
            departure[i][k] = result_value(p, 2 + k);
            arrival[i][k] = result_value(p, 4 + k);
        }
        for (unsigned f = 0; f < FREQUENCIES; ++f) {
            doppler[i * FREQUENCIES + f] = result_value(p, 6 + f);
            gain[i * FREQUENCIES + f] = complex_of(result_value(p, 8 + f), -result_value(p, 10 + f));
            for (unsigned k = 0; k < 4; ++k)
                transfer[(i * FREQUENCIES + f) * 4 + k] = complex_of(result_value(p, 12 + 4 * f + k), result_value(p, 20 + k));
        }
        for (unsigned k = 0; k < p % 3; ++k, ++interactions) {
            kind[interactions] = k ? KELLER_DIFFRACTION : KELLER_REFLECTION;
            position[interactions] = v3(result_value(p, 30 + k), 1, 2);
            triangle[interactions] = k ? KELLER_NONE : (uint32_t)(p % 2);
            wedge[interactions] = k ? 0 : KELLER_NONE;
            free_end[interactions] = (uint8_t)((p + k) % 4);
        }
    }
    offset[count] = interactions;
    KellerPathBatch batch = {.count = count, .interaction_count = interactions, .frequency_count = FREQUENCIES,
        .tx = tx, .rx = rx, .offset = offset, .length = length, .delay = delay, .departure = departure,
        .arrival = arrival, .doppler = doppler, .gain = gain, .transfer = transfer, .interaction_kind = kind,
        .interaction_position = position, .interaction_triangle = triangle, .interaction_wedge = wedge, .interaction_free_end = free_end,
        .weight = weight, .patch = patch, .part = part};
    return keller_result_append(result, &batch, error);
}

void result_write(const World *w, bool force, uint64_t paths)
{
    KellerResult *result = NULL;
    KellerError error = {0};
    if (keller_result_create(result_target, force, &w->config, &w->scene, "keller run test.xml", &result, &error) != KELLER_OK)
        fail_msg("%s", error.message);
    for (uint64_t p = 0; p < paths;) {
        size_t n = (size_t)(1 + p % 37);   /* batches of all sizes, some across the ends of chunks */
        if (n > paths - p) n = (size_t)(paths - p);
        if (result_append(result, p, n, &error) != KELLER_OK) fail_msg("%s", error.message);
        p += n;
    }
    double gain[FREQUENCIES * GRID_NY * GRID_NX], incoherent[FREQUENCIES * GRID_NY * GRID_NX];
    double spread[GRID_NY * GRID_NX], strongest[GRID_NY * GRID_NX], angle[KELLER_ANGLES][GRID_NY * GRID_NX];
    for (uint32_t t = 0; t < TRANSMITTERS && w->config.output_coverage; ++t) {
        for (int i = 0; i < FREQUENCIES * GRID_NY * GRID_NX; ++i) gain[i] = 1e-9 * (i + 1) + t, incoherent[i] = 2 * gain[i];
        for (int a = 0; a < KELLER_ANGLES; ++a)
            for (int i = 0; i < GRID_NY * GRID_NX; ++i) angle[a][i] = 10.0 * a + i + 100.0 * t;
        for (int i = 0; i < GRID_NY * GRID_NX; ++i) spread[i] = i == 2 ? NAN : 1e-8 * i, strongest[i] = 2e-8 * i + t;
        KellerCoverage map = {.tx = t, .set = 1, .ny = GRID_NY, .nx = GRID_NX, .frequency_count = FREQUENCIES,
                              .path_gain = gain, .path_gain_incoherent = incoherent, .delay_spread = spread,
                              .strongest_delay = strongest, .angle_spread = {angle[0], angle[1], angle[2], angle[3]}};
        assert_int_equal(keller_result_coverage(result, &map, &error), KELLER_OK);
    }
    for (uint32_t t = 0; t < TRANSMITTERS; ++t) {
        double sum[FREQUENCIES] = {t + 0.25, t + 0.5}, all[FREQUENCIES] = {t + 2.25, t + 2.5};
        KellerPairSums sums = {.tx = t, .rx = 0, .paths = (size_t)t + 7, .frequency_count = FREQUENCIES, .path_gain = sum,
                               .path_gain_incoherent = all, .delay_spread = NAN, .strongest_delay = 1e-8 * t,
                               .angle_spread = {0.1 * 1, 0.1 * 2, 0.1 * 3, 0.1 * 4 + t}};
        assert_int_equal(keller_result_pair(result, &sums, &error), KELLER_OK);
    }
    assert_int_equal(keller_result_statistic(result, "time_total", 1.25, "s", &error), KELLER_OK);
    assert_int_equal(keller_result_statistic_text(result, "accelerator", "bvh", &error), KELLER_OK);
    if (keller_result_finish(result, &error) != KELLER_OK) fail_msg("%s", error.message);
}

int result_entries(void)
{
    DIR *stream = opendir(result_folder);
    int count = 0;
    for (struct dirent *e; (e = readdir(stream));)
        if (strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0) ++count;
    closedir(stream);
    return count;
}

KellerReader *result_open(void)
{
    KellerReader *reader = NULL;
    KellerError error = {0};
    if (keller_reader_open(result_target, &reader, &error) != KELLER_OK) fail_msg("%s", error.message);
    return reader;
}

void result_rows(KellerReader *reader, const char *path, KellerCell cell, uint64_t width, uint64_t first, uint64_t count,
                 void *data)
{
    KellerError error = {0};
    if (keller_reader_rows(reader, path, cell, width, first, count, data, &error) != KELLER_OK)
        fail_msg("%s", error.message);
}

char *result_slurp(const char *file, size_t *size)
{
    FILE *stream = fopen(file, "rb");
    assert_non_null(stream);
    char *bytes = malloc(1 << 22);
    *size = fread(bytes, 1, 1 << 22, stream);
    fclose(stream);
    return bytes;
}

void result_spill(const char *file, const char *bytes, size_t size)
{
    FILE *stream = fopen(file, "wb");
    assert_non_null(stream);
    assert_int_equal(fwrite(bytes, 1, size, stream), size);
    fclose(stream);
}

int result_start(void **state)
{
    (void)state;
    if (!mkdtemp(result_folder)) return -1;
    snprintf(result_target, sizeof result_target, "%s/out.h5", result_folder);
    return 0;
}

int result_clean(void **state)
{
    (void)state;
    unlink(result_target);
    return 0;
}

int result_end(void **state)
{
    (void)state;
    return rmdir(result_folder);
}
