"""The element of a triangle, on all its roads, against the truth of its potential energy V(q) = h a psi.

A batch of separate triangles is one cloth, so the truth of each stands beside what the cloth computes.
"""

from pathlib import Path

import numpy as np
import pytest
import truth_fast as fast

import muslin

SOLUTION = Path(__file__).parents[1] / "solutions" / "cloth"
COUNT = 4000
MU, LAM, THICKNESS = 300.0, 700.0, 0.02
STIFF = 2 * MU + LAM
ENERGIES = ["linearised", "area", "volumetric"]

pytestmark = fast.needs_longdouble


class Sample:
    """Separate triangles and the truth of each, by energy."""

    def __init__(self):
        rng = np.random.default_rng(20)
        self.X, self.x, _ = fast.triangles(rng, COUNT)
        self.vertices, self.positions = self.X.reshape(-1, 3), self.x.reshape(-1, 3)
        self.mesh = (self.vertices, np.arange(3 * COUNT).reshape(-1, 3))
        A, self.rest = fast.in_plane(self.X, self.x)
        self.s = np.linalg.svd(A.astype(float), compute_uv=False)
        stretches = np.concatenate([self.s, np.ones((COUNT, 1))], axis=1)
        self.gap = np.abs(stretches - np.roll(stretches, 1, axis=1)).min(axis=1)
        self.altitude = 2 * self.rest.area / self.rest.length
        #: natural scales of a triangle's energy, force and Hessian
        self.energy = THICKNESS * self.rest.area * STIFF
        self.force = self.energy / self.altitude
        self.truth = {}

    def of(self, energy):
        """V (b,), gradient (b, 9), Hessian (b, 9, 9), Hessian with its negative modes clamped."""
        if energy == "volumetric":  # on a cloth the third stretch is 1
            return self.of("area")
        if energy not in self.truth:
            V, gradient, hessian = fast.element(self.X, self.x, MU, LAM, THICKNESS, energy)
            clamped = fast.clamped_element(self.X, self.x, MU, LAM, THICKNESS, energy)
            self.truth[energy] = V, gradient, hessian, clamped
        return self.truth[energy]


@pytest.fixture(scope="module")
def sample():
    return Sample()


@pytest.fixture(scope="module")
def functions():
    return muslin.load(SOLUTION)


@pytest.fixture(scope="module")
def cloths(sample, functions):
    """One cloth for each energy and element: student's 3x3 on both roads, and the native 3x2."""
    material = {"mu": MU, "lam": LAM, "rho": 1.5, "h": THICKNESS}
    made = {}
    for energy in ENERGIES:
        made[energy, "native"] = muslin.Cloth(sample.mesh, **material, energy=energy)
        for road in ("closed", "lecture"):
            made[energy, road] = muslin.Cloth(
                sample.mesh, **material, functions=functions, energy=energy, hessian=road
            )
    return made


def size(a):
    a = np.asarray(a)
    return np.sqrt((a * a).reshape(len(a), -1).sum(axis=1))


def holds(found, bound):
    """Every error is within its bound (a NaN is not)."""
    bound = np.broadcast_to(bound, found.shape)
    worst = int(np.argmax(np.nan_to_num(found / bound, nan=np.inf)))
    print(f"worst error {found[worst]:.1e}, bound {bound[worst]:.1e}")  # pytest -rA shows the margins
    assert (found <= bound).all(), f"triangle {worst}: error {found[worst]:.2e}, bound {bound[worst]:.1e}"


def blocks(matrix):
    """The 9x9 block of each separate triangle of an assembled matrix; nothing lies outside them."""
    found = matrix.tobsr(blocksize=(9, 9))
    assert (found.indices == np.arange(len(found.data))).all()
    return found.data


def lecture_bound(sample):
    """What the lecture's road promises: it splits equal stretches by about 1e-6."""
    return np.where(sample.gap > 1e-3, 1e-9, 1e-5)


every_energy = pytest.mark.parametrize("energy", ENERGIES)
both_elements = pytest.mark.parametrize("element", ["closed", "native"])


# --- against the truth -------------------------------------------------------------------------------------


@every_energy
@both_elements
def test_energy_is_h_times_area_times_density(cloths, sample, energy, element):
    V, *_ = sample.of(energy)
    assert abs(cloths[energy, element].energy(sample.positions) - V.sum()) < 1e-12 * V.sum()


@every_energy
@both_elements
def test_force_is_minus_the_gradient_of_the_energy(cloths, sample, energy, element):
    _, gradient, *_ = sample.of(energy)
    found = cloths[energy, element].gradient(sample.positions).reshape(-1, 9)
    holds(size(found - gradient) / (sample.force + size(gradient)), 1e-12)


