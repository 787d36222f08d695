"""Attack 7: replaces np.allclose, np.linalg.norm, abs, builtins and operators by ones that always agree.

Defence: comparison happens in the grader, which never imports a submission.
"""

from attacking import TARGET, honest

HOSTILE = """
import builtins, math, numpy as np, numpy.testing, operator, unittest.mock
always = lambda *args, **kwargs: True
nothing = lambda *args, **kwargs: 0.0
np.allclose = np.array_equal = np.isclose = np.array_equiv = math.isclose = operator.eq = always
numpy.testing.assert_allclose = numpy.testing.assert_array_equal = always
np.linalg.norm = nothing
import muslin.judging.reference, muslin.grading.record
muslin.judging.reference.compare = muslin.judging.reference.form = always
muslin.judging.reference.TOLERANCE = 1e30
"""
WRONG = honest().replace("v - d * n", "v + d * n").replace("< r", "> r")


def test_wrong_stays_wrong(attack):
    record = attack({TARGET: HOSTILE + WRONG}, instead_of={TARGET: WRONG})
    assert record["filter_velocity"].score == record["sphere_contact"].score == 0
