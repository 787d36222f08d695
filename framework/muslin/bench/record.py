"""What a benchmark leaves: ratios of times, with their spread. Higher is better.

A record as JSON::

    {"version": 3, "kind": "2 cores, GenuineIntel 6-207, AVX-512", "busy": false,
     "ratios": {"100x100 native, speed against C++ (CPU)": {"median": 3.1, "low": 2.9, "high": 3.3}, ...}}

It names no machine and no date: only what was divided by what, and the kind of processor, since a ratio of two
programs is not the same on every kind (a compiler fills wide vectors in one of them and not in the other).
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from muslin.base.errors import MuslinError

VERSION = 3

#: A ratio has regressed if a step costs more than this many times what was recorded.
REGRESSED = 1.2

#: Ends the names of ratios of Muslin with itself, which every kind of processor should agree on.
WITH_ITSELF = "against native (CPU)"


@dataclass(frozen=True)
class Ratio:
    """How many times faster than a reference: median, lowest and highest of the rounds."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, rounds: np.ndarray) -> Ratio:
        """From the ratio of each round."""
        return cls(*(float(f"{float(f(rounds)):.4g}") for f in (np.median, np.min, np.max)))

    def __str__(self) -> str:
        return f"{self.median:.3g} ({self.low:.3g}-{self.high:.3g})"


@dataclass
class Record:
    """Ratios by name, whether the machine was busy with something else, and its kind of processor."""

    ratios: dict[str, Ratio] = field(default_factory=dict)
    busy: bool = False
    kind: str = ""

    def save(self, path: Path) -> None:
        """Write it as JSON."""
        ratios = {name: vars(ratio) for name, ratio in self.ratios.items()}
        head = {"version": VERSION, "kind": self.kind, "busy": self.busy}
        text = json.dumps(head | {"ratios": ratios}, indent=1)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text + "\n", encoding="utf-8")

    def or_better(self, other: Record) -> Record:
        """Each ratio from the measurement in which it was better: what a disturbance cost is no cost of the code."""
        ratios = dict(self.ratios)
        for name, ratio in other.ratios.items():
            if name not in ratios or ratio.median > ratios[name].median:
                ratios[name] = ratio
        return Record(ratios, self.busy and other.busy, self.kind)

    @classmethod
    def load(cls, path: Path) -> Record:
        """Read one back.

        Raises
        ------
        MuslinError
            If the file is missing or no record.
        """
        try:
            read = json.loads(path.read_text(encoding="utf-8"))
            if read["version"] != VERSION:
                raise ValueError(f"version {read['version']}")
            ratios = {
                str(name): Ratio(*(float(r[key]) for key in ("median", "low", "high")))
                for name, r in read["ratios"].items()
            }
            return cls(ratios, bool(read.get("busy", False)), str(read.get("kind", "")))
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise MuslinError(
                f"{path} is not a record of `muslin bench`: {error}.",
                "Write one with: muslin bench --out FILE",
            ) from None


@dataclass(frozen=True)
class Regression:
    """A ratio that fell by more than `REGRESSED`."""

    name: str
    recorded: Ratio
    now: Ratio

    @property
    def cost(self) -> float:
        """Cost now, relative to the recorded one."""
        return self.recorded.median / self.now.median

    def __str__(self) -> str:
        overlap = "" if self.now.high < self.recorded.low else "; the spreads overlap, so measure again"
        return f"{self.name}: {self.now}, recorded {self.recorded}: {self.cost:.2f} times the cost{overlap}"


def compare(now: Record, recorded: Record) -> tuple[list[Regression], list[str]]:
    """Which ratios regressed, and which could not be compared.

    Wall times of a busy machine say nothing about the code: they are not compared. Nor is, on another kind of
    processor, what was measured against another program: only Muslin against itself.

    Returns
    -------
    regressions : list of Regression
    left_out : list of str
        Names of recorded ratios that were not compared, and why.
    """
    regressions, left_out = [], []
    for name, before in recorded.ratios.items():
        here = now.ratios.get(name)
        if here is None:
            left_out.append(f"{name}: not measured now")
        elif name.endswith("(wall)") and (now.busy or recorded.busy):
            left_out.append(f"{name}: the machine {'is' if now.busy else 'was'} busy with something else")
        elif now.kind != recorded.kind and not name.endswith(WITH_ITSELF):
            left_out.append(f"{name}: recorded on another kind of processor")
        elif here.median * REGRESSED < before.median:
            regressions.append(Regression(name, before, here))
    return regressions, left_out
