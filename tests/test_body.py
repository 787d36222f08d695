"""A body of tetrahedra goes through the same doors as cloth: energies, systems, steps, contacts, wind."""

import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin import mesh, tasks
from muslin.base.errors import MuslinError
from muslin.physics.body import Body
from muslin.physics.cloth import Cloth
from muslin.physics.colliders import Plane
from muslin.physics.elements.element import Element
from muslin.physics.elements.pattern import Pattern
from muslin.simulation import scenes
from muslin.simulation.integrators import steps
from muslin.simulation.model import Model, State

ROOT = Path(__file__).resolve().parent.parent
MU, LAM, RHO = 40.0, 60.0, 3.0


class SaintVenant(Element):
    """psi = mu E : E + lam / 2 tr(E)^2 with E = (F^T F - I) / 2, in plain NumPy, by the formula of any textbook."""

    def __init__(self, solid):
        m = len(solid.cells)
        super().__init__(solid.vertices, solid.cells, (16 * m, 3, 3))
        X = solid.vertices[solid.cells]
        edges = np.stack([X[:, k] - X[:, 0] for k in (1, 2, 3)], axis=-1)
        inner = np.linalg.inv(edges)
        self.dphi = np.concatenate([-inner.sum(axis=1, keepdims=True), inner], axis=1)  # rows: grad phi_i
        self.volume = solid.volumes

    def stress(self, x):
        F = np.einsum("mia,mib->mab", x[self.cells], self.dphi)
        E = (np.einsum("mka,mkb->mab", F, F) - np.eye(3)) / 2
        trace = np.trace(E, axis1=1, axis2=2)
        return F, E, trace, 2 * MU * E + LAM * trace[:, None, None] * np.eye(3)

    def _run(self, parts, project):
        F, E, trace, S = self.stress(self.x)
        w, g = self.volume, self.dphi
        if parts & 1:
            self.energies[:] = w * (MU * (E * E).sum(axis=(1, 2)) + LAM / 2 * trace**2)
        if parts & 2:
            self.gradients[:] = np.einsum("m,mab,mbc,mic->mia", w, F, S, g).reshape(-1, 3)
        if parts & 4:
            Fg = np.einsum("mab,mib->mia", F, g)  # F grad phi_i
            gg, B = np.einsum("mia,mja->mij", g, g), np.einsum("mac,mbc->mab", F, F)
            K = np.einsum("mia,mab,mjb,cd->mijcd", g, S, g, np.eye(3))
            K += LAM * np.einsum("mia,mjb->mijab", Fg, Fg) + MU * np.einsum("mja,mib->mijab", Fg, Fg)
            K += MU * np.einsum("mij,mab->mijab", gg, B)
            K *= w[:, None, None, None, None]
            if project:
                whole = K.transpose(0, 1, 3, 2, 4).reshape(-1, 12, 12)
                values, vectors = np.linalg.eigh(whole)
                whole = np.einsum("mak,mk,mbk->mab", vectors, np.maximum(values, 0), vectors)
                K = whole.reshape(-1, 4, 3, 4, 3).transpose(0, 1, 3, 2, 4)
            self.hessians[:] = K.reshape(-1, 3, 3)


def solid_body(solid):
    element = SaintVenant(solid)
    mass = (RHO * solid.volumes[:, None] * np.where(np.eye(4), 2.0, 1.0).ravel() / 20).ravel()
    seen = mesh.Mesh(solid.vertices, solid.surface)
    return Body(
        solid.vertices, solid.cells, dict.fromkeys(("energy", "gradient", "hessian"), element), mass, seen
    )


@pytest.fixture(scope="module")
def bent():
    solid = mesh.block(3, 4, 3, 1.0, 1.5, 1.0)
    x = solid.vertices + 0.07 * np.sin(2.0 * np.arange(solid.vertices.size)).reshape(-1, 3)
    return solid_body(solid), x


def test_forces_of_a_solid_are_the_slope_of_its_energy_and_balance(bent):
    body, x = bent
    d = np.cos(np.arange(x.size)).reshape(x.shape)
    slope = (body.energy(x + 1e-5 * d) - body.energy(x - 1e-5 * d)) / 2e-5
    gradient = body.gradient(x)
    assert slope == pytest.approx(float((gradient * d).sum()), rel=1e-8)
    scale = np.abs(gradient).sum()
    np.testing.assert_allclose(gradient.sum(axis=0), 0, atol=1e-14 * scale)
    np.testing.assert_allclose(np.cross(x, gradient).sum(axis=0), 0, atol=1e-14 * scale)


def test_the_hessian_of_a_solid_is_the_slope_of_its_gradient_and_symmetric(bent):
    body, x = bent
    d = np.cos(np.arange(x.size)).reshape(x.shape)
    K = body.hessian(x)
    slope = (body.gradient(x + 1e-5 * d) - body.gradient(x - 1e-5 * d)).ravel() / 2e-5
    np.testing.assert_allclose(K @ d.ravel(), slope, rtol=0, atol=1e-7 * np.abs(slope).max())
    assert abs(K - K.T).max() < 1e-13 * abs(K).max()
    assert np.linalg.eigvalsh(body.hessian(x, project=True).toarray())[0] > -1e-10 * abs(K).max()


