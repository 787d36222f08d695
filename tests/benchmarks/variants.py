"""Ten variants of cloth by seed, the whole way: python tests/benchmarks/variants.py [COUNT] [--mistakes]

Each is drawn, written, released, its cases made; its own solution, its stubs and the published solution are graded; its
functions simulate `drape`, whose picture is drawn. With --mistakes also what known mistakes make of the cases is made
(minutes), and the diagnosis is shown the suite of misconceptions, carried over into the variant's convention, and slips
and wrong ideas in `psi`, `dpsi_ds` and `d2psi_ds2` of its energy (`misconceptions/energies.py`): named of all, of each.
A table in Markdown comes out; it is in docs/integrity.md.
"""

import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

import muslin
from muslin import tasks
from muslin.authoring import mistakes, mutations, reference_data, variants
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.grading.diagnosis import diagnose
from muslin.judging import reference
from muslin.present import pictures
from muslin.tasks import wiring
from muslin.tasks.batch import evaluate

sys.path.insert(0, str(Path(__file__).parents[1] / "misconceptions"))
import energies
import suite

SEED = "autumn {}"

#: Mistakes in each of the energy's three tasks that are drawn of those in `misconceptions/energies.py`.
OF_ENERGY = 100


def main(count: int, with_mistakes: bool) -> None:
    """Print a row for every variant."""
    tables = variants.Tables("cloth")
    choices = [variants.draw(tables, SEED.format(k)) for k in range(count)]
    pairs = [a.differences(b) for k, a in enumerate(choices) for b in choices[:k]]
    print(f"Any two differ in at least {min(pairs)} ways.\n")
    print(
        "| seed | energy | parameters | conventions | own | stubs | published | run | mistakes named | seconds |"
    )
    print("| --- | --- | --- | --- | --: | --: | --: | --- | --: | --: |")
    with tempfile.TemporaryDirectory() as course:
        os.environ[paths.COURSE] = course
        for k, choice in enumerate(choices):
            began = time.monotonic()
            row = whole_way(f"variant-{k}", SEED.format(k), tables, with_mistakes, Path(course))
            told = [SEED.format(k), choice.energy, choice.parameters, ", ".join(choice.conventions), *row]
            print("| " + " | ".join(map(str, [*told, round(time.monotonic() - began)])) + " |", flush=True)


def whole_way(
    name: str, seed: str, tables: variants.Tables, with_mistakes: bool, course: Path
) -> list[object]:
    """What a row says after the choice."""
    list(variants.write("cloth", name, seed, data=False))
    reference_data.build(name)
    if with_mistakes:
        list(mistakes.build(name))
        list(mutations.build(name))
    own = muslin.grade(paths.solution(name), name)
    stubs = muslin.grade(paths.assignment(name), name)
    published = muslin.grade(paths.solution("cloth"), name)
    assert own.simulation.status == "passed", own.simulation
    assert published.score == tables.kept(variants.draw(tables, seed)), published.score
    share = named(name) if with_mistakes else "-"
    return [f"{own.score:g}", f"{stubs.score:g}", f"{published.score:g}", simulated(name, course), share]


def simulated(name: str, course: Path) -> str:
    """Simulate `drape` with the variant's functions and draw it; how far from the framework's own element."""
    small = {"resolution": 16, "steps": 90, "dt": 1 / 120, "contact": "filter", "friction": 0.0}
    run = muslin.simulate("drape", functions=paths.solution(name), out=course / f"run-{name}", **small)
    beside = muslin.simulate("drape", energy=tasks.assignment(name).energy or None, **small)
    written = pictures.render_run(course / f"run-{name}", None, "none", None, None)
    assert any(path.suffix == ".png" and path.stat().st_size > 10_000 for path in written)
    early = 30
    apart = (
        abs(run.energies.total[:early] - beside.energies.total[:early]).max()
        / abs(beside.energies.total).max()
    )
    return f"drawn; energies within {apart:.0e}"


def named(name: str) -> str:
    """Share of the suite's mistakes, in this variant's convention, that the diagnosis names."""
    table, published = tasks.assignment(name), tasks.assignment("cloth")
    good = total = 0
    energy = () if not table.energy else tuple(energies.WAYS["green"])
    for task in published.tasks:
        inputs, expected = reference.cases(name, task)
        for wrong in suite.written(published.tasks[task]):
            if wrong.verdict != "wrong" or task in energy:  # those are about the published energy
                continue
            with tempfile.TemporaryDirectory() as folder:
                suite.submission(folder, {task: wrong})
                function = muslin.load(folder, published)[task]
                try:
                    got = evaluate(function, **wiring.to_called(table.tasks[task], inputs))
                except MuslinError:
                    continue
            answers = wiring.results_own(table.tasks[task], got if isinstance(got, tuple) else (got,))
            if all(np.allclose(a, b) for a, b in zip(answers, expected, strict=True)):
                continue
            total += 1
            found = diagnose(table.tasks[task], answers, expected, inputs, name)
            good += found is not None
            if found is None:
                print(f"{name}: {task}: not named: {wrong.name}", file=sys.stderr, flush=True)
    own = own_good = 0
    for task in energies.WAYS["green"]:
        for what, _, found in energies.diagnosed(name, task, OF_ENERGY):
            own, own_good = own + 1, own_good + energies.is_named(found)
            if not energies.is_named(found):
                print(f"{name}: {task}: not named: {what}", file=sys.stderr, flush=True)
    return f"{good} of {total}, {own_good} of {own}"


if __name__ == "__main__":
    words = [word for word in sys.argv[1:] if word != "--mistakes"]
    main(int(words[0]) if words else 10, "--mistakes" in sys.argv)
