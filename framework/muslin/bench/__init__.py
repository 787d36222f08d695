"""`muslin bench`: what a step, a picture and a check cost here, beside C++ and what the machine could do at best.

- `candidates`  the scene measured, who simulates it (ours, C++), and how they take turns
- `everyday`    what a person waits for: a picture, a check
- `roofline`    what the machine could do at best: bytes over bandwidth, flops over peak
- `record`      ratios with their spread, as a file; which of them regressed
- `bench`       all of it, within a time, as lines to read

A time alone says more about the machine than about the code, so what is recorded and compared are ratios of
times taken in turns in one run: how many times faster than a reference, higher is better.
"""

from muslin.bench.bench import measure, read
from muslin.bench.record import Ratio, Record, compare

__all__ = ["Ratio", "Record", "compare", "measure", "read"]