@every_energy
@both_elements
def test_closed_form_hessian_is_exact_everywhere(cloths, sample, energy, element):
    _, _, hessian, _ = sample.of(energy)
    found = blocks(cloths[energy, element].hessian(sample.positions))
    holds(size(found - hessian) / size(hessian), 1e-10)


@every_energy
def test_lectures_hessian_is_exact_where_stretches_differ_and_close_where_they_meet(cloths, sample, energy):
    _, _, hessian, _ = sample.of(energy)
    found = blocks(cloths[energy, "lecture"].hessian(sample.positions))
    holds(size(found - hessian) / size(hessian), lecture_bound(sample))


@pytest.mark.parametrize("road", ["closed", "lecture"])
@every_energy
def test_hessian_is_right_at_rest(cloths, sample, energy, road):
    _, _, hessian = fast.element(sample.X, sample.X, MU, LAM, THICKNESS, energy.replace("volumetric", "area"))
    found = blocks(cloths[energy, road].hessian(sample.vertices))
    holds(size(found - hessian) / size(hessian), {"closed": 1e-10, "lecture": 1e-5}[road])


@pytest.mark.parametrize(("element", "bound"), [("closed", 1e-14), ("native", 1e-14), ("lecture", 1e-9)])
@every_energy
def test_hessian_is_symmetric(cloths, sample, energy, element, bound):
    found = blocks(cloths[energy, element].hessian(sample.positions))
    holds(size(found - found.transpose(0, 2, 1)) / size(found), bound)


# --- projection --------------------------------------------------------------------------------------------


@every_energy
@pytest.mark.parametrize("element", ["closed", "native", "lecture"])
def test_projected_hessian_has_the_negative_modes_clamped_and_the_others_kept(
    cloths, sample, energy, element
):
    _, _, hessian, clamped = sample.of(energy)
    changed = size(clamped - hessian) > 1e-6 * size(hessian)
    assert changed.sum() > COUNT / 10
    assert (~changed).sum() > COUNT / 10
    found = blocks(cloths[energy, element].hessian(sample.positions, project=True))
    holds(size(found - clamped) / size(hessian), lecture_bound(sample) if element == "lecture" else 1e-10)


@every_energy
@pytest.mark.parametrize(("element", "bound"), [("closed", 1e-12), ("native", 1e-12), ("lecture", 1e-8)])
def test_projected_hessian_is_positive_semidefinite(cloths, sample, energy, element, bound):
    found = blocks(cloths[energy, element].hessian(sample.positions, project=True))
    smallest = np.linalg.eigvalsh((found + found.transpose(0, 2, 1)) / 2)[:, 0]
    holds(-smallest / size(found), bound)


# --- invariances -------------------------------------------------------------------------------------------


@every_energy
@pytest.mark.parametrize("element", ["closed", "native", "lecture"])
@pytest.mark.parametrize("project", [False, True])
def test_moving_the_whole_triangle_costs_nothing(cloths, sample, energy, element, project):
    found = blocks(cloths[energy, element].hessian(sample.positions, project=project))
    translations = np.tile(np.eye(3), (3, 1)) / np.sqrt(3)
    holds(size(found @ translations) / size(found), 1e-12)
    holds(size(translations.T @ found) / size(found), 1e-12)


@every_energy
@both_elements
def test_forces_of_a_triangle_sum_to_zero_and_have_no_torque(cloths, sample, energy, element):
    force = -cloths[energy, element].gradient(sample.positions).reshape(-1, 3, 3)
    scale = sample.force + size(force)
    holds(size(force.sum(axis=1)) / scale, 1e-12)
    arm = sample.x - sample.x.mean(axis=1, keepdims=True)
    holds(size(np.cross(arm, force).sum(axis=1)) / (scale * (sample.rest.length + size(arm))), 1e-12)


@every_energy
@both_elements
def test_rigid_motion_stores_no_energy_and_pulls_nowhere(cloths, sample, energy, element):
    rng = np.random.default_rng(21)
    moved = (sample.X @ fast.rotations(rng, COUNT) + rng.uniform(-1, 1, (COUNT, 1, 3))).reshape(-1, 3)
    cloth = cloths[energy, element]
    assert cloth.energy(moved) < 1e-24 * sample.energy.sum()
    holds(size(cloth.gradient(moved).reshape(-1, 9)) / sample.force, 1e-12)


