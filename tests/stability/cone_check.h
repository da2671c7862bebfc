/* cone_check.h -- one case of one test of keller/cone.h through the kernel and through the oracle, and what came of
 * it. Shared by the stability test, the measurements (keller bench cone) and the fuzz target. */
#ifndef TEST_CONE_CHECK_H
#define TEST_CONE_CHECK_H
#include "cone_cases.h"
#include "cone_oracle.h"

/* What the kernel said of a case that is not one of eight. */
typedef struct {
    KellerRange range;
    KellerVec3 nearest, farthest;
    bool yes; /* its Boolean form; the whole answer of a containment */
} ConeAnswer;

typedef struct {
    uint64_t cases, met;            /* and in how many the truth is yes */
    uint64_t missed;                /* the truth is yes, the answer no */
    uint64_t too_short;             /* the reported range leaves out a part of the true one */
    uint64_t false_positive;        /* the answer yes, the truth no */
    uint64_t yes_missed, yes_false; /* the same two of the Boolean form of a range */
    uint64_t disagree;              /* the Boolean form says no and the range yes, or (but for boxes) the other way */
    uint64_t scalar_differs;        /* the scalar build's answer is not the same, bit for bit */
    /* The largest errors over true hits, in units of 2^-23 times the scale: how far the primitive reaches from the
     * origin. By how much a range reaches beyond the true one of the cone widened by the slack (where the primitive
     * runs along the envelope, the slack alone moves an end of the range far); by how much beyond that of the cone
     * itself, over random cases; how far a reported point is from the primitive, outside the cone, or from the end of
     * its range. */
    double range_error, plain_error, point_error;
    uint64_t first_wrong; /* index of the first case in which something must not be; UINT64_MAX: none */
} ConeTally;

/* What must be 0. */
static inline uint64_t cone_tally_wrong(const ConeTally *t)
{
    return t->missed + t->too_short + t->yes_missed + t->disagree + t->scalar_differs;
}
void cone_tally_add(ConeTally *sum, const ConeTally *t);
extern const ConeTally cone_tally_zero;

ConeAnswer cone_ask(ConeKind kind, const ConeCase *c);
/* Holds an answer against the oracle. `quad`: in 113 bits at once; otherwise long double, grown so as to miss nothing
 * (by a thousandth of the kernel's slack, and as much is let pass as no false positive), and 113 bits only where the
 * answer then seems wrong. */
void cone_judge(ConeKind kind, const ConeCase *c, const ConeAnswer *answer, bool quad, ConeTally *tally);
/* The eight-wide forms: asks and judges. */
void cone_check8(ConeKind kind, const ConeCase8 *c, bool quad, ConeTally *tally);
/* Draws, asks and judges; adds to rows[decade * CONE_ROUNDNESSES + roundness]. */
enum { CONE_ROWS = CONE_DECADES * CONE_ROUNDNESSES };
void cone_check(ConeKind kind, uint64_t seed, uint64_t index, bool quad, ConeTally rows[CONE_ROWS]);
/* cone_check of cases [0, count) by `threads` threads (0: as OpenMP likes), one in `quad_every` in 113 bits at once. */
void cone_check_all(ConeKind kind, uint64_t seed, uint64_t count, int threads, uint64_t quad_every,
                    ConeTally rows[CONE_ROWS]);
/* A case as text, hexadecimal floats, for a message. */
void cone_case_print(ConeKind kind, const ConeCase *c);
extern const char *const cone_kind_names[CONE_KINDS];
#endif
