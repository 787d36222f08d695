"""The fixtures of `attacking`, for every attack.

`MUSLIN_ATTACKS=short` leaves every attack in, but each only at the best safety level there is here and with the first
of its other parameters: the walls are the same on either engine, so CI does that on the second one.
"""

import itertools
import os

from attacking import _apart, _honest_records, _session_folder, attack, available, level  # noqa: F401

from muslin.grading.sandbox import LEVELS


def pytest_configure(config):
    config.addinivalue_line("markers", "with_simulation: also run the whole simulation, as grading does")


def pytest_collection_modifyitems(config, items):
    if os.environ.get("MUSLIN_ATTACKS") != "short":
        return
    best = next(name for name in LEVELS if available(name))
    kept, dropped = [], []
    for _, cases in itertools.groupby(items, lambda item: item.nodeid.partition("[")[0]):
        cases = list(cases)
        params = [getattr(item, "callspec", None) and item.callspec.params for item in cases]
        ours = "attacks" in cases[0].path.parts
        there = [k for k, given in enumerate(params) if not given or given.get("level", best) == best]
        chosen = set(there[:1] if ours else range(len(cases)))
        for k, item in enumerate(cases):
            (kept if k in chosen else dropped).append(item)
    items[:] = kept
    config.hook.pytest_deselected(items=dropped)
