"""Mistakes nobody wrote down: named by what one slip in a right formula makes of the public cases."""

import ast
import re
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

from muslin import tasks
from muslin.authoring import edits, mutations
from muslin.base import paths
from muslin.grading import diagnosis, slips
from muslin.judging import judge, reference
from muslin.student import plain

sys.path.insert(0, str(Path(__file__).parent / "misconceptions"))
import invented
import suite

TABLE = tasks.assignment("cloth").tasks

#: Share of the invented mistakes that must be named: what is wrong, not only where.
NAMED = 0.97

#: Every pitfall of the handout, by how it begins: mistakes in its manner. Empty where plain Python sees no wrong
#: numbers: what does not compile, or is cut to whole numbers by Taichi, is told elsewhere.
PITFALLS = {
    "phi": {
        "Solving with": ["the 3x3 matrix of the vertices"],
        "Forgetting": ["X0 not subtracted"],
        "Areas": ["areas without a sign"],
        "The order": ["phi_0 last"],
        "Dotting": ["unit edges", "one edge at a time"],
    },
    "dphi_dX": {
        "Rows and columns": ["transposed"],
        "Row 0": ["row 0 zero", "row 0 last"],
        "Inverting": ["D D^T inverted"],
        "Units": ["inverse forgotten", "determinant missing"],
    },
    "interpolate": {
        "Weighting by": ["order reversed", "order rotated"],
        "Weighting edges": ["edges without x0"],
        "Collecting": [],
    },
    "deformation_gradient": {
        "Vertices as rows": ["vertices as rows", "gradients transposed", "transposed"],
        "The normal not": ["normal not normalised"],
        "The normal from": ["N used twice"],
        "Edges in": ["edges in the wrong order"],
        "The outer": ["outer product the wrong way round"],
    },
    "dn_dx": {
        "No projection": ["no projection", "no division"],
        "Edges in": ["edges 1 and 2 exchanged", "sign of the edge for i = 1", "edges at the vertex"],
        "$[e]": ["cross matrix transposed"],
        "Rows and": ["transposed"],
        "Right only": ["plane z = 0"],
    },
    "mass_block": {
        "Guessed": ["a half and a quarter", "lumped"],
        "The thickness": ["no thickness", "no density", "area doubled"],
        "The factor": ["half of T"],
        "`i` and": [],
    },
    "kinetic_energy": {
        "Only the": ["squares only"],
        "Each mixed": ["mixed terms once"],
        "The factor": ["no half", "half twice"],
    },
    "right_cauchy_green": {"$F F": ["F F^T"], "Stretches": ["squared again"], "`*`": ["entry by entry"]},
    "psi": {
        "$\\mu$ and": ["mu and lambda exchanged"],
        "The sum": ["three stretches"],
        "$s^2$": ["squared stretches", "minus 1"],
        "The factor": ["lambda whole", "mu halved"],
    },
    "dpsi_ds": {
        "The factor": ["no 2 at mu", "half left at lambda"],
        "The $\\lambda$": ["lambda in the first only", "lambda s_i - 1"],
        "The third": ["third not zero"],
        "`ti.Vector": [],
    },
    "d2psi_ds2": {
        "A diagonal": ["diagonal"],
        "Something": ["third row", "third diagonal"],
        "The result": ["times s"],
    },
    "dpsi_dF": {
        "$V$ not": ["V not transposed", "U and V exchanged"],
        "$s$ in": ["no diag"],
        "`*`": ["entry by entry"],
    },
    "nodal_force": {"The sign": ["sign"], "$h$ or": ["no h", "no area"], "$P^T$": ["P transposed"]},
    "d2psi_dFij": {
        "`dV`": ["dV not transposed"],
        "$\\mathrm{diag}$": ["ds alone"],
        "One term": ["first missing", "middle missing", "last missing"],
        "The entry": ["entry-wise"],
    },
    "eigensystem": {
        "The quotient": ["no limit"],
        "Flip": ["flip and twist exchanged"],
        "The gap": ["limit where the gap is large"],
        "The projection": ["projected"],
        "Dividing": ["s_i - 1", "s_i - 1, floored"],
    },
    "sphere_contact": {
        "A *squared*": ["squared distance", "squared distance, no guard"],
        "Inward": ["inward", "not of length one"],
        "A default": [],
        "`<=`": ["<="],
        "Two values": [],
    },
    "filter_velocity": {
        "Filtering": ["always"],
        "$v-2d": ["reflection", "plus"],
        "Subtracting": ["along v", "along v's direction"],
    },
}


