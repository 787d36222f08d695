"""What callers hand over in Python: whatever cannot be meant is refused in a sentence, not by an error of NumPy's."""

import numpy as np
import pytest

import muslin
from muslin import MuslinError
from muslin.base import handed, paths
from muslin.mesh import block, grid
from muslin.present.pictures import render_run

SHEET = grid(3, 3)
SOLID = block(2, 2, 2, 1.0, 1.0, 1.0)
LAME = {"mu": 1.0, "lam": 1.0}


def a_cloth():
    return muslin.Cloth(SHEET, **LAME)


@pytest.mark.parametrize(
    ("made", "named"),
    [
        (lambda: muslin.Cloth(SHEET, mu="1", lam=1.0), r"mu = '1' is not a number\."),
        (lambda: muslin.Cloth(SHEET, mu=None, lam=1.0), r"mu = None is not a number\."),
        (lambda: muslin.Cloth(SHEET, mu=1 + 1j, lam=1.0), r"mu = \(1\+1j\) is not a number\."),
        (lambda: muslin.Cloth(SHEET, mu=1.0, lam=float("nan")), r"lam = nan is not finite\."),
        (lambda: muslin.Cloth(SHEET, mu=1.0, lam=[1.0]), r"lam = \[1.0\] is not a number\."),
        (lambda: muslin.Cloth(SHEET, mu=-1.0, lam=1.0), r"mu = -1.0 must be positive\."),
        (lambda: muslin.Cloth(SHEET, **LAME, energy=3), "There is no energy 3"),
        (lambda: muslin.Cloth(SHEET, **LAME, bending="quadratic", bending_stiffness="a"), "'a' is not a number"),
        (lambda: muslin.Cloth(SHEET, **LAME, functions=3), "3 has no task functions"),
        (lambda: muslin.Cloth(SHEET, **LAME, functions="no/where"), "There is no folder no/where"),
        (lambda: muslin.Cloth(3, **LAME), "3 is not a mesh"),
        (lambda: muslin.Cloth(None, **LAME), "None is not a mesh"),
        (lambda: muslin.Cloth(SOLID, **LAME), "is a TetMesh; a cloth needs a Mesh"),
        (lambda: muslin.Solid(SHEET, C=1.0, D=1.0), "is a Mesh; a solid needs a TetMesh"),
        (lambda: muslin.Solid(SOLID, C="a", D=1.0), r"C = 'a' is not a number\."),
        (lambda: muslin.Solid(SOLID, C=1.0, D=1.0, functions=3), "3 has no task functions"),
        (lambda: a_cloth().kinetic_energy(np.zeros((2, 3))), r"Velocities have shape \(2, 3\)"),
        (lambda: a_cloth().stretches(np.zeros((2, 3))), r"Positions have shape \(2, 3\)"),
        (lambda: a_cloth().momenta(SHEET.vertices, np.zeros(4)), r"Velocities have shape \(4,\)"),
        (lambda: a_cloth().energy(SHEET.vertices + 0j), r"Positions: .* complex numbers"),
        (lambda: a_cloth().energy("abc"), "Positions: 'abc' is an array of no numbers"),
        (lambda: muslin.simulate(3), "There is no scene 3"),
        (lambda: muslin.simulate("hang", mesh=3), "3 is not a mesh"),
        (lambda: muslin.simulate("hang", mesh=SOLID), "is a TetMesh; a cloth needs a Mesh"),
        (lambda: muslin.simulate("hang", functions=3), "3 has no task functions"),
        (lambda: muslin.simulate("hang", out=3), r"out = 3 is not a path\."),
        (lambda: muslin.simulate("hang", name="x"), "has no parameter 'name'"),
        (lambda: muslin.simulate("hang", resolution=3, pinned=""), "pinned = '' is not understood"),
        (lambda: muslin.evaluate(3, x=1.0), "3 is not a function"),
        (lambda: muslin.evaluate(muslin.given, x=1.0), r"<module .* is not a function"),
        (lambda: muslin.load(3), r"functions = 3 is not a path\."),
        (lambda: muslin.grade(3), r"submission = 3 is not a path\."),
        (lambda: muslin.grade(paths.source("cloth"), deadline=-1), "deadline = -1 s is too short"),
        (lambda: muslin.grade(paths.source("cloth"), deadline="x"), "deadline = 'x' is not a number"),
        (lambda: muslin.grade(paths.source("cloth"), only=["zz"]), "cloth has no task 'zz'"),
    ],
)  # fmt: skip
def test_what_cannot_be_meant_is_refused_in_a_sentence(made, named):
    with pytest.raises(MuslinError, match=named):
        made()


def test_complex_samples_are_refused_not_cut_down_to_their_real_part():
    functions = muslin.load(paths.source("cloth"))
    with pytest.raises(MuslinError, match=r"Argument area: .* complex numbers"):
        muslin.evaluate(functions.mass_block, i=0, j=1, area=1.0 + 1j, rho=1.0, h=1.0)


def test_a_cloth_and_a_solid_take_the_path_of_a_folder_as_simulate_does():
    x = SHEET.vertices * 1.1
    mass = [muslin.Cloth(SHEET, **LAME, functions=f).mass.sum() for f in (str(paths.source("cloth")), None)]
    assert mass[0] == pytest.approx(mass[1])
    given = muslin.Cloth(SHEET, **LAME, functions=paths.source("cloth"))
    assert given.functions is not None
    assert given.stretches(x) == pytest.approx(1.1)
    assert muslin.Solid(SOLID, C=1.0, D=1.0, functions=paths.source("solids")).functions is not None


def test_numbers_of_numpy_and_arrays_of_one_are_numbers():
    for value in (2, 2.0, np.float32(2), np.int64(2), np.array(2.0), np.array([2.0])):
        assert handed.positive("mu", value) == 2.0


def test_vertices_to_pin_may_be_an_array_and_none_of_them_pins_none():
    for pinned in (np.array([0, 2]), [0, 2], (0, 2), "0,2"):
        scene = muslin.simulation.scenes.get("hang", resolution=3, pinned=pinned)
        assert scene.pinned_vertices(scene.load_mesh()).tolist() == [0, 2]
    scene = muslin.simulation.scenes.get("hang", resolution=3, pinned=[])
    assert not len(scene.pinned_vertices(scene.load_mesh()))


def test_a_still_before_the_run_begins_is_refused(tmp_path):
    muslin.simulate("hang", resolution=3, steps=1, out=tmp_path / "run")
    with pytest.raises(MuslinError, match="before the run begins"):
        render_run(tmp_path / "run", film="none", still=-1.0, size=(32, 32), quality="draft")
