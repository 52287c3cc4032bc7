// An orbit in the field of a homogeneous polyhedron as R. A. Werner & D. J. Scheeres (1996) wrote it down: a sum over
// edges and one over faces, with the logarithm and the arc tangent of the C library. By leapfrog.
//
//     g++ -O3 -march=native polyhedron.cpp -o polyhedron && ./polyhedron < MESH
//
// MESH: G times the density, the step, the number of steps, position, velocity; numbers of vertices and faces; vertices;
// the three vertices of each face from 0. Prints the CPU time of the flight (s) and the last position.

#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <map>
#include <utility>
#include <vector>

struct V {
    double x, y, z;
};
static inline V operator+(V a, V b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline V operator-(V a, V b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline V operator*(double s, V a) { return {s * a.x, s * a.y, s * a.z}; }
static inline double dot(V a, V b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline double norm(V a) { return std::sqrt(dot(a, a)); }
static inline V cross(V a, V b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

struct Edge {
    V a, b;
    double length;
    V dyad[3];
};

struct Face {
    V a, b, c, normal;
};

static V acceleration(const std::vector<Edge>& edges, const std::vector<Face>& faces, double strength, V d) {
    V sum = {0, 0, 0};
    for (const Edge& edge : edges) {
        V r = edge.a - d;
        double around = norm(r) + norm(edge.b - d);
        double logarithm = std::log((around + edge.length) / (around - edge.length));
        sum = sum - logarithm * V{dot(edge.dyad[0], r), dot(edge.dyad[1], r), dot(edge.dyad[2], r)};
    }
    for (const Face& face : faces) {
        V ra = face.a - d, rb = face.b - d, rc = face.c - d;
        double a = norm(ra), b = norm(rb), c = norm(rc);
        double real = a * b * c + a * dot(rb, rc) + b * dot(rc, ra) + c * dot(ra, rb);
        double angle = 2 * std::atan2(dot(ra, cross(rb, rc)), real);
        sum = sum + (angle * dot(face.normal, ra)) * face.normal;
    }
    return strength * sum;
}

static double seconds() {
    timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

static bool read(V& v) { return std::scanf("%lf %lf %lf", &v.x, &v.y, &v.z) == 3; }

int main() {
    double strength, h;
    long steps;
    V x, v;
    size_t vertex_count, face_count;
    bool fine = std::scanf("%lf %lf %ld", &strength, &h, &steps) == 3 && read(x) && read(v) &&
                std::scanf("%zu %zu", &vertex_count, &face_count) == 2;
    if (!fine) return 1;
    std::vector<V> vertices(vertex_count);
    for (V& vertex : vertices)
        if (!read(vertex)) return 1;
    std::vector<Face> faces(face_count);
    std::vector<Edge> edges;
    std::map<std::pair<size_t, size_t>, V> normals;
    std::vector<std::array<size_t, 3>> corners(face_count);
    for (size_t i = 0; i < face_count; i++) {
        auto& [a, b, c] = corners[i];
        if (std::scanf("%zu %zu %zu", &a, &b, &c) != 3) return 1;
        V area = cross(vertices[b] - vertices[a], vertices[c] - vertices[a]);
        faces[i] = {vertices[a], vertices[b], vertices[c], (1 / norm(area)) * area};
        for (auto side : {std::pair{a, b}, {b, c}, {c, a}}) normals[side] = faces[i].normal;
    }
    for (auto [side, n] : normals) {
        auto [from, to] = side;
        if (from > to) continue;
        V a = vertices[from], b = vertices[to], m = normals[{to, from}];
        V along = (1 / norm(b - a)) * (b - a), n_edge = cross(along, n), m_edge = cross(m, along);
        edges.push_back({a, b, norm(b - a),
                         {n.x * n_edge + m.x * m_edge, n.y * n_edge + m.y * m_edge, n.z * n_edge + m.z * m_edge}});
    }
    double begun = seconds();
    V pull = acceleration(edges, faces, strength, x);
    for (long step = 0; step < steps; step++) {
        v = v + (0.5 * h) * pull;
        x = x + h * v;
        pull = acceleration(edges, faces, strength, x);
        v = v + (0.5 * h) * pull;
    }
    std::printf("%.17g %.17g %.17g %.17g\n", seconds() - begun, x.x, x.y, x.z);
}
