// The simulation step of Muslin as a strong C++ programmer writes it, with Eigen alone: the yardstick of
// tests/benchmarks/steps.py.
//
//   eigen_baseline PROBLEM STEPS TRAJECTORY direct|triplets
//
// Linearly implicit Euler on a linearised (corotational) cloth: closed-form 3x2 element Hessians, positive
// semi-definite by clamping their modes, SimplicialLDLT with AMD, analysed once; sphere contacts. `triplets` collects
// the lower triangle in a preallocated list and calls setFromTriplets in every step, as Eigen's manual does; `direct`
// knows where each number goes in the fixed pattern and adds it there, which is the best one can do.
// Prints the wall and the CPU time of every step in ms; writes positions (doubles, n x 3 after each of the first 20 steps).
//
// PROBLEM is text: n m k; mu lam rho h dt; gravity; sphere centre and radius (negative: none); n lines of
// undeformed and of starting position; m triangles; k pinned vertices.

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <vector>

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Sparse = Eigen::SparseMatrix<double, Eigen::ColMajor, int>;

struct Triangle {
    int v[3];
    double weight;          // h a
    double mass;            // rho h a / 12
    Vector2d g[3];          // gradients of the shape functions in the triangle's plane
    int slot[3][3][3];      // [i][j][column]: where rows 0..2 of that column of block (i, j) start; -1: not stored
};

struct Problem {
    int n, m, k;
    double mu, lam, rho, h, dt, radius;
    Vector3d gravity, centre;
    std::vector<Vector3d> X, x, v;
    std::vector<Triangle> triangles;
    std::vector<char> held;
};

static Problem read(const char *path) {
    Problem p;
    std::ifstream in(path);
    in >> p.n >> p.m >> p.k >> p.mu >> p.lam >> p.rho >> p.h >> p.dt;
    for (int d = 0; d < 3; ++d) in >> p.gravity[d];
    for (int d = 0; d < 3; ++d) in >> p.centre[d];
    in >> p.radius;
    p.X.resize(p.n), p.x.resize(p.n), p.v.assign(p.n, Vector3d::Zero());
    for (int i = 0; i < p.n; ++i)
        in >> p.X[i][0] >> p.X[i][1] >> p.X[i][2] >> p.x[i][0] >> p.x[i][1] >> p.x[i][2];
    p.triangles.resize(p.m);
    for (auto &t : p.triangles) {
        in >> t.v[0] >> t.v[1] >> t.v[2];
        const Vector3d a = p.X[t.v[1]] - p.X[t.v[0]], b = p.X[t.v[2]] - p.X[t.v[0]];
        const Vector3d m = a.cross(b), e0 = a.normalized(), e1 = m.normalized().cross(e0);
        const double area = m.norm() / 2;
        t.weight = p.h * area;
        t.mass = p.rho * p.h * area / 12;
        Matrix2d D;
        D << e0.dot(a), e0.dot(b), e1.dot(a), e1.dot(b);
        const Matrix2d inverse = D.inverse();
        t.g[1] = inverse.row(0).transpose();
        t.g[2] = inverse.row(1).transpose();
        t.g[0] = -t.g[1] - t.g[2];
    }
    p.held.assign(p.n, 0);
    for (int i = 0, j; i < p.k; ++i) in >> j, p.held[j] = 1;
    if (!in) std::cerr << "cannot read " << path << "\n", std::exit(1);
    return p;
}

