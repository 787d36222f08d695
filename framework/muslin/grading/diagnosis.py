"""Which mistake does a wrong answer look like?

The arrays that came are compared with what known mistakes make of the right ones, the plainest first: the
whole answer transformed (`TRANSFORMS`), mistakes known from students (`KNOWN`), a factor made of the sizes of
the inputs, the right answer to changed inputs (`changes`), then the same in a part of the answer (a row, a
component) or in some of the cases (`conditions`). Nothing here knows a formula of a solution: where a right
answer is needed it comes from the reference data or from `muslin.authoring.truth`.

Runs in the grader's parent process, on plain arrays.
"""

from __future__ import annotations

import itertools
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any

import numpy as np

from muslin.authoring import truth as tr
from muslin.grading.phrases import KNOWN_WORDS, OVERRIDES, WORDS
from muslin.reference import TOLERANCE, natural_scale
from muslin.tasks import Task