def bare(found):
    """Whether no more is said than where something is wrong."""
    place = r"(row|column|components?|entry) \d[^:]*|where [^:]*|diagonal|off the diagonal|factor|digits"
    return re.fullmatch(place, found.cause) is not None


@pytest.fixture(scope="module")
def told():
    """What is said of every invented mistake: {(task, name): (right by the public cases, diagnosis)}."""
    found = {}
    with plain.looked_at() as names, warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        for task, bodies in invented.INVENTED.items():
            inputs, expected = reference.cases("cloth", task)
            cases = [{k: plain.own(a[row]) for k, a in inputs.items()} for row in range(len(expected[0]))]
            for name, body in bodies.items():
                inside = dict(names)
                exec(suite.function(TABLE[task], name, body).code, inside)
                made = mutations.run(inside[task], cases, TABLE[task])
                if made is None:  # no results: told by the form
                    continue
                got = tuple(m.astype(e.dtype) for m, e in zip(made, expected, strict=True))
                right = reference.compare(TABLE[task], got, expected, inputs, judge("cloth", task).terms).ok
                found[task, name] = right, diagnosis.diagnose(TABLE[task], got, expected, inputs)
    return found


def test_nearly_all_invented_mistakes_are_named(told):
    wrong = {key: found for key, (right, found) in told.items() if not right}
    assert len(wrong) > 300
    missed = [
        f"{key}: {found and found.cause}" for key, found in wrong.items() if found is None or bare(found)
    ]
    assert len(missed) <= (1 - NAMED) * len(wrong), missed


def test_an_invented_mistake_passes_the_public_cases_only_where_a_property_catches_it(told):
    passing = {key for key, (right, _) in told.items() if right}
    floors = {"no abs", "no floor", "floor of 1e-12", "floor of 1e-3", "zero at collapse"}
    typed = {("mass_block", "a whole number"), ("sphere_contact", "integers")}  # Taichi cuts, Python does not
    assert passing <= {("eigensystem", name) for name in floors} | typed | {("filter_velocity", "threshold")}


def pitfalls(task):
    """The pitfalls the handout lists for a task."""
    text = (paths.root() / "solutions" / "cloth" / "README.md").read_text(encoding="utf-8")
    section = text.split(f"\n### {task}\n")[1]
    listed = section.split("**Pitfalls**")[1].split("**Check it:**")[0]
    return [line.removeprefix("- ") for line in listed.splitlines() if line.startswith("- ")]


@pytest.mark.parametrize("task", TABLE)
def test_every_pitfall_of_the_handout_is_named(told, task):
    listed = pitfalls(task)
    assert len(listed) == len(PITFALLS[task])
    for pitfall, (start, names) in zip(listed, PITFALLS[task].items(), strict=True):
        assert pitfall.startswith(start)
        for name in names:
            right, found = told[task, name]
            assert not right
            assert found is not None, (task, name)
            assert not bare(found), (task, name, found)


@pytest.mark.parametrize(
    ("task", "name", "words"),
    [
        ("phi", "both off-diagonal signs of the 2x2 inverse", "sign is wrong"),
        ("phi", "determinant with a plus", "determinant"),
        ("phi", "the 3x3 matrix of the vertices", "3x3 matrix of the vertices"),
        ("phi", "edges X1-X0 and X2-X1", "edge"),
        ("dphi_dX", "edges X1-X0, X2-X1", "edge"),
        ("dphi_dX", "D D^T inverted", "singular"),
        ("deformation_gradient", "a dot product added", "n . N"),
        ("dn_dx", "I - m m^T", "projection"),
        ("dpsi_dF", "first exchanged", "direction 0"),
        ("d2psi_dFij", "U and V swapped in the middle", "U and V have changed places in the middle term"),
        ("eigensystem", "s_i - 1, floored", "s_i - 1"),
        ("eigensystem", "s_i + 1", "s_i + 1"),
        ("sphere_contact", "squared distance, no guard", "squared distance"),
    ],
)
def test_a_slip_is_told_where_it_is(told, task, name, words):
    _, found = told[task, name]
    assert words in found.mistake


