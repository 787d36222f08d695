"""A term's own assignment: a published one with another energy, other parameters, other conventions, drawn from a seed.

A variant is data. `solutions/<assignment>/variants/` says in tables what may be otherwise (`energies.toml`,
`parameters.toml`, `conventions.toml`) and what is left out (`every.toml`): how values are carried over between the
published convention and the variant's, and which words of the published files change. From these follow the solution,
the stubs, the handout, the hints, the manifest and with it cases, truth, properties, mistakes, laws and the simulation
(`muslin.tasks.wiring`, `muslin.judging.wired`). What is written is an assignment like any other, in `solutions/NAME`.
"""

from __future__ import annotations

import json
import random
import re
import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from muslin.authoring import mistakes, reference_data
from muslin.authoring import release as releasing
from muslin.authoring.examples import answered
from muslin.base import paths
from muslin.base.errors import MuslinError, choices
from muslin.tasks import MANIFEST, Assignment, Value, read_assignment

FOLDER = "variants"

#: Which of the variant's choices it has, beside its solution: for those who teach with it.
RECORD = "variant.json"

#: Points that the published solution may still have, of 100, and how many conventions differ.
MOST_KEPT, CONVENTIONS = 50, (3, 5)

_TOKEN = re.compile(r"@([a-z]+(?:[./][\w.-]+)*(?:/[\w.-]+)?)@")


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
        self.base = read_assignment(self.source)
        self.energies, self.parameters = self._read("energies"), self._read("parameters")
        self.conventions, self.every = self._read("conventions"), self._read("every")

    def _read(self, name: str) -> dict[str, Any]:
        if sys.version_info >= (3, 11):
            import tomllib
        else:
            import tomli as tomllib

        return tomllib.loads((self.folder / f"{name}.toml").read_text(encoding="utf-8"))

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


def write(
    assignment: str, name: str, seed: str, choice: Choice | None = None, data: bool = True
) -> Iterator[str]:
    """Write a variant: its solution, and all that is made from it.

    Parameters
    ----------
    assignment : str
        Of which assignment.
    name : str
        Of the variant; small letters, digits and hyphens.
    seed : str
        What it is drawn from: keep it to yourself.
    choice : Choice, optional
        Instead of drawing one.
    data : bool
        Whether to make the reference data and what mistakes make of them, which takes minutes.

    Yields
    ------
    str
        What has been done.

    Raises
    ------
    MuslinError
        If the name is taken or cannot be used; nothing is left behind then.
    """
    tables = Tables(assignment)
    if not re.fullmatch(r"[a-z][a-z0-9-]*", name):
        raise MuslinError(f"{name!r} cannot be the name of a variant.", "Use small letters, digits and -.")
    if not seed.strip():
        raise MuslinError("A variant is drawn from a seed.", "Add --seed with words nobody will guess.")
    folders = [paths.new_home() / part / name for part in ("solutions", "assignments")]
    folders += [paths.new_home() / "data" / part / name for part in ("reference", "known")]
    if taken := [folder for folder in folders if folder.exists()]:
        raise MuslinError(f"There already is {paths.shown(taken[0])}.", "Choose another name.")
    choice = choice or draw(tables, seed)
    try:
        for relative, content in files(tables, name, choice).items():
            path = folders[0] / relative
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        handout = folders[0] / releasing.HANDOUT
        handout.write_text(answered(handout.read_text(encoding="utf-8"), folders[0]), encoding="utf-8")
        yield from tables.said(choice)
        yield f"Wrote {paths.shown(folders[0])}: the solution. Keep it."
        releasing.release(name)
        yield f"Wrote {paths.shown(folders[1])}: what students get."
        if data:
            reference_data.build(name)
            yield f"Wrote {paths.shown(folders[2])}: the public cases."
            list(mistakes.build(name))
            yield f"Wrote {paths.shown(folders[3])}: what mistakes make of them."
    except BaseException:
        for folder in folders:
            shutil.rmtree(folder, ignore_errors=True)
        raise


def files(tables: Tables, name: str, choice: Choice) -> dict[str, bytes]:
    """The solution folder of a variant, by relative path."""
    texts, without = {}, {FOLDER, "roads", "__pycache__", *tables.every["without"]}
    for path in sorted(tables.source.rglob("*")):
        relative = path.relative_to(tables.source)
        if path.is_file() and not without & set(relative.parts):
            texts[relative.as_posix()] = path.read_bytes()
    written = {
        file: text.decode("utf-8") for file, text in texts.items() if file.endswith((".py", ".md", ".toml"))
    }
    written = {file: text.replace("\r\n", "\n") for file, text in written.items()}
    for changes, look_up in _changes(tables, choice):
        for file, each in changes.items():
            for change in each:
                written[file] = _changed(written[file], change, look_up, file)
    base = tables.base
    written[MANIFEST] = _manifest(written[MANIFEST], base, name, _wires(tables, choice))
    for word in (f"`{base.name}-students.zip`", f"`{base.name}/`", f"muslin start {base.name} "):
        written[releasing.HANDOUT] = written[releasing.HANDOUT].replace(word, word.replace(base.name, name))
    record = {"of": base.name, "energy": choice.energy, "parameters": choice.parameters}
    written[RECORD] = json.dumps({**record, "conventions": choice.conventions}, indent=2) + "\n"
    return {**texts, **{file: text.encode("utf-8") for file, text in written.items()}}


