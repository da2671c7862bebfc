#define _GNU_SOURCE
#include "io/atomic.h"

#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* The folder part of a path, "." if there is none. */
static char *folder_of(const char *file)
{
    const char *slash = strrchr(file, '/');
    if (!slash) return strdup(".");
    return slash == file ? strdup("/") : strndup(file, (size_t)(slash - file));
}

static KellerStatus refuse_existing(const char *file, KellerError *error)
{
    return keller_error(error, KELLER_IO, "%s: the file exists already; remove it, name another, or use --force", file);
}

KellerStatus keller_atomic_check(const char *file, bool force, KellerError *error)
{
    size_t length = strlen(file);
    if (length == 0) return keller_error(error, KELLER_IO, "the output file's name is empty; expected a path");
    struct stat status;
    if (lstat(file, &status) == 0) {
        bool link = S_ISLNK(status.st_mode);
        if (link && stat(file, &status) != 0) link = false, status.st_mode = S_IFREG; /* dangling: rename replaces it */
        if (S_ISDIR(status.st_mode))
            return keller_error(error, KELLER_IO, "%s: is a folder; expected the name of a file", file);
        /* A device is no place for a file that is written aside and moved: the move would replace the device itself. */
        if (!S_ISREG(status.st_mode))
            return keller_error(error, KELLER_IO, "%s: is not a regular file; expected one, or a new name", file);
        if (!force) return refuse_existing(file, error);
    } else if (errno != ENOENT) {
        return keller_error(error, KELLER_IO, "%s: cannot be written: %s", file, strerror(errno));
    } else if (file[length - 1] == '/') {
        return keller_error(error, KELLER_IO, "%s: is a folder's name; expected the name of a file", file);
    }
    char *folder = folder_of(file);
    if (!folder) return keller_error_memory(error, length + 1);
    KellerStatus result = KELLER_OK;
    if (stat(folder, &status) != 0)
        result = keller_error(error, KELLER_IO, "%s: the folder %s cannot be used: %s", file, folder, strerror(errno));
    else if (!S_ISDIR(status.st_mode))
        result = keller_error(error, KELLER_IO, "%s: %s is not a folder", file, folder);
    else if (access(folder, W_OK | X_OK) != 0)
        result =
            keller_error(error, KELLER_IO, "%s: the folder %s cannot be written: %s", file, folder, strerror(errno));
    free(folder);
    return result;
}

static void release(KellerAtomic *atomic)
{
    free(atomic->target);
    free(atomic->temporary);
    *atomic = (KellerAtomic){0};
}

KellerStatus keller_atomic_begin(const char *file, bool force, KellerAtomic *atomic, KellerError *error)
{
    *atomic = (KellerAtomic){.force = force};
    KellerStatus status = keller_atomic_check(file, force, error);
    if (status != KELLER_OK) return status;
    /* With force a symbolic link stays one: the file that it points to is replaced. */
    atomic->target = realpath(file, NULL);
    if (!atomic->target) atomic->target = strdup(file);
    char *folder = atomic->target ? folder_of(atomic->target) : NULL;
    size_t size = folder ? strlen(folder) + 64 : 0;
    atomic->temporary = folder ? malloc(size) : NULL;
    if (!atomic->temporary) {
        free(folder);
        release(atomic);
        return keller_error_memory(error, strlen(file) + 64);
    }
    int descriptor = -1;
    for (int attempt = 0; descriptor < 0 && attempt < 100; ++attempt) {
        snprintf(atomic->temporary, size, "%s/.keller-%ld-%d.part", folder, (long)getpid(), attempt);
        descriptor = open(atomic->temporary, O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
        if (descriptor < 0 && errno != EEXIST) break;
    }
    free(folder);
    if (descriptor < 0) {
        status = keller_error(error, KELLER_IO, "%s: a temporary file beside it cannot be made: %s", file,
                              strerror(errno));
        release(atomic);
        return status;
    }
    close(descriptor);
    return KELLER_OK;
}

/* rename that fails with EEXIST where the target exists. */
static int move_without_replacing(const char *from, const char *to)
{
    if (renameat2(AT_FDCWD, from, AT_FDCWD, to, RENAME_NOREPLACE) == 0) return 0;
    if (errno != EINVAL && errno != ENOSYS) return -1;
    /* A file system without RENAME_NOREPLACE: a hard link never replaces. */
    if (link(from, to) != 0) return -1;
    return unlink(from);
}

KellerStatus keller_atomic_finish(KellerAtomic *atomic, KellerError *error)
{
    int failure = 0;
    int descriptor = open(atomic->temporary, O_RDONLY | O_CLOEXEC);
    if (descriptor < 0 || fsync(descriptor) != 0) failure = errno;
    if (descriptor >= 0) close(descriptor);
    if (failure == 0) {
        int moved = atomic->force ? rename(atomic->temporary, atomic->target)
                                  : move_without_replacing(atomic->temporary, atomic->target);
        if (moved != 0) failure = errno;
    }
    KellerStatus status = KELLER_OK;
    if (failure == 0) {
        /* The name is durable once the folder is; a folder that cannot be synced is not an error. */
        char *folder = folder_of(atomic->target);
        int place = folder ? open(folder, O_RDONLY | O_DIRECTORY | O_CLOEXEC) : -1;
        if (place >= 0) {
            (void)fsync(place);
            close(place);
        }
        free(folder);
    } else {
        status = failure == EEXIST ? refuse_existing(atomic->target, error)
                                   : keller_error(error, KELLER_IO, "%s: cannot be completed: %s", atomic->target,
                                                  strerror(failure));
        unlink(atomic->temporary);
    }
    release(atomic);
    return status;
}

void keller_atomic_abandon(KellerAtomic *atomic)
{
    if (atomic->temporary) unlink(atomic->temporary);
    release(atomic);
}
