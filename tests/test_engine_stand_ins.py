"""Stand-ins: native code computes what needs a function that must not be called, and the result is the same."""

from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin import mesh, tasks
from muslin.base.errors import MuslinError, NotImplementedYet
from muslin.physics import stand_ins

ROOT = Path(__file__).resolve().parent.parent
TASKS = list(muslin.load(ROOT / "assignments" / "cloth").assignment.tasks)
MATERIAL = {"mu": 300.0, "lam": 700.0, "rho": 1.5, "h": 0.02}


@pytest.fixture(scope="module")
def solution():
    return muslin.load(ROOT / "solutions" / "cloth")


@pytest.fixture(scope="module")
def stubs():
    return muslin.load(ROOT / "assignments" / "cloth")


@pytest.fixture(scope="module")
def sheet():
    flat = mesh.unstructured(1, 1, 0.2)
    x = flat.vertices * (1.1, 0.9, 1.0) + 0.05 * np.random.default_rng(1).normal(size=flat.vertices.shape)
    return flat, x


def poisoned_by(names, solution, stubs):
    """The solution's functions, but those of some tasks raise when they are called."""
    found = {name: (stubs if name in names else solution)[name] for name in TASKS}
    return tasks.Functions(solution.folder, solution.assignment, found)


def close(found, truth, tolerance):
    difference, scale = found - truth, truth
    size = abs(difference).max() if hasattr(difference, "tocsr") else np.abs(difference).max()
    assert size <= tolerance * (abs(scale).max() if hasattr(scale, "tocsr") else np.abs(scale).max())


@pytest.mark.parametrize("energy", ["linearised", "area", "volumetric"])
@pytest.mark.parametrize("road", ["closed", "lecture"])
def test_a_function_stood_in_for_is_not_called_and_nothing_changes(solution, stubs, sheet, road, energy):
    flat, x = sheet
    v = np.random.default_rng(2).normal(size=x.shape)
    chosen = {"hessian": road, "energy": energy}
    whole = muslin.Cloth(flat, **MATERIAL, functions=solution, **chosen)
    everything = {name for names in stand_ins.NEEDS.values() for name in names}
    for name in TASKS:
        poisoned = poisoned_by({name}, solution, stubs)
        cloth = muslin.Cloth(flat, **MATERIAL, functions=poisoned, stand_ins=(name,), **chosen)
        assert name not in cloth.uses
        assert cloth.uses < everything
        close(np.array(cloth.energy(x)), np.array(whole.energy(x)), 1e-10)
        close(cloth.gradient(x), whole.gradient(x), 1e-10)
        for project in (False, True):
            tolerance = 1e-10 if road == "closed" else 1e-5  # the lecture's road splits equal stretches
            close(cloth.hessian(x, project), whole.hessian(x, project), tolerance)
        close(cloth.mass, whole.mass, 1e-14)
        close(np.array(cloth.kinetic_energy(v)), np.array(whole.kinetic_energy(v)), 1e-12)


def test_a_function_that_must_not_be_called_is_not_even_compiled(solution, sheet, tmp_path):
    """One that can be called, but does harm when Taichi compiles it."""
    flat, x = sheet
    for file in (ROOT / "solutions" / "cloth").glob("*.py"):
        (tmp_path / file.name).write_text(file.read_text())
    for name in TASKS:
        path = tmp_path / solution[name].task.file
        before = path.read_text()
        head, body = before.split(f"def {name}(")
        body = body.replace("    # begin solution", "    ti.static(harm())\n    # begin solution", 1)
        path.write_text(f"{head}def {name}({body}\n\ndef harm():\n    raise SystemExit('called')\n")
        harmful = muslin.load(tmp_path)
        assert stand_ins.unusable(harmful) == ()
        for road in ("closed", "lecture"):
            cloth = muslin.Cloth(flat, **MATERIAL, functions=harmful, stand_ins=(name,), hessian=road)
            cloth.energy(x), cloth.gradient(x), cloth.hessian(x), cloth.kinetic_energy(x)
        path.write_text(before)


