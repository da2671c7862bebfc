#include "mesh/adjacency.h"

// OpenMesh grows its points by default-constructed vectors, which have no value.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Core/System/omstream.hh>
#include <algorithm>
#include <array>
#include <cstdlib>
#include <exception>
#include <new>
#include <numeric>
#include <vector>

namespace {

struct Traits : OpenMesh::DefaultTraits {
    using Point = OpenMesh::Vec3d;
    using Normal = OpenMesh::Vec3d;
    VertexAttributes(OpenMesh::Attributes::None);
    HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge);
    EdgeAttributes(OpenMesh::Attributes::None);
    FaceAttributes(OpenMesh::Attributes::None);
};
using Mesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;
using Triangle = std::array<uint32_t, 3>;

// add_face() reports what it refuses on a stream of the library's own.
class Silence {
public:
    Silence() : enabled_(omerr().is_enabled()) { omerr().disable(); }
    ~Silence()
    {
        if (enabled_) omerr().enable();
    }
    Silence(const Silence &) = delete;
    Silence &operator=(const Silence &) = delete;

private:
    bool enabled_;
};

// One side of a triangle: from corner `corner` to the next.
struct Side {
    uint32_t low, high, triangle;
    uint8_t corner;
    bool operator<(const Side &o) const
    {
        if (low != o.low) return low < o.low;
        if (high != o.high) return high < o.high;
        return triangle < o.triangle;
    }
    bool same_edge(const Side &o) const { return low == o.low && high == o.high; }
};

class Builder {
public:
    Builder(size_t vertex_count, const KellerVec3 *vertices, size_t triangle_count, const uint32_t (*triangles)[3])
        : vertices_(vertices), vertex_count_(vertex_count), corners_(triangle_count)
    {
        for (size_t t = 0; t < triangle_count; t++) std::copy(triangles[t], triangles[t] + 3, corners_[t].begin());
    }

    void run()
    {
        pair_sides();
        orient();
        separate();
        fill();
    }

    // Every OpenMesh edge with the triangle on each of its sides, under its original vertices.
    std::vector<Side> sides() const
    {
        std::vector<Side> found;
        found.reserve(3 * corners_.size());
        for (auto halfedge : mesh_.halfedges()) {
            if (mesh_.is_boundary(halfedge)) continue;
            uint32_t a = original_[size_t(mesh_.from_vertex_handle(halfedge).idx())];
            uint32_t b = original_[size_t(mesh_.to_vertex_handle(halfedge).idx())];
            uint32_t triangle = face_triangle_[size_t(mesh_.face_handle(halfedge).idx())];
            found.push_back(Side{std::min(a, b), std::max(a, b), triangle, 0});
        }
        std::sort(found.begin(), found.end());
        return found;
    }

    size_t cuts() const { return original_.size() > vertex_count_ ? original_.size() - vertex_count_ : 0; }

private:
    // neighbour_[t][i]: the one other triangle at side i of t, where there is exactly one.
    void pair_sides()
    {
        std::vector<Side> sides;
        sides.reserve(3 * corners_.size());
        for (uint32_t t = 0; t < corners_.size(); t++)
            for (uint8_t i = 0; i < 3; i++) {
                uint32_t a = corners_[t][i], b = corners_[t][(i + 1) % 3];
                sides.push_back(Side{std::min(a, b), std::max(a, b), t, i});
            }
        std::sort(sides.begin(), sides.end());
        neighbour_.assign(corners_.size(), {none, none, none});
        for (size_t i = 0, j; i < sides.size(); i = j) {
            for (j = i + 1; j < sides.size() && sides[j].same_edge(sides[i]); j++) continue;
            if (j - i != 2) continue;
            neighbour_[sides[i].triangle][sides[i].corner] = sides[i + 1].triangle;
            neighbour_[sides[i + 1].triangle][sides[i + 1].corner] = sides[i].triangle;
        }
    }

    // Turns each patch after its first triangle, and notes the order in which it grew; a side whose two triangles
    // cannot agree is no longer a connection.
    void orient()
    {
        flipped_.assign(corners_.size(), 0);
        std::vector<char> reached(corners_.size(), 0);
        order_.reserve(corners_.size());
        for (uint32_t seed = 0; seed < corners_.size(); seed++) {
            if (reached[seed]) continue;
            reached[seed] = 1;
            size_t head = order_.size();
            order_.push_back(seed);
            for (; head < order_.size(); head++) {
                uint32_t t = order_[head];
                for (int i = 0; i < 3; i++) {
                    uint32_t u = neighbour_[t][i];
                    if (u == none) continue;
                    int k = side_towards(u, corners_[t][i], corners_[t][(i + 1) % 3]);
                    bool same_way = corners_[u][k] == corners_[t][i];
                    char wanted = char(flipped_[t] ^ (same_way ? 1 : 0));
                    if (!reached[u]) {
                        reached[u] = 1;
                        flipped_[u] = wanted;
                        order_.push_back(u);
                    } else if (flipped_[u] != wanted) {
                        neighbour_[t][i] = neighbour_[u][k] = none;
                    }
                }
            }
        }
    }

    int side_towards(uint32_t t, uint32_t a, uint32_t b) const
    {
        for (int i = 0; i < 3; i++) {
            uint32_t c = corners_[t][i], d = corners_[t][(i + 1) % 3];
            if ((c == a && d == b) || (c == b && d == a)) return i;
        }
        return 0;
    }

