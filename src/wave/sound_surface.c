/* What surfaces and edges do to sound. The uniform theory's terms are those of keller_utd_terms; a rigid wedge is the hard one of
 * Kouyoumjian and Pathak, and the faces' coefficients enter as in diffraction.c, where waves have two components instead of one. */
#include <string.h>
#include "keller/sound.h"
#include "wave/azimuth.h"
#include "wave/chain.h"

static const double smallest_sine = 1e-12;      /* as in diffraction.c: the limit is reached */
static const double smallest_distance = 1e-100; /* m */

/* Where a frequency lies among the bands: value = (1 - part) of band i + part of band i + 1. */
static uint32_t band_place(const KellerMaterial *m, double frequency, double *part)
{
    *part = 0;
    uint32_t last = m->band_count - 1;
    if (frequency <= m->band[0]) return 0;
    if (frequency >= m->band[last]) return last;
    uint32_t i = 0;
    while (frequency >= m->band[i + 1]) i++;
    *part = log(frequency / m->band[i]) / log(m->band[i + 1] / m->band[i]);
    return i;
}

void keller_sound_medium(const KellerMaterial *material, double frequency, KellerMedium *medium)
{
    *medium = (KellerMedium){.sound = true, .factor = sqrt(1 - material->scattering)};
    if (material->kind == KELLER_MATERIAL_RIGID) return;
    double part, value[2];
    uint32_t i = band_place(material, frequency, &part), next = part > 0 ? i + 1 : i;
    for (int j = 0; j < 2; j++) value[j] = (1 - part) * material->surface[i][j] + part * material->surface[next][j];
    medium->reacts = material->kind == KELLER_MATERIAL_IMPEDANCE;
    if (medium->reacts) medium->impedance = value[0] + I * value[1];
    else medium->factor *= sqrt(1 - value[0]);
}

double complex keller_sound_reflection(const KellerMedium *medium, double cos_incidence)
{
    if (!medium->reacts) return medium->factor;
    double cosine = cos_incidence < 0 ? 0 : cos_incidence > 1 ? 1 : cos_incidence;
    double complex x = medium->impedance * cosine;
    return medium->factor * (x - 1) / (x + 1);
}

/* ---- edges -------------------------------------------------------------------------------------------------------------- */

typedef struct {
    const KellerWedgeWave *wedge;
    double phi_in, phi, sin_beta0;
} Rays;

static Rays rays_of(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out)
{
    EdgeAzimuth incident = edge_azimuth(wedge, v3_scale(in, -1)), diffracted = edge_azimuth(wedge, out);
    return (Rays){wedge, incident.phi, diffracted.phi, fmax(sqrt(incident.r * diffracted.r), smallest_sine)};
}

/* The coefficient of a face for a wave whose azimuth is `angle`. */
static double complex face(const Rays *r, int which, double angle)
{
    double psi = which == 0 ? angle : r->wedge->n * M_PI - angle;
    return keller_sound_reflection(&r->wedge->medium[which], r->sin_beta0 * fabs(sin(psi)));
}

/* `count` reflections, in turn in the one face and the other, of a wave from the azimuth `angle`. */
static double complex reflections(const Rays *r, int first, int count, double angle)
{
    double complex product = 1;
    for (int i = 0, at = first; i < count; i++, at = 1 - at) {
        product *= face(r, at, angle);
        angle = at == 0 ? -angle : 2 * r->wedge->n * M_PI - angle;
    }
    return product;
}

/* `blend` as for dyad_matrices. */
static void term_factors(const Rays *r, double blend, double complex factor[4])
{
    double n = r->wedge->n, nearer0 = fmin(r->phi_in, r->phi), nearer_n = fmax(r->phi_in, r->phi);
    if (n < 1) { /* each term has the reflections of the wave whose boundary is its pole (docs/theory.md, "Sectors below pi") */
        for (int i = 0; i < 4; i++) {
            int count = i < 2 ? 2 * (int)ceil((1 - n) / (2 * n)) : 2 * (int)ceil(1 / (2 * n)) - 1;
            int last = i % 2 == 0 ? 1 : 0, first = count % 2 == 1 ? last : 1 - last;
            factor[i] = 0.5 * (reflections(r, first, count, r->phi_in) + reflections(r, last, count, r->phi));
        }
        return;
    }
    double difference = r->phi - r->phi_in;
    double first = fabs(difference) < blend ? 0.5 * (1 + difference / blend) : difference > 0 ? 1 : 0;
    if (r->wedge->model == KELLER_WEDGE_HOLM) first = r->phi_in <= 0.5 * n * M_PI ? 1 : 0;
    bool luebbers = r->wedge->model == KELLER_WEDGE_LUEBBERS;
    factor[2] = face(r, 1, luebbers ? r->phi : nearer_n);
    factor[3] = face(r, 0, luebbers ? r->phi_in : nearer0);
    double complex both = luebbers ? 1 : factor[2] * factor[3];
    factor[0] = first * both + (1 - first);
    factor[1] = (1 - first) * both + first;
}