def test_the_mass_of_a_solid_is_density_times_volume(bent):
    body, x = bent
    assert body.mass.sum() / 3 == pytest.approx(RHO * 1.5)
    v = np.tile([1.0, -2.0, 2.0], (len(x), 1))
    assert body.kinetic_energy(v) == pytest.approx(RHO * 1.5 * 9 / 2)


@pytest.mark.parametrize("cells", [mesh.grid(3, 4).triangles, mesh.block(2, 3, 3).cells])
def test_a_pattern_sums_what_adding_corner_by_corner_would(cells):
    n, (m, k) = cells.max() + 1, cells.shape
    pattern = Pattern(np.ascontiguousarray(cells, dtype=np.int32), n)
    rows = np.random.default_rng(0).normal(size=(k * m, 3))
    factor = np.random.default_rng(1).normal(size=k * k * m)
    total, blocks = np.zeros((n, 3)), np.zeros((n, n))
    np.add.at(total, cells.ravel(), rows)
    np.add.at(blocks, (np.repeat(cells, k, axis=1).ravel(), np.tile(cells, k).ravel()), factor)
    np.testing.assert_allclose(pattern.vector(rows), total, atol=1e-14)
    found = np.zeros((n, n))
    found[pattern.layout.row, pattern.layout.col] = pattern.blocks(factor)
    np.testing.assert_allclose(found, blocks, atol=1e-14)


@pytest.mark.parametrize("name", ["linearly-implicit", "backward-euler"])
def test_a_solid_in_free_fall_stays_as_it_is(name):
    solid = mesh.ball(3)
    g, dt = np.array([0, -9.81, 0]), 0.01
    model, start = Model(solid_body(solid), g), State(solid.vertices.copy(), np.zeros_like(solid.vertices))
    *_, last = steps(model, start, dt, name, 5)
    np.testing.assert_allclose(last.x, solid.vertices + dt**2 * g * 15, atol=1e-9)


def test_a_solid_comes_to_lie_on_the_floor_with_its_surface():
    solid = mesh.block(3, 3, 3)
    floor = Plane((0.0, -0.6, 0.0), (0.0, 1.0, 0.0))
    model = Model(solid_body(solid), np.array([0.0, -9.81, 0.0]), colliders=lambda time: (floor,))
    start = State(solid.vertices.copy(), np.zeros_like(solid.vertices))
    touched, lowest = set(), 0.0
    for state in steps(model, start, 1 / 60, "linearly-implicit", 60):
        lowest = min(lowest, float(state.x[:, 1].min()))
        touched |= {int(v) for contact in state.contacts for v in contact.vertices}
    assert -0.6 - 1e-9 < lowest < -0.599
    centre = int(np.flatnonzero((solid.vertices == 0).all(axis=1))[0])
    assert touched
    assert centre not in touched, "what is inside touches nothing"


def test_the_wind_pushes_a_closed_surface_the_way_it_blows():
    solid = mesh.block(3, 3, 3)
    model = Model(solid_body(solid), np.zeros(3), wind=(3.0, 0.0, 0.0), drag=1.2)
    force = model.wind_force(solid.vertices, np.zeros_like(solid.vertices))
    # drag / 2 v^2 on each of the two square metres across the wind
    np.testing.assert_allclose(force.sum(axis=0), [2 * 1.2 / 2 * 3.0**2, 0, 0], atol=1e-12)
    inside = np.setdiff1d(np.arange(len(solid.vertices)), solid.surface)
    assert len(inside) == 1
    assert not force[inside].any()


def test_a_stretch_limit_is_refused_where_there_are_no_triangles_to_limit():
    with pytest.raises(MuslinError, match="A stretch limit is for cloth"):
        Model(solid_body(mesh.block(2, 2, 2)), np.zeros(3), stretch_limit=1.1)


def test_cloth_is_a_body_whose_surface_is_its_cells():
    cloth = Cloth(scenes.get("hang", resolution=4).load_mesh(), mu=1.0, lam=1.0)
    assert isinstance(cloth, Body)
    assert {element.corners for element in cloth.elements.values()} == {3}
    np.testing.assert_array_equal(cloth.surface, cloth.cells)
    moved = replace(cloth.mesh, name="moved")
    np.testing.assert_array_equal(moved.triangles, cloth.surface)


def test_a_folder_of_another_assignment_is_refused_by_cloth_in_words():
    cloth = muslin.load(ROOT / "solutions" / "cloth")
    fewer = replace(cloth.assignment, name="solids", tasks={"psi": cloth.assignment.tasks["psi"]})
    others = tasks.Functions(cloth.folder, fewer, {"psi": cloth.psi})
    with pytest.raises(
        MuslinError, match="The assignment 'solids' has no task 'dphi_dX', which a cloth calls"
    ):
        Cloth(mesh.grid(2, 2), mu=1.0, lam=1.0, functions=others)


def test_what_is_behind_the_parts_of_a_simulation_is_known_without_meshes_or_the_engine():
    code = (
        "import sys, muslin.physics.stand_ins\n"
        "print({'muslin.mesh', 'taichi', 'quadrants', 'scipy'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"
