"""A solid's energy, gradient, Hessian and mass against values of many digits, and what they must obey."""

from __future__ import annotations

import itertools

import mpmath as mp
import numpy as np
import pytest

import muslin
from muslin.base.errors import MuslinError, SimulationError
from muslin.mesh import TetMesh, block
from muslin.physics.solid import ENERGIES, Solid

C, D = 3.0, 20.0
CORNERS = np.array([[0.0, 0, 0], [1, 0.1, 0], [0.2, 0.9, 0.1], [0.1, 0.3, 1.1]])


def rotation(axis, angle):
    a = np.asarray(axis) / np.linalg.norm(axis)
    K = np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


TURNED = rotation((1, 2, -1), 1.1)
#: Deformations by name: how large the tetrahedron is, and F.
STATES = {
    "rest": (1.0, np.eye(3)),
    "turned": (1.0, TURNED),
    "twice as large": (1.0, 2 * np.eye(3)),
    "sheared": (1.0, TURNED @ np.array([[1.2, 0.3, 0], [0.1, 0.8, -0.2], [0, 0.1, 0.9]])),
    "pressed": (1.0, np.array([[1.0, 0.2, 0], [0, 0.05, 0], [0.1, 0, 1.0]])),
    "pulled": (1.0, TURNED @ np.diag([8.0, 1.0, 1.0])),
    "tiny": (1e-3, np.array([[1.1, 0.3, 0], [0.1, 0.9, 0.2], [0, 0.1, 1.0]])),
    "huge": (1e3, np.array([[1.1, 0.3, 0], [0.1, 0.9, 0.2], [0, 0.1, 1.0]])),
}


def psi(energy, F):
    """The energies as they are defined, of an mpmath matrix."""
    mu, lam = 2 * mp.mpf(C), 2 * mp.mpf(D) - mp.mpf(4) / 3 * C
    S = F.T * F
    J, I1 = mp.det(F), S[0, 0] + S[1, 1] + S[2, 2]
    if energy == "neo-hookean":
        return C * (J ** (-mp.mpf(2) / 3) * I1 - 3) + D * (J - 1) ** 2
    if energy == "st-venant-kirchhoff":
        E = (S - mp.eye(3)) / 2
        return mu * sum(e**2 for e in E) + lam / 2 * (E[0, 0] + E[1, 1] + E[2, 2]) ** 2
    if energy == "corotated":
        s = [mp.sqrt(value) for value in mp.eigsy(S, eigvals_only=True)]
        s[0] *= mp.sign(J)
        return mu * sum((k - 1) ** 2 for k in s) + lam / 2 * (sum(s) - 3) ** 2
    m, l = 4 * mu / 3, lam + 5 * mu / 6  # noqa: E741

    def stable(J, I1):
        alpha = 1 + 3 * m / (4 * l)
        return m / 2 * (I1 - 3) + l / 2 * (J - alpha) ** 2 - m / 2 * mp.log(I1 + 1)

    return stable(J, I1) - stable(mp.mpf(1), mp.mpf(3))


def exact(energy, X, x):
    """Energy, gradient (12,) and Hessian (12, 12) of one tetrahedron, by differences of the energy in 80 digits."""
    mp.mp.dps = 80
    h = mp.mpf(10) ** -20
    rest = mp.matrix((X[1:] - X[0]).T.tolist())
    inverse, volume = rest**-1, mp.det(rest) / 6

    def value(q):
        return volume * psi(energy, edges(q) * inverse)

    def edges(q):
        return mp.matrix([[q[3 * k + a] - q[a] for k in (1, 2, 3)] for a in range(3)])

    def moved(*by):
        q = [mp.mpf(float(c)) for c in x.ravel()]
        for k, sign in by:
            q[k] += sign * h
        return value(q)

    here = moved()
    up, down = ([moved((k, sign)) for k in range(12)] for sign in (1, -1))
    gradient = [(up[k] - down[k]) / (2 * h) for k in range(12)]
    H = np.zeros((12, 12))
    for k, l in itertools.combinations_with_replacement(range(12), 2):  # noqa: E741
        if k == l:
            H[k, k] = (up[k] + down[k] - 2 * here) / h**2
        else:
            H[k, l] = H[l, k] = (moved((k, 1), (l, 1)) - up[k] - up[l] + 2 * here
                                 - down[k] - down[l] + moved((k, -1), (l, -1))) / (2 * h**2)  # fmt: skip
    return float(here), np.array([float(g) for g in gradient]), H


