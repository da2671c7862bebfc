/* The result file: what is written is what is read, to the last bit; nothing is left behind or written over; a damaged
 * file is an error, not a crash. */
#include <setjmp.h>
#include <signal.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <dirent.h>
#include <hdf5.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include "io/result_read.h"
#include "keller/result.h"

enum { FREQUENCIES = 2, TRANSMITTERS = 2, GRID_NY = 2, GRID_NX = 3, RECEIVERS = 1 + GRID_NY * GRID_NX };

static char folder[] = "/tmp/keller-result-XXXXXX";
static char target[200];

/* ---- a small simulation, made by hand ------------------------------------------------------------------------- */

typedef struct {
    KellerConfig config;
    KellerScene scene;
    double frequencies[FREQUENCIES];
    KellerTransmitter transmitters[TRANSMITTERS];
    KellerReceiverSet sets[2];
    KellerReceiver receivers[RECEIVERS];
    KellerVec3 vertices[4];
    uint32_t triangles[2][3], face[2], object[2], source[2], sheets[2];
    KellerFace faces[2];
    KellerWedge wedges[1];
    KellerMaterial materials[2];
    char *objects[2];
} World;

static void world_make(World *w)
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

/* Path number p of the whole run has values that no other path has, with all bits in use. */
static double value_of(uint64_t p, unsigned what) { return (double)(p + 1) / 3 + what * 1000 + 1e-9; }

