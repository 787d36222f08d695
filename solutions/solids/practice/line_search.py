"""newton: what a student's `newtons_method` does, told from what it asks the functions it is given, in order."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from muslin.judging import Seen, Way

from .steps import ROUNDING, along, falls, multiple, near, part, same, to

#: Share of what the slope promises that is enough; a step too short to be judged, relative; part of the step by which a
#: line search may have given up.
ENOUGH, SHORT, TINY = 1e-4, 1e-6, 1e-5


def watched_newtons_method(way: Way) -> Iterator[Seen]:
    """Where it leaves Newton's way, in order of time; the first says most."""
    yield from _Walk(way).told()


class _Walk:
    """One run: where x is, which parts of the step d have been tried from there, and how many steps have been taken."""

    def __init__(self, way: Way) -> None:
        self.way, given = way, way.given
        self.objective, self.gradient, self.hessian = (given[k] for k in ("objective", "gradient", "hessian"))
        self.tolerance, self.most = given["tolerance"], given["most_steps"]
        self.past: list[np.ndarray] = []
        self.steps, self.lines, self.part = 0, {"": 0}, 1.0
        self._stand(np.array(given["x"], dtype=np.float64))

    def _stand(self, x: np.ndarray) -> None:
        """Be at x: what is right there."""
        self.x, self.solves = x, 0
        self.tried: list[tuple[float, int]] = []
        self.fresh = {"gradient": False, "hessian": False}
        self.f, self.g, self.H = self.objective(x), self.gradient(x), self.hessian(x)
        try:
            self.d = np.linalg.solve(self.H, -self.g)
        except np.linalg.LinAlgError:
            self.d = np.full_like(x, np.nan)
        self.slope = self.g @ self.d

    @property
    def judged(self) -> bool:
        """Whether steps from here are so long that what is right about them can be told."""
        size = float(np.linalg.norm(self.d))
        return bool(np.isfinite(size) and size > SHORT * (1 + np.linalg.norm(self.x)))

    def told(self) -> Iterator[Seen]:
        """All there is to say."""
        for name, arguments, _answer, line in self.way.asked:
            self.lines[name] = line
            if name == "solve":
                yield from self._solved(*arguments[:2], line)
                continue
            point = np.asarray(arguments[0], dtype=np.float64)
            if point.shape != self.x.shape:
                yield Seen("shape", line, f"{name} is asked at something that is no point like x", "")
                return
            if not self.judged:
                if (
                    np.linalg.norm(self.g) > self.tolerance
                    and near(point, self.x + self.d)
                    and name != "objective"
                ):
                    self._move(point, 1.0)
                elif name in self.fresh and same(point, self.x):
                    self.fresh[name] = True
                continue
            if name == "objective":
                found = self._looked(point, line)
            else:
                found = self._went(name, point, line)
            yield from found
        yield from self._ended()

    def _offset(self, point: np.ndarray) -> float | None:
        """The s of a point x + s d; None if it is none."""
        if not np.isfinite(point).all():
            return np.inf if self.tried and self.tried[-1][0] > 1 else None
        s = float((point - self.x) @ self.d / (self.d @ self.d))
        size = np.abs(point).max() + np.abs(self.x).max()
        near = np.abs(point - self.x - s * self.d).max() <= ROUNDING * (size + abs(s) * np.abs(self.d).max())
        if not near:
            return None
        return float(round(s, 9)) if abs(s) > 1e-3 else s

    def _solved(self, A: Any, b: Any, line: int) -> Iterator[Seen]:
        """What a linear system is made of."""
        A, b = np.asarray(A), np.asarray(b)
        if not self.judged or A.shape != self.H.shape or b.shape != self.x.shape:
            return
        x = "this x" if self.steps else "x"
        self.solves += 1
        if self.solves == 3:
            words = f"in step {self.steps + 1}, the same system is solved again: x has not moved"
            yield Seen("stays", line, words, "x + t d is the new x: keep it, and begin the next step there.")
        if not same(b, self.g) and not same(b, -self.g):
            old = [p for p in self.past if same(abs(b), abs(self.gradient(p)))]
            if old and not same(old[-1], self.x):
                yield Seen(
                    "old gradient",
                    self.lines.get("gradient", line),
                    f"the gradient used in step {self.steps + 1} is that of an earlier x, not asked again at this one",
                    "Each step needs gradient(x) at its own x: ask within the loop, after x has moved.",
                )
            elif (times := multiple(b, self.g)) is not None:
                yield Seen(
                    "right side",
                    line,
                    f"solve is given {times:.4g} times the gradient; -g is meant",
                    "H d = -g.",
                )
            else:
                yield Seen(
                    "right side",
                    line,
                    f"the right side that solve is given is not -g, the gradient at {x}",
                    "H d = -g.",
                )
        if not same(A, self.H):
            old = [p for p in self.past if same(A, self.hessian(p))]
            if old:
                yield Seen(
                    "old hessian",
                    self.lines.get("hessian", line),
                    f"the Hessian used in step {self.steps + 1} is that of an earlier x, not asked again at this one",
                    "Each step needs hessian(x) at its own x: ask within the loop.",
                )
            else:
                yield Seen(
                    "matrix", line, f"the matrix that solve is given is not the Hessian at {x}", "H d = -g."
                )

    def _looked(self, point: np.ndarray, line: int) -> Iterator[Seen]:
        """The objective is asked somewhere."""
        if same(point, self.x):
            return
        s = self._offset(point)
        if s is not None:
            self.tried.append((s, line))
        else:
            yield from self._astray(point, line, "the objective is asked at")

    def _astray(self, point: np.ndarray, line: int, what: str) -> Iterator[Seen]:
        """A point that does not lie on the way x + t d."""
        advice = "From x, all points to try are x + t d, with t = 1, 1/2, 1/4 ..."
        size = float(point @ self.d / (self.d @ self.d)) if np.isfinite(point).all() else 0.0
        if not np.isfinite(point).all():
            words = f"{what} a point that is not finite"
        elif size and near(point, size * self.d):
            words = f"{what} {part(size)}d, and not at {to(size)}: x is not added"
        elif size := multiple(point - self.x, self.g) or 0.0:
            words = f"{what} a point along the gradient from x, not along d = solve(H, -g)"
        elif any(same(point, p) for p in self.past):
            words = f"{what} an earlier x, not at the one that has been reached"
        elif self.past and along(point - self.past[-1], self.d):
            words = f"{what} a point that is d away from an earlier x, not from the one that has been reached"
        else:
            words = f"{what} a point that does not lie on x + t d, the way from x in Newton's direction"
        yield Seen("astray", line, words, advice)

    def _went(self, name: str, point: np.ndarray, line: int) -> Iterator[Seen]:
        """Gradient or Hessian are asked somewhere: at x, or where it has gone."""
        if same(point, self.x):
            self.fresh[name] = True
            return
        if any(same(point, p) for p in self.past):
            return  # `_solved` says what comes of it
        s = self._offset(point)
        if s is None:
            yield from self._astray(point, line, "x goes to")
        else:
            yield from self._chosen(s, line)
        self._move(point, s if s is not None else 1.0)
        self.fresh[name] = True

    def _move(self, point: np.ndarray, s: float) -> None:
        self.past.append(self.x)
        self.steps, self.part = self.steps + 1, s
        self._stand(point)

    def _falls(self, s: float) -> float:
        """By which share of what the slope promises the objective falls at x + s d; NaN where rounding hides it."""
        there = self.objective(self.x + s * self.d) if np.isfinite(s) else np.inf
        if not np.isfinite(there):
            return -np.inf
        if abs(there - self.f) <= 1e-13 * max(abs(self.f), abs(there)):
            return np.nan
        return float((self.f - there) / (-s * self.slope)) if s > 0 else float(np.sign(self.f - there))

    def _chosen(self, end: float | None, line: int) -> Iterator[Seen]:
        """Which parts of the step were tried, which was taken; `end` is None where none was, for the run had no end."""
        tried = list(self.tried)
        shares = [self._falls(s) for s, _ in tried]
        if len(tried) > 1 and tried[-1][0] == end and any(share >= ENOUGH for share in shares[:-1]):
            tried, shares = tried[:-1], shares[:-1]  # it is the x of the next step that is asked there
        which = f"in step {self.steps + 1}, "
        if not tried and end is not None:
            share = self._falls(end)
            if not share >= ENOUGH and not np.isnan(share):
                yield Seen(
                    "untried",
                    line,
                    f"{which}x goes untried to {to(end)}, where the objective {falls(share)}",
                    "Compare the objective there with the one here; while it has not fallen enough, halve the step.",
                )
            elif end != 1 and not np.isnan(share):
                yield Seen(
                    "untried",
                    line,
                    f"{which}x goes to {to(end)}: the whole step, x + d, was not tried",
                    "Try the whole step first.",
                )
            return
        same = 0
        for k, (s, at) in enumerate(tried):
            before = tried[k - 1][0] if k else None
            same = same + 1 if s == before else 0
            if s == before and same < 3:
                continue
            yield from self._tried(k, s, before, same, at, which)
            if end is not None and s == end and shares[k] >= ENOUGH:
                return
            if shares[k] >= ENOUGH and (end is None or s != end):
                rest = (
                    f"x goes on to {to(end)}"
                    if end is not None and k + 1 == len(tried)
                    else "the search goes on"
                )
                yield Seen(
                    "refused",
                    at,
                    f"{which}at {to(s)} the objective falls by {shares[k]:.2g} of the promise: enough, yet {rest}",
                    "The next x is the first x + t d whose objective is at most objective(x) + 1e-4 t g^T d.",
                )
                return
            last = k + 1 == len(tried)
            if s == end and not np.isnan(shares[k]) and tried[-1][0] > TINY and last:
                tries = f"after {len(tried)} tries " if len(tried) > 1 else ""
                yield Seen(
                    "taken",
                    at,
                    f"{which}{tries}{to(s)} is taken, where the objective {falls(shares[k])}",
                    "Enough is objective(x) + 1e-4 t g^T d; g^T d is negative: that is below objective(x).",
                )
                return
        if end is not None and end not in [s for s, _ in tried] and not np.isnan(self._falls(end)):
            yield Seen(
                "untried",
                line,
                f"{which}x goes to {to(end)}, which was not tried; {to(tried[-1][0])} was, at last",
                "Go to the very point that was found good enough.",
            )

    def _tried(
        self, k: int, s: float, before: float | None, same: int, at: int, which: str
    ) -> Iterator[Seen]:
        """One part of the step that is tried, after another."""
        if before is None:
            if s < 0:
                yield Seen(
                    "uphill",
                    at,
                    f"{which}the first point tried is {to(s)}, where d = solve(H, -g): that is uphill",
                    "H d = -g, and x + t d.",
                )
            elif s != 1 and self.steps and s == self.part:
                yield Seen(
                    "not whole",
                    at,
                    f"{which}the first point tried is {to(s)}: the step is not set back to 1",
                    "Every direction deserves to be tried whole: begin each line search with 1.",
                )
            elif s != 1:
                yield Seen(
                    "not whole",
                    at,
                    f"{which}the first point tried is {to(s)}: the whole step, x + d, is not",
                    "Try the whole step first.",
                )
        elif same:
            yield Seen(
                "again",
                at,
                f"{which}the same point {to(s)} is tried again and again",
                "Halve the step, and ask at x + t d with the t that has been halved.",
            )
        elif abs(s) > abs(before):
            yield Seen(
                "grows",
                at,
                f"{which}the step grows: after {to(before)}, {to(s)} is tried",
                "Where it is not good enough the step must become shorter: t = t / 2.",
            )
        elif abs(s / before - 0.5) > 1e-6 and s > 1e-6:
            yield Seen(
                "other part",
                at,
                f"{which}after {to(before)}, {to(s)} is tried: that is not half of the step",
                "Of the step the whole, 1/2, 1/4 ... are tried: t = t / 2.",
            )

    def _ended(self) -> Iterator[Seen]:
        """What it returns, and when."""
        end = self.way.end
        line = self.way.asked[-1][3] if self.way.asked else 0
        if end is None:
            yield from self._endless(line)
            return
        end = np.asarray(end, dtype=np.float64)
        if end.shape != self.x.shape or not np.isfinite(end).all():
            return
        if not same(end, self.x) and self.judged:
            if any(same(end, p) for p in self.past):
                yield Seen(
                    "returns",
                    0,
                    "what is returned is an earlier x, not the last one",
                    "Return the x that has been reached.",
                )
                return
            s = self._offset(end)
            if s is None:
                yield from self._astray(end, line, "x goes to")
            else:
                yield from self._chosen(s, line)
            self._move(end, s if s is not None else 1.0)
        elif self.judged and any(self._falls(s) >= ENOUGH for s, _ in self.tried):
            yield Seen(
                "stays",
                line,
                "a point low enough has been found, and x stays where it is",
                "x + t d is the new x: keep it, and begin the next step there.",
            )
        yield from self._counted(line)

    def _counted(self, line: int) -> Iterator[Seen]:
        """Whether it ends when it should."""
        steps = f"{self.steps} step{'s' * (self.steps != 1)}"
        if self.steps > self.most:
            yield Seen(
                "too many",
                0,
                f"{steps} {'is' if self.steps == 1 else 'are'} taken where most_steps = {self.most}",
                "Count the steps, and stop after most_steps of them.",
            )
        length = float(np.linalg.norm(self.g))
        if self.steps >= self.most or not length > 1.5 * self.tolerance:
            return
        small = [k for k in range(len(self.g)) if abs(self.g[k]) <= self.tolerance]
        if small:
            why = f": its entry {small[0]} is small, and the others are not"
        elif (
            low := [k for k in range(len(self.g)) if self.g[k] <= self.tolerance]
        ) and self.most > self.steps + 1:
            why = f"; its entry {low[0]} is below the tolerance, for it is negative"
        elif self.g @ self.g <= self.tolerance:
            why = ": its squared length g^T g is small, and its length is the root of that"
        else:
            why = ""
        yield Seen(
            "too few",
            0,
            f"it ends after {steps} of {self.most}, its gradient {length:.2g} long, tolerance {self.tolerance:.2g}",
            "Go on until np.linalg.norm(gradient(x)) <= tolerance, or most_steps steps have been taken.",
            why,
        )

    def _endless(self, line: int) -> Iterator[Seen]:
        """What it does in the end, where it has none."""
        if self.judged and self.tried:
            yield from self._chosen(None, line)
        if self.way.broken:
            return
        if self.steps > self.most:
            yield Seen(
                "too many",
                0,
                f"it goes on after {self.steps} steps, where most_steps = {self.most}",
                "Count the steps, and stop after most_steps of them.",
            )
        elif self.tried and abs(self.tried[-1][0]) < TINY:
            yield Seen(
                "halved for ever",
                line,
                f"in step {self.steps + 1} the step is halved for ever: nothing is low enough",
                "End the search at some tiny step; near the minimum the whole step is best then.",
            )
        else:
            yield Seen(
                "endless",
                line,
                "it never ends: a loop goes on whose condition does not change any more",
                "What does the loop wait for, and which line in it changes that?",
            )
