"""The misconception suite: every mistake is caught by the public cases and nearly every one is named."""

import itertools
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import muslin
from muslin import tasks
from muslin.authoring import mistakes
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.grading import diagnosis, known
from muslin.grading.diagnosis.partial import opposite
from muslin.judging import judge, reference

sys.path.insert(0, str(Path(__file__).parent / "misconceptions"))
import suite

TABLE = tasks.assignment("cloth").tasks
WRITTEN = [v for v in suite.variants() if not v.generated]

#: Share of the written wrong variants that must get exactly the cause they declare.
NAMED = 0.8


def answers(function, inputs):
    got = muslin.evaluate(function, **inputs)
    return got if isinstance(got, tuple) else (got,)


@pytest.fixture(scope="module")
def outcomes(tmp_path_factory):
    """What comes of every variant: {variant: (verdict, diagnosis, seconds)}."""
    found = {}
    for kind in ("wrong", "right"):
        for chosen in suite.rounds(kind):
            functions = muslin.load(suite.submission(tmp_path_factory.mktemp(kind), chosen))
            for name, variant in chosen.items():
                inputs, expected = reference.cases("cloth", name)
                try:
                    got = answers(functions[name], inputs)
                except MuslinError as error:
                    found[variant] = reference.Verdict(name, False, str(error)), None, 0.0
                    continue
                verdict = reference.compare(TABLE[name], got, expected, inputs, judge("cloth", name).terms)
                start = time.process_time()
                named = diagnosis.diagnose(TABLE[name], got, expected, inputs)
                found[variant] = verdict, named, time.process_time() - start
    return found


def test_every_wrong_variant_is_caught_by_the_public_cases(outcomes):
    passed = [str(v) for v, (verdict, _, _) in outcomes.items() if v.verdict == "wrong" and verdict.ok]
    assert not passed


def test_every_right_variant_passes(outcomes):
    failed = [
        (str(v), verdict.message)
        for v, (verdict, _, _) in outcomes.items()
        if v.verdict == "right" and not verdict.ok
    ]
    assert not failed


def test_nothing_is_said_of_right_answers(outcomes):
    assert not [str(v) for v, (_, named, _) in outcomes.items() if v.verdict == "right" and named is not None]


@pytest.mark.parametrize("generated", [False, True])
def test_most_mistakes_are_named(outcomes, generated):
    asked = [v for v in outcomes if v.cause and v.generated == generated]
    named = {v: outcomes[v][1].cause if outcomes[v][1] else None for v in asked}
    missed = [f"{v}: {v.cause}, not {named[v]}" for v in asked if named[v] != v.cause]
    print(f"{len(asked) - len(missed)} of {len(asked)} named", *missed, sep="\n")
    assert len(missed) <= (1 - NAMED) * len(asked)


def test_a_wrong_shape_is_refused_before_anything_is_compared(outcomes):
    refused = [verdict.message for v, (verdict, _, _) in outcomes.items() if v.name == "wrong-shape"]
    assert len(refused) == len(TABLE)
    assert all("is asked" in message for message in refused)


def test_a_diagnosis_takes_about_a_second_at_most(outcomes):
    slow = {str(v): seconds for v, (_, _, seconds) in outcomes.items() if seconds > 1.5}
    assert not slow


def test_a_diagnosis_is_made_of_full_sentences(outcomes):
    for variant, (_, named, _) in outcomes.items():
        for text in (named.mistake, named.advice) if named else ():
            assert text.endswith((".", "?", "!")), (str(variant), text)
            assert "{" not in text, (str(variant), text)


@pytest.mark.parametrize(
    ("task", "variant", "words"),
    [
        ("nodal_force", "gradient-for-force", "opposite sign"),
        ("nodal_force", "area-missing", "area"),
        ("psi", "mu-and-lam-exchanged", "mu and lam"),
        ("dphi_dX", "row-0-forgotten", "Row 0"),
        ("mass_block", "lumped", "lumped"),
        ("mass_block", "the-same-everywhere", "i != j"),
        ("right_cauchy_green", "left", "left Cauchy-Green"),
        ("d2psi_dFij", "dV-not-transposed", "dV is not transposed"),
        ("eigensystem", "flip-and-twist-exchanged", "Flip and twist"),
        ("eigensystem", "no-limit", "limit"),
        ("sphere_contact", "nan-at-the-centre", "centre"),
        ("sphere_contact", "squared-distance-against-r", "squared distance"),
        ("filter_velocity", "reflected", "reflected"),
        ("dn_dx", "plane-z-0-only", "plane"),
    ],
)
def test_the_words_say_what_is_wrong(outcomes, task, variant, words):
    (named,) = (found for v, (_, found, _) in outcomes.items() if (v.task, v.name) == (task, variant))
    assert words in named.mistake


# --- the suite itself --------------------------------------------------------------------------------------


@pytest.mark.parametrize("task", TABLE)
def test_every_task_has_enough_variants(task):
    verdicts = [v.verdict for v in WRITTEN if v.task == task]
    assert verdicts.count("wrong") >= 5
    assert verdicts.count("right") >= 2


def test_the_suite_is_large_and_nothing_in_it_is_written_twice():
    everything = suite.variants()
    assert sum(v.verdict == "wrong" for v in everything) > 200
    assert len({(v.task, v.name) for v in everything}) == len(everything)
    assert len({(v.task, v.code) for v in everything}) == len(everything)
    assert all(v.cause for v in WRITTEN if v.verdict == "wrong")