def chosen(name: str) -> Choice | None:
    """What a variant that has been written asks for; None of what is no variant."""
    try:
        record = json.loads((paths.source(name) / RECORD).read_text(encoding="utf-8"))
        return Choice(record["energy"], record["parameters"], tuple(record["conventions"]))
    except (OSError, ValueError, KeyError):
        return None


# --- words ---------------------------------------------------------------------------------------------------


def _changes(tables: Tables, choice: Choice) -> Iterator[tuple[Mapping[str, list[Any]], Any]]:
    """Changes of files, in the order in which they are made, each with where its tokens are looked up."""
    yield tables.every["change"], _Tokens(tables.folder, "", {})
    if choice.energy != tables.energies["published"]:
        energy = {"energy": choice.energy, **tables.energies["energies"][choice.energy]}
        yield tables.energies["change"], _Tokens(tables.folder, choice.energy, energy)
    for name in tables.conventions:
        if name in choice.conventions and name != "thickness":
            yield tables.conventions[name]["change"], _Tokens(tables.folder, name, {})
    if choice.parameters != tables.parameters["published"]:
        entry = dict(tables.parameters["parameters"][choice.parameters])
        values = ", ".join(f"{name} = {json.dumps(text)}" for name, text in entry.pop("values").items())
        words = {**entry, "values": values, "names": ", ".join(entry["names"])}
        yield tables.parameters["change"], _Tokens(tables.folder, choice.parameters, words)
    if "thickness" in choice.conventions:  # last: units stand everywhere
        yield tables.conventions["thickness"]["change"], _Tokens(tables.folder, "thickness", {})


class _Tokens:
    """What stands for `@name@` in a change: an entry of a table, or a file."""

    def __init__(self, folder: Path, own: str, entries: Mapping[str, Any]):
        self.folder, self.own, self.entries = folder, own, entries

    def __call__(self, match: re.Match[str]) -> str:
        found: Any = self.entries
        for key in match[1].split("."):
            found = found.get(key) if isinstance(found, Mapping) else None
        if found is None:
            own = match[1].startswith("energy/")
            path = self.folder / self.own / match[1].partition("/")[2] if own else self.folder / match[1]
            found = path.read_text(encoding="utf-8")
        if isinstance(found, list):
            return "".join(f"  {json.dumps(line)},\n" for line in found)
        return str(found)


def _changed(text: str, change: Mapping[str, Any], look_up: Any, file: str) -> str:
    """A text with one change made.

    Raises
    ------
    MuslinError
        If what is to be changed is not there, or not as often as it should be.
    """
    old, times = change.get("old", ""), change.get("times", 1)
    pattern = change.get("pattern") or re.escape(old)
    if "until" in change:
        pattern += r"(?s:.*?)(?=" + re.escape(change["until"]) + ")" if change["until"] else r"(?s:.*)"

    def new(match: re.Match[str]) -> str:
        said = match.expand(change["new"]) if "pattern" in change else change["new"]
        return _TOKEN.sub(look_up, said)

    text, found = re.subn(pattern, new, text)
    if found != times and not (times == 0 and found):
        raise MuslinError(
            f"{file}: a variant changes {(old or pattern)[:60]!r} {times or 'some'} times, and it is there "
            f"{found} times.",
            f"Bring {FOLDER}/ beside the solution in step with it.",
        )
    return text


# --- the manifest --------------------------------------------------------------------------------------------


def _wires(tables: Tables, choice: Choice) -> dict[str, dict[str, dict[str, str]]]:
    """How Muslin calls each task that is touched: task -> give, take, back, send."""
    wires: dict[str, dict[str, dict[str, str]]] = {}
    each = [tables.conventions[name]["wire"] for name in tables.conventions if name in choice.conventions]
    if choice.parameters != tables.parameters["published"]:
        entry = tables.parameters["parameters"][choice.parameters]
        wire = {kind: entry[kind] for kind in ("give", "back")}
        each.append({task: wire for task in tables.parameters["tasks"]})
    for wire in each:
        for task, expressions in wire.items():
            for kind, further in expressions.items():
                told = wires.setdefault(task, {}).setdefault(kind, {})
                for name, text in further.items():
                    inner = told.get(name)
                    told[name] = re.sub(rf"\b{name}\b", f"({inner})", text) if inner else text
    return wires


def _manifest(
    text: str, base: Assignment, name: str, wires: Mapping[str, Mapping[str, Mapping[str, str]]]
) -> str:
    text = text.replace(f"of the {base.name} assignment:", f"of the {name} assignment:")
    text = text.replace(f'name = "{base.name}"\n', f'name = "{name}"\n', 1)
    lines = ["", "# How Muslin calls the functions that it has another convention for (muslin.tasks.wiring)."]
    for task, wire in wires.items():
        lines += ["", f"[task.{task}.called]"]
        lines += [f"arguments = {_inline(_described(base.tasks[task].arguments))}"]
        lines += [f"results = {_inline(_described(base.tasks[task].results))}"]
        lines += [f"{kind} = {_inline(expressions.items())}" for kind, expressions in wire.items()]
    return text + "\n".join(lines) + "\n" if wires else text


def _described(values: Iterable[Value]) -> Iterator[tuple[str, str]]:
    return ((value.name, f"{value.kind} [{value.unit}] {value.meaning}") for value in values)


def _inline(entries: Iterable[tuple[str, str]]) -> str:
    return "{ " + ", ".join(f"{name} = {json.dumps(text)}" for name, text in entries) + " }"


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
