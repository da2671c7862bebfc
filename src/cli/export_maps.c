#include "cli/export_maps.h"

#include <stdlib.h>
#include "cli/cli.h"

enum { GAIN, POWERS, SPREAD, STRONGEST, DEPARTURE_AZIMUTH, DEPARTURE_ZENITH, ARRIVAL_AZIMUTH, ARRIVAL_ZENITH, LEVEL, KINDS };
static const struct {
    const char *dataset, *json;
    bool each_frequency;
} kinds[KINDS] = {{"path_gain", "path_gain", true}, {"path_gain_incoherent", "path_gain_incoherent", true},
                  {"delay_spread", "delay_spread_s", false}, {"strongest_delay", "strongest_delay_s", false},
                  {"departure_azimuth_spread", "departure_azimuth_spread_rad", false}, {"departure_zenith_spread", "departure_zenith_spread_rad", false},
                  {"arrival_azimuth_spread", "arrival_azimuth_spread_rad", false}, {"arrival_zenith_spread", "arrival_zenith_spread_rad", false},
                  {"level", "level_dB", true}};

typedef struct {
    KellerReader *reader;
    const KellerResultInfo *info;
    const char *id;
    size_t ny, nx;
    double *x, *y, *z, *cells[KINDS];   /* owned; cells of a kind that the result has not are NULL */
} Map;

static void map_free(Map *m)
{
    double *const owned[] = {m->x, m->y, m->z};
    for (size_t i = 0; i < sizeof owned / sizeof *owned; ++i) free(owned[i]);
    for (int k = 0; k < KINDS; ++k) free(m->cells[k]);
}

static bool has(const Map *m, int kind)
{
    char path[400];
    snprintf(path, sizeof path, "/coverage/%s/%s", m->id, kinds[kind].dataset);
    return keller_reader_has(m->reader, path);
}

static KellerStatus map_open(Map *m, const char *file, size_t set, KellerError *error)
{
    char path[400];
    m->id = m->info->set_ids[set];
    m->ny = m->info->set_shapes[set][0];
    m->nx = m->info->set_shapes[set][1];
    snprintf(path, sizeof path, "/coverage/%s", m->id);
    if (!keller_reader_has(m->reader, path))
        return keller_error(error, KELLER_BAD_INPUT, "%s: holds no coverage of the grid \"%.60s\"; expected a run with <output coverage=\"yes\"/>",
                            file, m->id);
    size_t cells = m->ny * m->nx;
    m->x = calloc(m->nx + 1, sizeof *m->x);
    m->y = calloc(m->ny + 1, sizeof *m->y);
    m->z = calloc(cells + 1, sizeof *m->z);
    if (!m->x || !m->y || !m->z) return keller_error_memory(error, cells * sizeof *m->z);
    for (int k = 0; k < KINDS; ++k) {
        if (!has(m, k)) continue;
        m->cells[k] = calloc(cells + 1, sizeof *m->cells[k]);
        if (!m->cells[k]) return keller_error_memory(error, cells * sizeof *m->cells[k]);
    }
    snprintf(path, sizeof path, "/coverage/%s/x", m->id);
    KellerStatus status = keller_reader_rows(m->reader, path, KELLER_CELL_F8, 1, 0, m->nx, m->x, error);
    snprintf(path, sizeof path, "/coverage/%s/y", m->id);
    if (status == KELLER_OK) status = keller_reader_rows(m->reader, path, KELLER_CELL_F8, 1, 0, m->ny, m->y, error);
    snprintf(path, sizeof path, "/coverage/%s/z", m->id);
    if (status == KELLER_OK) status = keller_reader_rows(m->reader, path, KELLER_CELL_F8, m->nx, 0, m->ny, m->z, error);
    return status;
}

/* One transmitter's map of a kind, at a frequency where there is one for each. */
static KellerStatus map_read(Map *m, int kind, size_t tx, size_t frequency, KellerError *error)
{
    char path[400];
    const uint64_t at[] = {tx, frequency, 0, 0}, box[] = {1, 1, m->ny, m->nx}, flat[] = {tx, 0, 0}, flat_box[] = {1, m->ny, m->nx};
    if (!m->cells[kind]) return KELLER_OK;
    snprintf(path, sizeof path, "/coverage/%s/%s", m->id, kinds[kind].dataset);
    return kinds[kind].each_frequency ? keller_reader_box(m->reader, path, KELLER_CELL_F8, 4, at, box, m->cells[kind], error)
                                      : keller_reader_box(m->reader, path, KELLER_CELL_F8, 3, flat, flat_box, m->cells[kind], error);
}

/* ---- CSV ------------------------------------------------------------------------------------------------------------- */