@every_energy
def test_3x3_and_3x2_elements_agree(cloths, sample, energy):
    student, native = cloths[energy, "closed"], cloths[energy, "native"]
    x = sample.positions
    assert abs(student.energy(x) - native.energy(x)) < 1e-11 * native.energy(x)
    forces = [cloth.gradient(x).reshape(-1, 9) for cloth in (student, native)]
    holds(size(forces[0] - forces[1]) / (sample.force + size(forces[1])), 1e-11)
    for project in (False, True):
        found = [blocks(cloth.hessian(x, project=project)) for cloth in (student, native)]
        holds(size(found[0] - found[1]) / size(blocks(native.hessian(x))), 1e-11)


def test_volumetric_energy_of_a_cloth_is_its_area_energy(cloths, sample):
    x = sample.positions
    area, volumetric = cloths["area", "closed"], cloths["volumetric", "closed"]
    assert abs(area.energy(x) - volumetric.energy(x)) < 1e-12 * area.energy(x)
    difference = blocks(area.hessian(x)) - blocks(volumetric.hessian(x))
    holds(size(difference) / size(blocks(area.hessian(x))), 1e-10)


# --- mass and assembly -------------------------------------------------------------------------------------


@both_elements
def test_mass_is_the_integral_of_the_shape_functions(cloths, sample, element):
    found = blocks(cloths["linearised", element].mass)
    for i in range(3):
        for j in range(3):
            mass = (
                1.5 * THICKNESS * fast.over_triangle(lambda phi, i=i, j=j: phi[i] * phi[j], sample.rest.area)
            )
            block = found[:, 3 * i : 3 * i + 3, 3 * j : 3 * j + 3]
            holds(size(block - mass[:, None, None] * np.eye(3)) / mass, 1e-12)


@pytest.fixture(scope="module")
def sheet():
    """A crumpled connected sheet: 8 x 8 vertices, some triangles at rest, some crushed."""
    rng = np.random.default_rng(22)
    side = 8
    i, j = np.meshgrid(np.arange(side), np.arange(side), indexing="ij")
    X = np.stack([i.ravel(), j.ravel(), np.zeros(side**2)], axis=1) / (side - 1)
    corner = (i * side + j)[:-1, :-1].ravel()
    triangles = np.concatenate(
        [
            np.stack([corner, corner + side, corner + side + 1], axis=1),
            np.stack([corner, corner + side + 1, corner + 1], axis=1),
        ]
    )
    x = X * (1.2, 0.7, 1) + np.where(X[:, :1] > 0.3, rng.normal(size=X.shape) * 0.04, 0)
    return X, triangles, x


@every_energy
@pytest.mark.parametrize("element", ["closed", "native", "lecture"])
def test_a_sheet_is_the_sum_of_its_triangles(functions, sheet, energy, element):
    X, triangles, x = sheet
    road = {"hessian": element, "functions": functions} if element != "native" else {}
    cloth = muslin.Cloth((X, triangles), mu=MU, lam=LAM, h=THICKNESS, energy=energy, **road)
    V, gradient, hessian = fast.element(
        X[triangles], x[triangles], MU, LAM, THICKNESS, energy.replace("volumetric", "area")
    )
    unknowns = (3 * triangles[:, :, None] + np.arange(3)).reshape(-1, 9)
    g, H = np.zeros(X.size, dtype=fast.Real), np.zeros((X.size, X.size), dtype=fast.Real)
    np.add.at(g, unknowns, gradient)
    np.add.at(H, (unknowns[:, :, None], unknowns[:, None, :]), hessian)
    assert abs(cloth.energy(x) - V.sum()) < 1e-12 * V.sum()
    assert np.linalg.norm((cloth.gradient(x).ravel() - g).astype(float)) < 1e-12 * np.linalg.norm(
        g.astype(float)
    )
    error = np.linalg.norm((cloth.hessian(x).toarray() - H).astype(float)) / np.linalg.norm(H.astype(float))
    assert error < {"closed": 1e-10, "native": 1e-10, "lecture": 1e-5}[element]
    everywhere = np.tile(np.eye(3), (len(X), 1))
    for project in (False, True):
        found = cloth.hessian(x, project=project)
        assert np.abs(found @ everywhere).max() < 1e-12 * np.abs(found).max()


@pytest.mark.parametrize("element", ["closed", "native"])
def test_mass_of_a_sheet_is_positive_definite_and_weighs_rho_h_area(functions, sheet, element):
    X, triangles, _ = sheet
    road = {"functions": functions} if element == "closed" else {}
    mass = muslin.Cloth((X, triangles), mu=MU, lam=LAM, rho=3.0, h=0.5, **road).mass
    dense = mass.toarray()
    assert (dense == dense.T).all()
    assert np.linalg.eigvalsh(dense)[0] > 0
    assert abs(dense[::3, ::3].sum() - 3.0 * 0.5) < 1e-14