class Simulator {
  public:
    Simulator(Problem problem, bool triplets) : p(std::move(problem)), triplets(triplets) {
        row.assign(p.n, -1);
        int free = 0;
        for (int i = 0; i < p.n; ++i)
            if (!p.held[i]) row[i] = 3 * free++;
        for (const auto &t : p.triangles)
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    if (stored(t, i, j))
                        for (int c = 0; c < 3; ++c)
                            for (int r = 0; r < 3; ++r) entries.emplace_back(row[t.v[i]] + r, row[t.v[j]] + c, 0.0);
        A.resize(3 * free, 3 * free);
        A.setFromTriplets(entries.begin(), entries.end());
        A.makeCompressed();
        for (auto &t : p.triangles)
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    for (int c = 0; c < 3; ++c) t.slot[i][j][c] = stored(t, i, j) ? slot(row[t.v[i]], row[t.v[j]] + c) : -1;
        mass.setZero(A.nonZeros());
        for (const auto &t : p.triangles)
            for (int i = 0; i < 3; ++i)
                for (int j = 0; j < 3; ++j)
                    if (t.slot[i][j][0] >= 0)
                        for (int c = 0; c < 3; ++c) mass[t.slot[i][j][c] + c] += t.mass * (i == j ? 2 : 1);
        b.resize(3 * free);
        solver.analyzePattern(A);
    }

    void step() {
        contacts.clear();
        for (int i = 0; i < p.n; ++i)
            if (!p.held[i] && (p.x[i] - p.centre).norm() < p.radius)
                contacts.emplace_back(i, (p.x[i] - p.centre).normalized());
        Eigen::Map<VectorXd> values(A.valuePtr(), A.nonZeros());
        if (triplets) entries.clear();
        else values = mass;
        b.setZero();
        for (const auto &t : p.triangles) element(t);
        if (triplets) A.setFromTriplets(entries.begin(), entries.end());
        solver.factorize(A);
        const VectorXd v = solver.solve(b);
        for (int i = 0; i < p.n; ++i) p.v[i] = row[i] < 0 ? Vector3d(Vector3d::Zero()) : Vector3d(v.segment<3>(row[i]));
        for (const auto &[i, n] : contacts) {
            const double d = n.dot(p.v[i]);
            if (d < 0) p.v[i] -= d * n;
        }
        for (int i = 0; i < p.n; ++i) p.x[i] += p.dt * p.v[i];
    }

    Problem p;

  private:
    bool stored(const Triangle &t, int i, int j) const { return row[t.v[j]] >= 0 && row[t.v[i]] >= row[t.v[j]]; }

    // Diagonal blocks have entries above the diagonal too: the solver reads the lower triangle only.
    int slot(int r, int c) const {
        const int *begin = A.innerIndexPtr() + A.outerIndexPtr()[c], *end = A.innerIndexPtr() + A.outerIndexPtr()[c + 1];
        return int(std::lower_bound(begin, end, r) - A.innerIndexPtr());
    }