def single(energy, size=1.0):
    mesh = TetMesh.from_arrays(size * CORNERS, [[0, 1, 2, 3]])
    return Solid(mesh, C=C, D=D, rho=1.5, energy=energy)


def crumpled(amount=0.04, seed=1):
    mesh = block(3, 4, 3)
    return mesh, mesh.vertices + amount * np.random.default_rng(seed).standard_normal(mesh.vertices.shape)


@pytest.mark.parametrize("energy", ENERGIES)
@pytest.mark.parametrize("state", STATES)
def test_energy_gradient_and_hessian_are_exact(energy, state):
    size, F = STATES[state]
    solid = single(energy, size)
    X = solid.X
    x = X @ F.T + size * np.array([0.3, -0.2, 0.5])
    value, gradient, H = exact(energy, X, x)
    volume, J = solid.volume[0], np.linalg.det(F)
    natural = volume * (C * ((F**2).sum() * J ** (-2 / 3) + 3) + D * (J**2 + 1)) + abs(value)
    assert abs(solid.energy(x) - value) <= 1e-12 * natural
    assert np.abs(solid.gradient(x).ravel() - gradient).max() <= 1e-11 * max(
        np.abs(gradient).max(), natural / size
    )
    assert np.abs(solid.hessian(x).toarray() - H).max() <= 1e-9 * np.abs(H).max()


@pytest.mark.parametrize("energy", ENERGIES[2:])
def test_an_inverted_tetrahedron_has_the_energy_its_definition_says(energy):
    solid = single(energy)
    x = solid.X @ (TURNED @ np.diag([1.1, 0.9, -0.4])).T
    value, gradient, H = exact(energy, solid.X, x)
    assert solid.energy(x) == pytest.approx(value, rel=1e-12)
    assert np.abs(solid.gradient(x).ravel() - gradient).max() <= 1e-11 * np.abs(gradient).max()
    assert np.abs(solid.hessian(x).toarray() - H).max() <= 1e-9 * np.abs(H).max()


def test_neo_hookean_energy_is_infinite_where_a_tetrahedron_is_inverted_and_says_which():
    mesh = block(3, 3, 3)
    solid = Solid(mesh, C=C, D=D)
    x = mesh.vertices.copy()
    x[13] += (0, 2, 0)
    assert solid.energy(x) == np.inf
    with pytest.raises(SimulationError, match=r"Tetrahedron \d+ .* inverted"):
        solid.gradient(x)
    with pytest.raises(SimulationError, match="inverted"):
        solid.hessian(x)


@pytest.mark.parametrize("energy", ENERGIES)
def test_at_rest_and_turned_there_is_no_energy_and_no_force(energy):
    mesh, _ = crumpled()
    solid = Solid(mesh, C=C, D=D, energy=energy)
    for F in (np.eye(3), TURNED):
        x = mesh.vertices @ F.T + (1.0, 2.0, 3.0)
        assert abs(solid.energy(x)) <= 1e-13 * (C + D)
        assert np.abs(solid.gradient(x)).max() <= 1e-13 * (C + D)


@pytest.mark.parametrize("energy", ENERGIES)
def test_translations_and_rotations_are_in_the_null_space(energy):
    mesh, x = crumpled()
    solid = Solid(mesh, C=C, D=D, energy=energy)
    H, g = solid.hessian(x), solid.gradient(x)
    scale = np.abs(H).max()
    for a in np.eye(3):
        assert np.abs(H @ np.tile(a, len(x))).max() <= 1e-11 * scale
        assert abs((g @ a).sum()) <= 1e-11 * scale
        # the force turns with the solid: H (a x x) = a x g
        assert np.abs((H @ np.cross(a, x).ravel()).reshape(-1, 3) - np.cross(a, g)).max() <= 1e-11 * scale
    assert np.abs(np.cross(x, g).sum(axis=0)).max() <= 1e-11 * scale


