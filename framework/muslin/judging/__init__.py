"""What is known of the tasks of an assignment: nothing here is about any assignment in particular.

An assignment's own files say how cases are drawn (`draws`) and what is true (`exact`), what must hold for every input
(`relations`, `properties`), what students get wrong, and more (`judge`). They are found by assignment and name.
"""

from muslin.judging.judge import Derivative, Judge, Law, Line, Mistake, Property, judge

__all__ = ["Derivative", "Judge", "Law", "Line", "Mistake", "Property", "judge"]