double complex keller_sound_diffraction(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, double s_in, double s,
                                        double k)
{
    Rays r = rays_of(wedge, in, out);
    s_in = fmax(s_in, smallest_distance);
    s = fmax(s, smallest_distance);

    double complex d[4], factor[4], sum = 0;
    keller_utd_terms(wedge->n, r.phi, r.phi_in, r.sin_beta0, k, r.sin_beta0 * r.sin_beta0 / (1 / s_in + 1 / s), d);
    term_factors(&r, 0, factor);
    for (int i = 0; i < 4; i++) sum += factor[i] * d[i];
    return sum * sqrt(1 / (s * (1 + s / s_in)));
}

/* ---- edges in a row ------------------------------------------------------------------------------------------------------ */

/* A pressure has one component; dyads are minus their matrices. */
static void join_row(SoundRow *row, const UtdTerm term[4], const double complex factor[4], ChainPlace place)
{
    RowEdge *e = &row->edge[row->count++];
    *e = (RowEdge){.from = {{{1, 0}, {0, 0}}}, .coupling = place.coupling};
    memcpy(e->term, term, sizeof e->term);
    for (int b = 0; b < 4; b++) e->matrix[b].m[0][0] = -factor[b];
}

void sound_chain_begin(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, ChainPlace place, double k, SoundRow *row,
                       SoundChain *c)
{
    Rays r = rays_of(wedge, in, out);
    chain_edge(wedge->n, r.phi, r.phi_in, r.sin_beta0, place.distance, k, &c->edge);
    double complex factor[4];
    term_factors(&r, CHAIN_BLEND, factor);
    memset(c->whole, 0, sizeof c->whole);
    memset(c->rest, 0, sizeof c->rest);
    for (int b = 0; b < 4; b++) c->whole[b][0] = factor[b];
    c->row = row;
    if (!row) return;
    row->count = 0;
    join_row(row, c->edge.term, factor, place);
    memcpy(row->product, c->whole, sizeof row->product);
}

/* The products of terms alone, as sound_chain_next has them. */
static void next_products(const ChainEdge *before, const ChainLink *link, const double complex factor[4], SoundRow *row)
{
    double complex last[4][4];
    memcpy(last, row->product, sizeof last);
    for (int n = 0; n < 4; n++)
        for (int b = 0; b < 4; b++) {
            double complex sum = 0;
            for (int a = 0; a < 4; a++) sum += link->triple[b][a][n] * last[b][a];
            row->product[n][b] = factor[n] * link->ratio[b][n] * chain_value(&before->term[b]) * sum;
        }
}

void sound_chain_next(const KellerWedgeWave *wedge, KellerVec3 in, KellerVec3 out, ChainPlace place, SoundChain *c)
{
    Rays r = rays_of(wedge, in, out);
    SoundChain before = *c;
    ChainLink link;
    double complex factor[4];
    chain_edge(wedge->n, r.phi, r.phi_in, r.sin_beta0, place.distance, before.edge.k, &c->edge);
    chain_link(&before.edge, place.coupling, &c->edge, &link);
    term_factors(&r, CHAIN_BLEND, factor);
    for (int n = 0; n < 4; n++) {
        c->rest[n] = 0;
        for (int b = 0; b < 4; b++) {
            double complex whole = before.rest[b], value = chain_value(&before.edge.term[b]);
            for (int a = 0; a < 4; a++) {
                whole += link.triple[b][a][n] * value * before.whole[b][a];
                c->rest[n] += factor[n] * link.more[b][n] * before.whole[b][a];
            }
            c->whole[n][b] = factor[n] * link.ratio[b][n] * whole;
        }
    }
    if (!c->row) return;
    next_products(&before.edge, &link, factor, c->row);
    join_row(c->row, c->edge.term, factor, place);
}

double complex sound_chain_pressure(const SoundChain *c)
{
    double complex p = 0, product = 0, field[2][2] = {{1, 0}, {0, 0}};
    for (int b = 0; b < 4; b++) {
        for (int a = 0; a < 4; a++) p += chain_value(&c->edge.term[b]) * c->whole[b][a];
        p += c->rest[b];
    }
    double share = c->row ? row_share(c->row->edge, c->row->count) : 0;
    if (!(share > 0) || !row_field(c->row->edge, c->row->count, field)) return p;
    for (int b = 0; b < 4; b++)
        for (int a = 0; a < 4; a++) product += chain_value(&c->edge.term[b]) * c->row->product[b][a];
    return p + share * (field[0][0] - product);
}
