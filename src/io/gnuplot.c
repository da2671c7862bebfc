#define _GNU_SOURCE
#include "io/gnuplot.h"

#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <string.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

extern char **environ;

void keller_gnuplot_text(FILE *script, const char *text)
{
    fputc('\'', script);
    for (; *text; ++text) {
        if (*text == '\'') fputc('\'', script);
        fputc((unsigned char)*text < 32 || *text == 127 ? '?' : *text, script);
    }
    fputc('\'', script);
}

/* gnuplot's complaint in one line: the first that says something, without its arrow. */
static void complaint(FILE *messages, char *text, size_t size)
{
    char line[400];
    text[0] = '\0';
    rewind(messages);
    while (fgets(line, sizeof line, messages)) {
        line[strcspn(line, "\n")] = '\0';
        const char *start = line + strspn(line, " \t^");
        if (*start && !strstr(line, "gnuplot>")) snprintf(text, size, "%s", start);
        if (strstr(line, "line ") && *start) break;
    }
}

static KellerStatus spawn(FILE *script, int picture, FILE *messages, const char *name, KellerError *error)
{
    posix_spawn_file_actions_t files;
    posix_spawnattr_t attributes;
    sigset_t none, plain;
    sigemptyset(&none);
    sigfillset(&plain);
    posix_spawn_file_actions_init(&files);
    posix_spawn_file_actions_adddup2(&files, fileno(script), STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&files, picture, STDOUT_FILENO);
    posix_spawn_file_actions_adddup2(&files, fileno(messages), STDERR_FILENO);
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setsigmask(&attributes, &none);
    posix_spawnattr_setsigdefault(&attributes, &plain);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
    char program[] = "gnuplot", plainly[] = "--default-settings", input[] = "-";
    char *const arguments[] = {program, plainly, input, NULL};
    pid_t child;
    int failure = posix_spawnp(&child, program, &files, &attributes, arguments, environ);
    posix_spawn_file_actions_destroy(&files);
    posix_spawnattr_destroy(&attributes);
    if (failure == ENOENT)
        return keller_error(error, KELLER_FAILED,
                            "%s: the program gnuplot is needed for pictures and was not found; install it (Debian: "
                            "gnuplot-nox)", name);
    if (failure) return keller_error(error, KELLER_FAILED, "%s: gnuplot cannot be run: %s", name, strerror(failure));
    int status = 0;
    while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return KELLER_OK;
    char text[400];
    complaint(messages, text, sizeof text);
    if (WIFSIGNALED(status))
        return keller_error(error, KELLER_FAILED, "%s: gnuplot was killed by signal %d", name, WTERMSIG(status));
    return keller_error(error, KELLER_FAILED, "%s: gnuplot failed: %s", name, text[0] ? text : "it did not say why");
}

KellerStatus keller_gnuplot(FILE *script, const char *output, const char *name, KellerError *error)
{
    if (fflush(script) != 0 || ferror(script) || lseek(fileno(script), 0, SEEK_SET) != 0)
        return keller_error(error, KELLER_IO, "%s: the plot's data cannot be written to a temporary file: %s", name,
                            strerror(errno));
    int picture = open(output, O_WRONLY | O_TRUNC | O_CLOEXEC);
    if (picture < 0) return keller_error(error, KELLER_IO, "%s: cannot be written: %s", name, strerror(errno));
    FILE *messages = tmpfile();
    KellerStatus status = messages ? spawn(script, picture, messages, name, error)
                                   : keller_error(error, KELLER_IO, "%s: no temporary file: %s", name, strerror(errno));
    struct stat written;
    if (status == KELLER_OK && fstat(picture, &written) == 0 && written.st_size == 0)
        status = keller_error(error, KELLER_IO, "%s: gnuplot wrote nothing (is the disk full?)", name);
    if (messages) fclose(messages);
    close(picture);
    return status;
}
