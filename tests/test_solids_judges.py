"""What is known of the tasks of the solids assignment: enough of it, and it names what students get wrong."""

from __future__ import annotations

import re
import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin import reading, tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.grading import diagnosis
from muslin.judging import judge, properties, reference
from muslin.student.checking import examine

sys.path.insert(0, str(Path(__file__).parent / "misconceptions"))
import suite

TABLE = tasks.assignment("solids").tasks
WRITTEN = [v for v in suite.variants("solids") if not v.generated]

#: Share of the written wrong variants that must get exactly the cause they declare.
NAMED = 0.95

#: Every pitfall of the handout, by how it begins: variants with that mistake. Empty where no wrong numbers come of it:
#: what does not compile, and what is told from the text (`SEEN`).
PITFALLS = {
    "phi": {
        "Forgetting to": ["X0-not-subtracted"],
        "Edges as": ["edges-as-rows", "transpose-for-inverse"],
        "Volumes without": ["volumes-without-sign"],
        "The order": ["phi-0-last"],
    },
    "dphi_dX": {
        "Columns of": ["columns-of-the-inverse", "edges-as-rows"],
        "Row 0": ["row-0-zero", "row-0-one-minus"],
        "Normals of": ["unit-normals", "normals-of-the-faces"],
        "Units": ["not-inverted"],
    },
    "interpolate": {
        "Weighting by": ["order-reversed", "order-rotated", "three-vertices"],
        "Weighting edges": ["edges-without-x0"],
        "Collecting": [],
    },
    "deformation_gradient": {
        "Vertices as": ["transposed", "outer-products-the-wrong-way-round"],
        "Vertex 0": ["vertex-0-missing"],
        "The gradient": ["displacements"],
    },
    "mass_block": {
        "The triangle": ["of-a-triangle", "lumped"],
        "A 6": ["six-volumes"],
        "The factor": ["half-of-the-energy"],
        "`i` and": [],
    },
    "kinetic_energy": {
        "Only the": ["squares-only"],
        "Four pairs": ["around-the-ring"],
        "The factor": ["no-half", "half-twice"],
    },
    "psi": {
        "$J^{-2/3}$ left": ["un-barred"],
        "Another power": ["power-minus-a-third", "power-two-thirds"],
        "`-2 // 3`": ["whole-number-division"],
        "$(I_1-3)$": ["three-times-the-power"],
        "$\\mathrm{tr}(F)$": ["trace-of-F", "trace-of-F-F", "entry-by-entry"],
        "$D/2$": ["half-D", "half-C"],
        "$J$ kept": ["J-clamped"],
    },
    "dpsi_dF": {
        "$J^{-2/3}$ treated": ["power-held-fixed"],
        "$F^{-1}$": ["not-transposed"],
        "The factor": ["J-missing", "minus-five-thirds"],
        "Factors 2": ["no-two-in-the-shape", "no-two-in-the-volume"],
        "Other stresses": ["cauchy", "second-piola-kirchhoff"],
    },
    "d2psi_dF2": {
        "$G$ treated": ["G-held-fixed", "sign-of-dG"],
        "The indices": ["indices-of-dG", "indices-of-dG-straight"],
        "One of": ["one-of-a-pair", "the-other-of-a-pair"],
        "$J^2-J$": ["volume-held-fixed", "one-minus-missing"],
        "Column by": ["column-by-column", "rows-column-by-column"],
        "Negative eigenvalues": ["projected"],
    },
    "nodal_force": {
        "The sign": ["gradient-for-force"],
        "The volume": ["volume-missing", "shared-out"],
        "$P^T$": ["P-transposed"],
    },
    "stiffness_block": {
        "The opposite": ["opposite-sign"],
        "The gradients": ["gradients-exchanged", "transposed"],
        "$a+3c$": ["column-by-column"],
        "A single": ["one-inner-index"],
    },
    "spring_force": {
        "The force": ["pushes"],
        "A direction": ["no-direction", "nan-where-the-ends-meet"],
        "The rest": ["no-rest-length", "only-pulls"],
    },
    "newtons_method": {
        "The sign": ["uphill", "uphill-without-line-search"],
        "The slope": ["slope-added"],
        "`while objective": [],
        "The step": ["step-stays-short"],
        "The gradient": ["hessian-of-the-start", "all-of-the-start"],
        "`x += step": [],
    },
}