# --- the data ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("task", ["nodal_force", "right_cauchy_green"])
def test_the_shipped_slips_are_those_the_roads_make(task):
    made, shipped = mutations.make("cloth", task), slips.load("cloth", task)
    assert made.words.tolist() == shipped.words.tolist()
    np.testing.assert_allclose(made.prints, shipped.prints, rtol=1e-6)


@pytest.mark.parametrize("task", TABLE)
def test_the_shipped_slips_are_made_of_the_public_cases_and_none_is_right(task):
    _, expected = reference.cases("cloth", task)
    shipped = slips.load("cloth", task)
    right = np.stack([slips.print_of(np.asarray(e, dtype=float)) for e in expected])
    assert shipped.prints.shape[1:] == right.shape
    assert len(shipped.words) > 20
    alike = np.isclose(shipped.prints, right, rtol=1e-7, atol=0, equal_nan=True).all(axis=(1, 2))
    assert not alike.any()


@pytest.mark.parametrize("task", TABLE)
def test_every_road_is_right_and_every_line_says_what_it_is(task):
    inputs, expected = reference.cases("cloth", task)
    cases = [{k: plain.own(a[row]) for k, a in inputs.items()} for row in range(len(expected[0]))]
    with plain.looked_at() as names, np.errstate(all="ignore"):
        for function, source in mutations.roads("cloth")[task]:
            made = mutations.run(mutations.compiled(function, {}, names), cases, TABLE[task])
            got = tuple(m.astype(e.dtype) for m, e in zip(made, expected, strict=True))
            verdict = reference.compare(TABLE[task], got, expected, inputs, judge("cloth", task).terms)
            whole = ast.get_docstring(function)
            assert verdict.ok == (whole is None), function.name
            if whole:
                assert len(whole.split("\n\n")) == 2
                continue
            for line in source[function.lineno : function.end_lineno]:
                assert "  # " in line or line.strip().startswith("if "), line


def test_a_missing_or_damaged_file_of_slips_costs_names_only(monkeypatch, tmp_path):
    monkeypatch.setattr(paths, "slips", lambda assignment: tmp_path)
    slips.load.cache_clear()
    (tmp_path / "psi.npz").write_bytes(b"half")
    assert slips.load("cloth", "psi") is None
    assert slips.load("cloth", "phi") is None
    inputs, expected = reference.cases("cloth", "psi")
    assert diagnosis.diagnose(TABLE["psi"], (2 * expected[0],), expected, inputs).cause == "scaled:2"
    slips.load.cache_clear()


def test_slips_of_roads_whose_lines_say_nothing_can_be_asked_about_some_of_the_cases(monkeypatch, tmp_path):
    """Those of a variant's own energy: its solution has no comments."""
    monkeypatch.setattr(paths, "slips", lambda assignment: tmp_path)
    made = np.arange(8.0)
    slips.Slips.of([(("sign: s", "A sign.", "Look."), [made])]).save(tmp_path / "silent.npz")
    slips.load.cache_clear()
    found = slips.load("cloth", "silent")
    some = found.at(made > 2)
    assert not len(some.places)
    assert np.array_equal(some.prints[0, 0], made[3:])
    assert found.place(made) == ""
    slips.load.cache_clear()


def test_the_words_of_slips_give_no_formula_away():
    lines = set()
    for file in tasks.assignment("cloth").files:
        text = (paths.root() / "solutions" / "cloth" / file).read_text(encoding="utf-8")
        lines |= {
            "".join(line.split("#")[0].split())
            for line in text.splitlines()
            if "=" in line or "return" in line
        }
    for task in TABLE:
        for text in slips.load("cloth", task).words.ravel():
            assert not [line for line in lines if len(line) > 12 and line in "".join(text.split())]


def test_every_kind_of_slip_has_words_that_are_sentences():
    for mistake, advice in edits.WORDS.values():
        assert advice.endswith((".", "?"))
        assert not mistake.endswith(".")