    void element(const Triangle &t) {
        const double floor = 1e-6, mu = p.mu, lam = p.lam;
        const Vector3d e1 = p.x[t.v[1]] - p.x[t.v[0]], e2 = p.x[t.v[2]] - p.x[t.v[0]];
        const Vector3d f0 = e1 * t.g[1][0] + e2 * t.g[2][0], f1 = e1 * t.g[1][1] + e2 * t.g[2][1];
        const Vector3d n = e1.cross(e2).normalized();
        const double length = f0.norm();
        const Vector3d q0 = f0 / length, q1 = n.cross(q0);
        const double m01 = q0.dot(f1), m11 = q1.dot(f1);
        // polar decomposition of the 2x2 part, then the eigenvectors of its symmetric factor
        const double trace = std::hypot(length + m11, m01), area = length * m11;
        const double ca = (length + m11) / trace, sa = -m01 / trace;
        const Vector3d r0 = ca * q0 + sa * q1, r1 = ca * q1 - sa * q0;
        const double S00 = ca * length, S11 = ca * m11 - sa * m01, S01 = -sa * length;
        const double half = (S00 - S11) / 2, radius = std::sqrt(half * half + S01 * S01);
        double c = 1, s = 0;
        if (radius > 0) {
            if (half >= 0) c = radius + half, s = S01;
            else c = std::abs(S01), s = S01 < 0 ? half - radius : radius - half;
            const double l = std::sqrt(c * c + s * s);
            c /= l, s /= l;
        }
        const double s0 = trace / 2 + radius, s1 = area / std::max(s0, floor);
        const double sum = s0 + s1 - 2, psi0 = 2 * mu * (s0 - 1) + lam * sum, psi1 = 2 * mu * (s1 - 1) + lam * sum;
        const Vector3d u0 = c * r0 + s * r1, u1 = c * r1 - s * r0;
        Vector2d g[3];
        for (int i = 0; i < 3; ++i)
            g[i] = Vector2d(c * t.g[i][0] + s * t.g[i][1], c * t.g[i][1] - s * t.g[i][0]);
        const double w = t.weight, k = p.dt * p.dt * w, stretch = 2 * mu + lam, flip = 2 * mu;
        const double twist = std::max((psi0 + psi1) / std::max(s0 + s1, floor), 0.0);
        const double out0 = std::max(psi0 / std::max(s0, floor), 0.0), out1 = std::max(psi1 / std::max(s1, floor), 0.0);
        const double same = (flip + twist) / 2, cross = (flip - twist) / 2;
        // momentum, gravity and elastic force
        const Vector3d total = p.v[t.v[0]] + p.v[t.v[1]] + p.v[t.v[2]];
        for (int i = 0; i < 3; ++i) {
            const int r = row[t.v[i]];
            if (r < 0) continue;
            const Vector3d f = 4 * t.mass * p.gravity - w * (psi0 * g[i][0] * u0 + psi1 * g[i][1] * u1);
            b.segment<3>(r) += t.mass * (total + p.v[t.v[i]]) + p.dt * f;
        }
        Matrix3d U;
        U << u0, u1, n;
        double *values = A.valuePtr();
        for (int i = 0; i < 3; ++i)
            for (int j = 0; j < 3; ++j) {
                if (t.slot[i][j][0] < 0) continue;
                Matrix3d C = Matrix3d::Zero();
                C(0, 0) = k * (stretch * g[i][0] * g[j][0] + same * g[i][1] * g[j][1]);
                C(1, 1) = k * (stretch * g[i][1] * g[j][1] + same * g[i][0] * g[j][0]);
                C(0, 1) = k * (lam * g[i][0] * g[j][1] + cross * g[i][1] * g[j][0]);
                C(1, 0) = k * (lam * g[i][1] * g[j][0] + cross * g[i][0] * g[j][1]);
                C(2, 2) = k * (out0 * g[i][0] * g[j][0] + out1 * g[i][1] * g[j][1]);
                Matrix3d B = U * C * U.transpose();
                if (triplets) {
                    B.diagonal().array() += t.mass * (i == j ? 2 : 1);
                    for (int col = 0; col < 3; ++col)
                        for (int r = 0; r < 3; ++r) entries.emplace_back(row[t.v[i]] + r, row[t.v[j]] + col, B(r, col));
                    continue;
                }
                for (int col = 0; col < 3; ++col) {
                    double *target = values + t.slot[i][j][col];
                    target[0] += B(0, col), target[1] += B(1, col), target[2] += B(2, col);
                }
            }
    }

    std::vector<int> row;  // first unknown of a vertex, -1 where it is pinned
    bool triplets;
    std::vector<Eigen::Triplet<double>> entries;
    Sparse A;
    VectorXd mass, b;
    Eigen::SimplicialLDLT<Sparse, Eigen::Lower, Eigen::AMDOrdering<int>> solver;
    std::vector<std::pair<int, Vector3d>> contacts;
};

int main(int argc, char **argv) {
    if (argc != 5) return std::cerr << "eigen_baseline PROBLEM STEPS TRAJECTORY direct|triplets\n", 1;
    Simulator simulator(read(argv[1]), argv[4][0] == 't');
    std::ofstream out(argv[3], std::ios::binary);
    for (int step = 0, steps = std::atoi(argv[2]); step < steps; ++step) {
        const auto begin = std::chrono::steady_clock::now();
        const std::clock_t cpu = std::clock();
        simulator.step();
        const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - begin;
        std::printf("%.6f %.6f\n", wall.count(), 1e3 * double(std::clock() - cpu) / CLOCKS_PER_SEC);
        if (step < 20)
            out.write(reinterpret_cast<const char *>(simulator.p.x.data()), sizeof(double) * 3 * simulator.p.n);
    }
}
