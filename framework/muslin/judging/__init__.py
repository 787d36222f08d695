"""What is known of the tasks of an assignment: nothing here is about any assignment in particular.

An assignment's own files say how cases are drawn (`draws`) and what is true (`exact`), what must hold for every input
(`relations`, `properties`), what students get wrong, and more (`parts`). They are found by assignment and name
(`knowledge`) and put together (`judge`).
"""

from muslin.judging.judge import judge
from muslin.judging.parts import (
    Arrays,
    Ask,
    Case,
    Change,
    Derivative,
    Given,
    Inputs,
    Judge,
    Law,
    Line,
    Mistake,
    Outputs,
    Property,
    Rng,
    Seen,
    Terms,
    Tested,
    Way,
)

__all__ = [
    "Arrays",
    "Ask",
    "Case",
    "Change",
    "Derivative",
    "Given",
    "Inputs",
    "Judge",
    "Law",
    "Line",
    "Mistake",
    "Outputs",
    "Property",
    "Rng",
    "Seen",
    "Terms",
    "Tested",
    "Way",
    "judge",
]
