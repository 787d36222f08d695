"""Which functions of an installed Muslin answer a task: every one is called with a task's public cases.

    python -I tests/answers_in.py FOLDER ASSIGNMENT [TASK ...]

FOLDER is where Muslin is installed. The files of `practice/` are tried too, of every assignment: they ship as data. A
function is called with the inputs as they are, with points of a kind as one array (x0, x1, x2 as one of triangles), and
with all of them as a dictionary; of a dictionary that it gives, every value is an answer. Prints, as JSON, the tasks
that were tried with how many functions, what could not be imported, and `module.function` of each that answers.
"""

from __future__ import annotations

import contextlib
import copy
import importlib
import inspect
import io
import json
import os
import pkgutil
import re
import signal
import sys
import types

folder, assignment, *wanted = sys.argv[1:]
sys.path.insert(0, folder)

import numpy as np  # noqa: E402

import muslin  # noqa: E402
from muslin import tasks  # noqa: E402
from muslin.base import paths  # noqa: E402
from muslin.judging import knowledge, reference  # noqa: E402
from muslin.tasks import batch  # noqa: E402

assert muslin.__file__.startswith(folder), muslin.__file__

#: Rooms whose functions start processes, read and write files, or wait for somebody: no place for a formula.
NOT_CALLED = (
    "base",
    "cli",
    "doctor",
    "bench",
    "packing",
    "classes",
    "viewer",
    "student",
    "notebook",
    "grading",
    "export",
)

#: Tasks that the product of two arrays answers, once their points are one array: what multiplies is no answer.
PRODUCTS = ("interpolate", "deformation_gradient")

#: How long one call may take [s].
LIMIT = 5


def modules():
    """Every module that can be imported, those of `practice/` among them, and why others cannot."""
    found, failed = [], {}
    for name in paths.assignments():
        ours = [m for m in knowledge.modules(name) if m.__name__.startswith("muslin_practice_")]
        assert ours, f"{name} has no practice/"
        found += ours
    for info in pkgutil.walk_packages(muslin.__path__, "muslin.", onerror=lambda name: None):
        if info.name.rsplit(".", 1)[-1] == "__main__":
            continue
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                found.append(importlib.import_module(info.name))
        except BaseException as error:
            failed[info.name] = f"{type(error).__name__}: {error}"
    return found, failed


def functions(found):
    """Every function of those modules once, static methods of classes included, by name."""
    seen, known = set(), {}
    for module in found:
        if module.__name__.split(".")[1] in NOT_CALLED:
            continue
        for holder in [
            module,
            *(c for c in vars(module).values() if inspect.isclass(c) and c.__module__ == module.__name__),
        ]:
            for name, value in vars(holder).items():
                value = value.__func__ if isinstance(value, (staticmethod, classmethod)) else value
                if isinstance(value, (tuple, list, dict)):
                    values = value.values() if isinstance(value, dict) else value
                    inside = [v for v in values if isinstance(v, types.FunctionType)]
                else:
                    inside = [value]
                for one in inside:
                    ours = isinstance(one, types.FunctionType) and one.__module__.startswith("muslin")
                    if ours and id(one) not in seen:
                        seen.add(id(one))
                        inside_class = "" if holder is module else f".{holder.__name__}"
                        known[f"{module.__name__}{inside_class}.{name}"] = one
    return known


def fits(function, count):
    """Whether it can be called with so many arguments by position."""
    try:
        inspect.signature(function).bind(*range(count))
    except (TypeError, ValueError):
        return False
    return True


def right(result, expected):
    """Whether it is the answer, batched or of the first sample."""
    got = result if isinstance(result, tuple) else (result,)
    if len(got) != len(expected):
        return False
    for one, value in zip(got, expected, strict=True):
        try:
            one = np.asarray(one, dtype=float)
        except (TypeError, ValueError):
            return False
        if one.shape != value.shape or not np.allclose(
            one, value, 1e-7, 1e-9 * np.abs(value[np.isfinite(value)]).max(initial=0)
        ):
            return False
    return True


