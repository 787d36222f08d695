"""Solids in motion: what theory says of a bar, and what no step may do."""

from __future__ import annotations

import shutil
from contextlib import nullcontext

import numpy as np
import pytest
import scipy.sparse.linalg as sla

import muslin
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.mesh import block
from muslin.mesh.creature import creature, creature_skin
from muslin.mesh.filling import fill
from muslin.mesh.tets import signed_volumes
from muslin.physics.skinning import bind
from muslin.physics.solid import ENERGIES, Solid, constants
from muslin.present import demo_solids, exporting, film, pictures
from muslin.present.strain import vertex_stress
from muslin.render import stage
from muslin.simulation import scenes
from muslin.simulation.model import Model
from muslin.simulation.runs import RunFolder
from muslin.simulation.simulating import build


def settled(solid, x, load, held, steps=60):
    """Where a solid is at rest under forces (n, 3), with some unknowns (3n,) held, by Newton's method."""
    free = np.flatnonzero(~held)
    for _ in range(steps):
        r = (load - solid.gradient(x)).ravel()[free]
        if np.abs(r).max() <= 1e-12 * max(np.abs(load).max(), 1e-300):
            break
        dx = np.zeros(x.size)
        dx[free] = sla.spsolve(solid.hessian(x)[free][:, free].tocsc(), r)
        x = x + dx.reshape(x.shape)
    return x


def largest_turned_volume(run):
    return (signed_volumes(run.x, run.body.cells) / run.body.volume).min()


def deflection(n, E, nu, length, thick, pull):
    """How far the end of a bar, held at the other, is bent by a small shear force, with n vertices across it."""
    scene = scenes.get("beam", E=E, nu=nu)
    mesh = block(4 * (n - 1) + 1, n, n, length, thick, thick)
    solid = scene.body(mesh, None, "neo-hookean", "closed", ())
    X = mesh.vertices
    end = np.isclose(X[:, 0], length / 2)
    weights = np.zeros(len(X))  # thirds of the end's triangles
    for t in solid.surface[end[solid.surface].all(axis=1)]:
        a, b, c = X[t]
        weights[t] += np.linalg.norm(np.cross(b - a, c - a)) / 6
    weights /= weights.sum()
    model = Model(solid, gravity=np.zeros(3), pinned=np.flatnonzero(np.isclose(X[:, 0], -length / 2)))
    solid.update(X)
    far = 1e9  # a step so long that masses do not count
    model.assemble(far, project=False)
    return model.system.solve(far**2 * pull * weights[:, None] * (0.0, 1.0, 0.0))[:, 1] @ weights


def test_the_end_of_a_beam_comes_to_the_beams_value_with_the_square_of_the_spacing():
    E, length, thick, pull = 2e5, 1.0, 0.25, 1e-3
    bent = np.array([deflection(n, E, 0.0, length, thick, pull) for n in (5, 9, 17)])
    bending = pull * length**3 / (3 * E * thick**4 / 12)
    shearing = pull * length / (5 / 6 * E / 2 * thick**2)
    errors = 1 - bent / (bending + shearing)  # Timoshenko's beam, without contraction across it
    assert (np.log2(errors[:-1] / errors[1:]) >= 1.5).all()
    assert errors[-1] < 0.02
    # with contraction a held end is no beam's any more: what is left is that refinements agree ever better
    contracting = np.array([deflection(n, E, 0.3, length, thick, pull) for n in (5, 9, 17)])
    first, second = np.diff(contracting)
    assert np.log2(first / second) >= 1.5


@pytest.mark.parametrize("energy", ENERGIES)
def test_small_strains_have_the_E_and_nu_that_were_asked_for(energy):
    E, nu, strain = 3e5, 0.35, 1e-6
    found = measured(scenes.get("beam", E=E, nu=nu), energy, strain)
    np.testing.assert_allclose(found, (E, nu), rtol=1e-4)


