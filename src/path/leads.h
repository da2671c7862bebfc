/* Ways with reflections and diffractions between an end and the patches that scatter: a way to a patch is one to its face, as the
 * search finds them, solved for the patch's middle. */
#ifndef KELLER_PATH_LEADS_H
#define KELLER_PATH_LEADS_H
#include "path/scatter.h"

/* Sequences of at least one reflection or diffraction that may lead from an end to faces with patches. */
typedef struct {
    KellerVec3 end;
    Trie trie;
    uint32_t *node;             /* sequences, each with the face with patches as its last step */
    uint32_t count;
} Leads;

/* KELLER_FAILED: memory. Free with leads_free. */
KellerStatus leads_find(const Scattering *s, KellerVec3 end, uint32_t threads, Leads *leads, TreeWork *work, KellerError *error);
void leads_free(Leads *leads);

/* false ends the walk. The way begins at the end, or, to_end, at the patch. */
typedef bool (*LeadFound)(void *context, uint32_t patch, const KellerPath *way);
/* Solves one of the sequences for each patch of its face that passes `fewest` (NULL: all do): of which fewest[patch] bends and those
 * of the sequence are together no more than asked for. Slabs on the way are steps of it. Returns false if found did. */
bool leads_walk(const Scattering *s, const Leads *leads, uint32_t lead, bool to_end, const uint8_t *fewest, LeadFound found,
                void *context, JoinWork *work);
#endif
