/* The result file: what is written is what is read, to the last bit. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <hdf5.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include "result_files.h"

static void every_path_comes_back_exactly(void **state)
{
    (void)state;
    /* More rows than a chunk of any column holds: tx has 2^14 rows a chunk, transfer 2^18/(2*4*16) = 2048. */
    const uint64_t paths = 20000;
    World w;
    result_world(&w);
    result_write(&w, false, paths);
    assert_int_equal(result_entries(), 1);
    KellerReader *reader = result_open();
    const KellerResultInfo *info = keller_reader_info(reader);
    assert_int_equal(info->paths, paths);
    uint64_t end = 0;
    for (uint64_t p = 0; p < paths; p += p < 5 || p > paths - 40 ? 1 : 97) {
        uint32_t tx, rx;
        uint64_t offset[2];
        double length, delay, departure[2], arrival[2], doppler[FREQUENCIES];
        double complex gain[FREQUENCIES], transfer[FREQUENCIES * 4];
        result_rows(reader, "/paths/tx", KELLER_CELL_U4, 1, p, 1, &tx);
        result_rows(reader, "/paths/rx", KELLER_CELL_U4, 1, p, 1, &rx);
        result_rows(reader, "/paths/offset", KELLER_CELL_U8, 1, p, 2, offset);
        result_rows(reader, "/paths/length", KELLER_CELL_F8, 1, p, 1, &length);
        result_rows(reader, "/paths/delay", KELLER_CELL_F8, 1, p, 1, &delay);
        result_rows(reader, "/paths/departure", KELLER_CELL_F8, 2, p, 1, departure);
        result_rows(reader, "/paths/arrival", KELLER_CELL_F8, 2, p, 1, arrival);
        result_rows(reader, "/paths/doppler", KELLER_CELL_F8, FREQUENCIES, p, 1, doppler);
        result_rows(reader, "/paths/gain", KELLER_CELL_C16, FREQUENCIES, p, 1, gain);
        result_rows(reader, "/paths/transfer", KELLER_CELL_C16, FREQUENCIES * 4, p, 1, transfer);
        assert_int_equal(tx, p % TRANSMITTERS);
        assert_int_equal(rx, p % RECEIVERS);
        /* Of three paths in a row the interactions are 0, 1, 2: path p = 3a + b begins at 3a + (0, 0, 1)[b]. */
        assert_int_equal(offset[0], p / 3 * 3 + (p % 3 == 2));
        assert_int_equal(offset[1] - offset[0], p % 3);
        end = offset[1];
        assert_true(length == result_value(p, 0) && delay == result_value(p, 1));
        assert_true(departure[1] == result_value(p, 3) && arrival[0] == result_value(p, 4) && arrival[1] == result_value(p, 5));
        for (unsigned f = 0; f < FREQUENCIES; ++f) {
            assert_true(doppler[f] == result_value(p, 6 + f));
            assert_true(creal(gain[f]) == result_value(p, 8 + f) && cimag(gain[f]) == -result_value(p, 10 + f));
            for (unsigned k = 0; k < 4; ++k)
                assert_true(creal(transfer[4 * f + k]) == result_value(p, 12 + 4 * f + k) &&
                            cimag(transfer[4 * f + k]) == result_value(p, 20 + k));
        }
        double weight, patch, part[2];
        result_rows(reader, "/paths/weight", KELLER_CELL_F8, 1, p, 1, &weight);
        result_rows(reader, "/paths/patch", KELLER_CELL_F8, 1, p, 1, &patch);
        result_rows(reader, "/paths/part", KELLER_CELL_F8, 2, p, 1, part);
        assert_true(weight == result_value(p, 40) && patch == result_value(p, 41));
        assert_true(part[0] == result_value(p, 42) && part[1] == result_value(p, 43));
        for (uint64_t k = 0; k < p % 3; ++k) {
            uint8_t kind, free_end;
            double position[3];
            uint32_t triangle, wedge;
            result_rows(reader, "/interactions/kind", KELLER_CELL_ENUM, 1, offset[0] + k, 1, &kind);
            result_rows(reader, "/interactions/free_end", KELLER_CELL_U1, 1, offset[0] + k, 1, &free_end);
            assert_int_equal(free_end, (p + k) % 4);
            result_rows(reader, "/interactions/position", KELLER_CELL_F8, 3, offset[0] + k, 1, position);
            result_rows(reader, "/interactions/triangle", KELLER_CELL_U4, 1, offset[0] + k, 1, &triangle);
            result_rows(reader, "/interactions/wedge", KELLER_CELL_U4, 1, offset[0] + k, 1, &wedge);
            assert_int_equal(kind, k ? KELLER_DIFFRACTION : KELLER_REFLECTION);
            assert_true(position[0] == result_value(p, 30 + (unsigned)k));
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
    result_world(&w);
    result_write(&w, false, 0);
    KellerReader *reader = result_open();
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
    result_rows(reader, "/materials/permittivity", KELLER_CELL_F8, FREQUENCIES, 0, 2, permittivity);
    result_rows(reader, "/materials/conductivity", KELLER_CELL_F8, FREQUENCIES, 0, 2, conductivity);
    result_rows(reader, "/materials/thickness", KELLER_CELL_F8, 1, 0, 2, thickness);
    assert_true(permittivity[0] == 5 && permittivity[1] == 5 && isnan(permittivity[2]));
    /* The conductivity goes through eta = eps' - j sigma/(w eps0) and back: a few roundings. */
    assert_true(fabs(conductivity[1] - 0.25) < 1e-15 && isinf(conductivity[3]));
    assert_true(thickness[0] == 0.3 && thickness[1] == 0);
    uint32_t material[2], source[2], wedge[2];
    result_rows(reader, "/scene/material", KELLER_CELL_U4, 1, 0, 2, material);
    result_rows(reader, "/scene/source", KELLER_CELL_U4, 1, 0, 2, source);
    result_rows(reader, "/scene/wedges/vertices", KELLER_CELL_U4, 2, 0, 1, wedge);
    result_rows(reader, "/scene/wedges/n", KELLER_CELL_F8, 1, 0, 1, &n);
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
    result_world(&w);
    result_write(&w, false, 0);
    KellerReader *reader = result_open();
    KellerError error = {0};
    double gain[GRID_NY * GRID_NX], spread[GRID_NY * GRID_NX], x[GRID_NX];
    const uint64_t start[] = {1, 1, 0, 0}, count[] = {1, 1, GRID_NY, GRID_NX}, flat[] = {1, GRID_NY, GRID_NX};
    assert_int_equal(keller_reader_box(reader, "/coverage/street/path_gain", KELLER_CELL_F8, 4, start, count, gain,
                                       &error), KELLER_OK);
    assert_int_equal(keller_reader_box(reader, "/coverage/street/delay_spread", KELLER_CELL_F8, 3,
                                       (uint64_t[]){1, 0, 0}, flat, spread, &error), KELLER_OK);
    result_rows(reader, "/coverage/street/x", KELLER_CELL_F8, 1, 0, GRID_NX, x);
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
        result_rows(reader, path, KELLER_CELL_F8, 1, 1, 1, angle);
        assert_true(angle[0] == 0.1 * (a + 1) + (a == 3));
    }
    assert_int_equal(keller_reader_box(reader, "/coverage/street/path_gain_incoherent", KELLER_CELL_F8, 4, start, count, spread,
                                       &error), KELLER_OK);
    for (int i = 0; i < GRID_NY * GRID_NX; ++i) assert_true(spread[i] == 2 * gain[i]);
    result_rows(reader, "/pairs/path_gain_incoherent", KELLER_CELL_F8, FREQUENCIES, 1, 1, sums);
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
    result_world(&w);
    result_write(&w, false, 0);
    KellerReader *reader = result_open();
    KellerError error;
    int seen = 0;
    assert_int_equal(keller_reader_statistics(reader, count_statistic, &seen, &error), KELLER_OK);
    assert_int_equal(seen, 11);
    keller_reader_close(reader);
}
static void the_same_run_gives_the_same_bytes(void **state)
{
    (void)state;
    setenv("SOURCE_DATE_EPOCH", "86400", 1);
    World w;
    result_world(&w);
    size_t size[2];
    char *bytes[2];
    for (int i = 0; i < 2; ++i) {
        result_write(&w, true, 100);
        bytes[i] = result_slurp(result_target, &size[i]);
    }
    unsetenv("SOURCE_DATE_EPOCH");
    assert_int_equal(size[0], size[1]);
    assert_memory_equal(bytes[0], bytes[1], size[0]);
    free(bytes[0]);
    free(bytes[1]);
    KellerReader *reader = result_open();
    assert_string_equal(keller_reader_info(reader)->created, "1970-01-02T00:00:00Z");
    keller_reader_close(reader);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(every_path_comes_back_exactly, result_clean),
        cmocka_unit_test_teardown(the_tables_come_back, result_clean),
        cmocka_unit_test_teardown(maps_come_back, result_clean),
        cmocka_unit_test_teardown(statistics_come_back, result_clean),
        cmocka_unit_test_teardown(the_same_run_gives_the_same_bytes, result_clean),
    };
    /* As the program does: HDF5 cannot close at exit what a full disk kept it from writing. */
    H5dont_atexit();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, result_start, result_end);
}
