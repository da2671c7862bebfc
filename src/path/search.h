/* The state of a candidate search, shared by its files: what a beam meets (meet.c), what it becomes at a wedge (fan.c), which cells of a
 * map it reaches (reach.c), what hides things from it (hidden.c), what is put off (pending.c), and the search itself (tree.c). */
#ifndef KELLER_PATH_SEARCH_H
#define KELLER_PATH_SEARCH_H
#include "path/slabs.h"
#include "path/tree.h"

#define SEARCH_SPHERE 0.2       /* share of a search that looking around from the end is, about: the rest is what was put off */

typedef struct {
    uint32_t node;              /* the sequence so far */
    Bundle bundle;              /* its rays: from images of the end, or of the piece of edge that they fan out from */
    uint32_t mirror;            /* face it was last reflected in, or KELLER_NONE */
    uint32_t wedge;             /* wedge it fans out from, or KELLER_NONE */
    uint32_t passed;            /* slabs that each of its rays has surely passed through on the way */
    double piece[2];            /* m along the edge of the last wedge: where the two sources are images of, */
    double z[2], rho[2];        /* and between which the sources before it are, along it and away from its line */
    double share;               /* of the sphere, of a beam from the end itself */
    uint32_t halved;            /* so many times was the piece */
    bool whole;                 /* not to be split */
} Beam;

typedef struct {
    uint32_t face;
    double near;
} HitFace;

/* The beams of one sequence from one source, together: the smallest window in a frame of its own that holds theirs. */
typedef struct {
    uint32_t node, mirror, passed, source_count;
    KellerVec3 source[SOURCES], along;
    Slopes slopes;
} Pending;

/* The parts of the edge of a sequence's last wedge that are lit from one source, together. */
typedef struct {
    uint32_t node, wedge, passed;
    KellerVec3 source;          /* the end, or its image behind the last mirror */
    double from, to;            /* m along the edge */
} PendingFan;

typedef struct {
    const TreeLimits *limits;
    KellerVec3 end;
    Trie trie;
    TreeWork work;
    bool failed;                /* out of memory, or too many cells reached: nothing more is searched */
    uint32_t *stamp, *slot;     /* [face_count]: query that last met the face, and its place among the hits */
    uint32_t query;
    Pending *pending;           /* [pending_room] sequences of which only what they meet next is asked for: the many small */
    uint32_t pending_count, pending_room;   /* beams that are found of each at different times are followed as one */
    PendingFan *fan;            /* [fan_room] */
    uint32_t fan_count, fan_room;
    uint32_t *place, place_capacity;    /* [nodes of the trie]: where among the pending ones a node may be */
    CellCandidates reached;
    size_t *together;           /* candidates of all threads, to a CHUNK */
    bool full;                  /* they are more than allowed */
    double *looked;             /* share of the sphere that all threads are done with */
    bool reports, last;         /* this thread says how far the search is; nothing more will be put off */
    bool gathers;               /* of what all threads put off: as many as there are */
} Search;

/* One beam's look at the scene. */
typedef struct {
    Search *search;
    const Beam *beam;
    BundleTest test;
    KellerCone cone;
    double start_near, start_far;   /* z where rays of the beam start */
    double front;                   /* sign of the mirror's side the rays are on; 0: no mirror, or not to be told */
    double far;                     /* nothing beyond this can be seen */
    Slabs slabs;
    bool may_split, too_much;
    bool to_end;                /* only wedges from which rays go on to the limits' target_end are asked for */
    uint32_t much;
    uint32_t faces, wedges, face_capacity, wedge_capacity;
    HitFace *face;
    uint32_t *wedge;
} Query;

/* The part of a wedge's edge inside the cone, m from its start. */
typedef struct {
    double from, to;
    double near;                /* of the cone's z */
} Piece;

/* The array with room for one more; as it was, and the search failed, without memory. */
void *search_room(Search *s, void *array, uint32_t count, uint32_t *capacity, size_t size);
/* The sign of the mirror's side that a reflected beam's rays are on; 0: no mirror, or not to be told. */
double beam_front(const Beam *beam, const KellerScene *scene);
/* The beam's cone and where its rays start; false if it is too wide for one cone. `slabs`: that its rays may pass through. Free with
 * query_free. */
