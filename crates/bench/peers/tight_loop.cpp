// The least that an LGVI step can take: the arithmetic alone, of one known system, with no checks, no errors, no
// interface. Starting guess extrapolated from three solutions, one Newton correction, residual unchecked.
//
//     g++ -O3 -march=native tight_loop.cpp -o tight_loop && ./tight_loop REPEATS
//
// Prints the best time a step (ns) of a free body and of two dumbbells, of blocks of a million steps.

#include <ctime>
#include <cmath>
#include <cstdio>
#include <cstdlib>

struct V {
    double x, y, z;
};
static inline V operator+(V a, V b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
static inline V operator-(V a, V b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
static inline V operator*(double s, V a) { return {s * a.x, s * a.y, s * a.z}; }
static inline double dot(V a, V b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static inline V cross(V a, V b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

// Attitude as its rows: R F is Fᵀ applied to each.
struct Body {
    double mass;
    V inertia;
    V x, p, row[3], pi;
    V last[3];
    V arm;
};

static inline V rotate_back(V f, double s, V p) {
    V pf = cross(p, f);
    return p + s * (pf + cross(pf, f));
}

static inline void drift(Body& b, double h) {
    V g = h * b.pi, f = 3.0 * (b.last[0] - b.last[1]) + b.last[2];
    double s = dot(g, f);
    V jf = {2 * b.inertia.x * f.x, 2 * b.inertia.y * f.y, 2 * b.inertia.z * f.z};
    V residual = g + cross(g, f) + s * f - jf;
    // Columns of S(g) + s I + f gᵀ − 2 J.
    V c0 = {s - 2 * b.inertia.x + f.x * g.x, g.z + f.y * g.x, -g.y + f.z * g.x};
    V c1 = {-g.z + f.x * g.y, s - 2 * b.inertia.y + f.y * g.y, g.x + f.z * g.y};
    V c2 = {g.y + f.x * g.z, -g.x + f.y * g.z, s - 2 * b.inertia.z + f.z * g.z};
    V c12 = cross(c1, c2);
    double r = 1.0 / dot(c0, c12);
    f = f - r * V{dot(residual, c12), dot(c0, cross(residual, c2)), dot(c0, cross(c1, residual))};
    b.last[2] = b.last[1];
    b.last[1] = b.last[0];
    b.last[0] = f;
    double factor = 2.0 / (1.0 + dot(f, f));
    for (V& row : b.row) row = rotate_back(f, factor, row);
    b.pi = rotate_back(f, factor, b.pi);
    b.x = b.x + (h / b.mass) * b.p;
}

static void start(Body& b, double h) {
    V f = {0.5 * h * b.pi.x / b.inertia.x, 0.5 * h * b.pi.y / b.inertia.y, 0.5 * h * b.pi.z / b.inertia.z};
    for (V& last : b.last) last = f;
}

static inline V to_inertial(const Body& b, V a) { return {dot(b.row[0], a), dot(b.row[1], a), dot(b.row[2], a)}; }
static inline V to_body(const Body& b, V a) { return a.x * b.row[0] + a.y * b.row[1] + a.z * b.row[2]; }

struct Loads {
    V force, moment[2];
};

static inline Loads attract(const Body& a, const Body& b) {
    V arms[2] = {to_inertial(a, a.arm), to_inertial(b, b.arm)};
    V separation = a.x - b.x, force = {0, 0, 0}, torque[2] = {{0, 0, 0}, {0, 0, 0}};
    double weight = 0.25 * a.mass * b.mass;
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2; j++) {
            V one = (i ? -1.0 : 1.0) * arms[0], other = (j ? -1.0 : 1.0) * arms[1];
            V d = separation + one - other;
            double squared = dot(d, d);
            V pair = (-weight / (squared * std::sqrt(squared))) * d;
            force = force + pair;
            torque[0] = torque[0] + cross(one, pair);
            torque[1] = torque[1] - cross(other, pair);
        }
    return {force, {to_body(a, torque[0]), to_body(b, torque[1])}};
}

static inline void kick(Body& a, Body& b, const Loads& l, double h) {
    a.p = a.p + h * l.force;
    b.p = b.p - h * l.force;
    a.pi = a.pi + h * l.moment[0];
    b.pi = b.pi + h * l.moment[1];
}

// Of this process on the processor.
static double seconds() {
    timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return now.tv_sec + 1e-9 * now.tv_nsec;
}

template <class Step>
static double best(int repeats, Step step) {
    double least = 1e300;
    const int block = 1000000;
    for (int i = 0; i < repeats; i++) {
        double before = seconds();
        for (int k = 0; k < block; k++) step();
        least = std::fmin(least, 1e9 * (seconds() - before) / block);
    }
    return least;
}

int main(int argc, char** argv) {
    int repeats = argc > 1 ? std::atoi(argv[1]) : 5;
    const V identity[3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    Body free = {1, {1, 2, 3}, {0, 0, 0}, {0, 0, 0}, {identity[0], identity[1], identity[2]}, {1, 1, -2.25}, {}, {}};
    const double slow = 0.01;
    start(free, slow);
    double free_ns = best(repeats, [&] { drift(free, slow); });

    Body a = {1.5, {.000375, .0238125, .0238125}, {.84375, 0, 0}, {0, 1.96875, .515625},
              {identity[0], identity[1], identity[2]}, {.00075, .01190625, .1905}, {}, {.125, 0, 0}};
    Body b = {3, {.003, .1905, .1905}, {-.421875, 0, 0}, {0, -1.96875, -.515625},
              {{0, -1, 0}, {1, 0, 0}, {0, 0, 1}}, {.003, -.09525, 1.143}, {}, {.25, 0, 0}};
    const double fast = 0.002;
    start(a, fast);
    start(b, fast);
    Loads loads = attract(a, b);
    double pair_ns = best(repeats, [&] {
        kick(a, b, loads, 0.5 * fast);
        drift(a, fast);
        drift(b, fast);
        loads = attract(a, b);
        kick(a, b, loads, 0.5 * fast);
    });
    std::printf("%.17g %.17g %.17g\n", free_ns, pair_ns, free.row[0].x + a.x.x);
}
