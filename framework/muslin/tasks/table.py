"""What a task table says, read: tasks with their arguments and results, how they are graded, what is simulated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from muslin.tasks.constants import OF, Constants
from muslin.tasks.kinds import form
from muslin.tasks.wiring import Wiring

#: Languages a task's function may be written in.
LANGUAGES = ("taichi", "python")


@dataclass(frozen=True)
class Value:
    """An argument or a result of a task: its kind (see `form`), unit and meaning."""

    name: str
    kind: str
    unit: str
    meaning: str = ""

    @property
    def shape(self) -> tuple[int, ...]:
        """Of one sample."""
        return form(self.kind)[0]

    @property
    def integer(self) -> bool:
        """Whether it is an integer."""
        return form(self.kind)[1]

    @property
    def is_function(self) -> bool:
        """Whether it is a function, which is built from the arrays of a case where the task runs."""
        return self.kind == FUNCTION


#: Kind of an argument that is a function.
FUNCTION = "function"


@dataclass(frozen=True)
class Task:
    """One function a student fills in.

    Attributes
    ----------
    arguments : tuple of Value
        What the function takes, in order.
    results : tuple of Value
        What it returns, in order.
    needs : tuple of str
        Tasks without which this one cannot be tried in the simulator; every task is checked on its own, whatever the
        state of the others.
    language : str
        "taichi": a `@ti.func` on small vectors and matrices; "python": a plain function on NumPy arrays.
    problem : tuple of Value
        Arrays of a case that the function does not see, but the functions it takes are built from.
    builder : str
        File of the assignment with a function of the task's name that builds them: arrays by name -> functions by name.
    called : Wiring
        How Muslin calls the function, where it is otherwise than the assignment asks for.
    """

    name: str
    file: str
    section: str
    title: str
    points: int
    arguments: tuple[Value, ...]
    results: tuple[Value, ...]
    needs: tuple[str, ...] = ()
    hints: tuple[str, ...] = ()
    language: str = "taichi"
    problem: tuple[Value, ...] = ()
    builder: str = ""
    called: Wiring | None = None

    @property
    def inputs(self) -> tuple[Value, ...]:
        """The arrays that make a case: those the function sees, then those of the problem."""
        return (*self.seen, *self.problem)

    @property
    def seen(self) -> tuple[Value, ...]:
        """The arguments that are arrays."""
        return tuple(value for value in self.arguments if not value.is_function)

    @property
    def in_python(self) -> bool:
        """Whether it is written in plain Python over NumPy arrays."""
        return self.language == "python"


@dataclass(frozen=True)
class Grading:
    """How an assignment is graded: the manifest's `[grading]`.

    Attributes
    ----------
    deadline, simulation_deadline : float
        Processor time and sleep that a task may take for an answer, and the simulation, compilation included [s].
    hidden_cases : int
        Random cases drawn per task for every submission.
    credit : mapping
        Share of a task's points for each layer of its checks, earned only if all layers before it have passed.
    """

    deadline: float = 20.0
    simulation_deadline: float = 60.0
    hidden_cases: int = 20
    credit: Mapping[str, float] = field(default_factory=lambda: {"hidden": 0.7, "properties": 0.3})


@dataclass(frozen=True)
class Simulation:
    """The run that all functions of an assignment make together: the manifest's `[simulation]`.

    Attributes
    ----------
    scene : str
        One of Muslin's, small and short.
    compared_steps : int
        How many of its steps are held against the reference: what touches is chaotic after a while.
    parameters : mapping
        Of the scene.
    shown : mapping
        Parameters of whichever scene `muslin run` shows a student's functions in, unless they are set.
    """

    scene: str
    compared_steps: int = 30
    parameters: Mapping[str, Any] = field(default_factory=dict)
    shown: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Question:
    """A question that is answered in words and marked by hand, its points on top of the tasks': `[written.NAME]`."""

    name: str
    section: str
    title: str
    points: int


@dataclass(frozen=True)
class Assignment:
    """A manifest, read."""

    name: str
    title: str
    version: str
    tasks: Mapping[str, Task]
    grading: Grading = Grading()
    simulation: Simulation | None = None
    written: Mapping[str, Question] = field(default_factory=dict)
    energy: str = ""  # which of a body's energies its functions write; default the body's first
    constants: Constants | None = None  # each student's own, if it has such

    @property
    def student(self) -> str:
        """Whose it is, of an assignment with constants of each student's own."""
        return self.name.partition(OF)[2]

    @property
    def files(self) -> tuple[str, ...]:
        """Names of the files a student hands in, in the order of the handout."""
        return tuple(dict.fromkeys(task.file for task in self.tasks.values()))

    @property
    def given(self) -> tuple[str, ...]:
        """Names of the files beside them that a student is given and hands back unread: what builds arguments."""
        return tuple(dict.fromkeys(task.builder for task in self.tasks.values() if task.builder))