#: Pitfalls of `newtons_method` that are told from the text: a part of its body, and words of the note.
SEEN = {
    "`while objective": (
        "while objective(x + step * d) > here:\n            step /= 2",
        "NaN is not greater",
    ),
    "`x += step": ("x += step * d", "changes the caller's x in place"),
}


#: Functions whose answer is a derivative: `gradcheck` compares it with differences.
DERIVATIVES = (
    "dphi_dX", "deformation_gradient", "mass_block", "dpsi_dF", "d2psi_dF2", "nodal_force", "stiffness_block",
    "spring_force",
)  # fmt: skip


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory):
    """What comes of every variant: {variant: (verdict, diagnosis)}."""
    found = {}
    for kind in ("wrong", "right"):
        for chosen in suite.rounds(kind, "solids"):
            folder = suite.submission(tmp_path_factory.mktemp(kind), chosen, "solids")
            functions = muslin.load(folder, "solids")
            for name, variant in chosen.items():
                inputs, expected = reference.cases("solids", name)
                try:
                    got = muslin.evaluate(functions[name], **inputs)
                except MuslinError as error:
                    found[variant] = reference.Verdict(name, False, str(error)), None
                    continue
                got = got if isinstance(got, tuple) else (got,)
                terms = judge("solids", name).terms
                verdict = reference.compare(TABLE[name], got, expected, inputs, terms)
                found[variant] = verdict, diagnosis.diagnose(TABLE[name], got, expected, inputs, "solids")
    return found


def test_every_wrong_variant_is_caught_and_every_right_one_passes(outcomes):
    assert not [str(v) for v, (verdict, _) in outcomes.items() if verdict.ok != (v.verdict == "right")]


def test_mistakes_are_named(outcomes):
    asked = {v: found for v, (_, found) in outcomes.items() if v.cause}
    missed = [
        f"{v}: {v.cause}, not {found and found.cause}"
        for v, found in asked.items()
        if found is None or found.cause != v.cause
    ]
    print(f"{len(asked) - len(missed)} of {len(asked)} named", *missed, sep="\n")
    assert len(missed) <= (1 - NAMED) * len(asked)


def test_nothing_is_said_of_right_answers(outcomes):
    assert not [str(v) for v, (_, found) in outcomes.items() if v.verdict == "right" and found is not None]


@pytest.mark.parametrize(
    ("task", "variant", "words"),
    [
        ("psi", "un-barred", "not least at rest"),
        ("psi", "half-D", "D is taken for lam"),
        ("psi", "J-clamped", "limited"),
        ("dpsi_dF", "power-held-fixed", "treated as a constant"),
        ("d2psi_dF2", "column-by-column", "column by column"),
        ("d2psi_dF2", "sign-of-dG", "wrong sign"),
        ("stiffness_block", "opposite-sign", "derivative of the force"),
        ("spring_force", "only-pulls", "does not push"),
        ("newtons_method", "no-line-search", "whole step is taken always"),
        ("newtons_method", "any-decrease", "Any decrease"),
    ],
)
def test_the_words_say_what_is_wrong(outcomes, task, variant, words):
    (found,) = (found for v, (_, found) in outcomes.items() if (v.task, v.name) == (task, variant))
    assert words in found.mistake


@pytest.mark.parametrize("task", TABLE)
def test_every_task_has_enough_of_everything(task):
    known = judge("solids", task)
    assert len(known.properties) >= 4
    assert len({mistake.cause for mistake in known.mistakes}) >= 6
    assert known.steps is not None or task == "interpolate"
    assert (known.derivative is not None) == (task in DERIVATIVES)
    assert len(TABLE[task].hints) >= 2
    verdicts = [v.verdict for v in WRITTEN if v.task == task]
    assert verdicts.count("wrong") >= 6
    assert verdicts.count("right") >= 2