def test_the_courses_parameters_have_the_E_and_nu_that_follow_from_its_bulk_modulus():
    E, nu = 3e5, 0.35
    mu, lam = E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))
    kappa = lam  # instead of lam + 2/3 mu
    expected = 9 * kappa * mu / (3 * kappa + mu), (3 * kappa - 2 * mu) / (2 * (3 * kappa + mu))
    found = measured(scenes.get("beam", E=E, nu=nu, course_parameters=True), "neo-hookean", 1e-6)
    np.testing.assert_allclose(found, expected, rtol=1e-4)
    assert abs(found[1] - nu) > 0.02
    assert constants(mu, lam, True) == (mu / 2, lam / 2)


def measured(scene, energy, strain):
    """Young's modulus and Poisson's ratio of a bar that is stretched by a small strain."""
    mesh = block(5, 3, 3, 1.0, 0.5, 0.5)
    solid = scene.body(mesh, None, energy, "closed", ())
    X = mesh.vertices
    ends = np.abs(np.abs(X[:, 0]) - 0.5) < 1e-9
    held = np.zeros((len(X), 3), dtype=bool)
    held[ends, 0] = True  # the ends slide freely across
    middle = int(np.argmin((X**2).sum(axis=1)))
    held[middle, 1:] = True
    held[int(np.argmin(((X - (0.25, 0, 0)) ** 2).sum(axis=1))), 1:] = True
    held[int(np.argmin(((X - (0, 0.25, 0)) ** 2).sum(axis=1))), 2] = True
    x = X * (1 + strain, 1.0, 1.0)
    x = settled(solid, x, np.zeros_like(X), held.ravel(), steps=6)
    force = solid.gradient(x)[np.isclose(X[:, 0], 0.5), 0].sum()
    across = np.ptp(x[:, 1]) / 0.5 - 1
    return force / 0.25 / strain, -across / strain


@pytest.mark.parametrize(("name", "steps"), [("twist", 60), ("drop", 120), ("jelly", 40)])
def test_backward_euler_never_gains_energy_and_never_turns_a_tetrahedron_over(name, steps):
    run = muslin.simulate(name, steps=steps)
    assert np.isfinite(run.x).all()
    assert largest_turned_volume(run) > 0
    total = run.energies.total
    assert np.diff(total).max() <= 1e-9 * np.abs(total).max()
    if name == "drop":
        assert run.energies.contacts.max() > 0
    if name == "twist":
        assert run.energies.kinetic[-1] > 0.1 * run.energies.elastic[0]


#: A ball that begins above the sphere.
ABOVE = {"mesh": "ball", "resolution": 3, "start_at": (0.08, 1.1, 0.03)}


@pytest.mark.parametrize(("name", "smaller"), [("twist", {"resolution": 3}), ("drop", ABOVE)])
def test_a_scene_goes_to_its_end_without_an_overturned_tetrahedron_or_energy_from_nowhere(
    name, smaller, tmp_path
):
    run = muslin.simulate(name, out=tmp_path / "run", frame_every=1, **smaller)
    kept = RunFolder(tmp_path / "run")
    assert len(kept.simulated) == len(run.energies) == scenes.get(name).steps + 1
    volumes = np.array([signed_volumes(x, kept.cells) for x in kept.simulated])
    assert (volumes > 0.1 * signed_volumes(kept.X, kept.cells)).all()  # and none is NaN
    total = run.energies.total
    assert np.isfinite(total).all()
    assert np.diff(total).max() <= 1e-9 * np.abs(total).max()
    if name == "drop":
        assert run.energies.contacts.max() > 0


def test_the_stress_of_a_stretched_bar_is_drawn_from_white_to_red_with_its_scale(tmp_path):
    """Pulled along its axis, a bar has E times its strain everywhere; small, so that the law hardly matters."""
    folder = tmp_path / "run"
    muslin.simulate("twist", steps=1, out=folder, resolution=3, turns=0.1, nu=0.0)
    kept = RunFolder(folder)
    stretched = kept.X * (1.001, 1.0, 1.0)
    np.testing.assert_allclose(vertex_stress(kept)(stretched), 100.0, rtol=2e-3)
    show = pictures.Show(kept, (160, 90), "draft", stress=True)
    stress = show.stress(0)
    assert show.legend.top == pytest.approx(max(np.percentile(show.stress(k), 99.5) for k in (0, 1)) / 1e3)
    drawn = show.surfaces(0)[0]
    where = [int(np.flatnonzero((show.frames[0] == x).all(axis=1))[0]) for x in drawn.vertices]
    np.testing.assert_allclose(drawn.values, 1 + stress[where] / (1e3 * show.legend.top))
    assert [show.legend.label(t) for t in (0, 1)] == ["0", f"{show.legend.top:.3g}"]
    assert show.picture(0).shape == (90, 160, 3)
    with pytest.raises(MuslinError, match="strain or stress"):
        pictures.Show(kept, (160, 90), "draft", strain=True, stress=True)


