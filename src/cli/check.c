#include <stdio.h>
#include "cli/cli.h"

KellerStatus keller_cli_check(int argc, char **argv, KellerError *error)
{
    enum { DEFINE };
    static const KellerOption options[] = {{NULL, 'D', true}, {0}};
    KellerArguments arguments = {.verb = "check", .argc = argc, .argv = argv};
    KellerVariables variables = {0};
    const char *file = NULL, *value;
    KellerStatus status = KELLER_OK;
    for (int what; status == KELLER_OK &&
                   (what = keller_next_argument(&arguments, options, &value, error)) != KELLER_ARGUMENT_END;) {
        if (what == DEFINE) status = keller_variables_add(&variables, "check", value, error);
        else if (what == KELLER_ARGUMENT_WRONG) status = KELLER_USAGE;
        else if (file) status = keller_usage(error, "check", "\"%s\" is one configuration too many", value);
        else file = value;
    }
    if (status == KELLER_OK && !file) status = keller_usage(error, "check", "a configuration is expected");
    if (status == KELLER_OK) {
        KellerPrepared prepared;
        status = keller_prepare_config(file, &variables, &prepared, error);
        if (status == KELLER_OK) status = keller_prepare_scene(&prepared, error);
        if (status == KELLER_OK) {
            keller_print_configuration(&prepared.config);
            keller_print_scene(&prepared.soup, &prepared.scene, true);
            keller_print_surfaces(&prepared.config);
            keller_print_opaque(&prepared.config, &prepared.scene);
            keller_print_strips(&prepared.config, &prepared.scene);
            printf("would trace %zu transmitter%s to %zu receiver%s at %zu frequenc%s; nothing was simulated\n",
                   prepared.config.transmitter_count, prepared.config.transmitter_count == 1 ? "" : "s",
                   prepared.config.receiver_count, prepared.config.receiver_count == 1 ? "" : "s",
                   prepared.config.frequency_count, prepared.config.frequency_count == 1 ? "y" : "ies");
        }
        keller_prepared_free(&prepared);
    }
    keller_variables_free(&variables);
    return status;
}
