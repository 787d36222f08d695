"""What variants of an assignment may choose from: tables beside its solution, and an instructor's own; and drawing.

`solutions/<assignment>/variants/` has `energies.toml`, `parameters.toml`, `conventions.toml`, `students.toml` and
`every.toml`. Tables
of the same names in `variants/<assignment>/` of an instructor's own folder add to them, where nobody else reads them.
"""

from __future__ import annotations

import random
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from muslin.base import paths
from muslin.base.errors import MuslinError, choices
from muslin.physics import invariants
from muslin.tasks import read_assignment

FOLDER = "variants"

#: Points that the published solution may still have, of 100, and how many conventions differ.
MOST_KEPT, CONVENTIONS = 50, (3, 5)

#: Largest relative difference of an energy and what its invariants say.
SAME = 1e-9


@dataclass(frozen=True)
class Choice:
    """What a variant asks for: an energy, its parameters, and the conventions that are not the published ones."""

    energy: str
    parameters: str
    conventions: tuple[str, ...]

    def differences(self, other: Choice) -> int:
        """In how many ways two variants differ."""
        apart = set(self.conventions) ^ set(other.conventions)
        return (self.energy != other.energy) + (self.parameters != other.parameters) + len(apart)


class Tables:
    """What variants of an assignment may choose from.

    Raises
    ------
    MuslinError
        If the assignment has no such tables.
    """

    def __init__(self, assignment: str):
        self.source = paths.solution(assignment)
        self.folder = self.source / FOLDER
        if not self.folder.is_dir():
            raise MuslinError(
                f"Nobody has written which variants {assignment} may have: "
                f"{paths.shown(self.folder)} is missing.",
                "solutions/cloth/variants shows how.",
            )
        own = paths.course()
        #: An instructor's own tables, and what they name, beside the published ones.
        self.own = own / FOLDER / assignment if own is not None else self.folder
        self.base = read_assignment(self.source)
        self.energies, self.parameters = self._read("energies"), self._read("parameters")
        self.conventions, self.every = self._read("conventions"), self._read("every")
        #: Constants of each student's own: the manifest's `constants`, and the `change` of files.
        self.students = self._read("students")

    def _read(self, name: str) -> dict[str, Any]:
        if sys.version_info >= (3, 11):
            import tomllib
        else:
            import tomli as tomllib

        found = tomllib.loads((self.folder / f"{name}.toml").read_text(encoding="utf-8"))
        further = self.own / f"{name}.toml"
        if self.own == self.folder or not further.is_file():
            return found
        try:
            own = tomllib.loads(further.read_text(encoding="utf-8"))
        except tomllib.TOMLDecodeError as error:
            raise MuslinError(f"{paths.shown(further)} is not valid TOML: {error}.") from None
        entries = found.get(name, found)  # energies and parameters have more beside them
        entries |= own.get(name, own)
        return found

    def energy(self, name: str) -> dict[str, Any]:
        """An energy's entry, with `energy`, what the simulator calls it.

        Raises
        ------
        MuslinError
            If an energy of one's own does not say how it is simulated, or says so of another one.
        """
        entry = dict(self.energies["energies"][name])
        if "invariants" not in entry:
            if "of" in entry and name not in invariants.INVARIANTS:
                raise MuslinError(
                    f"The energy {name!r} does not say how it is simulated.",
                    "Give it invariants = [[a, b], [c, d]]: see muslin.physics.invariants.",
                )
            return {"energy": name, **entry}
        (a, b), (c, d) = entry["invariants"]
        scope: dict[str, Any] = {}
        exec("def of(s, mu, lam):\n" + entry["of"].strip("\n"), scope)
        for s, mu, lam in (((1.3, 0.8), 2.0, 3.0), ((0.6, 0.9), 5.0, 1.0), ((2.0, 1.5), 1.0, 7.0)):
            stretch, size = s[0] ** 2 + s[1] ** 2 - 2, s[0] * s[1] - 1
            by = mu / 2 * (s[0] - s[1]) ** 2
            by += (a * mu + b * lam) / 2 * stretch**2 + (c * mu + d * lam) / 2 * size**2
            if abs(by - scope["of"](s, mu, lam)) > SAME * abs(by):
                raise MuslinError(
                    f"The invariants of the energy {name!r} are those of another energy than `of`.",
                    f"At s = {s}, mu = {mu}, lam = {lam} they give {by:.6g} and {scope['of'](s, mu, lam):.6g}.",
                )
        return {**entry, "energy": invariants.named(name, ((a, b), (c, d)))}

    def path(self, inside: str) -> Path:
        """A file that tables speak of: an instructor's own, else the published one."""
        return own if (own := self.own / inside).is_file() else self.folder / inside

    def touched(self, choice: Choice) -> frozenset[str]:
        """Tasks that the published answer no longer solves."""
        tasks = {task for name in choice.conventions for task in self.conventions[name]["wire"]}
        for table, chosen in ((self.energies, choice.energy), (self.parameters, choice.parameters)):
            tasks |= set(table["tasks"]) if chosen != table["published"] else set()
        return frozenset(tasks)

    def kept(self, choice: Choice) -> int:
        """Points that the published solution would still get."""
        touched = self.touched(choice)
        return sum(task.points for name, task in self.base.tasks.items() if name not in touched)

    def said(self, choice: Choice) -> list[str]:
        """A choice in words, one line for each way in which it differs."""
        told = [
            f"The energy is {self.energies['energies'][choice.energy]['says']}.",
            f"It takes {self.parameters['parameters'][choice.parameters]['says']}",
        ]
        return told + [self.conventions[name]["says"] for name in choice.conventions]


def draw(tables: Tables, seed: str) -> Choice:
    """The choice that belongs to a seed: of those in which the published solution gets at most half of the points."""
    stream = random.Random(f"variant/{seed}")
    while True:
        conventions = sorted(stream.sample(sorted(tables.conventions), stream.randint(*CONVENTIONS)))
        choice = Choice(
            stream.choice(sorted(tables.energies["energies"])),
            stream.choice(sorted(tables.parameters["parameters"])),
            tuple(conventions),
        )
        published = (choice.energy, choice.parameters) == (
            tables.energies["published"],
            tables.parameters["published"],
        )
        if not published and tables.kept(choice) <= MOST_KEPT:
            return choice


def picked(tables: Tables, names: Iterable[str]) -> Choice:
    """A choice by the names of its parts; what is not named is as it was published.

    Raises
    ------
    MuslinError
        If there is no such part, or two energies or parameters are named.
    """
    one = {"energy": dict(tables.energies["energies"]), "parameters": dict(tables.parameters["parameters"])}
    found = {"energy": tables.energies["published"], "parameters": tables.parameters["published"]}
    conventions, named = [], set()
    for name in names:
        kind = next((kind for kind, known in one.items() if name in known), None)
        if kind is None and name not in tables.conventions:
            every = [*one["energy"], *one["parameters"], *tables.conventions]
            raise MuslinError(f"There is no {name!r} to pick.", choices(name, every))
        if kind in named:
            raise MuslinError(f"Pick one of these: {', '.join(one[str(kind)])}.")
        if kind is None:
            conventions.append(name)
        else:
            named.add(kind)
            found[kind] = name
    return Choice(found["energy"], found["parameters"], tuple(sorted(set(conventions))))
