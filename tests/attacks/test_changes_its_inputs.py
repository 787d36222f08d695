"""Attack 17: writes into its inputs, or returns an input, so that comparison meets what it changed itself.

Defence: inputs are copies sent to another process; the grader compares with its own.
"""

from attacking import TARGET, honest

HOSTILE = """
import numpy as np
from muslin.tasks import batch
real = batch.evaluate
def changing(function, **arrays):
    for array in arrays.values():
        array.setflags(write=True)
        array[...] = 0
    return arrays["v"] if "v" in arrays else (np.zeros(len(arrays["x"]), np.int32), arrays["x"])
batch.evaluate = changing
"""


def test_inputs_are_copies(attack):
    record = attack({TARGET: HOSTILE + honest()})
    assert record["sphere_contact"].score == record["filter_velocity"].score == 0
