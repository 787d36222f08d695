"""Attack 14, in depth: answers that are legal frames and no answers, to whoever asks: checks, properties or laws.

A header nested so deep that a recursion over it ends the grader, several results where one is asked, a small array
whose shape broadcasts to gigabytes. Defence: depth, number, shapes and types are checked where an answer comes in; and
should judging fail all the same, that is the verdict of one task.
"""

import pytest
from attacking import BYSTANDER, LEVEL, TARGET, TASKS, honest, public_sizes

from muslin.grading import checks

DEEP = """
import json
from muslin.grading import wire
real = wire.send
def send(channel, header, *rest):
    if header.get("id") == "ready" or "failures" in header:
        return real(channel, header, *rest)
    head = json.dumps({"id": header["id"], "arrays": []})[:-1] + ', "x": ' + "[" * 700 + "]" * 700 + "}"
    channel.sendall(wire._LENGTHS.pack(len(head), len(head)) + head.encode())
wire.send = send
"""
#: Right on the public cases, and on the properties; otherwise it answers the laws.
LAWS = """
import numpy as np
from muslin.tasks import batch
real = batch.evaluate
def evaluate(function, **arrays):
    got = real(function, **arrays)
    n = len(next(iter(arrays.values())))
    if function.__name__ == NAME and n == COUNT:
        return ANSWER
    return got
batch.evaluate = evaluate
"""
#: The triangles of the cloth that laws are asked on, and the states it is in.
TRIANGLES, STATES = 32, 11
ANSWERS = {
    "a tuple": ("strain_energy.py", "psi", TRIANGLES * STATES, "(got, got)"),
    "a shape that broadcasts": (
        "shape_functions.py", "interpolate", 3 * TRIANGLES, "np.zeros((5_000_000, 12, 1, 1), dtype=np.uint8)",
    ),
    "a string": ("strain_energy.py", "psi", TRIANGLES * STATES, "np.full(n, 'x')"),
    "integers": ("strain_energy.py", "psi", TRIANGLES * STATES, "np.ones(n, dtype=np.int64)"),
    "not finite": ("strain_energy.py", "psi", TRIANGLES * STATES, "np.full(n, np.nan)"),
    "huge": ("strain_energy.py", "psi", TRIANGLES * STATES, "np.full(n, 1e308)"),
}  # fmt: skip


def test_a_header_nested_deep_costs_its_own_file(attack, level):
    record = attack({TARGET: DEEP + honest()}, level=level)
    for name in ("sphere_contact", "filter_velocity"):
        assert record[name].status == "error"
        assert "something else than the arrays" in record[name].message


@pytest.mark.with_simulation
@pytest.mark.parametrize("what", ["a tuple", "a shape that broadcasts"])
def test_what_laws_did_not_ask_for_fails_the_law_on_every_level(attack, what, level):
    _fails_the_law_and_nothing_else(attack, what, level)


@pytest.mark.with_simulation
@pytest.mark.parametrize("what", sorted({*ANSWERS} - {"a tuple", "a shape that broadcasts"}))
def test_what_laws_did_not_ask_for_fails_the_law_and_nothing_else(attack, what):
    _fails_the_law_and_nothing_else(attack, what, LEVEL)


def _fails_the_law_and_nothing_else(attack, what, level):
    file, name, count, answer = ANSWERS[what]
    assert count not in public_sizes()
    hostile = LAWS.replace("NAME", repr(name)).replace("COUNT", str(count)).replace("ANSWER", answer)
    spoiled = tuple(task for task in TASKS if TASKS[task].file == file)
    files = {file: honest(file) + hostile, "deformation_gradient.py": honest("deformation_gradient.py")}
    files |= {"shape_functions.py": files.get("shape_functions.py", honest("shape_functions.py"))}
    files |= {"strain_energy.py": files.get("strain_energy.py", honest("strain_energy.py"))}
    files |= {"stress.py": honest("stress.py")}
    record = attack(files, spoils=spoiled, level=level)
    assert record[name].status == "passed"
    failed = [check for check in record.simulation.checks if check.status == "failed"]
    assert failed, "the answer was not noticed"
    assert record.simulation.status == "failed"
    assert len(record.simulation.positions) > 0


@pytest.mark.parametrize("error", [MemoryError(), RecursionError(), ZeroDivisionError()])
def test_judging_that_fails_is_the_verdict_of_one_task(attack, monkeypatch, tmp_path, error):
    compare = checks.reference.compare

    def failing(task, *rest):
        found = compare(task, *rest)
        if task.name == "filter_velocity" and not found.ok:  # the honest one is compared, too
            raise error
        return found

    monkeypatch.setattr(checks.reference, "compare", failing)
    wrong = honest().replace("v - d * n", "v + d * n")
    record = attack({TARGET: wrong}, instead_of={TARGET: honest()})
    assert record["filter_velocity"].status == "failed"
    assert type(error).__name__ in record["filter_velocity"].message
    assert record["filter_velocity"].score == 0
    assert record["sphere_contact"].status == record["kinetic_energy"].status == "passed"
    assert BYSTANDER == "kinetic_energy.py"
