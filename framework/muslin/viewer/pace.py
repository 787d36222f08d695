"""Real time, as far as the machine keeps up."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from muslin.viewer.session import Session


@dataclass
class Pace:
    """Real time, as far as the machine keeps up: steps are never left out, the time they are late is."""

    owed: float = 0.0
    past: deque[tuple[float, float]] = field(default_factory=lambda: deque(maxlen=240))

    def advance(self, session: Session, elapsed: float, budget: float) -> None:
        """Take the steps that `elapsed` [s] asks for, until `budget` [s] are spent computing."""
        if not session.playing:
            self.owed = 0.0
            self.past.clear()
            return
        began, dt, simulated = time.perf_counter(), session.scene.dt, 0.0
        self.owed += elapsed
        while self.owed >= dt and session.playing:
            session.step()
            self.owed -= dt
            simulated += dt
            if time.perf_counter() - began > budget:
                self.owed = min(self.owed, dt)  # late: slow motion, rather than a lagging hand
                break
        self.past.append((elapsed, simulated))
        while len(self.past) > 1 and sum(real for real, _ in self.past) > 2.0:
            self.past.popleft()

    @property
    def factor(self) -> float | None:
        """Simulated time per real time over the last two seconds; None before there is enough to say."""
        real = sum(elapsed for elapsed, _ in self.past)
        return sum(simulated for _, simulated in self.past) / real if real > 0.3 else None