def test_stress_is_not_shown_of_cloth(tmp_path):
    muslin.simulate("drape", steps=1, out=tmp_path / "run", resolution=4)
    with pytest.raises(MuslinError, match="is a run of cloth, and stress is shown of solids"):
        pictures.render_run(tmp_path / "run", stress=True)


def test_what_is_held_is_held_and_where_is_said_by_place():
    scene = scenes.get("wobble")
    mesh = scene.load_mesh()
    held = scene.pinned_vertices(mesh)
    np.testing.assert_array_equal(
        held, np.flatnonzero(mesh.vertices[:, 1] <= mesh.vertices[:, 1].min() + 0.03)
    )
    run = muslin.simulate(scene, steps=3)
    np.testing.assert_array_equal(run.x[held], run.x0[held])
    bar = scenes.get("beam", pinned="left:0,right:0")
    ends = bar.pinned_vertices(bar.load_mesh())
    np.testing.assert_array_equal(ends, np.flatnonzero(np.isclose(abs(bar.load_mesh().vertices[:, 0]), 0.5)))
    wrong = scenes.get("beam", pinned="lowest:1,sideways:3")
    with pytest.raises(MuslinError, match="sideways"):
        wrong.pinned_vertices(bar.load_mesh())


def test_the_students_newton_the_frameworks_and_the_solutions_end_in_the_same_place(tmp_path):
    f = muslin.load(paths.source("solids"))
    ours = muslin.simulate("wobble", steps=6)
    theirs = muslin.simulate("wobble", steps=6, functions=f)
    assert "newtons_method" in theirs.uses
    assert {"psi", "dpsi_dF", "d2psi_dF2", "stiffness_block"} <= theirs.uses
    size = np.ptp(ours.x, axis=0).max()
    np.testing.assert_allclose(theirs.x, ours.x, rtol=0, atol=1e-9 * size)
    waiting = muslin.simulate("wobble", steps=1, functions=f, stand_ins=["newtons_method"])
    assert "newtons_method" not in waiting.uses


def test_a_newton_that_does_nothing_does_not_move_as_it_should(tmp_path):
    text = (paths.source("solids") / "newton.py").read_text()
    start = text.index("    # begin solution")
    (tmp_path / "newton.py").write_text(text[:start] + "    return x\n")
    for file in ("shape_functions", "deformation_gradient", "kinetic_energy", "neo_hookean", "forces"):
        (tmp_path / f"{file}.py").write_text((paths.source("solids") / f"{file}.py").read_text())
    (tmp_path / "assignment.toml").write_text((paths.source("solids") / "assignment.toml").read_text())
    run = muslin.simulate("wobble", steps=2, functions=tmp_path)
    np.testing.assert_allclose(run.x, run.x0, atol=1e-9)


def test_the_drag_spring_is_the_students_and_pulls_as_ours_does():
    f = muslin.load(paths.source("solids"))
    model, state = build(scenes.get("jelly"), f)
    mine, _ = build(scenes.get("jelly"))
    np.testing.assert_allclose(
        model.conservative_force(state.x), mine.conservative_force(state.x), rtol=1e-12, atol=1e-9
    )
    assert np.abs(model.conservative_force(state.x) - model.weight).max() > 100


