"""What is known of the tasks of the solids assignment: enough of it, and it names what students get wrong."""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.grading import diagnosis
from muslin.judging import judge, properties, reference

sys.path.insert(0, str(Path(__file__).parent / "misconceptions"))
import suite

TABLE = tasks.assignment("solids").tasks
WRITTEN = [v for v in suite.variants("solids") if not v.generated]

#: Share of the written wrong variants that must get exactly the cause they declare.
NAMED = 0.95

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
