// A step of a Neo-Hookean solid as the course builds it, with Eigen alone: the yardstick of tests/benchmarks/solids.py.
//
//   solid_baseline PROBLEM STEPS POSITIONS
//
// Backward Euler by Newton's method with backtracking; 12x12 element Hessians clamped through
// SelfAdjointEigenSolver; triplets; SimplicialLDLT, analysed once; pinned vertices projected out.
// Prints the wall and the CPU time of every step in ms, and its Newton iterations; writes the last positions.
//
// PROBLEM is text: n m k; C D rho dt tolerance; gravity; n lines of undeformed and of starting position;
// m tetrahedra; k pinned vertices.

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <iostream>
#include <limits>
#include <vector>

using namespace Eigen;
using Matrix9d = Matrix<double, 9, 9>;
using Vector9d = Matrix<double, 9, 1>;
using Matrix12d = Matrix<double, 12, 12>;
using Vector12d = Matrix<double, 12, 1>;

struct Tetrahedron {
    int v[4];
    double volume;
    Matrix<double, 4, 3> g;         // gradients of the shape functions
    Matrix<double, 9, 12> B;        // vec(F), column by column, of the corners' coordinates
};

static int n, m, k;
static double C, D, rho, dt, tolerance;
static Vector3d gravity;
static std::vector<Tetrahedron> tetrahedra;
static std::vector<int> row;        // first unknown of a vertex, -1 where it is pinned
static VectorXd X, x, v, weight;    // all (3n); weight: M times gravity
static int unknowns = 0;
static SparseMatrix<double> M;      // all vertices

static Matrix3d cross(const Vector3d &a) {
    Matrix3d A;
    A << 0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0;
    return A;
}

static Matrix3d gradient_of(const Tetrahedron &t, const VectorXd &q) {
    Matrix<double, 3, 4> Q;
    for (int i = 0; i < 4; ++i) Q.col(i) = q.segment<3>(3 * t.v[i]);
    return Q * t.g;
}

static Matrix3d cofactors(const Matrix3d &F) {
    Matrix3d G;
    G << F.col(1).cross(F.col(2)), F.col(2).cross(F.col(0)), F.col(0).cross(F.col(1));
    return G;
}

static double energy(const VectorXd &q) {
    double sum = 0;
    for (const auto &t : tetrahedra) {
        const Matrix3d F = gradient_of(t, q);
        const double J = F.determinant();
        if (!(J > 0)) return std::numeric_limits<double>::infinity();
        sum += t.volume * (C * (std::pow(J, -2. / 3) * F.squaredNorm() - 3) + D * (J - 1) * (J - 1));
    }
    return sum;
}

static VectorXd gradient(const VectorXd &q) {
    VectorXd g = VectorXd::Zero(3 * n);
    for (const auto &t : tetrahedra) {
        const Matrix3d F = gradient_of(t, q), G = cofactors(F);
        const double J = F.determinant(), a = std::pow(J, -2. / 3);
        const Matrix3d P = C * a * (2 * F - 2. / 3 * F.squaredNorm() / J * G) + 2 * D * (J - 1) * G;
        for (int i = 0; i < 4; ++i) g.segment<3>(3 * t.v[i]) += t.volume * (P * t.g.row(i).transpose());
    }
    return g;
}

static Matrix12d hessian(const Tetrahedron &t, const VectorXd &q) {
    const Matrix3d F = gradient_of(t, q), G = cofactors(F);
    const double J = F.determinant(), a = std::pow(J, -2. / 3), I = F.squaredNorm();
    const Map<const Vector9d> f(F.data()), c(G.data());
    Matrix9d second = Matrix9d::Zero();  // of J
    for (int i = 0; i < 3; ++i) {
        const int j = (i + 1) % 3, l = (i + 2) % 3;
        second.block<3, 3>(3 * i, 3 * j) = -cross(F.col(l));
        second.block<3, 3>(3 * i, 3 * l) = cross(F.col(j));
    }
    Matrix9d H = 2 * C * a * Matrix9d::Identity();
    H -= 4. / 3 * C * a / J * (f * c.transpose() + c * f.transpose());
    H += (10. / 9 * C * I * a / J / J + 2 * D) * c * c.transpose();
    H += (2 * D * (J - 1) - 2. / 3 * C * I * a / J) * second;
    const Matrix12d full = t.volume * t.B.transpose() * H * t.B;
    SelfAdjointEigenSolver<Matrix12d> modes(full);
    const Vector12d clamped = modes.eigenvalues().cwiseMax(0.0);
    return modes.eigenvectors() * clamped.asDiagonal() * modes.eigenvectors().transpose();
}

static double free_norm(const VectorXd &r) {
    double sum = 0;
    for (int i = 0; i < n; ++i) if (row[i] >= 0) sum += r.segment<3>(3 * i).squaredNorm();
    return std::sqrt(sum);
}

static SimplicialLDLT<SparseMatrix<double>> solver;
static bool analysed = false;

