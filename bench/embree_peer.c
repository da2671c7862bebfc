#include "embree_peer.h"

#ifdef BENCH_EMBREE
#include <embree3/rtcore.h>
#include <stdlib.h>
#include <time.h>

struct Peer {
    RTCDevice device;
    RTCScene scene;
    KellerVec3 middle;
};

bool peer_there(void) { return true; }

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static bool fill(Peer *p, size_t triangle_count, const KellerVec3 *vertices, const uint32_t (*triangles)[3])
{
    size_t vertex_count = 0;
    for (size_t i = 0; i < triangle_count; i++)
        for (int k = 0; k < 3; k++)
            if (triangles[i][k] >= vertex_count) vertex_count = (size_t)triangles[i][k] + 1;
    RTCGeometry geometry = rtcNewGeometry(p->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    float *v = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof *v, vertex_count);
    unsigned *t = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof *t, triangle_count);
    bool ok = v && t;
    for (size_t i = 0; ok && i < vertex_count; i++) {
        KellerVec3 q = v3_sub(vertices[i], p->middle);
        v[3 * i] = (float)q.x, v[3 * i + 1] = (float)q.y, v[3 * i + 2] = (float)q.z;
    }
    for (size_t i = 0; ok && i < 3 * triangle_count; i++) t[i] = triangles[i / 3][i % 3];
    if (ok) {
        rtcCommitGeometry(geometry);
        rtcAttachGeometry(p->scene, geometry);
    }
    rtcReleaseGeometry(geometry);
    return ok;
}

Peer *peer_new(size_t triangle_count, const KellerVec3 *vertices, const uint32_t (*triangles)[3], KellerVec3 middle,
               bool robust, double *seconds)
{
    Peer *p = calloc(1, sizeof *p);
    if (!p) return NULL;
    p->middle = middle;
    p->device = rtcNewDevice("threads=1,user_threads=1");
    if (p->device) p->scene = rtcNewScene(p->device);
    if (!p->scene || !fill(p, triangle_count, vertices, triangles)) {
        peer_free(p);
        return NULL;
    }
    rtcSetSceneFlags(p->scene, robust ? RTC_SCENE_FLAG_ROBUST : RTC_SCENE_FLAG_NONE);
    rtcSetSceneBuildQuality(p->scene, RTC_BUILD_QUALITY_MEDIUM);
    double start = now();
    rtcCommitScene(p->scene);
    *seconds = now() - start;
    return p;
}

static struct RTCRayHit ray_of(const Peer *p, KellerVec3 origin, KellerVec3 direction)
{
    KellerVec3 o = v3_sub(origin, p->middle), d = direction;
    struct RTCRayHit r = {.ray = {.org_x = (float)o.x, .org_y = (float)o.y, .org_z = (float)o.z, .dir_x = (float)d.x,
                                  .dir_y = (float)d.y, .dir_z = (float)d.z, .tfar = INFINITY, .mask = ~0u}};
    r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    return r;
}

size_t peer_nearest(Peer *p, size_t count, const KellerVec3 *origins, const KellerVec3 *directions)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    size_t hits = 0;
    for (size_t i = 0; i < count; i++) {
        struct RTCRayHit r = ray_of(p, origins[i], directions[i]);
        rtcIntersect1(p->scene, &context, &r);
        hits += r.hit.geomID != RTC_INVALID_GEOMETRY_ID;
    }
    return hits;
}

typedef struct {
    struct RTCIntersectContext context; /* first, so that the filter finds the rest */
    PeerHit *hits;
    size_t count, most;
} Collecting;

static void collect(const struct RTCFilterFunctionNArguments *args)
{
    Collecting *c = (Collecting *)args->context;
    if (c->count < c->most)
        c->hits[c->count++] = (PeerHit){((const struct RTCRay *)args->ray)->tfar, ((const struct RTCHit *)args->hit)->primID};
    args->valid[0] = 0;
}

bool peer_set_filter(Peer *p)
{
    RTCGeometry geometry = rtcGetGeometry(p->scene, 0);
    rtcSetGeometryIntersectFilterFunction(geometry, collect);
    rtcCommitGeometry(geometry);
    rtcCommitScene(p->scene);
    return rtcGetDeviceError(p->device) == RTC_ERROR_NONE;
}

size_t peer_filter(Peer *p, KellerVec3 origin, KellerVec3 direction, PeerHit *hits, size_t most)
{
    Collecting c = {.hits = hits, .most = most};
    rtcInitIntersectContext(&c.context);
    struct RTCRayHit r = ray_of(p, origin, direction);
    rtcIntersect1(p->scene, &c.context, &r);
    for (size_t i = 1; i < c.count; i++) { /* nearly in order already */
        PeerHit h = hits[i];
        size_t j = i;
        for (; j > 0 && (h.t < hits[j - 1].t || (h.t == hits[j - 1].t && h.triangle < hits[j - 1].triangle)); j--)
            hits[j] = hits[j - 1];
        hits[j] = h;
    }
    return c.count;
}

size_t peer_restart(Peer *p, KellerVec3 origin, KellerVec3 direction, PeerHit *hits, size_t most)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    struct RTCRayHit r = ray_of(p, origin, direction);
    size_t count = 0;
    while (count < most) {
        rtcIntersect1(p->scene, &context, &r);
        if (r.hit.geomID == RTC_INVALID_GEOMETRY_ID) break;
        hits[count++] = (PeerHit){r.ray.tfar, r.hit.primID};
        r.ray.tnear = nextafterf(r.ray.tfar, INFINITY);
        r.ray.tfar = INFINITY;
        r.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    }
    return count;
}

void peer_free(Peer *p)
{
    if (!p) return;
    if (p->scene) rtcReleaseScene(p->scene);
    if (p->device) rtcReleaseDevice(p->device);
    free(p);
}

#else

bool peer_there(void) { return false; }

Peer *peer_new(size_t triangle_count, const KellerVec3 *vertices, const uint32_t (*triangles)[3], KellerVec3 middle,
               bool robust, double *seconds)
{
    (void)triangle_count, (void)vertices, (void)triangles, (void)middle, (void)robust, (void)seconds;
    return NULL;
}

size_t peer_nearest(Peer *peer, size_t count, const KellerVec3 *origins, const KellerVec3 *directions)
{
    (void)peer, (void)count, (void)origins, (void)directions;
    return 0;
}

bool peer_set_filter(Peer *peer)
{
    (void)peer;
    return false;
}

size_t peer_filter(Peer *peer, KellerVec3 origin, KellerVec3 direction, PeerHit *hits, size_t most)
{
    (void)peer, (void)origin, (void)direction, (void)hits, (void)most;
    return 0;
}

size_t peer_restart(Peer *peer, KellerVec3 origin, KellerVec3 direction, PeerHit *hits, size_t most)
{
    (void)peer, (void)origin, (void)direction, (void)hits, (void)most;
    return 0;
}

void peer_free(Peer *peer) { (void)peer; }
#endif