def test_properties_hold_for_right_answers_whatever_is_drawn():
    functions = muslin.load(paths.solution("solids"), "solids")
    for task in TABLE:
        for seed in range(5):
            drawn = properties.draw("solids", task, f"seed {seed}")
            for prop, inputs in drawn:
                got = muslin.evaluate(functions[task], **inputs)
                error = properties.judge(prop, inputs, got if isinstance(got, tuple) else (got,))
                assert error <= prop.tolerance / 10, (task, prop.name, error)


#: Mistakes that public cases could let pass, each with the property that must not.
BROKEN = (
    ("psi", "no energy at rest", lambda a: a["C"] * 1e-6),
    ("psi", "size costs only D", lambda a: 1e-6 * a["C"] * (np.linalg.det(a["F"]) - 1) ** 2),
    ("mass_block", "symmetric", lambda a: 1e-6 * a["rho"] * a["volume"] * (a["i"] < a["j"])),
)


@pytest.mark.parametrize(("task", "name", "more"), BROKEN, ids=[name for _, name, _ in BROKEN])
def test_a_property_sees_one_part_in_a_million(task, name, more):
    functions = muslin.load(paths.solution("solids"), "solids")
    (found,) = (pair for pair in properties.draw("solids", task, "a seed") if pair[0].name == name)
    prop, inputs = found
    got = muslin.evaluate(functions[task], **inputs)
    assert properties.judge(prop, inputs, (got,)) <= prop.tolerance
    assert properties.judge(prop, inputs, (got + more(inputs),)) > prop.tolerance


def test_a_wrong_sign_of_the_stiffness_is_charged_once(tmp_path):
    chosen = next(v for v in WRITTEN if (v.task, v.name) == ("stiffness_block", "opposite-sign"))
    folder = suite.submission(tmp_path / "work", {"stiffness_block": chosen}, "solids")
    shutil.copy(paths.source("solids") / tasks.MANIFEST, folder)
    record = muslin.grade(folder)  # which assignment it answers its own manifest says
    assert record.score == 92
    assert record["stiffness_block"].score == 0


def pitfalls(task):
    """The pitfalls the handout lists for a task."""
    text = (paths.solution("solids") / "README.md").read_text(encoding="utf-8")
    listed = text.split(f"\n### {task}\n")[1].split("**Pitfalls**")[1].split("**Check it:**")[0]
    return [line.removeprefix("- ") for line in listed.splitlines() if line.startswith("- ")]


@pytest.mark.parametrize("task", TABLE)
def test_every_pitfall_of_the_handout_is_named(outcomes, task):
    of_task = {v.name: outcome for v, outcome in outcomes.items() if v.task == task}
    of_task["projected"] = _projected() if task == "d2psi_dF2" else None
    listed = pitfalls(task)
    assert len(listed) == len(PITFALLS[task])
    for pitfall, (start, names) in zip(listed, PITFALLS[task].items(), strict=True):
        assert pitfall.startswith(start)
        for name in names:
            verdict, found = of_task[name]
            assert not verdict.ok
            assert found is not None, name
            assert not re.fullmatch(
                r"(row|column|components?|entry) \d+|where .*|off the diagonal", found.cause
            )


def _projected():
    """What comes of a Hessian without its negative eigenvalues, which no short function computes."""
    inputs, (right,) = reference.cases("solids", "d2psi_dF2")
    values, vectors = np.linalg.eigh(right)
    got = (vectors * np.maximum(values, 0)[:, None, :] @ vectors.transpose(0, 2, 1),)
    verdict = reference.compare(TABLE["d2psi_dF2"], got, (right,), inputs, judge("solids", "d2psi_dF2").terms)
    return verdict, diagnosis.diagnose(TABLE["d2psi_dF2"], got, (right,), inputs, "solids")


@pytest.mark.parametrize("pitfall", SEEN)
def test_a_pitfall_that_makes_no_wrong_numbers_is_seen_in_the_text(pitfall, tmp_path):
    line, words = SEEN[pitfall]
    body = (
        f"    for _ in range(most_steps):\n        d, step, here = -gradient(x), 1.0, 0.0\n        {line}\n"
    )
    head = f"import numpy as np\ndef newtons_method({', '.join(a.name for a in TABLE['newtons_method'].arguments)}):\n"
    (tmp_path / "newton.py").write_text(head + body + "    return x\n")
    (told,) = reading.told(muslin.load(tmp_path, "solids").newtons_method)
    assert words in told
    assert pitfall in "\n".join(f"`{p.strip('`')}" for p in pitfalls("newtons_method"))