static int step() {
    const VectorXd before = v, start = x;
    VectorXd u = before;
    for (int i = 0; i < n; ++i) if (row[i] < 0) u.segment<3>(3 * i).setZero();
    auto value = [&](const VectorXd &w) {
        const VectorXd d = w - before, q = start + dt * w;
        return 0.5 * d.dot(M * d) + energy(q) - weight.dot(q);
    };
    double phi = value(u);
    int iterations = 0;
    for (; iterations < 200; ++iterations) {
        const VectorXd q = start + dt * u, momentum = M * (u - before), elastic = dt * gradient(q), outer = dt * weight;
        const VectorXd r = momentum + elastic - outer;
        const double scale = std::max(std::max(free_norm(momentum), free_norm(elastic)), std::max(free_norm(outer), free_norm(M * u)));
        if (free_norm(r) <= tolerance * scale) break;
        std::vector<Triplet<double>> entries;
        entries.reserve(144 * m);
        for (const auto &t : tetrahedra) {
            Matrix12d A = dt * dt * hessian(t, q);
            for (int i = 0; i < 4; ++i)
                for (int j = 0; j < 4; ++j) {
                    if (row[t.v[i]] < 0 || row[t.v[j]] < 0) continue;
                    A.block<3, 3>(3 * i, 3 * j).diagonal().array() += rho * t.volume / 20 * (i == j ? 2 : 1);
                    for (int a = 0; a < 3; ++a)
                        for (int b = 0; b < 3; ++b)
                            entries.emplace_back(row[t.v[i]] + a, row[t.v[j]] + b, A(3 * i + a, 3 * j + b));
                }
        }
        SparseMatrix<double> A(unknowns, unknowns);
        A.setFromTriplets(entries.begin(), entries.end());
        if (!analysed) solver.analyzePattern(A), analysed = true;
        solver.factorize(A);
        VectorXd b(unknowns);
        for (int i = 0; i < n; ++i) if (row[i] >= 0) b.segment<3>(row[i]) = -r.segment<3>(3 * i);
        const VectorXd s = solver.solve(b);
        VectorXd d = VectorXd::Zero(3 * n);
        for (int i = 0; i < n; ++i) if (row[i] >= 0) d.segment<3>(3 * i) = s.segment<3>(row[i]);
        const double slope = r.dot(d);
        double length = 1, trial = value(u + d);
        while (!(trial <= phi + 1e-4 * length * slope + 1e-11 * std::abs(phi)) && length > 1e-10)
            length /= 2, trial = value(u + length * d);
        u += length * d;
        phi = trial;
        if (dt * d.cwiseAbs().maxCoeff() < 1e-15) break;
    }
    v = u;
    x = start + dt * v;
    return iterations;
}

int main(int argc, char **argv) {
    if (argc != 4) return std::cerr << "solid_baseline PROBLEM STEPS POSITIONS\n", 1;
    std::ifstream in(argv[1]);
    in >> n >> m >> k >> C >> D >> rho >> dt >> tolerance >> gravity[0] >> gravity[1] >> gravity[2];
    X.resize(3 * n), x.resize(3 * n), v.setZero(3 * n), weight.setZero(3 * n);
    for (int i = 0; i < n; ++i) {
        for (int d = 0; d < 3; ++d) in >> X[3 * i + d];
        for (int d = 0; d < 3; ++d) in >> x[3 * i + d];
    }
    tetrahedra.resize(m);
    std::vector<Triplet<double>> masses;
    for (auto &t : tetrahedra) {
        in >> t.v[0] >> t.v[1] >> t.v[2] >> t.v[3];
        Matrix3d E;
        for (int i = 0; i < 3; ++i) E.col(i) = X.segment<3>(3 * t.v[i + 1]) - X.segment<3>(3 * t.v[0]);
        t.volume = std::abs(E.determinant()) / 6;
        t.g.bottomRows<3>() = E.inverse();
        t.g.row(0) = -t.g.bottomRows<3>().colwise().sum();
        t.B.setZero();
        for (int i = 0; i < 4; ++i)
            for (int c = 0; c < 3; ++c) t.B.block<3, 3>(3 * c, 3 * i) = t.g(i, c) * Matrix3d::Identity();
        for (int i = 0; i < 4; ++i) {
            weight.segment<3>(3 * t.v[i]) += rho * t.volume / 4 * gravity;
            for (int j = 0; j < 4; ++j)
                for (int d = 0; d < 3; ++d)
                    masses.emplace_back(3 * t.v[i] + d, 3 * t.v[j] + d, rho * t.volume / 20 * (i == j ? 2 : 1));
        }
    }
    row.assign(n, 0);
    for (int i = 0, j; i < k; ++i) in >> j, row[j] = -1;
    if (!in) return std::cerr << "cannot read " << argv[1] << "\n", 1;
    for (int i = 0; i < n; ++i) if (row[i] == 0) row[i] = unknowns, unknowns += 3;
    M.resize(3 * n, 3 * n);
    M.setFromTriplets(masses.begin(), masses.end());
    for (int s = 0, steps = std::atoi(argv[2]); s < steps; ++s) {
        const auto begin = std::chrono::steady_clock::now();
        const std::clock_t cpu = std::clock();
        const int iterations = step();
        const std::chrono::duration<double, std::milli> wall = std::chrono::steady_clock::now() - begin;
        std::printf("%.6f %.6f %d\n", wall.count(), 1e3 * double(std::clock() - cpu) / CLOCKS_PER_SEC, iterations);
    }
    std::ofstream(argv[3], std::ios::binary).write(reinterpret_cast<const char *>(x.data()), sizeof(double) * 3 * n);
}