static KellerStatus write_csv(Map *m, FILE *out, KellerError *error)
{
    static const char *const names[KINDS] = {"path_gain", "path_gain_incoherent", "delay_spread/s", "strongest_delay/s", "departure_azimuth_spread/rad",
                                             "departure_zenith_spread/rad", "arrival_azimuth_spread/rad", "arrival_zenith_spread/rad", "level/dB"};
    fputs("tx,frequency/Hz,x/m,y/m,z/m", out);
    for (int k = 0; k < KINDS; ++k)
        if (m->cells[k]) fprintf(out, ",%s", names[k]);
    fputc('\n', out);
    KellerStatus status = KELLER_OK;
    for (uint64_t t = 0; t < m->info->transmitter_count; ++t)
        for (uint64_t f = 0; f < m->info->frequency_count; ++f) {
            for (int k = 0; k < KINDS && status == KELLER_OK; ++k) status = map_read(m, k, t, f, error);
            for (size_t i = 0; i < m->ny * m->nx && status == KELLER_OK; ++i) {
                keller_put_csv(out, m->info->transmitter_ids[t]);
                fprintf(out, ",%.17g,%.17g,%.17g,%.17g", m->info->frequencies[f], m->x[i % m->nx], m->y[i / m->nx], m->z[i]);
                for (int k = 0; k < KINDS; ++k)
                    if (m->cells[k]) fprintf(out, ",%.17g", m->cells[k][i]);
                fputc('\n', out);
            }
        }
    return status;
}

/* ---- JSON ------------------------------------------------------------------------------------------------------------ */

static void put_row(FILE *out, size_t count, const double *values)
{
    for (size_t i = 0; i < count; ++i) {
        fputs(i ? ", " : "[", out);
        keller_put_json_number(out, values[i]);
    }
    fputs(count ? "]" : "[]", out);
}

static void put_table(FILE *out, size_t ny, size_t nx, const double *values)
{
    fputc('[', out);
    for (size_t j = 0; j < ny; ++j) {
        fputs(j ? ",\n  " : "\n  ", out);
        put_row(out, nx, &values[j * nx]);
    }
    fputc(']', out);
}

static KellerStatus write_json(Map *m, FILE *out, KellerError *error)
{
    KellerStatus status = KELLER_OK;
    fputs("{\"grid\": ", out);
    keller_put_json(out, m->id);
    fputs(", \"frequencies_Hz\": ", out);
    put_row(out, m->info->frequency_count, m->info->frequencies);
    fputs(",\n \"x_m\": ", out);
    put_row(out, m->nx, m->x);
    fputs(",\n \"y_m\": ", out);
    put_row(out, m->ny, m->y);
    fputs(",\n \"z_m\": ", out);
    put_table(out, m->ny, m->nx, m->z);
    fputs(",\n \"maps\": [", out);
    for (uint64_t t = 0; t < m->info->transmitter_count; ++t) {
        fputs(t ? ",\n {\"tx\": " : "\n {\"tx\": ", out);
        keller_put_json(out, m->info->transmitter_ids[t]);
        for (int k = 0; k < KINDS; ++k) {
            if (!m->cells[k]) continue;
            uint64_t count = kinds[k].each_frequency ? m->info->frequency_count : 1;
            fprintf(out, ",\n  \"%s\": %s", kinds[k].json, kinds[k].each_frequency ? "[" : "");
            for (uint64_t f = 0; f < count && status == KELLER_OK; ++f) {
                status = map_read(m, k, t, f, error);
                if (f) fputs(", ", out);
                put_table(out, m->ny, m->nx, m->cells[k]);
            }
            if (kinds[k].each_frequency) fputc(']', out);
        }
        fputc('}', out);
    }
    fputs("]}\n", out);
    return status;
}

/* ---- XDMF ------------------------------------------------------------------------------------------------------------ */

static void put_xml(FILE *out, const char *text)
{
    for (; *text; ++text) {
        if (*text == '&') fputs("&amp;", out);
        else if (*text == '<') fputs("&lt;", out);
        else if (*text == '"') fputs("&quot;", out);
        else fputc((unsigned char)*text < 32 ? '?' : *text, out);
    }
}

/* The item that is a whole dataset. */
static void put_dataset(FILE *out, const char *link, const char *dimensions, const char *type, int bytes, const char *path)
{
    fprintf(out, "<DataItem Dimensions=\"%s\" NumberType=\"%s\" Precision=\"%d\" Format=\"HDF\">", dimensions, type, bytes);
    put_xml(out, link);
    fputc(':', out);
    put_xml(out, path);
    fputs("</DataItem>\n", out);
}