@pytest.mark.parametrize("verdict", ["wrong", "right"])
def test_rounds_cover_all_variants_in_the_fewest_submissions(verdict):
    rounds = list(suite.rounds(verdict))
    asked = [v for v in suite.variants() if v.verdict == verdict]
    assert sorted(map(str, itertools.chain(*(chosen.values() for chosen in rounds)))) == sorted(
        map(str, asked)
    )
    assert len(rounds) == max(sum(v.task == task for v in asked) for task in TABLE)


def test_a_submission_differs_from_the_solution_in_the_chosen_functions_only(tmp_path):
    chosen = next(v for v in WRITTEN if v.task == "dpsi_dF")
    folder = suite.submission(tmp_path, {"dpsi_dF": chosen})
    functions = muslin.load(folder)
    assert all(tasks.failure_of(function) is None for function in functions)
    for file in tasks.assignment("cloth").files:
        same = (folder / file).read_text() == (paths.source("cloth") / file).read_text()
        assert same == (file != "stress.py")
    assert chosen.code in (folder / "stress.py").read_text()


# --- what ships to students --------------------------------------------------------------------------------


def solution_lines():
    """Every line of code of the solution regions, without blanks."""
    for file in tasks.assignment("cloth").files:
        inside = False
        for line in (paths.source("cloth") / file).read_text().splitlines():
            if "begin solution" in line or "end solution" in line:
                inside = "begin" in line
            elif inside and (code := "".join(line.split("#")[0].split()).removeprefix("return")):
                yield code


def all_words():
    """Every sentence a student can be told."""
    yield from itertools.chain(*diagnosis.WORDS.values())
    for task in TABLE:
        yield from itertools.chain(*((m.mistake, m.advice) for m in judge("cloth", task).mistakes))
        yield from itertools.chain(*judge("cloth", task).said.values())


def test_no_advice_and_no_table_holds_a_line_of_the_solution():
    lines = {line for line in solution_lines() if len(line) > 12}
    assert len(lines) > 40
    code = [path.read_text() for path in Path(diagnosis.__file__).parent.glob("*.py")]
    assert len(code) > 5
    for text in (*all_words(), *code):
        squeezed = "".join(text.split())
        assert not [line for line in lines if line in squeezed]


def test_something_is_known_of_every_task():
    assert all(judge("cloth", task).mistakes for task in TABLE)


def test_the_data_hold_what_the_judges_say():
    """Made again, and beside what a mistake really makes of the cases."""
    task = "mass_block"
    found, made = known.load("cloth", task, 1), mistakes.make(TABLE[task], "cloth")
    for kind in (known.MISTAKE, known.CHANGE):
        pairs = list(zip(found.of(0, kind), made.of(0, kind), strict=True))
        assert pairs
        for stored, again in pairs:
            assert (stored.cause, stored.mistake, stored.advice) == (again.cause, again.mistake, again.advice)
            np.testing.assert_allclose(stored.made, again.made, rtol=1e-7)
    inputs, _ = reference.cases("cloth", task)
    twice = next(e for e in found.of(0, known.CHANGE) if e.cause.startswith("doubled"))
    right = muslin.evaluate(
        muslin.load("solutions/cloth")[task], **{**inputs, twice.of: 2 * inputs[twice.of]}
    )
    np.testing.assert_allclose(twice.made, right, rtol=1e-6)


# --- answers nobody expects --------------------------------------------------------------------------------


@pytest.mark.parametrize("task", TABLE)
def test_no_answer_breaks_the_diagnosis_and_nonsense_gets_no_name(task, lost_diagnoses):
    inputs, expected = reference.cases("cloth", task)
    rng = np.random.default_rng(3)
    sizes = (1.0, 1e-300, 1e300)
    for size in sizes:
        with np.errstate(invalid="ignore"):
            got = tuple((rng.standard_normal(e.shape) * size).astype(e.dtype) for e in expected)
        found = diagnosis.diagnose(TABLE[task], got, expected, inputs)
        assert size != 1 or task == "sphere_contact" or found is None
    for strange in (lambda e: e[:, None], lambda e: e[:3], lambda e: np.full(e.shape, "x"), lambda e: e[:0]):
        diagnosis.diagnose(TABLE[task], tuple(strange(e) for e in expected), expected, inputs)
        lost_diagnoses.clear()  # of words there is nothing to say
    assert diagnosis.diagnose(TABLE[task], (), expected, inputs) is None
    assert diagnosis.diagnose(TABLE[task], expected, expected, inputs) is None


def test_the_same_arrays_get_the_same_diagnosis():
    inputs, expected = reference.cases("cloth", "psi")
    answers = [diagnosis.diagnose(TABLE["psi"], (3 * expected[0],), expected, inputs) for _ in range(3)]
    assert answers[0].cause == "scaled:3"
    assert len(set(answers)) == 1


def test_a_task_of_another_assignment_gets_the_general_diagnosis():
    inputs, expected = reference.cases("cloth", "nodal_force")
    found = diagnosis.diagnose(TABLE["nodal_force"], (-expected[0],), expected, inputs, assignment="other")
    assert found.cause == "negated"


@pytest.mark.parametrize("assignment", ["cloth", "solids"])
def test_every_condition_can_be_turned_round(assignment):
    for name, task in tasks.assignment(assignment).tasks.items():
        for words, _ in known.load(assignment, name, len(task.results)).conditions:
            turned = opposite(words)
            assert turned != words
            assert opposite(turned) != turned
