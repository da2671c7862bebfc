/* How far a long piece of work is, as a part of a longer one. */
#ifndef KELLER_PATH_ADVANCE_H
#define KELLER_PATH_ADVANCE_H

typedef struct {
    void (*report)(void *context, double fraction);     /* of the whole, in [0, 1]; one that is less than before is not told */
    void *context;
    double from, to;            /* the piece's share of the whole */
} Advance;

/* Says how much of the piece is done; nothing where nobody listens. For one thread. */
static inline void advance(const Advance *piece, double done)
{
    if (piece) piece->report(piece->context, piece->from + (done < 1 ? done : 1) * (piece->to - piece->from));
}
#endif
