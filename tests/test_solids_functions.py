"""The solids assignment's answers against truth of more digits, on tetrahedra of every kind and size.

Truth comes from the energy alone: values, slopes and curvatures of whole formulas at once (second-order Taylor
arithmetic), in 80-bit numbers. Nothing here is differentiated by hand, and nothing is shared with the judges.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import muslin
from muslin.authoring import reference_data
from muslin.base import paths
from muslin.judging import judge
from muslin.tasks.comparing import natural_scale, size_of

LONG = np.longdouble

pytestmark = pytest.mark.skipif(np.finfo(LONG).eps > 1e-18, reason="no numbers of more digits here")

COUNT = 5000

#: Largest errors, in parts of the natural scale.
EXACT, CURVATURE = 1e-12, 1e-11


class Jet:
    """A number for each sample with its slopes and curvatures in n variables: (b,), (b, n), (b, n, n)."""

    def __init__(self, value, slope, curvature):
        self.value, self.slope, self.curvature = value, slope, curvature

    @classmethod
    def variables(cls, x):
        """The variables themselves, (b, n)."""
        b, n = x.shape
        zero = np.zeros((b, n, n), LONG)
        return [cls(x[:, k].astype(LONG), np.tile(np.eye(n, dtype=LONG)[k], (b, 1)), zero) for k in range(n)]

    def __add__(self, other):
        if not isinstance(other, Jet):
            return Jet(self.value + other, self.slope, self.curvature)
        return Jet(self.value + other.value, self.slope + other.slope, self.curvature + other.curvature)

    def __neg__(self):
        return Jet(-self.value, -self.slope, -self.curvature)

    def __sub__(self, other):
        return self + (-other)

    def __mul__(self, other):
        if not isinstance(other, Jet):
            column = np.broadcast_to(other, self.value.shape)
            return Jet(
                self.value * column, self.slope * column[:, None], self.curvature * column[:, None, None]
            )
        mixed = self.slope[:, :, None] * other.slope[:, None, :]
        return Jet(
            self.value * other.value,
            self.value[:, None] * other.slope + other.value[:, None] * self.slope,
            self.value[:, None, None] * other.curvature
            + other.value[:, None, None] * self.curvature
            + mixed
            + np.swapaxes(mixed, 1, 2),
        )

    def __pow__(self, p):
        v = self.value
        once, twice = p * v ** (p - 1), p * (p - 1) * v ** (p - 2)
        pair = self.slope[:, :, None] * self.slope[:, None, :]
        return Jet(
            v**p,
            once[:, None] * self.slope,
            once[:, None, None] * self.curvature + twice[:, None, None] * pair,
        )


def energy(F, C, D):
    """C (J^(-2/3) tr(F^T F) - 3) + D (J - 1)^2 of the entries of F, row by row."""
    a, b, c, d, e, f, g, h, i = F
    J = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    squares = a * a + b * b + c * c + d * d + e * e + f * f + g * g + h * h + i * i
    return (squares * J ** (LONG(-2) / 3) - LONG(3)) * C + (J - LONG(1)) ** LONG(2) * D


def rotations(rng, count):
    q, _ = np.linalg.qr(rng.normal(size=(count, 3, 3)))
    return q * np.sign(np.linalg.det(q))[:, None, None]


def deformations(rng, count):
    """Rest, rotations, the same stretch everywhere, and any with J from 0.05 to 8."""
    s = np.exp(rng.uniform(np.log(0.15), np.log(2.6), (8 * count, 3)))
    J = s.prod(axis=1)
    s = s[(J > 0.05) & (J < 8)][:count]
    s[: count // 8] = 1
    s[count // 8 : count // 4] = rng.uniform(0.37, 2, (count // 4 - count // 8, 1))
    F = (rotations(rng, count) * s[:, None, :]) @ np.swapaxes(rotations(rng, count), 1, 2)
    F[: count // 16] = np.eye(3)
    return F


def tetrahedra(rng, count):
    """Positively oriented, cond(D) at most 10, of 1 mm, 1 m and 1 km, near the origin and a few sizes from it."""
    D = rng.normal(size=(8 * count, 3, 3))
    D = D[(np.linalg.cond(D) <= 10) & (np.linalg.det(D) > 0)][:count]
    assert len(D) == count
    size = 10.0 ** rng.choice([-3, 0, 3], (count, 1, 1))
    X0 = rng.uniform(-2, 2, (count, 1, 3))
    return size * np.concatenate([X0, X0 + np.swapaxes(D, 1, 2)], axis=1)


@pytest.fixture(scope="module")
def functions():
    return muslin.load(paths.solution("solids"), "solids")


@pytest.fixture(scope="module")
def shapes():
    """Undeformed and deformed vertices, F, and the gradients of the shape functions in 80 bits."""
    rng = np.random.default_rng(13)
    X, F = tetrahedra(rng, COUNT), deformations(rng, COUNT)
    x = np.einsum("bij,bkj->bki", F, X) + rng.uniform(-1, 1, (COUNT, 1, 3)) * np.abs(X).max(
        axis=(1, 2), keepdims=True
    )
    return X, x, F


@pytest.fixture(scope="module")
def strained():
    rng = np.random.default_rng(17)
    C = 10.0 ** rng.uniform(2, 6, COUNT)
    return {"F": deformations(rng, COUNT), "C": C, "D": C * rng.uniform(0.1, 8, COUNT)}


@pytest.fixture(scope="module")
def truth(strained):
    """The energy with its slopes and curvatures."""
    return energy(
        Jet.variables(strained["F"].reshape(-1, 9)), strained["C"].astype(LONG), strained["D"].astype(LONG)
    )


def cross(a, b):
    return np.stack([a[:, k - 2] * b[:, k - 1] - a[:, k - 1] * b[:, k - 2] for k in range(3)], axis=1)


def dot(a, b):
    return np.sum(a * b, axis=-1)


def gradients(X):
    """In 80 bits: normals of the faces over six times the volume, (b, 4, 3)."""
    e, f, g = (X[:, k].astype(LONG) - X[:, 0].astype(LONG) for k in (1, 2, 3))
    three = np.stack([cross(f, g), cross(g, e), cross(e, f)], axis=1) / dot(cross(e, f), g)[:, None, None]
    return np.concatenate([-three.sum(axis=1, keepdims=True), three], axis=1)


def worst(task, got, right, inputs):
    """Largest error in parts of the natural scale."""
    right = np.asarray(right)
    scale = natural_scale(judge("solids", task).terms, right.astype(float), inputs)
    error = float(
        (size_of((got.astype(LONG) - right).astype(float)) / np.maximum(scale, np.finfo(float).tiny)).max()
    )
    print(f"{task}: worst error {error:.1e} of the natural scale")
    return error


def corners(letter, points):
    return {f"{letter}{k}": points[:, k] for k in range(4)}


def test_shape_functions_are_shares_of_the_volume(functions, shapes):
    X, _, _ = shapes
    rng = np.random.default_rng(19)
    weights = rng.dirichlet(np.ones(4), COUNT) * 3 - 0.5
    weights += (1 - weights.sum(axis=1, keepdims=True)) / 4
    point = np.einsum("bk,bki->bi", weights, X)
    inputs = {"X": point, **corners("X", X)}
    right = np.einsum("bki,bi->bk", gradients(X), point.astype(LONG) - X[:, 0])
    right[:, 0] += 1
    # a point far outside of a small tetrahedron is a large number of its sizes away
    assert worst("phi", muslin.evaluate(functions.phi, **inputs), right, inputs) < EXACT


def test_gradients_of_shape_functions_are_normals_of_faces(functions, shapes):
    X, _, _ = shapes
    inputs = corners("X", X)
    assert worst("dphi_dX", muslin.evaluate(functions.dphi_dX, **inputs), gradients(X), inputs) < EXACT


def test_a_point_is_the_weighted_sum_of_the_vertices(functions, shapes):
    _, x, _ = shapes
    phi = np.random.default_rng(23).uniform(-1, 2, (COUNT, 4))
    inputs = {"phi": phi, **corners("x", x)}
    right = np.sum(phi[:, :, None].astype(LONG) * x, axis=1)
    assert worst("interpolate", muslin.evaluate(functions.interpolate, **inputs), right, inputs) < EXACT


def test_the_deformation_gradient_of_an_affine_map_is_that_map(functions, shapes):
    X, x, F = shapes
    inputs = {**corners("x", x), "dphi_dX": gradients(X).astype(float)}
    got = muslin.evaluate(functions.deformation_gradient, **inputs)
    right = np.sum(x[:, :, :, None].astype(LONG) * inputs["dphi_dX"][:, :, None, :], axis=1)
    assert worst("deformation_gradient", got, right, inputs) < EXACT
    assert worst("deformation_gradient", got, F, inputs) < EXACT


def test_mass_and_kinetic_energy_are_integrals(functions):
    """Against Gauss points that are exact for products of shape functions."""
    rng = np.random.default_rng(29)
    a, b = (5 + 3 * np.sqrt(LONG(5))) / 20, (5 - np.sqrt(LONG(5))) / 20
    points = np.full((4, 4), b) + (a - b) * np.eye(4, dtype=LONG)
    volume, rho = 10.0 ** rng.uniform(-9, 9, COUNT), 10.0 ** rng.uniform(0, 4, COUNT)
    v = rng.normal(size=(COUNT, 4, 3))
    inputs = {**corners("v", v), "volume": volume, "rho": rho}
    moved = np.einsum("pk,bki->bpi", points, v.astype(LONG))
    right = rho * volume * np.sum(moved**2, axis=(1, 2)) / 8
    assert worst("kinetic_energy", muslin.evaluate(functions.kinetic_energy, **inputs), right, inputs) < EXACT
    for i, j in itertools.product(range(4), repeat=2):
        numbers = {"i": np.full(COUNT, i, np.int32), "j": np.full(COUNT, j, np.int32)}
        inputs = {**numbers, "volume": volume, "rho": rho}
        right = rho * volume * np.sum(points[:, i] * points[:, j]) / 4
        assert worst("mass_block", muslin.evaluate(functions.mass_block, **inputs), right, inputs) < EXACT


def test_the_energy_is_the_formula(functions, strained, truth):
    got = muslin.evaluate(functions.psi, **strained)
    assert worst("psi", got, truth.value, strained) < EXACT


def test_the_stress_is_the_slope_of_the_energy(functions, strained, truth):
    got = muslin.evaluate(functions.dpsi_dF, **strained).reshape(-1, 9)
    assert worst("dpsi_dF", got, truth.slope, strained) < EXACT


def test_the_hessian_is_the_curvature_of_the_energy(functions, strained, truth):
    got = muslin.evaluate(functions.d2psi_dF2, **strained)
    assert worst("d2psi_dF2", got, truth.curvature, strained) < CURVATURE
    assert (size_of((got - truth.curvature).astype(float)) <= CURVATURE * size_of(truth.curvature)).all()


def test_at_rest_energy_and_stress_are_zero_to_rounding(functions):
    rng = np.random.default_rng(31)
    F = np.concatenate([np.eye(3)[None], rotations(rng, COUNT - 1)])
    C, D = 10.0 ** rng.uniform(2, 6, COUNT), 10.0 ** rng.uniform(2, 6, COUNT)
    psi = muslin.evaluate(functions.psi, F=F, C=C, D=D)
    P = muslin.evaluate(functions.dpsi_dF, F=F, C=C, D=D)
    assert psi[0] == 0
    assert not P[0].any()
    assert (np.abs(psi) < 1e-14 * (C + D)).all()
    assert (size_of(P) < 1e-14 * (C + D)).all()


def test_forces_and_stiffness_are_slopes_of_the_energy_in_the_vertices(functions, shapes, strained, truth):
    X, _, _ = shapes
    g = gradients(X).astype(float)
    volume = np.abs(np.linalg.det(X[:, 1:] - X[:, :1])) / 6
    P, H = truth.slope.astype(float).reshape(-1, 3, 3), truth.curvature.astype(float)
    for i in range(4):
        inputs = {"P": P, "grad_phi": g[:, i], "volume": volume}
        right = -volume[:, None] * np.sum(P.astype(LONG) * g[:, i, None, :], axis=2)
        assert worst("nodal_force", muslin.evaluate(functions.nodal_force, **inputs), right, inputs) < EXACT
    blocks = H.astype(LONG).reshape(-1, 3, 3, 3, 3)
    for i, j in ((0, 0), (1, 2), (3, 0)):
        inputs = {"d2psi_dF2": H, "grad_phi_i": g[:, i], "grad_phi_j": g[:, j], "volume": volume}
        weights = g[:, i, None, :, None, None] * g[:, j, None, None, None, :].astype(LONG)
        right = volume[:, None, None] * np.sum(blocks * weights, axis=(2, 4))
        got = muslin.evaluate(functions.stiffness_block, **inputs)
        assert worst("stiffness_block", got, right, inputs) < EXACT


def test_a_spring_pulls_along_the_slope_of_its_energy(functions):
    rng = np.random.default_rng(37)
    size = 10.0 ** rng.choice([-3, 0, 3], (COUNT, 1))
    x0 = size * rng.normal(size=(COUNT, 3))
    x1 = x0 + size * rng.normal(size=(COUNT, 3))
    l0, k = size[:, 0] * rng.uniform(0, 3, COUNT), 10.0 ** rng.uniform(0, 6, COUNT)
    x1[:100] = x0[:100]
    inputs = {"x0": x0, "x1": x1, "l0": l0, "k": k}
    x, y, z = Jet.variables(x0)
    way = [p * LONG(-1) + x1[:, i].astype(LONG) for i, p in enumerate((x, y, z))]
    apart = way[0] * way[0] + way[1] * way[1] + way[2] * way[2]
    apart.value[:100] = 1  # where the ends meet there is no slope; the force is zero there
    slope = ((apart ** (LONG(1) / 2) - l0.astype(LONG)) ** LONG(2) * (k.astype(LONG) / 2)).slope
    slope[:100] = 0
    got = muslin.evaluate(functions.spring_force, **inputs)
    assert not got[:100].any()
    assert worst("spring_force", got, -slope, inputs) < EXACT


def test_newtons_method_finds_known_minima(functions):
    made = reference_data.make("solids", "newtons_method", "other objectives", 400)
    right = made.pop("expected_x")
    # it stops where the gradient is 1e-10 of the least weight, and so this near
    assert worst("newtons_method", muslin.evaluate(functions.newtons_method, **made), right, made) < 1e-10


#: A cube in five tetrahedra.
CUBE = np.array(
    [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float
)
FIVE = np.array([(0, 1, 2, 5), (0, 2, 3, 7), (0, 5, 7, 4), (2, 5, 6, 7), (0, 2, 7, 5)])


def test_newtons_method_lets_a_stretched_cube_come_to_rest_and_turns_nothing_inside_out(functions):
    """All functions together: a cube held at its foot, begun wrung and wide; no objective but its energy."""
    f, free = functions, slice(12, 24)
    X = CUBE[FIVE]
    g = muslin.evaluate(f.dphi_dX, **corners("X", X))
    volume = np.linalg.det(X[:, 1:] - X[:, :1]) / 6
    material = {"C": np.full(5, 400.0), "D": np.full(5, 900.0)}
    asked = []

    def gradient_of(q):
        x = np.concatenate([CUBE[:4].ravel(), q]).reshape(8, 3)
        return muslin.evaluate(f.deformation_gradient, **corners("x", x[FIVE]), dphi_dX=g)

    def objective(q):
        F = gradient_of(q)
        asked.append(np.linalg.det(F).min())
        return np.inf if asked[-1] <= 0 else float(volume @ muslin.evaluate(f.psi, F=F, **material))

    def slope(q):
        P = muslin.evaluate(f.dpsi_dF, F=gradient_of(q), **material)
        force = muslin.evaluate(
            f.nodal_force, P=np.repeat(P, 4, axis=0), grad_phi=g.reshape(-1, 3), volume=np.repeat(volume, 4)
        )
        total = np.zeros((8, 3))
        np.add.at(total, FIVE.ravel(), -force)
        return total.ravel()[free]

    def curvature(q):
        H = np.repeat(muslin.evaluate(f.d2psi_dF2, F=gradient_of(q), **material), 16, axis=0)
        i, j = (np.tile(k, 5) for k in np.divmod(np.arange(16), 4))
        cell = np.repeat(np.arange(5), 16)
        K = muslin.evaluate(
            f.stiffness_block, d2psi_dF2=H, grad_phi_i=g[cell, i], grad_phi_j=g[cell, j], volume=volume[cell]
        )
        total = np.zeros((8, 3, 8, 3))
        np.add.at(total, (FIVE[cell, i], slice(None), FIVE[cell, j]), K)
        values, V = np.linalg.eigh(total.reshape(24, 24)[free, free])
        return (V * np.maximum(np.abs(values), 1e-3)) @ V.T

    turned = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    wrung = (CUBE[4:] - 0.5) @ turned.T * [2.0, 2.0, 1.0] + [0.5, 0.5, 0.1]
    q = f.newtons_method(wrung.ravel(), objective, slope, curvature, np.linalg.solve, 1e-9, 200)
    np.testing.assert_allclose(q, CUBE[4:].ravel(), atol=1e-10)
    assert min(asked) <= 0  # there were steps to refuse
