"""Variants of an assignment: another energy, other parameters and conventions, and everything follows."""

import re
import sys
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin import tasks
from muslin.authoring import mistakes, mutations, variants
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.grading import laws, slips
from muslin.judging import cases, judge, properties
from muslin.mesh import grid
from muslin.tasks import wiring
from muslin.tasks.batch import evaluate
from muslin.tasks.comparing import compare

sys.path.insert(0, str(Path(__file__).parent / "misconceptions"))
import energies

SEEDS = [f"autumn {k}" for k in range(40)]


@pytest.fixture(scope="module")
def tables():
    return variants.Tables("cloth")


@pytest.fixture(scope="module")
def course(tmp_path_factory):
    """A course of two variants: one with every convention at once, one that is drawn."""
    folder = tmp_path_factory.mktemp("course")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(paths.COURSE, str(folder))
        tables = variants.Tables("cloth")
        every = variants.Choice("green", "young", tuple(sorted(tables.conventions)))
        for line in (
            *variants.write("cloth", "all-at-once", "a seed", every, data=False),
            *variants.write("cloth", "drawn", SEEDS[2], data=False),
        ):
            assert line
        yield folder


BOTH = ["all-at-once", "drawn"]


def answers(functions, name, inputs):
    got = evaluate(functions[name], **inputs)
    return got if isinstance(got, tuple) else (got,)


def right_on(assignment, functions, name, count=6):
    """Whether a function agrees with what is true of a task of an assignment."""
    task, known = tasks.assignment(assignment).tasks[name], judge(assignment, name)
    inputs = cases.draw_inputs(assignment, name, "hidden", count)
    try:
        got = answers(functions, name, inputs)
    except MuslinError:
        return False
    return compare(task, got, cases.truth(assignment, name, inputs), inputs, known.terms).ok


def test_of_every_choice_what_it_changes_is_there_to_be_changed(tables):
    names = list(tables.conventions)
    for energy in tables.energies["energies"]:
        for parameters in tables.parameters["parameters"]:
            for conventions in ((), *((name,) for name in names), tuple(names)):
                variants.files(tables, "x", variants.Choice(energy, parameters, conventions))


def test_without_a_choice_all_files_are_the_published_ones(tables):
    made = variants.files(tables, "cloth", variants.Choice("linearised", "lame", ()))
    for name in (variants.RECORD, *tables.every["change"]):
        del made[name]
    assert made == {name: (tables.source / name).read_bytes() for name in made}


def test_seeds_draw_variants_that_differ_and_that_the_published_solution_solves_half_of_at_most(tables):
    drawn = [variants.draw(tables, seed) for seed in SEEDS]
    assert [variants.draw(tables, seed) for seed in SEEDS] == drawn
    assert max(tables.kept(choice) for choice in drawn) <= 50
    apart = [a.differences(b) for k, a in enumerate(drawn[:10]) for b in drawn[:k]]
    assert min(apart) >= 2


@pytest.mark.parametrize("name", BOTH)
def test_a_variants_own_solution_is_right_and_the_published_one_where_nothing_differs(course, tables, name):
    table, choice = tasks.assignment(name), variants.chosen(name)
    own = muslin.load(paths.solution(name))
    published = muslin.load(paths.solution("cloth"), table)
    for task in table.tasks:
        assert right_on(name, own, task), task
        assert right_on(name, published, task) == (task not in tables.touched(choice)), task


@pytest.mark.parametrize("name", BOTH)
def test_properties_hold_for_a_variants_solution(course, name):
    own = muslin.load(paths.solution(name))
    for task in own.assignment.tasks:
        for prop, inputs in properties.draw(name, task, "seed"):
            assert properties.judge(prop, inputs, answers(own, task, inputs)) <= prop.tolerance, prop.name


@pytest.mark.parametrize("name", BOTH)
def test_laws_hold_for_a_variants_solution(course, name):
    own = muslin.load(paths.solution(name))
    table = own.assignment.tasks
    obeyed = laws.obeyed(name, lambda task, inputs: answers(own, task, inputs), frozenset(table))
    assert [(law.name, law.message) for law in obeyed if law.status != "passed"] == []


