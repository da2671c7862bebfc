#include "io/result_sound.h"

#include <complex.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include "keller/sound.h"

KellerStatus keller_result_sound(KellerHdf *hdf, const KellerConfig *config, KellerError *error)
{
    size_t F = config->frequency_count, T = config->transmitter_count;
    const hsize_t table[] = {T, F};
    double *values = malloc((T * F + F + 1) * sizeof *values);
    if (!values) return keller_error_memory(error, (T + 1) * F * sizeof *values);
    for (size_t t = 0; t < T; ++t)
        for (size_t f = 0; f < F; ++f) values[t * F + f] = config->transmitters[t].level[f];
    keller_hdf_table(hdf, "/transmitters/level", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 2, table, "dB", values);
    for (size_t f = 0; f < F; ++f)
        values[f] = config->bands_per_octave ? keller_band_width(config->bands_per_octave, config->frequencies[f]) : 0;
    keller_hdf_table(hdf, "/medium/bandwidth", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 1, &table[1], "Hz", values);
    for (size_t f = 0; f < F; ++f) values[f] = keller_sound_loss(&config->sound, config->frequencies[f]);
    keller_hdf_table(hdf, "/medium/absorption", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 1, &table[1], "dB/m", values);
    keller_hdf_table(hdf, "/medium/speed", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 0, NULL, "m/s", &config->sound.speed);
    free(values);
    return KELLER_OK;
}

KellerStatus keller_result_surfaces(KellerHdf *hdf, const KellerConfig *config, const KellerScene *scene, KellerError *error)
{
    size_t M = scene->material_count, F = config->frequency_count, cells = M * F;
    double complex *impedance = malloc((cells + 1) * sizeof *impedance);
    double *absorption = malloc((cells + M + 1) * sizeof *absorption), *scattering = absorption + cells;
    char **names = malloc((M + 1) * sizeof *names);
    if (!impedance || !absorption || !names) {
        free(impedance);
        free(absorption);
        free(names);
        return keller_error_memory(error, cells * sizeof *impedance);
    }
    for (size_t m = 0; m < M; ++m) {
        const KellerMaterial *material = &scene->materials[m];
        names[m] = material->name;
        scattering[m] = material->scattering;
        for (size_t f = 0; f < F; ++f) {
            KellerMedium medium;
            double *alpha = &absorption[m * F + f];
            impedance[m * F + f] = NAN + I * NAN;
            *alpha = NAN;
            if (!keller_material_of_sound(material->kind)) continue; /* allowed where no face has it */
            keller_sound_medium(material, config->frequencies[f], &medium);
            if (medium.impedance != 0) {
                impedance[m * F + f] = medium.impedance;
                double complex r = (medium.impedance - 1) / (medium.impedance + 1);
                *alpha = 1 - creal(r * conj(r));
            } else {
                *alpha = material->scattering < 1 ? 1 - medium.factor * medium.factor / (1 - material->scattering) : NAN;
            }
        }
    }
    const hsize_t table[] = {M, F};
    keller_hdf_texts(hdf, "/materials/name", M, names);
    keller_hdf_table(hdf, "/materials/absorption", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 2, table, "1", absorption);
    keller_hdf_table(hdf, "/materials/impedance", hdf->complex_type, hdf->complex_type, 2, table, "1", impedance);
    keller_hdf_table(hdf, "/materials/scattering", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 1, table, "1", scattering);
    free(impedance);
    free(absorption);
    free(names);
    return KELLER_OK;
}

/* ---- responses ---------------------------------------------------------------------------------------------------------- */

static const char *const room_names[7] = {"edt", "t20", "t30", "c50", "c80", "d50", "g"};
static const char *const room_units[7] = {"s", "s", "s", "dB", "dB", "1", "dB"};

void keller_responses_open(KellerHdf *hdf, KellerResponseColumns *c, const KellerConfig *config)
{
    const hsize_t samples[] = {(hsize_t)ceil(config->response_rate * config->response_duration)};
    c->open = true;
    c->bands = keller_room_bands(config->response_rate, c->middle);
    const hsize_t bands[] = {c->bands};
    keller_hdf_table(hdf, "/responses/rate", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 0, NULL, "Hz", &config->response_rate);
    keller_hdf_table(hdf, "/responses/bands", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 1, bands, "Hz", c->middle);
    keller_hdf_column(hdf, &c->tx, "/responses/tx", H5T_STD_U32LE, H5T_NATIVE_UINT32, 0, NULL, NULL);
    keller_hdf_column(hdf, &c->rx, "/responses/rx", H5T_STD_U32LE, H5T_NATIVE_UINT32, 0, NULL, NULL);
    keller_hdf_column(hdf, &c->arrival, "/responses/arrival", H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 0, NULL, "s");
    keller_hdf_column(hdf, &c->pressure, "/responses/pressure", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, 1, samples, "1");
    c->tails = config->response_volume > 0;
    if (c->tails) keller_hdf_column(hdf, &c->tail, "/responses/tail", H5T_IEEE_F32LE, H5T_NATIVE_FLOAT, 1, samples, "1");
    for (int i = 0; i < 7; ++i) {
        char path[32];
        snprintf(path, sizeof path, "/responses/%s", room_names[i]);
        keller_hdf_column(hdf, &c->room[i], path, H5T_IEEE_F64LE, H5T_NATIVE_DOUBLE, 1, bands, room_units[i]);
    }
}

KellerStatus keller_responses_append(KellerHdf *hdf, KellerResponseColumns *c, const KellerResponse *r, KellerError *error)
{
    KellerRoom rooms[KELLER_ROOM_BANDS];
    double values[7][KELLER_ROOM_BANDS];
    if (!keller_room(r, c->bands, c->middle, rooms))
        return keller_error(error, KELLER_FAILED, "out of memory for the decay of %zu samples", r->count);
    for (size_t b = 0; b < c->bands; ++b) {
        const double row[7] = {rooms[b].edt, rooms[b].t20, rooms[b].t30, rooms[b].c50, rooms[b].c80, rooms[b].d50, rooms[b].g};
        for (int i = 0; i < 7; ++i) values[i][b] = row[i];
    }
    keller_column_append(hdf, &c->tx, &r->tx, 1);
    keller_column_append(hdf, &c->rx, &r->rx, 1);
    keller_column_append(hdf, &c->arrival, &r->arrival, 1);
    keller_column_append(hdf, &c->pressure, r->pressure, 1);
    if (c->tails) keller_column_append(hdf, &c->tail, r->tail, 1);
    for (int i = 0; i < 7; ++i) keller_column_append(hdf, &c->room[i], values[i], 1);
    return KELLER_OK;
}

void keller_responses_close(KellerHdf *hdf, KellerResponseColumns *c)
{
    if (!c->open) return;
    keller_column_close(hdf, &c->tx);
    keller_column_close(hdf, &c->rx);
    keller_column_close(hdf, &c->arrival);
    keller_column_close(hdf, &c->pressure);
    if (c->tails) keller_column_close(hdf, &c->tail);
    for (int i = 0; i < 7; ++i) keller_column_close(hdf, &c->room[i]);
    c->open = false;
}