def test_the_cloth_says_which_functions_it_calls(solution, sheet):
    flat, _ = sheet

    def uses(**options):
        return muslin.Cloth(flat, **MATERIAL, functions=solution, **options).uses

    own = {"dphi_dX", "deformation_gradient", "psi", "dpsi_ds", "dpsi_dF", "nodal_force", "mass_block"}
    assert uses() == own | {"d2psi_ds2", "eigensystem", "kinetic_energy"}
    assert uses(hessian="lecture") == own | {"d2psi_ds2", "d2psi_dFij", "dn_dx", "kinetic_energy"}
    assert uses(energy="area").isdisjoint(stand_ins.STRAIN_ENERGY)
    assert uses(stand_ins=("dpsi_ds",)) == {
        "dphi_dX", "deformation_gradient", "psi", "mass_block", "kinetic_energy",
    }  # fmt: skip
    assert uses(stand_ins=("dphi_dX",)) == {"mass_block", "kinetic_energy"}
    assert uses(stand_ins=TASKS) == muslin.Cloth(flat, **MATERIAL).uses == frozenset()


def test_every_undone_task_can_be_stood_in_for(stubs, tmp_path):
    display = tmp_path / "fine.obj"
    mesh.save(mesh.unstructured(1.0, 1.0, 0.08), display)
    undone = stand_ins.unusable(stubs)
    assert undone == tuple(TASKS)
    run = muslin.simulate("throw", functions=stubs, stand_ins=undone, steps=40, display=display)
    assert run.uses == frozenset()
    assert run.energies.contacts.max() > 0
    native = muslin.simulate("throw", steps=40)
    np.testing.assert_array_equal(run.x, native.x)


@pytest.mark.parametrize("name", ["sphere_contact", "filter_velocity", "phi", "interpolate", "nodal_force"])
def test_a_run_goes_on_without_one_function(solution, stubs, tmp_path, name):
    display = tmp_path / "fine.obj"
    mesh.save(mesh.unstructured(1.0, 1.0, 0.08), display)
    whole = muslin.simulate("throw", functions=solution, steps=40, display=display)
    assert name in whole.uses
    poisoned = poisoned_by({name}, solution, stubs)
    assert stand_ins.unusable(poisoned) == (name,)
    run = muslin.simulate("throw", functions=poisoned, stand_ins=(name,), steps=40, display=display)
    assert name not in run.uses
    np.testing.assert_allclose(run.x, whole.x, atol=1e-9)
    assert run.energies.contacts.max() > 0


def test_without_stand_ins_a_stub_is_named(stubs, solution, sheet):
    with pytest.raises(NotImplementedYet, match="dphi_dX"):
        muslin.simulate("course", functions=stubs, steps=1)
    with pytest.raises(NotImplementedYet, match="nodal_force"):
        muslin.simulate("course", functions=poisoned_by({"nodal_force"}, solution, stubs), steps=1)


def test_only_tasks_can_be_stood_in_for(solution, sheet):
    with pytest.raises(MuslinError, match="no task 'psy'"):
        muslin.Cloth(sheet[0], **MATERIAL, functions=solution, stand_ins=("psy",))
    with pytest.raises(MuslinError, match="no task 'psy'"):
        muslin.simulate("course", steps=1, stand_ins=["psi", "psy"])


def test_a_resumed_run_keeps_its_stand_ins(stubs, tmp_path):
    muslin.simulate("course", functions=stubs, stand_ins=TASKS, steps=5, out=tmp_path / "run")
    run = muslin.simulate("course", out=tmp_path / "run", resume=True, steps=8)
    assert run.uses == frozenset()
    assert len(run.energies) == 9
    with pytest.raises(MuslinError, match="stand_ins cannot change"):
        muslin.simulate("course", out=tmp_path / "run", resume=True, stand_ins=("psi",))
