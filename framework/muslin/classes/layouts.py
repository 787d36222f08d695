"""What the names of a platform's download say: whose it is, when it came, whether it was late."""

from __future__ import annotations

import datetime
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from muslin.base import paths
from muslin.base.errors import MuslinError

#: Gradescope's file of who handed in what.
METADATA = "submission_metadata.yml"


class Claim(NamedTuple):
    """What a platform's name of a file or folder says; `inside` is the student's own name of it."""

    name: str
    id: str = ""
    late: bool = False
    upload: int = 0
    inside: str = ""


class Member(NamedTuple):
    """A submission in Gradescope's metadata: names and numbers of who handed it in, and when."""

    students: tuple[tuple[str, str], ...]
    time: str
    when: datetime.datetime | None = None


_MOODLE = re.compile(r"(?P<name>.+?)_(?P<id>\d+)_assignsubmission_(?:file|[a-z]+)_?(?P<inside>.*)", re.S)
_GRADESCOPE = re.compile(r"submission_(?P<id>\d+)")
#: Canvas: what was typed into its text box, or a link; it has no number of an upload.
_TYPED = re.compile(r"(?P<name>.+?)_(?P<late>LATE_)?(?P<id>\d+)_(?P<inside>(?:text|link|url)\.html?)")
#: Canvas without names: five letters and digits say which student.
_ANONYMOUS = re.compile(
    r"(?P<name>anon(?:ymous)?)_(?P<late>LATE_)?(?P<id>[0-9A-Za-z]{5})_(?P<upload>\d+)_(?P<inside>.+)", re.S
)
#: Canvas: numbers of the student and of the upload, with the student's file behind them.
_NUMBERS = re.compile(r"(?=_(?P<late>LATE_)?(?P<id>\d+)_(?P<upload>\d+)_(?P<inside>.+))", re.S)


def claimed(name: str, folder: bool) -> Claim | None:
    """What the name of a file or folder says, if it is one that Canvas, Moodle or Gradescope gives."""
    if match := _MOODLE.fullmatch(name):
        return _claim(match)
    if match := _GRADESCOPE.fullmatch(name):
        return Claim(name, match["id"])
    return None if folder else _canvas(name)


def _claim(match: re.Match[str], name: str = "") -> Claim:
    said = match.groupdict()
    upload = int(said.get("upload") or 0)
    return Claim(name or said["name"], said["id"], bool(said.get("late")), upload, said["inside"])


def _canvas(name: str) -> Claim | None:
    """Canvas' `name_LATE_student_upload_file`, where both the name and the file may hold numbers and underscores.

    Canvas' own numbers are long, those in the name of a group or at the start of a file are not: of all readings
    that with the longest numbers counts, and of equals the rightmost.
    """
    for pattern in (_ANONYMOUS, _TYPED):
        if match := pattern.fullmatch(name):
            return _claim(match)

    def likely(match: re.Match[str]) -> tuple[bool, int, int]:
        return bool(match["late"]), min(len(match["id"]), len(match["upload"])), match.start()

    best = max((m for m in _NUMBERS.finditer(name) if m.start() > 0), key=likely, default=None)
    return None if best is None else _claim(best, name[: best.start()])


def members(path: Path) -> dict[str, Member]:
    """Who handed in what, from Gradescope's metadata; nothing if there is no such file.

    Raises
    ------
    MuslinError
        If it cannot be read, or PyYAML is not there.
    """
    if not path.is_file():
        return {}
    try:
        import yaml
    except ImportError:
        raise MuslinError(
            f"To read the students' names in {path.name}, PyYAML is needed.",
            "Install it with: pip install 'muslin[class]'",
        ) from None

    class Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
        """Plain data; Ruby's objects as the mappings they are written as."""

    def plain(loader: Any, _: str, node: Any) -> Any:
        if isinstance(node, yaml.MappingNode):
            return loader.construct_mapping(node, deep=True)
        if isinstance(node, yaml.SequenceNode):
            return loader.construct_sequence(node, deep=True)
        return loader.construct_scalar(node)

    Loader.add_multi_constructor("!", plain)
    try:
        data = yaml.load(path.read_text(encoding="utf-8"), Loader=Loader)
    except (OSError, ValueError, TypeError, yaml.YAMLError, RecursionError) as error:
        raise MuslinError(f"{paths.shown(path)} cannot be read: {str(error).splitlines()[0]}.") from None
    entries = data.items() if isinstance(data, dict) else ()
    return {
        str(name): Member(tuple(_students(about)), *_time(_symbol(about, "created_at")))
        for name, about in entries
    }


def _students(about: Any) -> Iterator[tuple[str, str]]:
    listed = _symbol(about, "submitters")
    for student in listed if isinstance(listed, list) else ():
        name, number = _symbol(student, "name"), _symbol(student, "sid") or _symbol(student, "email")
        if name or number:
            yield str(name or number), str(number or "")


def _symbol(data: Any, key: str) -> Any:
    """An entry of Gradescope's metadata, whose keys are Ruby symbols."""
    return data.get(f":{key}", data.get(key)) if isinstance(data, dict) else None


def _time(value: Any) -> tuple[str, datetime.datetime | None]:
    """A point in time, for people and for reckoning with."""
    if isinstance(value, dict):  # Ruby's time with a zone
        value = value.get("utc") or value.get("time")
    if not isinstance(value, datetime.datetime):
        return str(value or ""), None
    utc = datetime.timezone.utc
    value = value.replace(tzinfo=utc) if value.tzinfo is None else value.astimezone(utc)
    return f"{value:%Y-%m-%d %H:%M} UTC", value