@pytest.mark.parametrize("road", ["closed", "lecture"])
@pytest.mark.parametrize("name", BOTH)
def test_the_simulator_calls_a_variants_functions_as_they_are_meant(course, name, road):
    own = muslin.load(paths.solution(name))
    made_of = {"mu": 700.0, "lam": 400.0, "rho": 3.0, "h": 0.02}
    mesh = grid(5, 5)
    theirs = muslin.Cloth(mesh, functions=own, hessian=road, **made_of)
    native = muslin.Cloth(mesh, energy=own.assignment.energy, **made_of)
    x = mesh.vertices @ np.array([[1.2, 0.1, 0.2], [-0.1, 0.8, 0.1], [0, 0, 1]])
    x = x + 0.05 * np.sin(9 * mesh.vertices[:, ::-1])
    assert theirs.energy(x) == pytest.approx(native.energy(x), rel=1e-10)
    assert np.allclose(
        theirs.gradient(x), native.gradient(x), rtol=0, atol=1e-10 * abs(native.gradient(x)).max()
    )
    K = native.hessian(x).toarray()
    assert np.allclose(theirs.hessian(x).toarray(), K, rtol=0, atol=1e-5 * abs(K).max())
    assert np.allclose(theirs.mass.toarray(), native.mass.toarray(), rtol=1e-12, atol=0)
    assert theirs.kinetic_energy(x) == pytest.approx(native.kinetic_energy(x), rel=1e-12)


def test_a_variants_functions_simulate_as_muslins_own_element_does(course):
    small = {"resolution": 8, "steps": 12, "bending": "off"}
    run = muslin.simulate("hang", functions=paths.solution("all-at-once"), **small)
    beside = muslin.simulate("hang", energy="green", **small)
    assert "psi" in run.uses
    assert np.allclose(run.x, beside.x, rtol=0, atol=1e-9)
    assert not np.allclose(run.x, muslin.simulate("hang", **small).x, rtol=0, atol=1e-9)


def test_a_variants_files_do_not_speak_of_what_it_has_not(course):
    released = paths.assignment("all-at-once")
    for path in released.glob("*.py"):
        assert not re.search(
            r"\[Pa\]|\bmu, lam :|\boutward|thickness|rows are the gradients", path.read_text()
        )
    handout = (released / "README.md").read_text()
    assert "mu=8.0" not in handout
    assert "muslin start all-at-once " in handout


def test_slips_in_the_formulas_of_a_variants_own_energy_are_named(course):
    """As `write` makes them with the cases: from the variant's own answers, on its own road."""
    inputs = cases.draw_inputs("all-at-once", "psi", "slips", 8)
    expected = cases.truth("all-at-once", "psi", inputs)
    paths.reference("all-at-once").mkdir(parents=True, exist_ok=True)
    arrays = {**inputs, "expected_psi": expected[0]}
    np.savez(paths.reference("all-at-once") / "psi.npz", **arrays)
    made = mutations.make("all-at-once", "psi")
    assert len(made.words) > 20
    s, E, nu = (inputs[name] for name in ("s", "E", "nu"))
    mu, lam = E / (2 * (1 + nu)), E * nu / (1 - nu**2)
    e_0, e_1 = (s[:, 0] ** 2 - 1) / 2, (s[:, 1] ** 2 - 1) / 2
    wrong = mu * (e_0**2 + e_0**2) + lam / 2 * (e_0 + e_1) ** 2
    assert any(np.allclose(prints[0], slips.print_of(wrong), rtol=1e-6) for prints in made.prints)


@pytest.mark.parametrize(
    ("energy", "parameters", "names"),
    [("linearised", "young", ("psi",)), ("mixed", "bulk", ("psi", "dpsi_ds", "d2psi_ds2"))],
)
def test_nearly_all_mistakes_in_a_variants_energy_are_named(
    tables, tmp_path, monkeypatch, energy, parameters, names
):
    """Of the published energy in other parameters, and of an instructor's own; `benchmarks/variants.py` has all."""
    monkeypatch.setenv(paths.COURSE, str(tmp_path))
    own_energy(tmp_path, tables)
    variant = f"{energy}-in-{parameters}"
    list(variants.write("cloth", variant, "a seed", variants.Choice(energy, parameters, ()), data=False))
    paths.reference(variant).mkdir(parents=True)
    said = []
    for name in names:
        np.savez(paths.reference(variant) / f"{name}.npz", **cases.make(variant, name, "public", 30))
        mistakes.save(variant, name, mistakes.make(tasks.assignment(variant).tasks[name], variant))
        list(mutations.build(variant, [name]))
        said += [(name, *mistake) for mistake in energies.diagnosed(variant, name, 20)]
    missed = [(name, what, text) for name, what, text, found in said if not energies.is_named(found)]
    assert len(said) > 16 * len(names)
    assert len(missed) <= 0.05 * len(said), missed


