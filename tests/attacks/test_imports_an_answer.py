"""Attack 11, by import: calls whatever of Muslin can be imported where a submission is graded, in search of answers.

Muslin's own simulator computes much of what tasks ask for: shape functions, contacts, energies. Defences: nothing of it
answers a task as it is, and a worker that is graded sees of Muslin only what it needs to call one function.
"""

import functools
import types

import numpy as np
from attacking import TARGET, TASKS, honest, needs

from muslin.judging import reference
from muslin.tasks import form

#: Calls every function of some modules that takes as many arguments as a task, and compares.
SEARCH = '''
import importlib, inspect, pkgutil, sys, types
import numpy as np

def agrees(got, expected):
    got = got if isinstance(got, tuple) else (got,)
    if len(got) != len(expected):
        return False
    if any(np.shape(g) != e.shape for g, e in zip(got, expected)):
        return False
    return all(np.allclose(np.asarray(g, float), e, 1e-6, 1e-9) for g, e in zip(got, expected))

def stacked(call, inputs):
    rows = [call(*(a[k] for a in inputs)) for k in range(len(inputs[0]))]
    rows = [row if isinstance(row, tuple) else (row,) for row in rows]
    return tuple(np.stack(column) for column in zip(*rows))

def ways(function, inputs, expected, kinds):
    """Every sensible way to call a function on the samples of a task."""
    from muslin.base.engine.inside import is_function

    if is_function(function):
        from muslin.tasks.batch import evaluate
        names = list(inspect.signature(function).parameters)
        yield lambda: evaluate(function, results=kinds, **dict(zip(names, inputs)))
    elif getattr(function, "_is_wrapped_kernel", False):
        def into():
            results = tuple(np.zeros_like(e) for e in expected)
            function(*inputs, *results)
            return results
        yield into
    else:
        yield lambda: function(*inputs)
        yield lambda: stacked(function, inputs)
        yield lambda: tuple(r[:, 0] for r in stacked(function, [a[:, None] for a in inputs]))

def takes(function, count):
    try:
        parameters = list(inspect.signature(function).parameters.values())
    except (ValueError, TypeError):
        return False
    own = [p for p in parameters if p.kind in (p.POSITIONAL_ONLY, p.POSITIONAL_OR_KEYWORD)]
    return len([p for p in own if p.default is p.empty]) <= count <= len(own)

def functions(module):
    for name, thing in list(vars(module).items()):
        if not (str(getattr(thing, "__module__", "")).startswith("muslin.") or module.__name__ == "muslin.ours"):
            continue  # a library's, imported there
        if inspect.isclass(thing):
            things = {f"{name}.{n}": getattr(thing, n) for n in vars(thing) if callable(getattr(thing, n, None))}
        else:
            things = {name: thing}
        for name, function in things.items():
            if callable(function) and not inspect.isclass(function):
                yield name, function

def search(modules, cases):
    found, tried = set(), 0
    for module in modules:
        for name, function in functions(module):
            kernel = getattr(function, "_is_wrapped_kernel", False)
            for task, (inputs, expected, kinds) in cases.items():
                if not takes(function, len(inputs) + kernel * len(expected)):
                    continue
                for way in ways(function, inputs, expected, kinds):
                    tried += 1
                    try:
                        if agrees(way(), expected):
                            found.add(f"{module.__name__}.{name} answers {task}")
                    except BaseException:
                        pass
    return sorted(found), tried
'''
HOSTILE = """
import muslin
CASES = {task: ([np.array(a) for a in inputs], [np.array(e) for e in expected], kinds)
         for task, (inputs, expected, kinds) in GIVEN.items()}
ours = types.ModuleType("muslin.ours")
ours.shadow = lambda v, n: v - np.minimum((v * n).sum(axis=1), 0)[:, None] * n
ours.compiled = filter_velocity
modules = [muslin, ours]
for info in pkgutil.walk_packages(muslin.__path__, "muslin.", onerror=lambda name: None):
    try:
        modules.append(importlib.import_module(info.name))
    except BaseException:
        pass
modules += [m for name, m in list(sys.modules.items()) if name.startswith("muslin.") and m not in modules]
modules.remove(sys.modules["muslin.grading.worker"])  # what runs this: called with numbers, it closes its own files
found, tried = search(modules, CASES)
print("MODULES", len(modules), "TRIED", tried)
for one in found:
    print("FOUND", one)
"""


@functools.cache
def cases():
    """A few public cases of every task."""
    chosen = {}
    for name, task in TASKS.items():
        inputs, expected = reference.cases("cloth", name)
        kinds = tuple(value.kind for value in task.results)
        chosen[name] = [a[:8] for a in inputs.values()], [e[:8] for e in expected], kinds
    return chosen


def test_the_search_finds_what_is_in_the_open_and_the_simulator_is_no_answer():
    from muslin.physics import colliders, skinning

    open_ = types.ModuleType("muslin.ours")
    open_.filtered = lambda v, n: v - np.minimum((v * n).sum(axis=1), 0)[:, None] * n
    open_.one = lambda F: F.T @ F
    scope = {}
    exec(SEARCH, scope)
    found, tried = scope["search"]([colliders, skinning, open_], cases())
    assert found == [
        "muslin.ours.filtered answers filter_velocity",
        "muslin.ours.one answers right_cauchy_green",
    ]
    assert tried > 10
    assert all(form(kind) for _, _, kinds in cases().values() for kind in kinds)


def test_nothing_that_can_be_imported_answers_a_task(attack, level):
    given = {
        name: ([a.tolist() for a in inputs], [e.tolist() for e in expected], kinds)
        for name, (inputs, expected, kinds) in cases().items()
    }
    hostile = honest() + SEARCH + HOSTILE.replace("GIVEN", repr(given))
    record = attack({TARGET: hostile}, level=level, deadline=120)
    needs(record, "solution and hidden data out of sight")
    told = record["sphere_contact"].output
    assert int(told.split("TRIED")[1].split()[0]) > 10
    found = [line.removeprefix("FOUND ") for line in told.splitlines() if line.startswith("FOUND")]
    assert found == [
        "muslin.ours.compiled answers filter_velocity",
        "muslin.ours.shadow answers filter_velocity",
    ]