def test_a_spring_that_has_let_go_was_called_and_a_wrong_one_is_seen(tmp_path):
    """What a run calls is what any of its steps called; the end of jelly is free."""
    shutil.copytree(paths.source("solids"), tmp_path / "mine")
    file = tmp_path / "mine" / "forces.py"
    settings = {"steps": 4, "drag_until": 2 / 120}
    native = muslin.simulate("jelly", **settings)
    right = muslin.simulate("jelly", functions=tmp_path / "mine", **settings)
    assert "spring_force" in right.uses
    np.testing.assert_allclose(right.x, native.x, rtol=0, atol=1e-12)
    text = file.read_text(encoding="utf-8")
    start = text.index("    # begin solution", text.index("def spring_force"))
    file.write_text(f"{text[:start]}    return 0.0 * (x0 - x1)\n", encoding="utf-8")
    wrong = muslin.simulate("jelly", functions=tmp_path / "mine", **settings)
    assert "spring_force" in wrong.uses
    assert np.abs(wrong.x - native.x).max() > 1e-2
    stood_in = muslin.simulate("jelly", functions=tmp_path / "mine", stand_ins=["spring_force"], **settings)
    assert "spring_force" not in stood_in.uses
    np.testing.assert_allclose(stood_in.x, native.x, rtol=0, atol=1e-12)


def test_a_wall_is_drawn_where_a_whole_end_is_held():
    for pinned, sides in (("left:0", [-1]), ("left:0,right:0", [-1, 1]), ("lowest:0.01", [])):
        scene = scenes.get("beam", pinned=pinned)
        mesh = scene.load_mesh()
        found = stage.walls(mesh.vertices, scene.pinned_vertices(mesh))
        assert [np.sign(wall.vertices[:, 0].mean()) for wall in found] == sides
        for wall in found:
            assert np.abs(wall.vertices[:, 0]).min() == pytest.approx(
                0.5
            )  # it touches the end and is beyond it
            assert (np.abs(wall.vertices).max(axis=0)[1:] > 0.1).all()
    bear = scenes.get("jelly")
    assert stage.walls(bear.load_mesh().vertices, bear.pinned_vertices(bear.load_mesh())) == []


def test_wobble_wobbles():
    """Its height swings through that at rest again and again, at energies of a thing of that size."""
    run = muslin.simulate("wobble", steps=160)
    elastic = run.energies.elastic
    here, sooner, later = elastic[1:-1], elastic[:-2], elastic[2:]
    swings = here[(here > sooner) & (here > later)]
    assert len(swings) >= 3
    assert swings[2] > 0.05 * elastic[0]
    assert 100 < run.energies.total[0] < 1e4


def test_what_the_log_calls_gravity_is_said_to_hold_the_pull_where_the_mouse_pulls():
    run = muslin.simulate("jelly", steps=1)
    spring, x = run.scene.spring(run.scene.load_mesh(), 0.0), run.x0
    pull = spring.stiffness / 2 * ((x[spring.vertex] - spring.target) ** 2).sum()
    assert pull > 500
    height = (run.body.scalar_mass @ x[:, 1]).sum()
    assert run.energies.gravity[0] == pytest.approx(-run.scene.gravity[1] * height + pull)
    assert list(run.scene.energy_names.items())[2] == ("gravity and pull", "gravity")
    assert "gravity and pull" in run.scene.energies_told(run.energies[0])
    assert "pull" not in scenes.get("beam").energies_told(run.energies[0])
    assert "-0" not in scenes.get("twist").energies_told(
        dict.fromkeys(("kinetic", "elastic", "gravity"), -0.0)
    )


def test_the_mouse_lets_go():
    scene = scenes.get("jelly")
    mesh = scene.load_mesh()
    assert scene.spring(mesh, 0.0) is not None
    assert scene.spring(mesh, scene.drag_until) is None


def test_the_creature_is_a_sound_solid_with_a_fine_skin_that_it_carries():
    mesh, skin = creature(), creature_skin()
    assert 1500 <= len(mesh.cells) <= 3000
    assert len(skin.vertices) >= 10_000
    x = mesh.vertices[mesh.cells]
    edges = x[:, [1, 2, 3, 2, 3, 3]] - x[:, [0, 0, 0, 1, 1, 2]]
    longest = np.linalg.norm(edges, axis=2).max(axis=1)
    assert (6 * mesh.volumes / longest**3).min() > 0.05
    moved = np.array([[1.1, 0.2, 0], [0, 0.9, 0.1], [0.05, 0, 1.0]])
    carried = bind(skin, mesh).carry(mesh.vertices @ moved.T)
    np.testing.assert_allclose(carried, skin.vertices @ moved.T, atol=1e-12)