def test_an_answer_in_a_variants_handout_is_what_its_solution_gives(course):
    text = (paths.solution("all-at-once") / "README.md").read_text()
    given = re.search(r">>> evaluate\(f.psi, s=\[1.5, 0.5, 1.0\], E=19.2, nu=0.2\)\n(.*)\n", text)
    e, f = (1.5**2 - 1) / 2, (0.5**2 - 1) / 2
    assert given[1] == f"array([{8 * (e * e + f * f) + 2 * (e + f) ** 2:.4g}])"


@pytest.mark.parametrize(
    "text",
    ["__import__('os')", "x.__class__", "(lambda: 1)()", "open('x')", "x ** 9", "'a'", "[1 for a in x]", "x.T", "vec"
     ".f(x)", "True", "x.transpose", "1 +", "x" * 300],
)  # fmt: skip
def test_a_manifest_cannot_have_anything_else_than_arithmetic_evaluated(text):
    with pytest.raises(MuslinError, match="not an expression"):
        wiring.Wiring((), (), give={"x": text})


def test_names_that_cannot_be_picked_or_are_taken_are_refused_and_nothing_is_left(course, tables):
    with pytest.raises(MuslinError, match="'gren'"):
        variants.picked(tables, ["gren"])
    with pytest.raises(MuslinError, match="one of these"):
        variants.picked(tables, ["green", "neo-hookean"])
    assert variants.picked(tables, ["normal", "young"]) == variants.Choice("linearised", "young", ("normal",))
    with pytest.raises(MuslinError, match="already"):
        list(variants.write("cloth", "drawn", "x"))
    with pytest.raises(MuslinError, match="--seed"):
        list(variants.write("cloth", "other", " "))
    with pytest.raises(MuslinError, match="variants"):
        list(variants.write("solids", "other", "x"))
    assert not (course / "solutions" / "other").exists()


def test_what_students_install_has_their_variant_and_nothing_that_judges_it(course):
    from muslin.authoring import wheel

    inside = set(wheel.contents(assignment="drawn")) - set(wheel.contents())
    assert "muslin/_shipped/assignments/drawn/assignment.toml" in inside
    assert "muslin/_shipped/practice/drawn/stress.py" in inside
    assert all("/practice/drawn/" in path or "/assignments/drawn/" in path for path in inside)
    judges = set(wheel.contents(judges=True)) - set(wheel.contents())
    assert "muslin/_shipped/judge/drawn/stress.py" in judges


OWN = """
[energies.mixed]
says = "shape, and half of each of two measures of size"
of = '''
    shape, long, size = s[0] - s[1], s[0] * s[0] + s[1] * s[1] - 2, s[0] * s[1] - 1
    return mu / 2 * shape * shape + (lam + mu) / 16 * long * long + (lam + mu) / 4 * size * size
'''
invariants = [[0.125, 0.125], [0.5, 0.5]]
steps = '"s0 s1 - 1": s[0] * s[1] - 1'
hints = { psi = ["Shape first."], dpsi_ds = ["Three chain rules."], d2psi_ds2 = ["Products."] }
"""

DOCSTRING = '''    """{}

    s       : principal stretches, the normal's last, vec3 [1]
    mu, lam : Lamé parameters [Pa]
    returns : {}
    """
    # begin solution: {}
'''

