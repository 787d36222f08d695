"""The stages of a grading, in the order that keeps hidden inputs in.

A submission can show much: what it prints, how its functions fail, where its cloth lies at the end, how long it takes.
So all that can be shown is asked for before any hidden input goes out to any worker, and nothing afterwards:

1. `public`: everything is told.
2. `properties`: their inputs are drawn apart from the hidden cases, so that all of it may be told.
3. `laws`, asked of the same workers.
4. `rest`: what they have compiled is kept, and they end. Where an earlier grading has kept it, and workers are found to
   share nothing, they are only stopped.
5. `simulate`: all functions that are right so far. Its worker can see Muslin's own element, which computes what tasks
   ask for; so no other runs beside it.
6. `hidden`, when that worker has ended. What comes of it is one of four words a task.

Whoever was late in a stage is asked once more, alone, before it counts.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from concurrent.futures import Executor, Future

import numpy as np

from muslin.base.errors import MuslinError
from muslin.grading import checks, laws, parts, simulating
from muslin.grading.checks import Hidden, Outcome, Verdict
from muslin.grading.kernels import Store
from muslin.grading.parts import Part
from muslin.grading.patience import Patience
from muslin.grading.reader import Reader
from muslin.grading.record import PASSED, Check, Simulation
from muslin.grading.sandbox import Sandbox
from muslin.grading.submission import Handed
from muslin.judging import properties, reference
from muslin.tasks import Assignment, Task

#: Called as (done, total, what) while grading goes on.
Progress = Callable[[int, int, str], None]

#: What a simulation left, or nothing and why.
Run = tuple[Mapping[str, np.ndarray], str]

Inputs = Mapping[str, np.ndarray]


class Stages:
    """A submission on its way; call each stage once, in the order of this module.

    Parameters
    ----------
    sandbox : Sandbox
    reader : Reader
        Who reads its text.
    pool : Executor
        In which parts are asked side by side.
    table : Assignment
    handed : Handed
    store : Store
    deadline : float
        Time a task may take for an answer, compilation included [s].
    on_progress : callable, optional

    Attributes
    ----------
    verdicts : dict
        Of every task, as far as it has come.
    seconds : dict
        Time spent on each task until hidden inputs went out [s].
    """

    def __init__(
        self,
        sandbox: Sandbox,
        reader: Reader,
        pool: Executor,
        table: Assignment,
        handed: Handed,
        store: Store,
        deadline: float,
        on_progress: Progress | None = None,
    ):
        self._sandbox, self._pool, self._table, self._handed = sandbox, pool, table, handed
        self._reader, self._store, self._on_progress = reader, store, on_progress
        self._parts = [Part(sandbox, table, handed, file, deadline, store.load(file)) for file in table.files]
        self._done, self._total = 0, 2 * len(table.tasks) + 1
        self.verdicts = {name: Verdict(task) for name, task in table.tasks.items()}
        self.seconds = dict.fromkeys(table.tasks, 0.0)

    def public(self) -> None:
        """The public cases, with everything there is to say about them."""
        home = self._home()

        def ask(part: Part, task: Task) -> Outcome:
            inputs, _ = reference.cases(self._table.name, task.name)
            return self._timed(part, task, inputs, shown=True)

        def judge(verdict: Verdict, outcome: Outcome | None) -> None:
            assert outcome is not None
            part = home[verdict.task.name]
            checks.judge_public(self._table, verdict, outcome, self._reader, part.data)
            self._tick(verdict.task.name)

        self._asked("form", ask, judge)

    def properties(self, seed: str) -> None:
        """The properties, of functions that run."""
        drawn = {name: properties.draw(self._table.name, name, seed) for name in self._table.tasks}
        home = self._home()

        def ask(part: Part, task: Task) -> Outcome | None:
            if not drawn[task.name] or not self.verdicts[task.name].passed("form"):
                return None
            return self._timed(part, task, properties.batch([inputs for _, inputs in drawn[task.name]]))

        def judge(verdict: Verdict, outcome: Outcome | None) -> None:
            name = verdict.task.name
            given = self._table, verdict, drawn[name], outcome
            checks.judge_properties(*given, self._reader, home[name].data)

        self._asked("properties", ask, judge)

    def laws(self) -> tuple[Check, ...]:
        """The laws of mechanics, held against the functions that are right so far."""
        home = self._home()
        in_trouble: dict[str, laws.Trouble] = {}

        def ask(task: str, inputs: Inputs) -> tuple[np.ndarray, ...]:
            if task not in in_trouble:
                outcome = home[task].ask(self._table.tasks[task], inputs)
                if not outcome.kind:
                    return outcome.results
                in_trouble[task] = laws.Trouble(f"{task}: {outcome.text}")
            raise in_trouble[task]

        return laws.obeyed(self._table.name, ask, self._usable())

    def rest(self) -> None:
        """Keep what the workers have compiled, for those to come and for the next grading, and end or stop them."""
        apart = self._sandbox.safety.defences.get("nothing shared between workers", False)

        def of(part: Part) -> None:
            if part.rest(apart):
                self._store.save(part.file, part.kernels)

        for _ in self._pool.map(of, self._parts):
            pass

    def simulate(self) -> Future[Run]:
        """Start a simulation with the functions that are right so far, the framework's own code for the others."""
        return self._pool.submit(self._simulated)

    def _simulated(self) -> Run:
        expected, usable = simulating.reference(self._table.name), self._usable()
        if expected is None or not usable:
            return {}, ""
        allowed = self._table.grading.simulation_deadline
        # a file that kills its process, or brings nothing, is left out
        useful = {self._table.tasks[name].file for name in usable}
        files = {file: data for file, data in self._handed.files.items() if file in useful}
        patience = Patience(allowed)
        worker = self._sandbox.worker(bare=False)
        try:
            known = self._store.load("simulation")
            _, trouble = parts.load(worker, self._table, files, known, patience, allowed)
            run: Mapping[str, np.ndarray] = {}
            if trouble is None:
                request = {"do": "simulate", "stand_ins": self._stand_ins()}
                forms = simulating.forms(expected)
                _, run, trouble = parts.ask(worker, request, {}, patience, allowed, forms)
            if trouble is None:
                self._store.save("simulation", parts.compiled(worker))
            return run, trouble.text if trouble else ""
        finally:
            worker.close()

    def judge(self, obeyed: tuple[Check, ...], run: Run) -> Simulation:
        """The functions together: the laws they obey, and how their run follows the reference."""
        self._tick("simulation")
        expected = simulating.reference(self._table.name)
        if expected is None and not obeyed:
            return simulating.skipped("This assignment has no simulation.")
        if not self._usable():
            return simulating.skipped("skipped: none of the functions works yet.")
        return simulating.judge(
            self._table.simulation, obeyed, *run, expected, self._usable(), self._stand_ins()
        )

    def hidden(self, cases: Mapping[str, Hidden]) -> None:
        """The hidden cases, of functions that are right on the public ones; nothing is asked of anyone afterwards."""

        def ask(part: Part, task: Task) -> Outcome | None:
            return part.ask(task, cases[task.name].inputs) if task.name in cases else None

        def judge(verdict: Verdict, outcome: Outcome | None) -> None:
            checks.judge_hidden(verdict, cases.get(verdict.task.name), outcome)
            self._tick(verdict.task.name)

        self._asked("hidden", ask, judge)
        for part in self._parts:
            part.close()

    def right_on(self, layer: str) -> list[str]:
        """Tasks that run, and have passed a layer."""
        return [name for name, found in self.verdicts.items() if found.passed("form") and found.passed(layer)]

    def _home(self) -> dict[str, Part]:
        """The part of each task."""
        return {task.name: part for part in self._parts for task in part.tasks}

    def _usable(self) -> frozenset[str]:
        """Tasks whose functions have passed all they were asked."""
        return frozenset(name for name, verdict in self.verdicts.items() if verdict.status == PASSED)

    def _stand_ins(self) -> tuple[str, ...]:
        return tuple(name for name in self._table.tasks if name not in self._usable())

    def _asked(
        self,
        layer: str,
        ask: Callable[[Part, Task], Outcome | None],
        judge: Callable[[Verdict, Outcome | None], None],
    ) -> None:
        """Ask every task of every part, side by side, and judge the answers; who was late has another turn."""

        def turn(part: Part, task: Task) -> Outcome | None:
            verdict = self.verdicts[task.name]
            try:
                outcome = ask(part, task)
                if outcome is None or outcome.kind != "late":
                    judge(verdict, outcome)
                return outcome
            except MuslinError:  # the grading itself cannot be done
                raise
            except Exception as error:
                checks.judge_not(verdict, layer, error)
                return None

        def of(part: Part) -> list[tuple[Task, Outcome]]:
            answers = [(task, turn(part, task)) for task in part.tasks]
            return [(task, found) for task, found in answers if found is not None and found.kind == "late"]

        asked = [(part, self._pool.submit(of, part)) for part in self._parts]
        late = [(part, answer.result()) for part, answer in asked]
        for part, missed in late:
            part.forgive()
            alone = True  # is it in time now that no other worker runs?
            for task, outcome in missed:
                again = turn(part, task) if alone else outcome
                if again is not None and again.kind == "late":
                    alone = False
                    judge(self.verdicts[task.name], outcome)

    def _timed(self, part: Part, task: Task, inputs: Inputs, shown: bool = False) -> Outcome:
        began = time.monotonic()
        try:
            return part.ask(task, inputs, shown)
        finally:
            self.seconds[task.name] += time.monotonic() - began

    def _tick(self, what: str) -> None:
        self._done += 1
        if self._on_progress:
            self._on_progress(self._done, self._total, what)
