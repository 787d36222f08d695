"""A term's own assignment: a published one with another energy, other parameters, other conventions, drawn from a seed.

A variant is data. `solutions/<assignment>/variants/` says in tables what may be otherwise (`energies.toml`,
`parameters.toml`, `conventions.toml`) and what is left out (`every.toml`): how values are carried over between the
published convention and the variant's, and which words of the published files change. From these follow the solution,
the stubs, the handout, the hints, the manifest and with it cases, truth, properties, mistakes, laws and the simulation
(`muslin.tasks.wiring`, `muslin.judging.wired`). What is written is an assignment like any other, in `solutions/NAME`.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from muslin.authoring import mistakes, mutations, reference_data
from muslin.authoring import release as releasing
from muslin.authoring.examples import answered
from muslin.authoring.regions import read
from muslin.authoring.variant_tables import FOLDER, Choice, Tables, draw, picked
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.judging import cases
from muslin.reading.source import Source
from muslin.tasks import MANIFEST, Assignment, Value, load, read_assignment
from muslin.tasks.batch import evaluate

#: Which of the variant's choices it has, beside its solution: for those who teach with it.
RECORD = "variant.json"

#: Where the ways to write a variant's energy lie, for `mutations`.
ROAD = mutations.ROADS / "strain_energy.py"

#: Lines about constants of each student's own.
CONSTANTS = re.compile(r"\bc_\w+ \*")

#: Largest relative error of a variant's own answers about its energy, and cases they are asked on.
RIGHT, CASES = 1e-9, 10

__all__ = ["Choice", "Tables", "chosen", "draw", "files", "picked", "write"]

_TOKEN = re.compile(r"@([a-z]+(?:[./][\w.-]+)*(?:/[\w.-]+)?)@")


def write(
    assignment: str,
    name: str,
    seed: str,
    choice: Choice | None = None,
    data: bool = True,
    per_student: bool = False,
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
    per_student : bool
        Whether each student has constants of their own.

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
    folders += [paths.new_home() / "data" / part / name for part in ("reference", "known", "slips")]
    if taken := [folder for folder in folders if folder.exists()]:
        raise MuslinError(f"There already is {paths.shown(taken[0])}.", "Choose another name.")
    choice = choice or draw(tables, seed)
    try:
        salt = hashlib.sha256(f"constants/{seed}".encode()).hexdigest()[:16] if per_student else ""
        for relative, content in files(tables, name, choice, salt).items():
            path = folders[0] / relative
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        if choice.energy != tables.energies["published"]:
            _require_right(name, tables.energies["tasks"])
        handout = folders[0] / releasing.HANDOUT
        handout.write_text(answered(handout.read_text(encoding="utf-8"), folders[0]), encoding="utf-8")
        yield from tables.said(choice)
        if per_student:
            yield f"Each student has constants of their own: {', '.join(tables.students['constants']['factors'])}."
        yield f"Wrote {paths.shown(folders[0])}: the solution. Keep it."
        releasing.release(name)
        yield f"Wrote {paths.shown(folders[1])}: what students get."
        if data:
            reference_data.build(name)
            yield f"Wrote {paths.shown(folders[2])}: the public cases."
            list(mistakes.build(name))
            if mutations.written_down(name):
                list(mutations.build(name))
            yield f"Wrote {paths.shown(folders[3])}: what mistakes make of them."
    except BaseException:
        for folder in folders:
            shutil.rmtree(folder, ignore_errors=True)
        raise


def _require_right(name: str, tasks: Iterable[str]) -> None:
    """Refuse a variant whose answers are not what its energy says."""
    own = load(paths.source(name), read_assignment(paths.source(name)))
    for task in tasks:
        inputs = cases.draw_inputs(name, task, "own answers", CASES)
        (right,) = cases.truth(name, task, inputs)
        error = abs(np.asarray(evaluate(own[task], **dict[str, Any](inputs))) - right).max()
        if not error <= RIGHT * abs(right).max():
            raise MuslinError(
                f"The answer {task} of this variant is not what its energy says.",
                "Look at `of` in its table, and at its strain_energy.py.",
            )


def files(tables: Tables, name: str, choice: Choice, salt: str = "") -> dict[str, bytes]:
    """The solution folder of a variant, by relative path; with `salt` each student has constants of their own."""
    texts, without = {}, {FOLDER, "roads", "__pycache__", *tables.every["without"]}
    for path in sorted(tables.source.rglob("*")):
        relative = path.relative_to(tables.source)
        if path.is_file() and not without & set(relative.parts):
            texts[relative.as_posix()] = path.read_bytes()
    written = {
        file: text.decode("utf-8") for file, text in texts.items() if file.endswith((".py", ".md", ".toml"))
    }
    written = {file: text.replace("\r\n", "\n") for file, text in written.items()}
    for changes, look_up in _changes(tables, choice, bool(salt)):
        for file, each in changes.items():
            for change in each:
                written[file] = _changed(written[file], change, look_up, file)
    base = tables.base
    written[MANIFEST] = _manifest(written[MANIFEST], base, name, _wires(tables, choice))
    if salt:
        entries = {**tables.students["constants"], "salt": salt}
        lines = [f"{key} = {_inline(entry.items()) if isinstance(entry, Mapping) else json.dumps(entry)}"
                 for key, entry in entries.items()]  # fmt: skip
        written[MANIFEST] += "\n".join(["", "[constants]", *lines, ""])
    for word in (f"`{base.name}-students.zip`", f"`{base.name}/`", f"muslin start {base.name} "):
        written[releasing.HANDOUT] = written[releasing.HANDOUT].replace(word, word.replace(base.name, name))
    published = tables.energies["published"], tables.parameters["published"]
    if (choice.energy, choice.parameters) != published:
        written[ROAD.as_posix()] = _roads(tables, choice, written[ROAD.name])
    record = {"of": base.name, "energy": choice.energy, "parameters": choice.parameters}
    written[RECORD] = json.dumps({**record, "conventions": choice.conventions}, indent=2) + "\n"
    return {**texts, **{file: text.encode("utf-8") for file, text in written.items()}}


def _roads(tables: Tables, choice: Choice, solution: str) -> str:
    """Ways to write a variant's energy, that slips are made of (see `mutations`): published ones, if it is that energy,
    or else the variant's own answers; and these answers to arguments that are `mistaken` for others.

    Constants of each student's own, which are 1 in them, are left out.
    """
    entry = tables.parameters["parameters"][choice.parameters]
    names, first = ", ".join(entry["names"]), entry.get("solution", "").lstrip("\n")
    source, own, mistaken = Source(solution, ROAD.name), [], []
    for name in tables.energies["tasks"]:
        function = source.functions[name].node
        body = source.lines[function.body[1].lineno - 1 : function.end_lineno]
        lines = "".join(
            line for line in body if not line.lstrip().startswith("#") and not CONSTANTS.search(line)
        )
        own.append(f"def {name}(s, {names}):\n{lines}")
        for wrong in (*entry.get("mistaken", ()), *tables.energies["mistaken"]):
            head = f"def {name}__{wrong['what'].replace(' ', '_')}(s, {names}):\n"
            said = f'    """{wrong["says"]}\n\n    {wrong["advice"]}\n    """\n'
            line = wrong["line"].replace("@names@", names)
            mistaken.append(f"{head}{said}{first}    {line}\n{lines.removeprefix(first)}")
    if choice.energy != tables.energies["published"]:
        above = f'"""The way in which {ROAD.name} has it; see muslin.authoring.mutations."""\n\nimport taichi as ti\n'
        return "\n\n".join([above, *own, *mistaken])
    return "\n\n".join([_published_roads(tables, names, first), *mistaken])


def _published_roads(tables: Tables, names: str, first: str) -> str:
    """The published ways to write the energy, each after the line that makes mu and lam of a variant's parameters."""
    heads = re.compile(
        rf"(def (?:{'|'.join(tables.energies['tasks'])})(?:__\w+)?)\(s, mu, lam\):\n"
        r'(    """(?s:.*?)"""\n)?'
    )
    text = (tables.source / ROAD).read_text(encoding="utf-8")
    return heads.sub(lambda m: f"{m[1]}(s, {names}):\n{m[2] or ''}{first}", text)