bool query_of(Query *q, Search *search, const Beam *beam, uint32_t slabs);
/* The same for query_hides and query_blocked alone, which need no cone: z is along the window's middle, from the first source.
 * False if not all rays run well along that. Not to be freed. */
bool query_look(Query *q, Search *search, const Beam *beam);
void query_free(Query *q);
/* Does the face cross all rays of the beam, so that nothing behind it is reached? If so *far is its farthest z. */
bool query_blocked(const Query *q, uint32_t face, double *far);
/* Do the beam's rays start in this plane: that of its mirror, or one of the faces at its edge? */
bool query_starts_in(const Query *q, uint32_t plane);
/* Collects the faces met, and q->far behind those that all rays meet, and the wedges met, where asked for, or sets too_much. Some wedges may
 * lie behind q->far: query_piece leaves them out. */
void query_scene(Query *q, bool faces, bool wedges);
/* The part of a wedge met; false: none. */
bool query_piece(const Query *q, uint32_t wedge, Piece *piece);

/* Does a face that a ray from the middle of the sources to b meets stop all of the beam before `near` (m along the cone's directrix)? Faces in
 * `plane`, and slabs that may be passed through, do not count. *met: whether the ray meets anything else. */
bool query_hides(const Query *q, KellerVec3 b, double near, uint32_t plane, bool *met);
/* What a ray down the middle of a beam, narrowed to a face, tells of its way there. */
typedef struct {
    bool hidden;                /* none of its rays gets there */
    bool met;                   /* this one does not */
    double length;              /* m: of its rays' ways to the face, at most; 0: not known */
} WayTo;
WayTo way_to_face(Search *search, const Beam *beam, uint32_t face);
/* The same of all its rays to the edge from a to b: are they surely stopped? */
bool edge_hidden(Search *search, const Beam *beam, KellerVec3 a, KellerVec3 b);

/* Looks for what follows the beam's sequence. */
void search_next(Search *s, const Beam *beam);
/* The same, and for the cells that the beam reaches. */
void search_beam(Search *s, const Beam *beam);

/* Puts the beam off, together with others of its sequence; false if that cannot be. */
bool put_off_beam(Search *s, const Beam *beam);
/* Puts the fan off, together with others of its sequence. */
void put_off_fan(Search *s, const PendingFan *fan);
/* Follows the beams that were put off, then the fans, since the beams may add to them; fans add to neither. */
void pending_follow(Search *s);
/* The same for what all threads put off, each with its own s and one `all`: sequences that several have found are followed once, by
 * whoever is free. To be called by all threads of a team. */
void pending_share(Search *s, Search *all);
/* Keller's law: rays leave the edge at the angle beta at which they came, from the `count` sources (1 or 2, the ends of a segment): the
 * beams from the part from .. to (m) of the wedge's edge, whose sequence is `node`. */
void search_fan(Search *s, uint32_t node, uint32_t wedge, double from, double to, uint32_t count, const KellerVec3 *source, uint32_t passed);
/* Adds the cells that the beam may reach. */
void search_cells(Search *s, const Beam *beam);
/* The same for a beam that runs to the face and is mirrored there, its sequence then `node`; narrowed to the face. Parts of it that do
 * not get there are left out. */
void search_mirrored(Search *s, const Beam *before, uint32_t face, uint32_t node);
/* What of the beam may be mirrored in the face: its window as bundle_narrow has it, and of a beam from an edge the part of the edge from
 * which Keller's law leads there. False: nothing. */
bool beam_narrow(Beam *beam, const KellerScene *scene, uint32_t face);
/* The two halves of the beam's window, as window_halves has them. */
int beam_halves(const Beam *beam, Beam half[2]);
/* The beams of the two halves of its piece of edge. */
void beam_pieces(const Beam *beam, Beam half[2]);
#endif
