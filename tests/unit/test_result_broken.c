/* The result file where something is in the way: nothing is left behind or written over; a damaged file is an error, not a
 * crash. */
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <cmocka.h>

#include <hdf5.h>
#include <signal.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>
#include "result_files.h"

static void an_existing_file_stays(void **state)
{
    (void)state;
    World w;
    result_world(&w);
    KellerError error = {0};
    KellerResult *result = NULL;
    result_spill(result_target, "mine", 4);
    assert_int_equal(keller_result_check_target(result_target, false, &error), KELLER_IO);
    assert_non_null(strstr(error.message, "exists already"));
    assert_int_equal(keller_result_create(result_target, false, &w.config, &w.scene, "", &result, &error), KELLER_IO);
    assert_null(result);
    /* one that appears during the run */
    unlink(result_target);
    assert_int_equal(keller_result_create(result_target, false, &w.config, &w.scene, "", &result, &error), KELLER_OK);
    result_spill(result_target, "mine", 4);
    assert_int_equal(keller_result_finish(result, &error), KELLER_IO);
    assert_non_null(strstr(error.message, result_target));
    size_t size;
    char *bytes = result_slurp(result_target, &size);
    assert_int_equal(size, 4);
    free(bytes);
    assert_int_equal(result_entries(), 1);
    result_write(&w, true, 3);
    keller_reader_close(result_open());
    assert_int_equal(result_entries(), 1);
}

static void abandoning_leaves_nothing(void **state)
{
    (void)state;
    World w;
    result_world(&w);
    KellerError error = {0};
    KellerResult *result = NULL;
    assert_int_equal(keller_result_create(result_target, false, &w.config, &w.scene, "", &result, &error), KELLER_OK);
    assert_int_equal(result_entries(), 1);
    assert_int_equal(result_append(result, 0, 30, &error), KELLER_OK);
    keller_result_abandon(result);
    assert_int_equal(result_entries(), 0);
    keller_result_abandon(NULL);
}

static void impossible_targets_are_named(void **state)
{
    (void)state;
    KellerError error = {0};
    char name[300];
    assert_int_equal(keller_result_check_target(result_folder, true, &error), KELLER_IO);
    assert_non_null(strstr(error.message, "folder"));
    snprintf(name, sizeof name, "%s/none/out.h5", result_folder);
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
            result_world(&w);
            KellerError error = {0};
            KellerResult *result = NULL;
            KellerStatus s = keller_result_create(result_target, false, &w.config, &w.scene, "", &result, &error);
            for (uint64_t p = 0; p < 20000 && s == KELLER_OK; p += 50) s = result_append(result, p, 50, &error);
            if (s == KELLER_OK) s = keller_result_finish(result, &error);
            else keller_result_abandon(result);
            bool told = strstr(error.message, "File too large") && strstr(error.message, result_target);
            if (!told) fprintf(stderr, "# %d %s\n", (int)s, error.message);
            exit(s == KELLER_IO && told ? 0 : 1);
        }
        int status;
        waitpid(child, &status, 0);
        if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
            fail_msg("limit %lu: child ended with %x", (unsigned long)limit, (unsigned)status);
        assert_int_equal(result_entries(), 0);
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
        KellerStatus s = keller_reader_open(result_target, &reader, &error);
        if (s != KELLER_OK && !strstr(error.message, result_target)) _exit(99);
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
    result_world(&w);
    result_write(&w, false, 100);
    size_t size;
    char *bytes = result_slurp(result_target, &size);
    for (size_t keep = 0; keep < size; keep += 1 + size / 50) {
        result_spill(result_target, bytes, keep);
        assert_int_equal(read_all_in_child(), 100 + KELLER_BAD_INPUT);
    }
    free(bytes);
}

static void foreign_files_are_bad_input(void **state)
{
    (void)state;
    KellerReader *reader = NULL;
    KellerError error = {0};
    assert_int_equal(keller_reader_open(result_target, &reader, &error), KELLER_IO);
    result_spill(result_target, "hello", 5);
    assert_int_equal(keller_reader_open(result_target, &reader, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "not an HDF5 file"));
    hid_t file = H5Fcreate(result_target, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    H5Fclose(file);
    assert_int_equal(keller_reader_open(result_target, &reader, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "another kind"));
    assert_int_equal(keller_reader_open(result_folder, &reader, &error), KELLER_IO);
}

/* A valid result in which one thing was changed through HDF5. */
static void spoiled(void (*spoil)(hid_t file), const char *expected)
{
    World w;
    result_world(&w);
    result_write(&w, true, 10);
    hid_t file = H5Fopen(result_target, H5F_ACC_RDWR, H5P_DEFAULT);
    spoil(file);
    H5Fclose(file);
    KellerReader *reader = NULL;
    KellerError error = {0};
    assert_int_equal(keller_reader_open(result_target, &reader, &error), KELLER_BAD_INPUT);
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
    result_world(&w);
    w.sets[1].id = "a/b";
    KellerError error = {0};
    KellerResult *result = NULL;
    assert_int_equal(keller_result_create(result_target, false, &w.config, &w.scene, "", &result, &error), KELLER_BAD_INPUT);
    assert_non_null(strstr(error.message, "a/b"));
    assert_int_equal(result_entries(), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test_teardown(an_existing_file_stays, result_clean),
        cmocka_unit_test_teardown(abandoning_leaves_nothing, result_clean),
        cmocka_unit_test_teardown(impossible_targets_are_named, result_clean),
        cmocka_unit_test_teardown(a_full_disk_is_an_error, result_clean),
        cmocka_unit_test_teardown(a_cut_file_is_bad_input, result_clean),
        cmocka_unit_test_teardown(foreign_files_are_bad_input, result_clean),
        cmocka_unit_test_teardown(hostile_files_are_bad_input, result_clean),
        cmocka_unit_test_teardown(a_grid_that_cannot_be_a_group_is_refused, result_clean),
    };
    /* As the program does: HDF5 cannot close at exit what a full disk kept it from writing. */
    H5dont_atexit();
    cmocka_set_message_output(CM_OUTPUT_TAP);
    return cmocka_run_group_tests(tests, result_start, result_end);
}
