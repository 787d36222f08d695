"""Attack 13: ndarray and number subclasses that agree with everything.

Defence: results are raw bytes of a plain type; there is no subclass on the other side.
"""

from attacking import TARGET, honest

HOSTILE = """
import numpy as np
from muslin.tasks import batch

class Liar(np.ndarray):
    def __eq__(self, other): return np.ones(np.shape(other), bool)
    def __sub__(self, other): return np.zeros(np.shape(other))
    __rsub__ = __sub__
    def __array_ufunc__(self, ufunc, method, *inputs, **kwargs): return np.zeros(())
    def __array_function__(self, func, types, args, kwargs): return True
    shape = property(lambda self: (10**6,))

real = batch.evaluate
def lying(function, **arrays):
    got = real(function, **arrays)
    return tuple(np.zeros_like(g).view(Liar) for g in got) if isinstance(got, tuple) else np.zeros_like(got).view(Liar)
batch.evaluate = lying
"""


def test_lies_do_not_cross_the_wire(attack):
    record = attack({TARGET: HOSTILE + honest()})
    assert record["sphere_contact"].score == record["filter_velocity"].score == 0


def test_lying_numbers_in_taichi(attack):
    hostile = """
class Liar(float):
    def __eq__(self, other): return True
    def __sub__(self, other): return 0.0
"""
    lied = honest().replace("return v_new", "return v_new * Liar(2.0)")
    record = attack({TARGET: hostile + lied}, instead_of={TARGET: honest()})
    assert record["filter_velocity"].score == 0