def too_long(*_):
    raise TimeoutError


def answers(function, task, inputs, expected):
    """Whether a function answers a task: called with arrays of cases, with single cases, or from a kernel."""
    if getattr(function, "_is_taichi_function", False) or getattr(function, "_is_quadrants_function", False):
        names = tuple(inspect.signature(function).parameters)
        if len(names) != len(task.inputs):
            return False
        arrays = {name: inputs[value.name] for name, value in zip(names, task.inputs, strict=True)}
        kinds = tuple(value.kind for value in task.results)
        try:
            return right(batch.evaluate(function, results=kinds, **arrays), expected)
        except BaseException:
            return False
    for arguments in ways(task, inputs):
        if not fits(function, len(arguments)):
            continue
        single = [one(value) for value in arguments]
        for given, answer in ((arguments, expected), (single, [value[0] for value in expected])):
            try:
                got = function(*copy.deepcopy(given))
            except BaseException:
                continue
            found = got.values() if isinstance(got, dict) else (got,)
            if any(right(value, answer) for value in found):
                return True
    return False


def ways(task, inputs):
    """What a function may be called with: the inputs; points of a kind as one array; all in a dictionary."""
    yield [inputs[value.name] for value in task.inputs]
    kinds: dict = {}
    for value in task.inputs:
        kind = re.sub(r"\d+$", " of several", value.name)
        kinds.setdefault(kind, []).append(inputs[value.name])
    if len(kinds) < len(task.inputs) and task.name not in PRODUCTS:
        yield [np.stack(arrays, axis=1) if len(arrays) > 1 else arrays[0] for arrays in kinds.values()]
    yield [dict(inputs)]


def one(value):
    """The first sample of what is in an argument."""
    if isinstance(value, dict):
        return {name: one(array) for name, array in value.items()}
    return value[0] if not np.ndim(value[0]) else np.array(value[0])


def telling(inputs, expected):
    """Cases whose answers are no zeros and not one of the inputs."""
    count = len(expected[0])
    told = [k for k in range(count) if all(np.abs(value[k]).sum() > 1e-9 for value in expected)]
    return (
        ({name: value[told[:7]] for name, value in inputs.items()}, [value[told[:7]] for value in expected])
        if told
        else None
    )


def called(candidates, task, case):
    """Which of the candidates answer the task; those that end the process they are called in do not."""
    hits, begin = [], 0
    while begin < len(candidates):
        ours, theirs = os.pipe()
        if not (child := os.fork()):
            sink = io.StringIO()
            os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
            for k in range(begin, len(candidates)):
                os.write(theirs, f"{k}\n".encode())
                with contextlib.redirect_stdout(sink), contextlib.redirect_stderr(sink):
                    signal.alarm(LIMIT)
                    given = answers(candidates[k][1], task, *case)
                    signal.alarm(0)
                if given:
                    os.write(theirs, f"{k} answers\n".encode())
            os._exit(0)
        os.close(theirs)
        with os.fdopen(ours, encoding="ascii") as pipe:
            lines = pipe.read().split("\n")[:-1]
        os.waitpid(child, 0)
        hits += [candidates[int(line.split()[0])][0] for line in lines if line.endswith("answers")]
        begin = int(lines[-1].split()[0]) + 1 if lines else begin + 1
    return hits


found, failed = modules()
known = functions(found)
os.chdir("/")
signal.signal(signal.SIGALRM, too_long)
report: dict = {"failed": failed, "functions": len(known), "tried": {}, "answers": {}}
for name, task in tasks.assignment(assignment).tasks.items():
    if (wanted and name not in wanted) or task.in_python:
        continue
    inputs, expected = reference.cases(assignment, name)
    case = telling(inputs, [np.asarray(value) for value in expected])
    candidates = [
        (where, function)
        for where, function in known.items()
        if any(fits(function, len(arguments)) for arguments in ways(task, case[0]))
    ]
    report["tried"][name] = len(candidates)
    if hits := called(candidates, task, case):
        report["answers"][name] = hits
print(json.dumps(report))
