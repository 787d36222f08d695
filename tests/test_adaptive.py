"""A cloth whose mesh follows it: what must not depend on the mesh does not, and a run can be stopped and read back."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

import muslin
from muslin.base.errors import MuslinError
from muslin.mesh import Mesh, Refinement, grid
from muslin.mesh.refinement import violations
from muslin.mesh.surface import frozen
from muslin.simulation import adapting, scenes
from muslin.simulation.criteria import bound, folded, indicator
from muslin.simulation.runs import RunFolder
from muslin.simulation.simulating import adapter_for, build

#: Small, quick, and refined within the first steps.
DRAPE = {
    "resolution": 8,
    "adaptive": True,
    "adapt_every": 8,
    "start_at": "0,0.302,0",
    "steps": 32,
    "frame_every": 8,
}


def folds(mesh, x, angle=10.0, stretch=0.0, colliders=()):
    return indicator(mesh, mesh.spread(grid(6, 6).vertices), x, colliders, np.radians(angle), stretch)


def adapter_of(**parameters):
    scene = scenes.get("drape", **(DRAPE | parameters))
    mesh = scene.load_mesh()
    model, state = build(scene, mesh=mesh)
    return adapter_for(scene, None, None, "closed", mesh, (), model, state.x), state


def test_a_linearly_stretched_cloth_refined_at_random_has_one_stress():
    mesh, rng = grid(6, 6), np.random.default_rng(0)
    refined = Refinement.of(mesh)
    for _ in range(4):
        refined = refined.refine(rng.integers(0, len(refined.triangles), 12))
    F = np.array([[1.2, 0.1, 0.0], [-0.05, 0.9, 0.0], [0.3, 0.2, 1.0]])
    X, x = refined.spread(mesh.vertices), refined.spread(mesh.vertices @ F.T)
    cloth = muslin.Cloth(frozen(X, refined.triangles, "refined"), mu=1e3, lam=1e3)
    forces = cloth.gradient(x)
    inside = np.setdiff1d(np.arange(len(X)), muslin.mesh.boundary(refined.triangles))
    assert np.abs(forces[inside]).max() < 1e-12 * np.abs(forces).max() * 100
    assert np.ptp(cloth.stretches(x), axis=0).max() < 1e-12
    assert cloth.energy(x) == pytest.approx(
        muslin.Cloth(mesh, mu=1e3, lam=1e3).energy(mesh.vertices @ F.T), rel=1e-12
    )


def test_an_adapting_cloth_in_free_fall_falls_freely(monkeypatch):
    rng = np.random.default_rng(1)
    monkeypatch.setattr(
        adapting,
        "indicator",
        lambda mesh, *_: 2 * rng.random(len(mesh.triangles)) ** 4 * (rng.random() < 0.7),
    )
    parameters = {"sphere": False, "floor": False, "start_velocity": "1,2,3", "steps": 80, "tilt": 30.0}
    run = muslin.simulate("drape", **(DRAPE | parameters))
    assert len(run.x) > len(run.x0)
    t = run.energies[-1].time
    assert np.abs(run.v - np.array([1.0, 2.0 - 9.81 * t, 3.0])).max() < 1e-9


def test_an_adaptation_keeps_mass_momentum_and_angular_momentum():
    adapter, state = adapter_of()
    x = state.x + 0.02 * np.sin(9 * state.x[:, [1, 2, 0]] + 7 * state.x)
    state = replace(state, x=x, v=np.cos(5 * x))

    def kept(model, state):
        p = (model.body.mass @ state.v.ravel()).reshape(-1, 3)
        return np.array([model.body.mass.sum(), *p.sum(axis=0), *np.cross(state.x, p).sum(axis=0)])

    before = kept(adapter.model, state)
    for _ in range(6):
        state = adapter.adapt(state)
        assert violations(adapter.refined) == []
        assert np.abs(kept(adapter.model, state) - before).max() < 1e-13
    assert len(adapter.log) > 1
    assert len(state.x) == adapter.refined.vertices > len(x)


def test_what_is_flat_again_is_coarsened_to_the_mesh_one_began_with():
    adapter, state = adapter_of(sphere=False)
    flat = state.x.copy()
    begun = adapter.refined.triangles.tobytes()
    state = adapter.adapt(replace(state, x=flat + [0, 0.1, 0] * np.sin(9 * flat[:, :1])))
    assert adapter.refined.added
    for _ in range(8):
        level = state.x * [1.0, 0.0, 1.0]
        state = adapter.adapt(replace(state, x=level))
    assert adapter.refined.triangles.tobytes() == begun


def test_curvature_contact_and_uneven_stretch_ask_for_refinement_and_a_plane_does_not():
    from muslin.physics.colliders import Sphere

    mesh = Refinement.of(grid(6, 6))
    X = grid(6, 6).vertices
    assert folds(mesh, X @ np.diag([1.3, 0.8, 1.0]), stretch=0.01).max() < 1e-6
    bent = X + [0.0, 0.0, 0.3] * np.abs(X[:, :1])
    found = folds(mesh, bent)
    at_fold = np.abs(X[mesh.triangles, 0]).min(axis=1) < 0.11
    assert found[at_fold].max() > 1 > found[~at_fold].max()
    near = folds(mesh, X, colliders=[Sphere((0.0, 0.0, -0.31), 0.3)])
    assert near.max() > 1
    assert near.min() == 0
    uneven = X * [1.0, 1.0, 1.0] + [0.2, 0.0, 0.0] * np.maximum(X[:, :1], 0)
    assert folds(mesh, uneven, stretch=0.1).max() > 1


def test_a_fold_is_met_before_it_is_there():
    added = {}
    for ahead in (0.0, 0.05):
        adapter, state = adapter_of(look_ahead=ahead, sphere=False, start_at="0,1,0")
        closing = state.v + [0, 8.0, 0] * np.abs(state.x[:, :1])  # in 0.05 s folded by 22 degrees, twice
        adapter.adapt(replace(state, v=closing))
        added[ahead] = adapter.refined.added
    assert added[0.0] == 0
    assert added[0.05] > 0


def test_the_budget_of_vertices_is_kept():
    run = muslin.simulate("drape", **DRAPE, budget=90)
    assert 64 < len(run.x) <= 90


def test_levels_limit_how_fine_it_becomes():
    adapter, state = adapter_of(levels=1)
    bent = state.x + [0, 0.2, 0] * np.sin(9 * state.x[:, :1])
    for _ in range(5):
        state = adapter.adapt(replace(state, x=adapter.refined.spread(bent)))
    assert adapter.refined.generation.max() == 2


def test_the_same_run_has_the_same_bits_and_so_has_one_that_was_stopped(tmp_path):
    whole = muslin.simulate("drape", **DRAPE, out=tmp_path / "whole")
    stopped = {**DRAPE, "steps": 12}
    muslin.simulate("drape", **stopped, out=tmp_path / "parts")
    parts = muslin.simulate("drape", steps=32, out=tmp_path / "parts", resume=True)
    assert len(whole.x) > 64
    assert parts.x.tobytes() == whole.x.tobytes()
    assert parts.v.tobytes() == whole.v.tobytes()
    for file in [*(tmp_path / "whole").rglob("*.np[yz]"), tmp_path / "whole" / "adapting.csv"]:
        if file.name != "checkpoint.npz":
            there = tmp_path / "parts" / file.relative_to(tmp_path / "whole")
            assert there.read_bytes() == file.read_bytes(), file.name


def test_a_run_is_read_back_with_the_mesh_of_each_frame(tmp_path):
    run = muslin.simulate("drape", **DRAPE, out=tmp_path / "run")
    read = RunFolder(tmp_path / "run")
    sizes = []
    for k, x in enumerate(read.frames):
        rest, triangles = read.mesh_of(k)
        assert len(rest) == len(x) == triangles.max() + 1
        sizes.append(len(x))
    assert len(set(sizes)) > 1
    assert sizes[-1] == len(run.x)


@pytest.mark.parametrize("to", ["glb", "obj"])
def test_a_run_is_exported_on_one_fine_mesh_that_is_where_the_cloth_is(tmp_path, to):
    from muslin.present.carried import Carried
    from muslin.present.exporting import export_run

    muslin.simulate("drape", **DRAPE, out=tmp_path / "run")
    assert all(file.is_file() for file in export_run(tmp_path / "run", to))
    read = RunFolder(tmp_path / "run")
    carried = Carried(read)
    rest, triangles = read.mesh_of(-1)
    assert len(carried.mesh.triangles) == 9 * 98
    for k, x in enumerate(read.frames):
        assert np.abs(carried[k][:64] - x[:64]).max() < 1e-12  # where both have a vertex
    assert len(rest) == triangles.max() + 1


def test_a_students_functions_are_the_elements_of_whatever_triangles_there_are():
    own = muslin.simulate("drape", **DRAPE)
    theirs = muslin.simulate("drape", **DRAPE, functions="solutions/cloth")
    assert len(own.x) == len(theirs.x) > 64
    assert np.abs(own.x - theirs.x).max() < 1e-6
    assert "dpsi_dF" in theirs.uses


@pytest.mark.parametrize(
    "how",
    [
        {"contact": "solve"},
        {"integrator": "bdf2", "contact": "filter"},
        {"integrator": "backward-euler", "contact": "solve"},
    ],
)
def test_every_way_to_take_a_step_goes_on_where_the_mesh_changes(how):
    run = muslin.simulate("drape", **DRAPE, **how)
    assert len(run.x) > 64
    assert run.energies.penetration.max() < 0.01
    assert 0 < run.energies.elastic[-1] < 0.5


def test_what_lies_between_pinned_vertices_is_pinned_and_stays():
    adapter, state = adapter_of(pinned="highest:0.2", sphere=False)
    held = len(adapter.model.pinned)
    state = adapter.adapt(replace(state, x=state.x + [0, 0.2, 0] * np.sin(9 * state.x[:, :1])))
    model = adapter.model
    assert held < len(model.pinned) < len(state.x)
    assert model.body.X[model.pinned, 1].min() >= 0.3 - 1e-9
    later = next(after for k, after in enumerate(adapter.steps(state, 1)) if k == 2)
    assert adapter.model is model
    assert np.array_equal(later.x[model.pinned], state.x[model.pinned])
    assert not np.array_equal(later.x, state.x)


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"levels": -1}, "levels"),
        ({"budget": 2}, "budget"),
        ({"refine_angle": 0}, "refine_angle"),
        ({"adapt_every": 0}, "adapt_every"),
        ({"look_ahead": -0.1}, "look_ahead"),
        ({"adaptive": "maybe"}, "on or off"),
    ],
)
def test_parameters_that_make_no_sense_are_refused(parameters, said):
    with pytest.raises(MuslinError, match=said):
        muslin.simulate("drape", **(DRAPE | parameters))


def test_a_solid_cannot_be_adaptive():
    with pytest.raises(MuslinError, match="adaptive is for cloth"):
        muslin.simulate("jelly", adaptive=True, steps=1)


def test_no_fold_sharper_than_the_flip_angle_is_flipped():
    mesh = Refinement.of(grid(6, 6))
    X = grid(6, 6).vertices
    x = np.stack([X[:, 0], X[:, 1], 0.5 * np.abs(X[:, 0] - 0.05)], axis=1)
    for limit in (10.0, 60.0):
        kept = bound(mesh, x, np.radians(limit))
        finer = mesh.refine(np.flatnonzero(~kept))
        edges = np.sort(mesh.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        angles = folded(mesh, x).ravel()
        there = np.sort(finer.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
        number = [set(map(tuple, part.tolist())) for part in (edges, there)]
        gone = np.array([tuple(edge) not in number[1] for edge in edges.tolist()])
        assert gone.any()
        assert angles[gone].max() <= np.radians(limit)
    assert angles.max() > np.radians(20)  # so that the first limit forbade something, and the second nothing
    assert not kept.any()


def test_what_presses_goes_over_to_a_new_mesh_with_the_same_impulse():
    from muslin.physics.meeting import STRIDE
    from muslin.physics.transfer import Sheet
    from muslin.simulation import carrying
    from muslin.simulation.touching import Pressed

    mesh, begun = grid(6, 6), Refinement.of(grid(6, 6))

    def sheet(refined):
        area = muslin.mesh.area_and_normal(refined.spread(mesh.vertices), refined.triangles)[0]
        return Sheet(refined.triangles, 0.3 * area)

    pressing = np.flatnonzero(mesh.vertices[:, 0] < 0)
    count, stays = len(pressing), len(begun.triangles) - 1
    key = np.concatenate([pressing, [3 * STRIDE + stays], 4 * STRIDE + pressing[:4]])
    slide = np.tile([0.1, 0.0, 0.2], (len(key), 1))
    pressed = Pressed(key, np.linspace(1, 2, len(key)), slide, np.full(len(key), 0.3))
    finer = begun.refine([0, 7, 12])
    after = carrying.refined(pressed, finer, sheet(begun), sheet(finer))
    assert np.all(np.diff(after.key) > 0)

    def impulses(pressed):
        return np.bincount(pressed.key // STRIDE, pressed.impulse)

    assert impulses(after) == pytest.approx(impulses(pressed), rel=1e-12)
    presses = np.zeros(36, dtype=bool)
    presses[pressing] = True
    wanted = np.flatnonzero(finer.all_of(presses))
    assert len(wanted) > count
    assert np.array_equal(after.key[after.key < STRIDE], wanted)
    assert after.slide == pytest.approx(np.tile([0.1, 0.0, 0.2], (len(after), 1)))
    assert after.speed == pytest.approx(0.3)
    coarser, kept = finer.coarsen(np.flatnonzero(finer.removable()))
    assert coarser.vertices == 36
    back = carrying.coarsened(after, kept, sheet(finer), sheet(coarser))
    assert np.array_equal(back.key, key)
    assert impulses(back) == pytest.approx(impulses(pressed), rel=1e-12)


def test_a_mesh_is_not_changed_for_a_few_triangles(monkeypatch):
    adapter, state = adapter_of(resolution=16)
    ask = np.zeros(len(adapter.refined.triangles))
    monkeypatch.setattr(adapting, "indicator", lambda mesh, *_: np.resize(ask, len(mesh.triangles)))
    ask[[40]] = 2.0
    assert adapter.adapt(state) is state
    ask[:20] = 2.0
    assert adapter.adapt(state) is not state


def test_paraview_gets_the_mesh_of_each_frame(tmp_path):
    import meshio

    from muslin.present.exporting import export_run

    muslin.simulate("drape", **DRAPE, out=tmp_path / "run")
    read = RunFolder(tmp_path / "run")
    pieces = [
        file for file in export_run(tmp_path / "run", "pvd") if re.fullmatch(r"drape_\d+\.vtu", file.name)
    ]
    assert len(pieces) == len(read.frames)
    counts = set()
    for k, file in enumerate(pieces):
        piece, (rest, triangles) = meshio.read(file), read.mesh_of(k)
        assert np.array_equal(piece.cells_dict["triangle"], triangles)
        assert np.array_equal(piece.points, read.frames[k])
        assert np.array_equal(piece.point_data["displacement"], read.frames[k] - rest)
        assert len(piece.point_data["stretch"]) == len(rest)
        counts.add(len(triangles))
    assert len(counts) > 1


def test_openusd_gets_the_mesh_of_each_frame(tmp_path):
    from muslin.present.exporting import export_run

    muslin.simulate("drape", **DRAPE, out=tmp_path / "run")
    read = RunFolder(tmp_path / "run")
    text = export_run(tmp_path / "run", "usda")[0].read_text()
    cloth = text[: text.index("faceVertexIndices = ")]  # the sphere's triangles stay
    lines = cloth[cloth.index("faceVertexIndices.timeSamples") :].splitlines()[1:]
    meshes = [line.split(": [")[1] for line in lines[: lines.index("        }")]]
    there = [read.mesh_of(k)[1] for k in range(len(read.frames))]
    wanted = [mesh for k, mesh in enumerate(there) if not k or not np.array_equal(mesh, there[k - 1])]
    assert len(wanted) > 1
    assert [mesh.rstrip("],").split(", ") for mesh in meshes] == [
        list(map(str, mesh.ravel().tolist())) for mesh in wanted
    ]


def test_a_coarse_adaptive_cape_on_thin_limbs_is_not_torn_and_what_moves_it_does_the_work_it_needs():
    """Its first triangles are four times as long as the arms are thick: points inside them meet these."""
    X = scenes.get("cape").load_mesh().vertices
    radius, angle = np.hypot(X[:, 0], X[:, 1]), np.arctan2(X[:, 1], X[:, 0])
    flat = grid(9, 14, diagonals="zigzag")
    s, t = ((side - side.min()) / np.ptp(side) for side in flat.vertices[:, :2].T)
    r, phi = radius.min() + s * np.ptp(radius), angle.min() + t * np.ptp(angle)
    mesh = Mesh.from_arrays(np.stack([r * np.cos(phi), r * np.sin(phi)], axis=1), flat.triangles)
    run = muslin.simulate("cape", mesh=mesh, adaptive=True, levels=2, budget=1000, steps=120)
    assert len(run.x) > 900
    assert run.energies.elastic.max() < 0.05
    assert np.abs(run.energies.work).max() < 2


def test_an_adaptive_cloth_begins_on_alternating_diagonals_unless_others_are_asked_for():
    get = scenes.get
    assert get("drape").diagonals == get("drape", adaptive="off").diagonals == "zigzag"
    assert get("drape", adaptive="on").diagonals == "alternating"
    asked = get("drape", adaptive="on", diagonals="zigzag")
    assert asked.diagonals == "zigzag"
    for scene in (asked, get("drape", adaptive=True)):
        assert get("drape", **scene.parameters()) == scene  # as a run on disk is read back
    degree = np.bincount(get("drape", adaptive="on", resolution=9).load_mesh().triangles.ravel())
    assert set(degree.reshape(9, 9)[1:-1, 1:-1].ravel()) == {4, 8}