    // Corners belong to one vertex of the half-edge mesh where a chain of connected sides joins them.
    void separate()
    {
        std::vector<uint32_t> parent(3 * corners_.size());
        std::iota(parent.begin(), parent.end(), 0u);
        auto find = [&](uint32_t c) {
            while (parent[c] != c) c = parent[c] = parent[parent[c]];
            return c;
        };
        auto corner_of = [&](uint32_t t, uint32_t vertex) {
            uint32_t i = corners_[t][0] == vertex ? 0 : corners_[t][1] == vertex ? 1 : 2;
            return 3 * t + i;
        };
        for (uint32_t t = 0; t < corners_.size(); t++)
            for (int i = 0; i < 3; i++) {
                uint32_t u = neighbour_[t][i];
                if (u == none || u < t) continue;
                for (uint32_t vertex : {corners_[t][i], corners_[t][(i + 1) % 3]}) {
                    uint32_t a = find(corner_of(t, vertex)), b = find(corner_of(u, vertex));
                    parent[std::max(a, b)] = std::min(a, b);
                }
            }
        std::vector<uint32_t> number(parent.size(), none);
        own_.resize(corners_.size());
        for (uint32_t c = 0; c < parent.size(); c++) {
            uint32_t root = find(c);
            if (number[root] == none) number[root] = add_vertex(corners_[c / 3][c % 3]);
            own_[c / 3][c % 3] = number[root];
        }
    }

    uint32_t add_vertex(uint32_t original)
    {
        const KellerVec3 &p = vertices_[original];
        mesh_.add_vertex(Mesh::Point(p.x, p.y, p.z));
        original_.push_back(original);
        return uint32_t(original_.size() - 1);
    }

    void fill()
    {
        for (uint32_t t : order_) {
            Triangle v = own_[t];
            if (flipped_[t]) std::swap(v[1], v[2]);
            if (add_face(t, v)) continue;
            // What is still not a manifold stands on vertices of its own; its neighbours are found by their originals.
            for (uint32_t &corner : v) corner = add_vertex(original_[corner]);
            if (!add_face(t, v)) throw std::bad_alloc();
        }
    }

    bool add_face(uint32_t t, const Triangle &v)
    {
        Mesh::VertexHandle handle[3];
        for (size_t i = 0; i < 3; i++) handle[i] = Mesh::VertexHandle(int(v[i]));
        if (!mesh_.add_face(handle, 3).is_valid()) return false;
        face_triangle_.push_back(t);
        return true;
    }

    static constexpr uint32_t none = UINT32_MAX;
    const KellerVec3 *vertices_;
    size_t vertex_count_;
    std::vector<Triangle> corners_, neighbour_, own_;
    std::vector<char> flipped_;
    std::vector<uint32_t> order_, original_, face_triangle_;
    Mesh mesh_;
};

template <class T> T *allocate(size_t count)
{
    T *memory = static_cast<T *>(std::calloc(count ? count : 1, sizeof(T)));
    if (!memory) throw std::bad_alloc();
    return memory;
}

void collect(const std::vector<Side> &sides, size_t triangle_count, const uint32_t (*triangles)[3],
             KellerAdjacency *adjacency)
{
    size_t edges = 0;
    for (size_t i = 0; i < sides.size(); i++) edges += i == 0 || !sides[i].same_edge(sides[i - 1]);
    adjacency->vertices = allocate<uint32_t[2]>(edges);
    adjacency->begin = allocate<uint32_t>(edges + 1);
    adjacency->triangles = allocate<uint32_t>(sides.size());
    adjacency->edge = allocate<uint32_t[3]>(triangle_count);
    for (size_t i = 0; i < sides.size(); i++) {
        if (i == 0 || !sides[i].same_edge(sides[i - 1])) {
            adjacency->vertices[adjacency->edge_count][0] = sides[i].low;
            adjacency->vertices[adjacency->edge_count][1] = sides[i].high;
            adjacency->begin[adjacency->edge_count++] = uint32_t(i);
        }
        uint32_t t = sides[i].triangle;
        adjacency->triangles[i] = t;
        for (int k = 0; k < 3; k++) {
            uint32_t a = triangles[t][k], b = triangles[t][(k + 1) % 3];
            if (std::min(a, b) == sides[i].low && std::max(a, b) == sides[i].high)
                adjacency->edge[t][k] = uint32_t(adjacency->edge_count - 1);
        }
    }
    adjacency->begin[adjacency->edge_count] = uint32_t(sides.size());
}

} // namespace

extern "C" KellerStatus keller_adjacency_build(size_t vertex_count, const KellerVec3 *vertices, size_t triangle_count,
                                               const uint32_t (*triangles)[3], KellerAdjacency *adjacency,
                                               KellerError *error)
{
    *adjacency = KellerAdjacency{};
    // OpenMesh counts half-edges, up to six a triangle, in an int.
    if (triangle_count > size_t(INT32_MAX) / 6)
        return keller_error(error, KELLER_FAILED, "the scene has %zu triangles; at most %d can be held", triangle_count,
                            INT32_MAX / 6);
    try {
        Silence silence;
        Builder builder(vertex_count, vertices, triangle_count, triangles);
        builder.run();
        adjacency->cuts = builder.cuts();
        collect(builder.sides(), triangle_count, triangles, adjacency);
        return KELLER_OK;
    } catch (const std::bad_alloc &) {
        keller_adjacency_free(adjacency);
        return keller_error_memory(error, 1000ull * triangle_count);
    } catch (const std::exception &e) {
        keller_adjacency_free(adjacency);
        return keller_error(error, KELLER_FAILED, "the half-edge mesh could not be built: %s", e.what());
    } catch (...) {
        keller_adjacency_free(adjacency);
        return keller_error(error, KELLER_FAILED, "the half-edge mesh could not be built");
    }
}

extern "C" void keller_adjacency_free(KellerAdjacency *adjacency)
{
    std::free(adjacency->vertices);
    std::free(adjacency->begin);
    std::free(adjacency->triangles);
    std::free(adjacency->edge);
    *adjacency = KellerAdjacency{};
}