@pytest.mark.parametrize("energy", ENERGIES)
def test_projection_leaves_what_is_positive_and_takes_the_rest_away(energy):
    mesh, x = crumpled(0.12)
    x = x if energy != "neo-hookean" else crumpled(0.05)[1]
    solid = Solid(mesh, C=C, D=D, energy=energy)
    changed = kept = 0
    for cell in mesh.cells:
        one = Solid((mesh.vertices[cell], [[0, 1, 2, 3]]), C=C, D=D, energy=energy)
        full, projected = one.hessian(x[cell]).toarray(), one.hessian(x[cell], project=True).toarray()
        scale = np.abs(full).max()
        assert np.linalg.eigvalsh(projected)[0] >= -1e-12 * scale
        w = np.linalg.eigvalsh(full)
        if w[0] >= -1e-12 * scale:
            kept += 1
            assert np.abs(projected - full).max() <= 1e-12 * scale
        else:
            changed += 1
            # in F the modes are those of the Hessian of psi: what is left is positive and no less than the full one
            assert np.linalg.eigvalsh(projected - full)[0] >= -1e-12 * scale
            assert np.abs(projected - full).max() > 1e-12 * scale
    assert changed
    assert kept or energy != "neo-hookean"
    whole = solid.hessian(x, project=True).toarray()
    assert np.linalg.eigvalsh(whole)[0] >= -1e-12 * np.abs(whole).max()


def test_mass_is_the_integral_of_products_of_shape_functions():
    mesh = block(3, 2, 4)
    solid = Solid(mesh, C=C, D=D, rho=1.5)
    exact_mass = np.zeros((len(mesh.vertices), len(mesh.vertices)))
    for cell, volume in zip(mesh.cells, mesh.volumes, strict=True):
        exact_mass[np.ix_(cell, cell)] += 1.5 * volume / 20 * (np.ones((4, 4)) + np.eye(4))
    M = solid.mass.toarray()
    assert np.abs(M - np.kron(exact_mass, np.eye(3))).max() <= 1e-12 * M.max()
    v = np.random.default_rng(0).standard_normal(mesh.vertices.shape)
    assert solid.kinetic_energy(v) == pytest.approx(v.ravel() @ M @ v.ravel() / 2, rel=1e-12)
    assert solid.mass.sum() == pytest.approx(3 * 1.5 * mesh.volumes.sum(), rel=1e-12)


@pytest.mark.parametrize("energy", ENERGIES)
def test_small_strains_are_those_of_linear_elasticity(energy):
    solid = single(energy)
    mu, lam = solid.lame
    H = solid.hessian(solid.X).toarray()
    rng = np.random.default_rng(3)
    for _ in range(4):
        G = rng.standard_normal((3, 3))
        u = (solid.X @ G.T).ravel()
        strain = (G + G.T) / 2
        expected = solid.volume[0] * (2 * mu * (strain**2).sum() + lam * np.trace(strain) ** 2)
        assert u @ H @ u == pytest.approx(expected, rel=1e-11)


def test_a_solid_is_made_of_a_file_a_mesh_or_arrays(tmp_path):
    mesh = block(2, 2, 2)
    lines = ["MeshVersionFormatted 1", "Dimension 3", "Vertices", "8"]
    lines += [" ".join(map(repr, map(float, row))) + " 0" for row in mesh.vertices]
    lines += ["Tetrahedra", str(len(mesh.cells))]
    lines += [" ".join(str(int(k) + 1) for k in row) + " 0" for row in mesh.cells]
    file = tmp_path / "cube.mesh"
    file.write_text("\n".join([*lines, "End", ""]))

    x = mesh.vertices * (1.1, 0.9, 1.0)
    energies = {muslin.Solid(made, C=C, D=D).energy(x) for made in (mesh, file, (mesh.vertices, mesh.cells))}
    assert len(energies) == 1


@pytest.mark.parametrize("wrong", [{"C": 0.0}, {"D": -1.0}, {"rho": np.nan}, {"energy": "neo"}])
def test_parameters_without_sense_are_refused(wrong):
    with pytest.raises(MuslinError):
        Solid(block(2, 2, 2), **{"C": C, "D": D, **wrong})
