"""Properties of a task's function: inputs drawn for them, and how well each holds.

The parent draws inputs (`draw`), the child evaluates the student's function on them, the parent judges the outputs
(`judge`). Nothing here needs Taichi or an expected value.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence

import numpy as np

from muslin.judging.judge import judge as judge_of
from muslin.judging.parts import Arrays, Given, Outputs, Property
from muslin.tasks.authored import AuthorError

#: What is raised where what a function answered cannot be computed with, though it has the right shape;
#: an `IndexError`, too, where it is an index.
OF_VALUES = (ArithmeticError, np.linalg.LinAlgError)


def draw(assignment: str, task: str, seed: str) -> tuple[tuple[Property, Arrays], ...]:
    """Properties of a task, each with inputs drawn from a stream of its own.

    Parameters
    ----------
    assignment, task : str
        Which task; one without properties gives an empty tuple.
    seed : str
        What the streams are drawn from: the same seed gives the same bytes.

    Returns
    -------
    tuple of (Property, dict of ndarray (b, ...))
    """
    drawn = []
    for prop in judge_of(assignment, task).properties:
        digest = hashlib.sha256(f"{seed}/{assignment}/{task}/{prop.name}".encode()).digest()
        rng = np.random.Generator(np.random.PCG64(int.from_bytes(digest, "little")))
        inputs = {
            name: np.ascontiguousarray(array, dtype=np.int32 if array.dtype.kind == "i" else np.float64)
            for name, array in prop.inputs(rng).items()
        }
        drawn.append((prop, inputs))
    return tuple(drawn)


def judge(prop: Property, inputs: Given, outputs: Outputs) -> float:
    """Worst relative error of a property; infinite where anything is not finite.

    Parameters
    ----------
    prop : Property
    inputs : dict of ndarray, (b, ...)
        As drawn.
    outputs : tuple of ndarray, (b, ...)
        What the function made of them, of the shapes the task table says.

    Returns
    -------
    float
        The property holds if it is at most `prop.tolerance`.
    """
    return float(errors(prop, inputs, outputs).max(initial=0.0))


def errors(prop: Property, inputs: Given, outputs: Outputs) -> np.ndarray:
    """Relative error of each sample of a property, or of each group of samples, (k,); infinite if not finite.

    Answers that cannot be computed with break a property; where the property itself is wrong, its author is told.

    Parameters
    ----------
    prop, inputs, outputs
        As `judge` takes them.
    """
    finite = [np.isfinite(output.reshape(len(output), -1)).all(axis=1) for output in outputs]
    if not np.all(finite):
        return np.where(np.all(finite, axis=0), 0.0, np.inf)
    try:
        with np.errstate(all="ignore"):
            found = prop.judge(inputs, outputs)
    except AuthorError as error:
        if isinstance(error.raised, OF_VALUES) or type(error.raised) is IndexError:  # no axis too many
            return np.full(len(outputs[0]), np.inf)
        raise
    return np.where(np.isfinite(found), found, np.inf)


def batch(drawn: Sequence[Given]) -> Arrays:
    """Several draws as one batch, so that a function is launched once."""
    return {name: np.concatenate([inputs[name] for inputs in drawn]) for name in drawn[0]}


def apart(results: Outputs, drawn: Sequence[Given]) -> list[Outputs]:
    """Results of a batch, draw by draw again."""
    ends = np.cumsum([len(next(iter(inputs.values()))) for inputs in drawn])
    return [tuple(r[a:b] for r in results) for a, b in zip([0, *ends[:-1]], ends, strict=True)]