def test_filling_a_ball_approaches_its_volume():
    def distance(X):
        return np.linalg.norm(X, axis=1) - 1.0

    errors = []
    for spacing in (0.4, 0.2, 0.1):
        mesh = fill(distance, (-1, -1, -1), (1, 1, 1), spacing)
        outer = np.unique(mesh.surface)
        np.testing.assert_allclose(np.linalg.norm(mesh.vertices[outer], axis=1), 1.0, atol=1e-6)
        errors.append(4 / 3 * np.pi - mesh.volumes.sum())
    assert min(errors) > 0
    assert errors[0] / errors[1] > 3
    assert errors[1] / errors[2] > 3


def test_a_run_of_a_solid_is_resumed_to_the_bit(tmp_path):
    whole = muslin.simulate("beam", steps=6, out=tmp_path / "whole")
    muslin.simulate("beam", steps=3, out=tmp_path / "half")
    resumed = muslin.simulate("beam", steps=6, out=tmp_path / "half", resume=True)
    np.testing.assert_array_equal(resumed.x, whole.x)
    assert isinstance(resumed.body, Solid)


def test_von_mises_stress_of_a_stretched_bar_is_its_pull_over_its_section():
    E, strain = 3e5, 1e-6
    solid = scenes.get("beam", E=E, nu=0.3).body(block(3, 3, 3), None, "neo-hookean", "closed", ())
    stretched = solid.X * (1 + strain, 1 - 0.3 * strain, 1 - 0.3 * strain)
    np.testing.assert_allclose(solid.von_mises(stretched), E * strain, rtol=1e-4)
    assert solid.von_mises(solid.X * 1.1).max() <= 1e-9 * E  # of a change of volume alone there is none


def test_a_run_is_exported_with_its_skin_and_its_tetrahedra(tmp_path):
    import meshio

    run = muslin.simulate("jelly", steps=2, out=tmp_path / "run")
    exporting.export_run(tmp_path / "run", "vtu", tmp_path / "out.pvd")
    inside = meshio.read(tmp_path / "out_solid_0001.vtu")
    assert inside.cells_dict["tetra"].shape == run.body.cells.shape
    np.testing.assert_array_equal(inside.points, run.x)
    np.testing.assert_allclose(inside.cell_data["von_mises"][0], run.body.von_mises(run.x), rtol=1e-9)
    outside = meshio.read(tmp_path / "out_0001.vtu")
    assert len(outside.points) >= 10_000
    (glb,) = exporting.export_run(tmp_path / "run", "glb", tmp_path / "out.glb")
    assert glb.stat().st_size > 100_000


def test_strain_is_shown_on_the_skin_as_the_solid_inside_has_it(tmp_path):
    run = muslin.simulate("wobble", steps=0, out=tmp_path / "run")
    show = pictures.Show(RunFolder(tmp_path / "run"), (64, 48), "draft")
    values = show.strain(0)
    assert values.shape == (len(creature_skin().vertices),)
    np.testing.assert_allclose(values, 1.2, rtol=1e-9)  # it starts stretched by a fifth
    assert run.scene.stretch == (1.0, 1.2, 1.0)


def test_the_demo_films_the_creature_with_its_skin(tmp_path):
    said = []
    demo_solids.run(
        tmp_path, "draft", lambda title: nullcontext(lambda done, total: None), said.append, steps=2
    )
    for file in ("jelly.mp4", "jelly.png", "jelly-energies.png", "run/display/000002.npy"):
        assert (tmp_path / file).is_file()
    assert "reference solution" in said[0]
    assert said[1].startswith("First frame after")  # a picture of the skin, before the run has ended
    run = RunFolder(tmp_path / "run")
    opening = film._opening(run.scene)
    np.testing.assert_allclose(opening.frames[0], run.frames[0], atol=1e-12)
    np.testing.assert_array_equal(opening.triangles, run.shown_triangles)