static void put_scene(const KellerResultInfo *info, const char *link, FILE *out)
{
    char dimensions[64];
    const unsigned long long triangles = info->triangles, vertices = info->vertices;
    if (triangles == 0) return;
    fprintf(out, "<Grid Name=\"scene\" GridType=\"Uniform\">\n<Topology TopologyType=\"Triangle\" NumberOfElements=\"%llu\">", triangles);
    snprintf(dimensions, sizeof dimensions, "%llu 3", triangles);
    put_dataset(out, link, dimensions, "UInt", 4, "/scene/triangles");
    fputs("</Topology>\n<Geometry GeometryType=\"XYZ\">", out);
    snprintf(dimensions, sizeof dimensions, "%llu 3", vertices);
    put_dataset(out, link, dimensions, "Float", 8, "/scene/vertices");
    fputs("</Geometry>\n</Grid>\n", out);
}

/* The item of the grid's rows in /receivers/position. */
static void put_places(const KellerResultInfo *info, size_t set, const char *link, FILE *out)
{
    uint64_t first = 0;
    while (first < info->receiver_count && info->receiver_sets[first] != set) ++first;
    unsigned long long cells = (unsigned long long)info->set_shapes[set][0] * info->set_shapes[set][1];
    char dimensions[64];
    fprintf(out, "<Geometry GeometryType=\"XYZ\"><DataItem ItemType=\"HyperSlab\" Dimensions=\"%llu 3\">\n"
                 "<DataItem Dimensions=\"3 2\" Format=\"XML\">%llu 0 1 1 %llu 3</DataItem>\n", cells, (unsigned long long)first, cells);
    snprintf(dimensions, sizeof dimensions, "%llu 3", (unsigned long long)info->receiver_count);
    put_dataset(out, link, dimensions, "Float", 8, "/receivers/position");
    fputs("</DataItem></Geometry>\n", out);
}

static void put_attributes(const Map *m, int kind, const char *link, FILE *out)
{
    const unsigned long long T = m->info->transmitter_count, F = m->info->frequency_count, ny = m->ny, nx = m->nx;
    char dimensions[120], path[400];
    snprintf(path, sizeof path, "/coverage/%s/%s", m->id, kinds[kind].dataset);
    snprintf(dimensions, sizeof dimensions, "%llu %llu %llu %llu", T, F, ny, nx);
    for (unsigned long long t = 0; t < T; ++t)
        for (unsigned long long f = 0; f < F; ++f) {
            fprintf(out, "<Attribute Name=\"%s ", kinds[kind].dataset);
            put_xml(out, m->info->transmitter_ids[t]);
            fprintf(out, " %.6g Hz\" AttributeType=\"Scalar\" Center=\"Node\"><DataItem ItemType=\"HyperSlab\" Dimensions=\"1 %llu %llu\">\n"
                         "<DataItem Dimensions=\"3 4\" Format=\"XML\">%llu %llu 0 0 1 1 1 1 1 1 %llu %llu</DataItem>\n",
                    m->info->frequencies[f], ny, nx, t, f, ny, nx);
            put_dataset(out, link, dimensions, "Float", 8, path);
            fputs("</DataItem></Attribute>\n", out);
        }
}

static void write_xdmf(KellerReader *reader, const char *link, FILE *out)
{
    const KellerResultInfo *info = keller_reader_info(reader);
    fputs("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n<Xdmf Version=\"3.0\">\n<Domain>\n", out);
    put_scene(info, link, out);
    for (uint64_t s = 0; s < info->set_count; ++s) {
        Map m = {.reader = reader, .info = info, .id = info->set_ids[s], .ny = info->set_shapes[s][0], .nx = info->set_shapes[s][1]};
        if (info->set_kinds[s] != KELLER_SET_GRID || !has(&m, GAIN)) continue;
        fputs("<Grid Name=\"", out);
        put_xml(out, m.id);
        fprintf(out, "\" GridType=\"Uniform\">\n<Topology TopologyType=\"3DSMesh\" Dimensions=\"1 %zu %zu\"/>\n", m.ny, m.nx);
        put_places(info, s, link, out);
        put_attributes(&m, GAIN, link, out);
        put_attributes(&m, POWERS, link, out);
        if (has(&m, LEVEL)) put_attributes(&m, LEVEL, link, out);
        fputs("</Grid>\n", out);
    }
    fputs("</Domain>\n</Xdmf>\n", out);
}

KellerStatus keller_export_maps(KellerReader *reader, const char *file, size_t set, KellerExportFormat format, const char *link, FILE *out,
                                KellerError *error)
{
    if (format == KELLER_EXPORT_XDMF) {
        write_xdmf(reader, link, out);
        return KELLER_OK;
    }
    Map map = {.reader = reader, .info = keller_reader_info(reader)};
    KellerStatus status = map_open(&map, file, set, error);
    if (status == KELLER_OK) status = (format == KELLER_EXPORT_CSV ? write_csv : write_json)(&map, out, error);
    map_free(&map);
    return status;
}
