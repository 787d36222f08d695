"""The functions of the solids assignment in a body: the same numbers as Muslin's own, and faults that are named."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

import muslin
from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError, SimulationError
from muslin.mesh import block
from muslin.physics import cloth, stand_ins
from muslin.physics.solid import NEEDS, Solid

C, D = 3.0, 20.0
SOLUTION = paths.source("solids")
MESH = block(3, 4, 3)
CRUMPLED = MESH.vertices + 0.03 * np.random.default_rng(1).standard_normal(MESH.vertices.shape)


@pytest.fixture(scope="module")
def native():
    return Solid(MESH, C=C, D=D, rho=1.5)


def changed(folder, file, old, new):
    """A copy of the solution with one thing changed."""
    shutil.copytree(SOLUTION, folder, ignore=shutil.ignore_patterns("judge", "__pycache__"))
    text = (folder / file).read_text()
    assert old in text
    (folder / file).write_text(text.replace(old, new))
    return muslin.load(folder)


def test_the_solution_and_the_framework_agree(native):
    f = muslin.load(SOLUTION)
    solid = Solid(MESH, C=C, D=D, rho=1.5, functions=f)
    assert solid.uses == {name for names in NEEDS.values() for name in names}
    assert solid.energy(CRUMPLED) == pytest.approx(native.energy(CRUMPLED), rel=1e-12)
    g, H = native.gradient(CRUMPLED), native.hessian(CRUMPLED)
    assert np.abs(solid.gradient(CRUMPLED) - g).max() <= 1e-12 * np.abs(g).max()
    for project in (False, True):
        H = native.hessian(CRUMPLED, project)
        assert abs(solid.hessian(CRUMPLED, project) - H).max() <= 1e-12 * abs(H).max()
    assert abs(solid.hessian(CRUMPLED, True) - native.hessian(CRUMPLED)).max() > 1e-3 * abs(H).max()
    assert abs(solid.mass - native.mass).max() <= 1e-15 * abs(native.mass).max()
    assert solid.kinetic_energy(CRUMPLED) == pytest.approx(native.kinetic_energy(CRUMPLED), rel=1e-12)


def test_a_folder_says_itself_which_assignment_it_answers():
    assert muslin.load(SOLUTION).assignment.name == "solids"


def test_a_part_is_the_students_only_if_all_functions_behind_it_are(native):
    f = muslin.load(SOLUTION)
    solid = Solid(MESH, C=C, D=D, rho=1.5, functions=f, stand_ins=["stiffness_block"])
    assert solid.by_student("hessian") is None
    assert solid.by_student("gradient") is f
    assert not {"d2psi_dF2", "stiffness_block"} & solid.uses
    assert abs(solid.hessian(CRUMPLED) - native.hessian(CRUMPLED)).max() == 0


def test_other_energies_use_the_students_mass_alone():
    solid = Solid(MESH, C=C, D=D, functions=muslin.load(SOLUTION), energy="corotated")
    assert solid.uses == {"mass_block", "kinetic_energy"}


def test_functions_of_another_assignment_are_refused():
    with pytest.raises(MuslinError, match=r"cloth.*d2psi_dF2"):
        Solid(MESH, C=C, D=D, functions=muslin.load(paths.source("cloth")))


def test_an_inverted_tetrahedron_is_not_blamed_on_a_function():
    solid = Solid(MESH, C=C, D=D, functions=muslin.load(SOLUTION))
    x = CRUMPLED.copy()
    x[16] += 2
    assert solid.energy(x) == np.inf
    with pytest.raises(SimulationError, match="inverted"):
        solid.gradient(x)


@pytest.mark.parametrize(
    ("file", "old", "new", "part", "named"),
    [
        ("neo_hookean.py", "(J - 1) ** 2", "(J - 1) ** 2 + ti.sqrt(-J)", "energy", "psi"),
        ("neo_hookean.py", "(F - I1 / 3 * G)", "(F - I1 / (J - J) * G)", "gradient", "dpsi_dF"),
        ("forces.py", "K[a, b] += volume", "K[a, b] += 1 / (volume - volume)", "hessian", "stiffness_block"),
    ],
)
def test_a_function_that_returns_nan_is_named(tmp_path, file, old, new, part, named):
    solid = Solid(MESH, C=C, D=D, functions=changed(tmp_path / "mine", file, old, new))
    with pytest.raises(SimulationError, match=rf"{named} returns .* tetrahedron 0 \(vertices"):
        getattr(solid, part)(CRUMPLED)


@pytest.mark.parametrize(("assignment", "body"), [("cloth", cloth.NEEDS), ("solids", NEEDS)])
def test_the_tasks_behind_a_part_are_those_of_the_body_that_an_assignment_drives(assignment, body):
    """Energy, mass and kinetic energy have the same tasks in both; forces have not."""
    found = stand_ins.needs(tasks.assignment(assignment).tasks)
    assert dict(body).items() <= found.items()
    assert {"binding", "carrying"} <= set(found)