/* Path p has p % 3 interactions. */
static KellerStatus append(KellerResult *result, uint64_t first, size_t count, KellerError *error)
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
        length[i] = value_of(p, 0);
        weight[i] = value_of(p, 40);
        patch[i] = value_of(p, 41);
        part[i][0] = value_of(p, 42);
        part[i][1] = value_of(p, 43);
        delay[i] = value_of(p, 1);
        for (unsigned k = 0; k < 2; ++k) {
            departure[i][k] = value_of(p, 2 + k);
            arrival[i][k] = value_of(p, 4 + k);
        }
        for (unsigned f = 0; f < FREQUENCIES; ++f) {
            doppler[i * FREQUENCIES + f] = value_of(p, 6 + f);
            gain[i * FREQUENCIES + f] = complex_of(value_of(p, 8 + f), -value_of(p, 10 + f));
            for (unsigned k = 0; k < 4; ++k)
                transfer[(i * FREQUENCIES + f) * 4 + k] = complex_of(value_of(p, 12 + 4 * f + k), value_of(p, 20 + k));
        }
        for (unsigned k = 0; k < p % 3; ++k, ++interactions) {
            kind[interactions] = k ? KELLER_DIFFRACTION : KELLER_REFLECTION;
            position[interactions] = v3(value_of(p, 30 + k), 1, 2);
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

static void write_world(const World *w, const char *file, bool force, uint64_t paths)
{
    KellerResult *result = NULL;
    KellerError error = {0};
    if (keller_result_create(file, force, &w->config, &w->scene, "keller run test.xml", &result, &error) != KELLER_OK)
        fail_msg("%s", error.message);
    for (uint64_t p = 0; p < paths;) {
        size_t n = (size_t)(1 + p % 37);   /* batches of all sizes, some across the ends of chunks */
        if (n > paths - p) n = (size_t)(paths - p);
        if (append(result, p, n, &error) != KELLER_OK) fail_msg("%s", error.message);
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

static int entries_in_folder(void)
{
    DIR *stream = opendir(folder);
    int count = 0;
    for (struct dirent *e; (e = readdir(stream));)
        if (strcmp(e->d_name, ".") != 0 && strcmp(e->d_name, "..") != 0) ++count;
    closedir(stream);
    return count;
}

static KellerReader *open_reader(void)
{
    KellerReader *reader = NULL;
    KellerError error = {0};
    if (keller_reader_open(target, &reader, &error) != KELLER_OK) fail_msg("%s", error.message);
    return reader;
}

static void rows(KellerReader *reader, const char *path, KellerCell cell, uint64_t width, uint64_t first,
                 uint64_t count, void *data)
{
    KellerError error = {0};
    if (keller_reader_rows(reader, path, cell, width, first, count, data, &error) != KELLER_OK)
        fail_msg("%s", error.message);
}

/* ---- cases ------------------------------------------------------------------------------------------------------ */

static void every_path_comes_back_exactly(void **state)
{
    (void)state;
    /* More rows than a chunk of any column holds: tx has 2^14 rows a chunk, transfer 2^18/(2*4*16) = 2048. */
    const uint64_t paths = 20000;
    World w;
    world_make(&w);
    write_world(&w, target, false, paths);
    assert_int_equal(entries_in_folder(), 1);
    KellerReader *reader = open_reader();
    const KellerResultInfo *info = keller_reader_info(reader);
    assert_int_equal(info->paths, paths);
    uint64_t end = 0;
    for (uint64_t p = 0; p < paths; p += p < 5 || p > paths - 40 ? 1 : 97) {
        uint32_t tx, rx;
        uint64_t offset[2];
        double length, delay, departure[2], arrival[2], doppler[FREQUENCIES];
        double complex gain[FREQUENCIES], transfer[FREQUENCIES * 4];
        rows(reader, "/paths/tx", KELLER_CELL_U4, 1, p, 1, &tx);
        rows(reader, "/paths/rx", KELLER_CELL_U4, 1, p, 1, &rx);
        rows(reader, "/paths/offset", KELLER_CELL_U8, 1, p, 2, offset);
        rows(reader, "/paths/length", KELLER_CELL_F8, 1, p, 1, &length);
        rows(reader, "/paths/delay", KELLER_CELL_F8, 1, p, 1, &delay);
        rows(reader, "/paths/departure", KELLER_CELL_F8, 2, p, 1, departure);
        rows(reader, "/paths/arrival", KELLER_CELL_F8, 2, p, 1, arrival);
        rows(reader, "/paths/doppler", KELLER_CELL_F8, FREQUENCIES, p, 1, doppler);
        rows(reader, "/paths/gain", KELLER_CELL_C16, FREQUENCIES, p, 1, gain);
        rows(reader, "/paths/transfer", KELLER_CELL_C16, FREQUENCIES * 4, p, 1, transfer);
        assert_int_equal(tx, p % TRANSMITTERS);
        assert_int_equal(rx, p % RECEIVERS);
        /* Of three paths in a row the interactions are 0, 1, 2: path p = 3a + b begins at 3a + (0, 0, 1)[b]. */
        assert_int_equal(offset[0], p / 3 * 3 + (p % 3 == 2));
        assert_int_equal(offset[1] - offset[0], p % 3);
        end = offset[1];
        assert_true(length == value_of(p, 0) && delay == value_of(p, 1));
        assert_true(departure[1] == value_of(p, 3) && arrival[0] == value_of(p, 4) && arrival[1] == value_of(p, 5));
        for (unsigned f = 0; f < FREQUENCIES; ++f) {
            assert_true(doppler[f] == value_of(p, 6 + f));
            assert_true(creal(gain[f]) == value_of(p, 8 + f) && cimag(gain[f]) == -value_of(p, 10 + f));
            for (unsigned k = 0; k < 4; ++k)
                assert_true(creal(transfer[4 * f + k]) == value_of(p, 12 + 4 * f + k) &&
                            cimag(transfer[4 * f + k]) == value_of(p, 20 + k));
        }
        double weight, patch, part[2];
        rows(reader, "/paths/weight", KELLER_CELL_F8, 1, p, 1, &weight);
        rows(reader, "/paths/patch", KELLER_CELL_F8, 1, p, 1, &patch);
        rows(reader, "/paths/part", KELLER_CELL_F8, 2, p, 1, part);
        assert_true(weight == value_of(p, 40) && patch == value_of(p, 41));
        assert_true(part[0] == value_of(p, 42) && part[1] == value_of(p, 43));
        for (uint64_t k = 0; k < p % 3; ++k) {
            uint8_t kind, free_end;
            double position[3];
            uint32_t triangle, wedge;
            rows(reader, "/interactions/kind", KELLER_CELL_ENUM, 1, offset[0] + k, 1, &kind);
            rows(reader, "/interactions/free_end", KELLER_CELL_U1, 1, offset[0] + k, 1, &free_end);
            assert_int_equal(free_end, (p + k) % 4);
            rows(reader, "/interactions/position", KELLER_CELL_F8, 3, offset[0] + k, 1, position);
            rows(reader, "/interactions/triangle", KELLER_CELL_U4, 1, offset[0] + k, 1, &triangle);
            rows(reader, "/interactions/wedge", KELLER_CELL_U4, 1, offset[0] + k, 1, &wedge);
            assert_int_equal(kind, k ? KELLER_DIFFRACTION : KELLER_REFLECTION);
            assert_true(position[0] == value_of(p, 30 + (unsigned)k));
            assert_int_equal(triangle, k ? KELLER_NONE : p % 2);
            assert_int_equal(wedge, k ? 0 : KELLER_NONE);
        }
    }
    assert_int_equal(info->interactions, end);
    keller_reader_close(reader);
}

static void the_tables_come_back(void **state)
{
    (void)state;
    World w;
    world_make(&w);
    write_world(&w, target, false, 0);
    KellerReader *reader = open_reader();
    const KellerResultInfo *info = keller_reader_info(reader);
    assert_int_equal(info->paths, 0);
    assert_int_equal(info->frequency_count, FREQUENCIES);
    assert_true(info->frequencies[1] == 28e9);
    assert_string_equal(info->transmitter_ids[1], "tx\xc3\xa9");
    assert_true(info->transmitter_positions[1].x == 1 && info->transmitter_powers[1] == 1.5);
    assert_int_equal(info->receiver_count, RECEIVERS);
    assert_int_equal(info->receiver_indices[RECEIVERS - 1], GRID_NY * GRID_NX - 1);
    assert_string_equal(info->set_ids[1], "street");
    assert_int_equal(info->set_kinds[1], KELLER_SET_GRID);
    assert_int_equal(info->set_shapes[1][0], GRID_NY);
    assert_string_equal(info->command_line, "keller run test.xml");
    assert_int_equal(info->triangles, 2);
    double permittivity[4], conductivity[4], thickness[2], n;
    rows(reader, "/materials/permittivity", KELLER_CELL_F8, FREQUENCIES, 0, 2, permittivity);
    rows(reader, "/materials/conductivity", KELLER_CELL_F8, FREQUENCIES, 0, 2, conductivity);
    rows(reader, "/materials/thickness", KELLER_CELL_F8, 1, 0, 2, thickness);
    assert_true(permittivity[0] == 5 && permittivity[1] == 5 && isnan(permittivity[2]));
    /* The conductivity goes through eta = eps' - j sigma/(w eps0) and back: a few roundings. */
    assert_true(fabs(conductivity[1] - 0.25) < 1e-15 && isinf(conductivity[3]));
    assert_true(thickness[0] == 0.3 && thickness[1] == 0);
    uint32_t material[2], source[2], wedge[2];
    rows(reader, "/scene/material", KELLER_CELL_U4, 1, 0, 2, material);
    rows(reader, "/scene/source", KELLER_CELL_U4, 1, 0, 2, source);
    rows(reader, "/scene/wedges/vertices", KELLER_CELL_U4, 2, 0, 1, wedge);
    rows(reader, "/scene/wedges/n", KELLER_CELL_F8, 1, 0, 1, &n);
    assert_true(material[0] == 0 && material[1] == 1 && source[0] == 1 && source[1] == 0 && wedge[1] == 2 && n == 1.5);
    char *text = NULL;
    KellerError error;
    assert_int_equal(keller_reader_text(reader, "/config", &text, &error), KELLER_OK);
    assert_string_equal(text, "<simulation/>");
    free(text);
    keller_reader_close(reader);
}

static void maps_come_back(void **state)
{
    (void)state;
    World w;
    world_make(&w);
    write_world(&w, target, false, 0);
    KellerReader *reader = open_reader();
    KellerError error = {0};
    double gain[GRID_NY * GRID_NX], spread[GRID_NY * GRID_NX], x[GRID_NX];
    const uint64_t start[] = {1, 1, 0, 0}, count[] = {1, 1, GRID_NY, GRID_NX}, flat[] = {1, GRID_NY, GRID_NX};
    assert_int_equal(keller_reader_box(reader, "/coverage/street/path_gain", KELLER_CELL_F8, 4, start, count, gain,
                                       &error), KELLER_OK);
    assert_int_equal(keller_reader_box(reader, "/coverage/street/delay_spread", KELLER_CELL_F8, 3,
                                       (uint64_t[]){1, 0, 0}, flat, spread, &error), KELLER_OK);
    rows(reader, "/coverage/street/x", KELLER_CELL_F8, 1, 0, GRID_NX, x);
    for (int i = 0; i < GRID_NY * GRID_NX; ++i) assert_true(gain[i] == 1e-9 * (GRID_NY * GRID_NX + i + 1) + 1);
    assert_true(isnan(spread[2]) && spread[5] == 1e-8 * 5);
    assert_true(x[0] == -1 && x[2] == 0);
    double angle[GRID_NY * GRID_NX], sums[FREQUENCIES];
    static const char *const names[KELLER_ANGLES] = {"departure_azimuth", "departure_zenith", "arrival_azimuth", "arrival_zenith"};
    for (int a = 0; a < KELLER_ANGLES; ++a) {
        char path[80];
        snprintf(path, sizeof path, "/coverage/street/%s_spread", names[a]);
        assert_int_equal(keller_reader_box(reader, path, KELLER_CELL_F8, 3, (uint64_t[]){1, 0, 0}, flat, angle, &error), KELLER_OK);
        for (int i = 0; i < GRID_NY * GRID_NX; ++i) assert_true(angle[i] == 10 * a + i + 100);
        snprintf(path, sizeof path, "/pairs/%s_spread", names[a]);
        rows(reader, path, KELLER_CELL_F8, 1, 1, 1, angle);
        assert_true(angle[0] == 0.1 * (a + 1) + (a == 3));
    }
    assert_int_equal(keller_reader_box(reader, "/coverage/street/path_gain_incoherent", KELLER_CELL_F8, 4, start, count, spread,
                                       &error), KELLER_OK);
    for (int i = 0; i < GRID_NY * GRID_NX; ++i) assert_true(spread[i] == 2 * gain[i]);
    rows(reader, "/pairs/path_gain_incoherent", KELLER_CELL_F8, FREQUENCIES, 1, 1, sums);
    assert_true(sums[0] == 3.25 && sums[1] == 3.5);
    /* one column too many */
    assert_int_equal(keller_reader_box(reader, "/coverage/street/path_gain", KELLER_CELL_F8, 4,
                                       (uint64_t[]){1, 1, 0, 1}, count, gain, &error), KELLER_BAD_INPUT);
    keller_reader_close(reader);
}

static void count_statistic(void *context, const char *name, double value, const char *unit, const char *text)
{
    int *seen = context;
    if (text) *seen += strcmp(name, "accelerator") == 0 && strcmp(text, "bvh") == 0;
    else *seen += 10 * (strcmp(name, "time_total") == 0 && value == 1.25 && strcmp(unit, "s") == 0);
}

static void statistics_come_back(void **state)
{
    (void)state;
    World w;
    world_make(&w);
    write_world(&w, target, false, 0);
    KellerReader *reader = open_reader();
    KellerError error;
    int seen = 0;
    assert_int_equal(keller_reader_statistics(reader, count_statistic, &seen, &error), KELLER_OK);
    assert_int_equal(seen, 11);
    keller_reader_close(reader);
}

static char *slurp(const char *file, size_t *size)
{
    FILE *stream = fopen(file, "rb");
    assert_non_null(stream);
    char *bytes = malloc(1 << 22);
    *size = fread(bytes, 1, 1 << 22, stream);
    fclose(stream);
    return bytes;
}

static void spill(const char *file, const char *bytes, size_t size)
{
    FILE *stream = fopen(file, "wb");
    assert_non_null(stream);
    assert_int_equal(fwrite(bytes, 1, size, stream), size);
    fclose(stream);
}

static void the_same_run_gives_the_same_bytes(void **state)
{
    (void)state;
    setenv("SOURCE_DATE_EPOCH", "86400", 1);
    World w;
    world_make(&w);
    size_t size[2];
    char *bytes[2];
    for (int i = 0; i < 2; ++i) {
        write_world(&w, target, true, 100);
        bytes[i] = slurp(target, &size[i]);
    }
    unsetenv("SOURCE_DATE_EPOCH");
    assert_int_equal(size[0], size[1]);
    assert_memory_equal(bytes[0], bytes[1], size[0]);
    free(bytes[0]);
    free(bytes[1]);
    KellerReader *reader = open_reader();
    assert_string_equal(keller_reader_info(reader)->created, "1970-01-02T00:00:00Z");
    keller_reader_close(reader);
}

static void an_existing_file_stays(void **state)
{
    (void)state;
    World w;
    world_make(&w);
    KellerError error = {0};
    KellerResult *result = NULL;
    spill(target, "mine", 4);
    assert_int_equal(keller_result_check_target(target, false, &error), KELLER_IO);
    assert_non_null(strstr(error.message, "exists already"));
    assert_int_equal(keller_result_create(target, false, &w.config, &w.scene, "", &result, &error), KELLER_IO);
    assert_null(result);
    /* one that appears during the run */
    unlink(target);
    assert_int_equal(keller_result_create(target, false, &w.config, &w.scene, "", &result, &error), KELLER_OK);
    spill(target, "mine", 4);
    assert_int_equal(keller_result_finish(result, &error), KELLER_IO);
    assert_non_null(strstr(error.message, target));
    size_t size;
    char *bytes = slurp(target, &size);
    assert_int_equal(size, 4);
    free(bytes);
    assert_int_equal(entries_in_folder(), 1);
    write_world(&w, target, true, 3);
    keller_reader_close(open_reader());
    assert_int_equal(entries_in_folder(), 1);
}

static void abandoning_leaves_nothing(void **state)
{
    (void)state;
    World w;
    world_make(&w);
    KellerError error = {0};
    KellerResult *result = NULL;
    assert_int_equal(keller_result_create(target, false, &w.config, &w.scene, "", &result, &error), KELLER_OK);
    assert_int_equal(entries_in_folder(), 1);
    assert_int_equal(append(result, 0, 30, &error), KELLER_OK);
    keller_result_abandon(result);
    assert_int_equal(entries_in_folder(), 0);
    keller_result_abandon(NULL);
}

static void impossible_targets_are_named(void **state)
{
    (void)state;
    KellerError error = {0};
    char name[300];
    assert_int_equal(keller_result_check_target(folder, true, &error), KELLER_IO);
    assert_non_null(strstr(error.message, "folder"));
    snprintf(name, sizeof name, "%s/none/out.h5", folder);
    assert_int_equal(keller_result_check_target(name, true, &error), KELLER_IO);
    assert_non_null(strstr(error.message, name));
    assert_int_equal(keller_result_check_target("/dev/full", true, &error), KELLER_IO);
    assert_non_null(strstr(error.message, "regular file"));
    assert_int_equal(keller_result_check_target("", true, &error), KELLER_IO);
}

/* A full disk, played by a limit on the size of files in a child process. */
static void a_full_disk_is_an_error(void **state)
{
    (void)state;
    for (rlim_t limit = 0; limit < 60000; limit += 3000) {
        pid_t child = fork();
        if (child == 0) {
            signal(SIGXFSZ, SIG_IGN);
            setrlimit(RLIMIT_FSIZE, &(struct rlimit){limit, limit});
            World w;
            world_make(&w);
            KellerError error = {0};
            KellerResult *result = NULL;
            KellerStatus s = keller_result_create(target, false, &w.config, &w.scene, "", &result, &error);
            for (uint64_t p = 0; p < 20000 && s == KELLER_OK; p += 50) s = append(result, p, 50, &error);
            if (s == KELLER_OK) s = keller_result_finish(result, &error);
            else keller_result_abandon(result);
            bool told = strstr(error.message, "File too large") && strstr(error.message, target);
            if (!told) fprintf(stderr, "# %d %s\n", (int)s, error.message);
            exit(s == KELLER_IO && told ? 0 : 1);
        }
        int status;
        waitpid(child, &status, 0);
        if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
            fail_msg("limit %lu: child ended with %x", (unsigned long)limit, (unsigned)status);
        assert_int_equal(entries_in_folder(), 0);
    }
}

/* Reads everything that the program reads; the status of the first failure. Runs in a child, because the HDF5 library
 * itself is not proof against every damage; 100 + status, or the signal. */
static int read_all_in_child(void)
{
    pid_t child = fork();
    if (child == 0) {
        alarm(20);
        freopen("/dev/null", "w", stderr);
        KellerReader *reader = NULL;
        KellerError error = {0};
        KellerStatus s = keller_reader_open(target, &reader, &error);
        if (s != KELLER_OK && !strstr(error.message, target)) _exit(99);
        if (s == KELLER_OK) {
            uint64_t paths = keller_reader_info(reader)->paths;
            double complex gain[FREQUENCIES];
            for (uint64_t p = 0; p < paths && s == KELLER_OK; ++p)
                s = keller_reader_rows(reader, "/paths/gain", KELLER_CELL_C16, FREQUENCIES, p, 1, gain, &error);
            keller_reader_close(reader);
        }
        _exit(100 + (int)s);
    }
    int status;
    waitpid(child, &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

static void a_cut_file_is_bad_input(void **state)
{
    (void)state;
    World w;
    world_make(&w);
    write_world(&w, target, false, 100);
    size_t size;
    char *bytes = slurp(target, &size);
    for (size_t keep = 0; keep < size; keep += 1 + size / 50) {
        spill(target, bytes, keep);
        assert_int_equal(read_all_in_child(), 100 + KELLER_BAD_INPUT);
    }
    free(bytes);
}

static void foreign_files_are_bad_input(void **state)
{
    (void)state;
    KellerReader *reader = NULL;
    KellerError error = {0};
    assert_int_equal(keller_reader_open(target, &reader, &error), KELLER_IO);
    spill(target, "hello", 5);
    assert_int_equal(keller_reader_open(target, &reader, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "not an HDF5 file"));
    hid_t file = H5Fcreate(target, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    H5Fclose(file);
    assert_int_equal(keller_reader_open(target, &reader, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "another kind"));
    assert_int_equal(keller_reader_open(folder, &reader, &error), KELLER_IO);
}

/* A valid result in which one thing was changed through HDF5. */
static void spoiled(void (*spoil)(hid_t file), const char *expected)
{
    World w;
    world_make(&w);
    write_world(&w, target, true, 10);
    hid_t file = H5Fopen(target, H5F_ACC_RDWR, H5P_DEFAULT);
    spoil(file);
    H5Fclose(file);
    KellerReader *reader = NULL;
    KellerError error = {0};
    assert_int_equal(keller_reader_open(target, &reader, &error), KELLER_BAD_INPUT);
    if (!strstr(error.message, expected)) fail_msg("\"%s\" lacks \"%s\"", error.message, expected);
}

static void version_two(hid_t file)
{
    hid_t attribute = H5Aopen(file, "format_version", H5P_DEFAULT);
    uint32_t version = 2;
    H5Awrite(attribute, H5T_NATIVE_UINT32, &version);
    H5Aclose(attribute);
}

static void no_gain(hid_t file) { H5Ldelete(file, "/paths/gain", H5P_DEFAULT); }

static void replace(hid_t file, const char *path, hid_t type, hsize_t rows_claimed, bool external)
{
    H5Ldelete(file, path, H5P_DEFAULT);
    hid_t list = H5Pcreate(H5P_DATASET_CREATE), space = H5Screate_simple(1, &rows_claimed, NULL);
    if (external) H5Pset_external(list, "/etc/hostname", 0, H5F_UNLIMITED);
    else H5Pset_chunk(list, 1, (hsize_t[]){1});
    H5Dclose(H5Dcreate2(file, path, type, space, H5P_DEFAULT, list, H5P_DEFAULT));
    H5Sclose(space);
    H5Pclose(list);
}

static void endless_paths(hid_t file) { replace(file, "/paths/tx", H5T_STD_U32LE, (hsize_t)1 << 60, false); }
static void outside_file(hid_t file) { replace(file, "/paths/tx", H5T_STD_U32LE, 10, true); }
static void text_for_set(hid_t file) { replace(file, "/receivers/set", H5T_IEEE_F64LE, RECEIVERS, false); }
static void short_rx(hid_t file) { replace(file, "/paths/rx", H5T_STD_U32LE, 9, false); }

static void soft_link(hid_t file)
{
    H5Ldelete(file, "/paths/rx", H5P_DEFAULT);
    H5Lcreate_soft("/paths/tx", file, "/paths/rx", H5P_DEFAULT, H5P_DEFAULT);
}

static void set_out_of_range(hid_t file)
{
    uint32_t sets[RECEIVERS] = {7};
    hid_t dataset = H5Dopen2(file, "/receivers/set", H5P_DEFAULT);
    H5Dwrite(dataset, H5T_NATIVE_UINT32, H5S_ALL, H5S_ALL, H5P_DEFAULT, sets);
    H5Dclose(dataset);
}

static void hostile_files_are_bad_input(void **state)
{
    (void)state;
    spoiled(version_two, "format version 2");
    spoiled(no_gain, "/paths/gain is missing");
    spoiled(endless_paths, "/paths/tx claims more");
    spoiled(outside_file, "/paths/tx has an unknown layout");
    spoiled(text_for_set, "/receivers/set has another type");
    spoiled(short_rx, "/paths/rx has another length");
    spoiled(soft_link, "/paths/rx is missing");
    spoiled(set_out_of_range, "names a set that is not there");
}

static void a_grid_that_cannot_be_a_group_is_refused(void **state)
{
    (void)state;
    World w;
    world_make(&w);
    w.sets[1].id = "a/b";
    KellerError error = {0};
    KellerResult *result = NULL;
    assert_int_equal(keller_result_create(target, false, &w.config, &w.scene, "", &result, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "a/b"));
    assert_int_equal(entries_in_folder(), 0);
}

static int start(void **state)
{
    (void)state;
    if (!mkdtemp(folder)) return -1;
    snprintf(target, sizeof target, "%s/out.h5", folder);
    return 0;
}

static int clean(void **state)
{
    (void)state;
    unlink(target);
    return 0;
}

static int end(void **state)
{
    (void)state;
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(every_path_comes_back_exactly, clean),
        cmocka_unit_test_teardown(the_tables_come_back, clean),
        cmocka_unit_test_teardown(maps_come_back, clean),
        cmocka_unit_test_teardown(statistics_come_back, clean),
        cmocka_unit_test_teardown(the_same_run_gives_the_same_bytes, clean),
        cmocka_unit_test_teardown(an_existing_file_stays, clean),
        cmocka_unit_test_teardown(abandoning_leaves_nothing, clean),
        cmocka_unit_test_teardown(impossible_targets_are_named, clean),
        cmocka_unit_test_teardown(a_full_disk_is_an_error, clean),
        cmocka_unit_test_teardown(a_cut_file_is_bad_input, clean),
        cmocka_unit_test_teardown(foreign_files_are_bad_input, clean),
        cmocka_unit_test_teardown(hostile_files_are_bad_input, clean),
        cmocka_unit_test_teardown(a_grid_that_cannot_be_a_group_is_refused, clean),
    };
    /* As the program does: HDF5 cannot close at exit what a full disk kept it from writing. */
    H5dont_atexit();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, start, end);
}