@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("d = solve(hessian, d)", ["hessian is a function: it must be called"]),
        ("d = solve(hessian(x), d)", []),
        (
            "here = objective(x + step * d)\n        x = x - step * d",
            ["what is tried is x + step * d, and x goes elsewhere"],
        ),
        (
            "here = objective(x + step * d)\n        x = x + d",
            ["what is tried is x + step * d, and x goes elsewhere"],
        ),
        ("here = objective(x + step * d)\n        x = x + d * step", []),
        ("new = x + step * d\n        here = objective(new)\n        x = new", []),
    ],
)
def test_a_step_to_another_place_and_a_function_not_called_are_seen_in_the_text(line, words, tmp_path):
    head = f"import numpy as np\ndef newtons_method({', '.join(a.name for a in TABLE['newtons_method'].arguments)}):\n"
    body = f"    for _ in range(most_steps):\n        d, step = -gradient(x), 1.0\n        {line}\n    return x\n"
    (tmp_path / "newton.py").write_text(head + body)
    told = reading.told(muslin.load(tmp_path, "solids").newtons_method)
    assert len(told) == len(words)
    assert all(word in note for word, note in zip(words, told, strict=True))


NEWTON = """
    here = 0.0
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            return x
        d = solve(hessian(x), -g)
        step, here = 1.0, objective(x)
        while not objective(x + step * d) <= here + 1e-4 * step * g.dot(d):
            step *= 0.5
        x = x + step * d
    return x
"""


@pytest.mark.parametrize(
    ("right", "wrong", "words"),
    [
        ("", "", ""),
        ("while not", "while", "a not is missing"),
        ("*= 0.5", "*= 2", "does not make step smaller"),
        ("*= 0.5", "/= 0.5", "does not make step smaller"),
        ("*= 0.5", "-= 0.5", "past zero"),
        ("<= tolerance", "> tolerance", "<= belongs there"),
        ("here = 0.0\n", "H = hessian(x)\n", ""),
        ("here = 0.0\n", "g = gradient(x)\n", ""),
        ("solve(hessian(x)", "solve(H", "worked out once, before the loop: x changes in it, and H does not"),
    ],
)
def test_slips_of_a_line_search_are_seen_in_the_text(right, wrong, words, tmp_path):
    head = f"import numpy as np\ndef newtons_method({', '.join(a.name for a in TABLE['newtons_method'].arguments)}):"
    body = NEWTON.replace(right, wrong, 1) if right else NEWTON
    (tmp_path / "newton.py").write_text(
        head + body.replace("here = 0.0", "H = hessian(x)", "solve(H" in body)
    )
    told = reading.told(muslin.load(tmp_path, "solids").newtons_method)
    assert len(told) == bool(words), told
    assert not words or words in told[0]


def test_nothing_is_noticed_in_a_right_newtons_method():
    for folder in (paths.solution("solids"), paths.assignment("solids")):
        assert reading.told(muslin.load(folder, "solids").newtons_method) == []
    own = "x = x.copy()\n    x += 1.0\n    most_steps -= 1\n    while x[0] > 3:\n        x[0] = 0\n    return x\n"
    assert reading.notes(f"def f(x, most_steps):\n    {own}", "f", sizes={"x": 4}, in_python=True) == []


@pytest.mark.parametrize(
    ("written", "status", "said"),
    [
        ("x = x + step * d", "green", ""),
        ("x += step * d", "error", "newtons_method changes x, an array of whoever"),
    ],
)
def test_a_right_answer_that_changes_the_callers_array_is_none(written, status, said, tmp_path):
    solution = paths.solution("solids")
    for path in solution.iterdir():
        if path.suffix in (".py", ".toml"):
            shutil.copy(path, tmp_path)
    text = (solution / "newton.py").read_text(encoding="utf-8")
    assert text.count("x = x + step * d") == 1
    (tmp_path / "newton.py").write_text(text.replace("x = x + step * d", written), encoding="utf-8")
    (report,) = examine(tmp_path, "solids", ("newtons_method",))
    assert report.status == status
    assert said in report.message