ANSWERS = {
    "psi": ("the formula above; two stretches", "density [J/m^3]", [
        "long, size = s[0] ** 2 + s[1] ** 2 - 2, s[0] * s[1] - 1",
        "return mu / 2 * (s[0] - s[1]) ** 2 + (lam + mu) * (long**2 / 16 + size**2 / 4)",
    ]),
    "dpsi_ds": ("differentiate psi once", "gradient, vec3 [Pa]", [
        "k, long, size = (lam + mu) / 4, s[0] ** 2 + s[1] ** 2 - 2, s[0] * s[1] - 1",
        "p0 = mu * (s[0] - s[1]) + k * (long * s[0] + 2 * size * s[1])",
        "p1 = mu * (s[1] - s[0]) + k * (long * s[1] + 2 * size * s[0])",
        "return ti.Vector([p0, p1, 0.0])",
    ]),
    "d2psi_ds2": ("differentiate psi twice", "Hessian, mat3 [Pa]", [
        "k, long, size = (lam + mu) / 4, s[0] ** 2 + s[1] ** 2 - 2, s[0] * s[1] - 1",
        "a = mu + k * (long + 2 * s[0] ** 2 + 2 * s[1] ** 2)",
        "c = k * (2 * s[0] * s[1] + 2 * size + 2 * s[0] * s[1]) - mu",
        "return ti.Matrix([[a, c, 0.0], [c, a, 0.0], [0.0, 0.0, 0.0]])",
    ]),
}  # fmt: skip


def own_energy(course, tables):
    """An instructor's own energy in a folder that nobody else reads."""
    folder = course / "variants" / "cloth"
    (folder / "mixed").mkdir(parents=True)
    (folder / "energies.toml").write_text(OWN)
    for file in ("handout.md", "judge.py"):
        (folder / "mixed" / file).write_bytes((tables.folder / "neo-hookean" / file).read_bytes())
    functions = []
    for name, (words, returns, lines) in ANSWERS.items():
        body = "".join(f"    {line}\n" for line in lines)
        head = f"@ti.func\ndef {name}(s, mu, lam):\n" + DOCSTRING.format(name, returns, words)
        functions.append(f"{head}{body}    # end solution\n")
    (folder / "mixed" / "strain_energy.py").write_text("\n\n".join(functions), encoding="utf-8")
    return folder


def test_an_energy_of_ones_own_is_asked_for_and_simulated(tables, tmp_path, monkeypatch):
    monkeypatch.setenv(paths.COURSE, str(tmp_path))
    folder = own_energy(tmp_path, tables)
    own = variants.Tables("cloth")
    choice = variants.picked(own, ["mixed", "bulk", "modes"])
    assert "It takes mu and kappa" in " ".join(
        variants.write("cloth", "private", "a seed", choice, data=False)
    )
    functions = muslin.load(paths.solution("private"))
    assert all(
        right_on("private", functions, task) for task in ("psi", "dpsi_ds", "d2psi_ds2", "eigensystem")
    )
    mesh = grid(3, 3)
    theirs = muslin.Cloth(mesh, mu=7.0, lam=4.0, functions=functions)
    native = muslin.Cloth(mesh, mu=7.0, lam=4.0, energy=functions.assignment.energy)
    x = mesh.vertices * [1.3, 0.9, 1.0]
    (s,) = {tuple(pair) for pair in np.round(native.stretches(x), 12)}
    shape, long, size = s[0] - s[1], s[0] ** 2 + s[1] ** 2 - 2, s[0] * s[1] - 1
    right = 3.5 * shape**2 + 11 / 16 * long**2 + 11 / 4 * size**2
    assert native.energy(x) == pytest.approx(right, rel=1e-9)
    assert theirs.energy(x) == pytest.approx(right, rel=1e-9)
    assert np.allclose(theirs.gradient(x), native.gradient(x), rtol=0, atol=1e-10)
    with pytest.raises(MuslinError, match="mixed"):
        variants.picked(tables, ["mixed"])  # tables read without that folder
    answers = folder / "mixed" / "strain_energy.py"
    answers.write_text(
        answers.read_text(encoding="utf-8").replace("size**2 / 4", "size**2 / 3"), encoding="utf-8"
    )
    with pytest.raises(MuslinError, match="psi of this variant is not what its energy says"):
        list(variants.write("cloth", "wrong", "a seed", choice, data=False))
    assert not (tmp_path / "solutions" / "wrong").exists()
    (folder / "energies.toml").write_text(OWN.replace("0.125, 0.125", "0.125, 0.25"))
    with pytest.raises(MuslinError, match="another energy"):
        variants.files(variants.Tables("cloth"), "x", choice)
    (folder / "energies.toml").write_text(re.sub(r"invariants = .*\n", "", OWN))
    with pytest.raises(MuslinError, match="does not say how it is simulated"):
        variants.files(variants.Tables("cloth"), "x", choice)
    (folder / "energies.toml").write_text("[[[")
    with pytest.raises(MuslinError, match="not valid TOML"):
        variants.Tables("cloth")