def chosen(name: str) -> Choice | None:
    """What a variant that has been written asks for; None of what is no variant."""
    try:
        record = json.loads((paths.source(name) / RECORD).read_text(encoding="utf-8"))
        return Choice(record["energy"], record["parameters"], tuple(record["conventions"]))
    except (OSError, ValueError, KeyError):
        return None


# --- words ---------------------------------------------------------------------------------------------------


def _changes(
    tables: Tables, choice: Choice, per_student: bool
) -> Iterator[tuple[Mapping[str, list[Any]], Any]]:
    """Changes of files, in the order in which they are made, each with where its tokens are looked up."""
    yield tables.every["change"], _Tokens(tables, "", {})
    if choice.energy != tables.energies["published"]:
        energy = tables.energy(choice.energy)
        yield tables.energies["change"], _Tokens(tables, choice.energy, energy)
    for name in tables.conventions:
        if name in choice.conventions and name != "thickness":
            yield tables.conventions[name]["change"], _Tokens(tables, name, {})
    if per_student:
        yield tables.students["change"], _Tokens(tables, "", {})
    if choice.parameters != tables.parameters["published"]:
        entry = dict(tables.parameters["parameters"][choice.parameters])
        values = ", ".join(f"{name} = {json.dumps(text)}" for name, text in entry.pop("values").items())
        words = {**entry, "values": values, "names": ", ".join(entry["names"])}
        yield tables.parameters["change"], _Tokens(tables, choice.parameters, words)
    if "thickness" in choice.conventions:  # last: units stand everywhere
        yield tables.conventions["thickness"]["change"], _Tokens(tables, "thickness", {})


class _Tokens:
    """What stands for `@name@` in a change: an entry of a table, or a file."""

    def __init__(self, tables: Tables, own: str, entries: Mapping[str, Any]):
        self.tables, self.own, self.entries = tables, own, entries

    def __call__(self, match: re.Match[str]) -> str:
        found: Any = self.entries
        for key in match[1].split("."):
            found = found.get(key) if isinstance(found, Mapping) else None
        if found is None:
            inside = re.sub("^energy/", f"{self.own}/", match[1])
            found = read(self.tables.path(inside))
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
