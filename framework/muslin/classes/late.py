"""What being late costs: a policy an instructor writes down, and when everybody handed in.

    [late]
    deadline = 2026-03-02T23:59:00-05:00
    percent-per-day = 10

A day that has begun counts. `docs/class.md` describes every entry.
"""

from __future__ import annotations

import math
import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date, datetime, timedelta, timezone, tzinfo
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo

from muslin.authoring.wheel import read_toml
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.base.text import one_line
from muslin.classes import overrides
from muslin.classes.finding import Submission, tidy_name
from muslin.grading.views.text import points

DAY = timedelta(days=1)

#: Entries of `[late]`, and what they are if they are not there.
ENTRIES: dict[str, Any] = {
    "deadline": None, "zone": "", "percent-per-day": None, "of": "score", "grace-minutes": 0, "most-percent": 100,
    "extensions": {}, "handed-in": {},
}  # fmt: skip

#: What percent are taken of.
SCORE, MAXIMUM = "score", "maximum"


@dataclass(frozen=True)
class Lateness:
    """What the policy makes of a submission.

    Attributes
    ----------
    late : bool
    percent : float
        Taken off.
    said : str
        Why, for people; empty if there is nothing to say.
    base : float, optional
        What the percent are of; default the score.
    """

    late: bool = False
    percent: float = 0.0
    said: str = ""
    base: float | None = None

    def taken(self, score: float) -> float:
        """Points taken off a score."""
        return round(self.percent / 100 * (score if self.base is None else self.base), 2)


@dataclass(frozen=True)
class Handing:
    """When something was handed in, as far as anybody says; `by` is how late a platform says it was."""

    when: datetime | None = None
    by: timedelta | None = None
    flagged: bool = False


@dataclass(frozen=True)
class Policy:
    """A late policy; `extensions` and `handed_in` are by the key of the submission."""

    deadline: datetime
    percent: float
    grace: timedelta
    most: float
    base: float | None
    extensions: Mapping[str, datetime]
    handed_in: Mapping[str, datetime]
    notes: tuple[str, ...] = ()

    @property
    def zone(self) -> tzinfo:
        """What times without a zone are in."""
        assert self.deadline.tzinfo is not None
        return self.deadline.tzinfo

    def of(self, key: str, handing: Handing) -> Lateness:
        """What it makes of a submission.

        Parameters
        ----------
        key : str
        handing : Handing
            When it was handed in; what the policy itself says of that comes first.
        """
        due = self.extensions.get(key, self.deadline)
        extended = f", extended to {_told(due)}" if due > self.deadline else ""
        if (when := self.handed_in.get(key, handing.when)) is not None:
            by = when.astimezone(timezone.utc) - due.astimezone(timezone.utc)  # clocks may change between
        elif handing.by is not None:
            by = handing.by - (due - self.deadline)
        elif handing.flagged:
            return Lateness(True, said="late, but nobody says by how much: nothing is taken")
        else:
            return Lateness()
        if by <= timedelta():
            return Lateness(said=extended.removeprefix(", "))
        if by <= self.grace:
            return Lateness(said=f"{_long(by)} after the deadline{extended}, within the grace")
        days = math.ceil(by / DAY)
        percent = min(self.most, days * self.percent)
        what = "day" if days == 1 else "days"
        cap = f", at most {points(self.most)}%" if percent < days * self.percent else ""
        of = "" if self.base is None else f" of {points(self.base)}"
        reason = f"{days} {what} at {points(self.percent)}%{of}{cap}"
        return Lateness(True, percent, f"late by {_long(by)}{extended} ({reason})", self.base)


def read(path: Path | str, submissions: Sequence[Submission], maximum: float) -> Policy:
    """The policy in a file.

    Parameters
    ----------
    path : path
        A TOML file with a section `[late]`.
    submissions : sequence of Submission
    maximum : float
        Points there are.

    Raises
    ------
    MuslinError
        With what is wrong in it.
    """
    path = Path(path)
    try:
        entries = read_toml(path).get("late")
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise MuslinError(f"The late policy {paths.shown(path)} cannot be read: {why}.") from None
    try:
        return _policy(entries, submissions, maximum)
    except ValueError as error:
        raise MuslinError(
            f"The late policy {paths.shown(path)} cannot be used: {error}.",
            "docs/class.md describes its entries.",
        ) from None


def _policy(entries: Any, submissions: Sequence[Submission], maximum: float) -> Policy:
    if not isinstance(entries, dict):
        raise ValueError("it has no section [late]")
    if unknown := [name for name in entries if name not in ENTRIES]:
        raise ValueError(f"there is no entry {one_line(unknown[0])!r}; there is: {', '.join(ENTRIES)}")
    said = {**ENTRIES, **entries}
    zone = _zone(said["zone"])
    deadline = _moment(said["deadline"], "deadline", zone)
    if said["of"] not in (SCORE, MAXIMUM):
        raise ValueError(f"of is {one_line(str(said['of']))!r}; it is {SCORE!r} or {MAXIMUM!r}")
    meant, notes = overrides.names(submissions), []

    def by_key(name: str, value: Callable[[Any, str], datetime]) -> dict[str, datetime]:
        found: dict[str, datetime] = {}
        for student, entry in _table(said[name], name).items():
            moment = value(entry, f"{name} of {one_line(student)}")
            if tidy_name(student).casefold() not in meant:
                notes.append(f"late policy, {name}: nobody called {one_line(student)} has handed in")
                continue
            key = overrides.the_one(tidy_name(student), meant)
            found[key] = max(moment, found.get(key, moment))
        return found

    def extended(entry: Any, what: str) -> datetime:
        if isinstance(entry, (int, float)) and not isinstance(entry, bool):
            return deadline + DAY * _number(entry, what)
        return _moment(entry, what, deadline.tzinfo)

    return Policy(
        deadline=deadline,
        percent=_number(said["percent-per-day"], "percent-per-day", 100),
        grace=timedelta(minutes=_number(said["grace-minutes"], "grace-minutes")),
        most=_number(said["most-percent"], "most-percent", 100),
        base=maximum if said["of"] == MAXIMUM else None,
        extensions=by_key("extensions", extended),
        handed_in=by_key("handed-in", lambda entry, what: _moment(entry, what, deadline.tzinfo)),
        notes=tuple(notes),
    )


def _table(entry: Any, name: str) -> dict[str, Any]:
    if not isinstance(entry, dict):
        raise ValueError(f"{name} is no table of students")
    return entry


def _number(entry: Any, what: str, most: float = 1e6) -> float:
    if isinstance(entry, bool) or not isinstance(entry, (int, float)) or not 0 <= entry <= most:
        missing = "is missing" if entry is None else f"is no number from 0 to {most:g}"
        raise ValueError(f"{what} {missing}")
    return float(entry)


def _zone(name: Any) -> tzinfo | None:
    if not name:
        return None
    try:
        return ZoneInfo(str(name))
    except (KeyError, ValueError, OSError):
        raise ValueError(f"there is no time zone {one_line(str(name))!r} here") from None


def _moment(entry: Any, what: str, zone: tzinfo | None) -> datetime:
    """A point in time; a day alone is its last minute."""
    if isinstance(entry, str):
        try:
            entry = entry.strip().replace("Z", "+00:00")
            entry = (date if len(entry) == len("2026-03-02") else datetime).fromisoformat(entry)
        except ValueError:
            raise ValueError(f"{what} {one_line(entry)!r} is no point in time") from None
    if isinstance(entry, date) and not isinstance(entry, datetime):
        entry = datetime(entry.year, entry.month, entry.day, 23, 59)
    if not isinstance(entry, datetime):
        raise ValueError(f"{what} is missing" if entry is None else f"{what} is no point in time")
    if entry.tzinfo is None:
        if zone is None:
            raise ValueError(
                f'{what} has no time zone; write {entry:%Y-%m-%dT%H:%M:%S}-05:00, or zone = "America/Toronto"'
            )
        entry = entry.replace(tzinfo=zone)
    return entry


def _told(when: datetime) -> str:
    return f"{when:%Y-%m-%d %H:%M %z}".strip()


def _long(by: timedelta) -> str:
    """How long, in the two largest units; a minute that has begun counts."""
    minutes = math.ceil(by / timedelta(minutes=1))
    days, hours, minutes = minutes // 1440, minutes // 60 % 24, minutes % 60
    parts = [(days, f"{days} day" + "s" * (days != 1)), (hours, f"{hours} h"), (minutes, f"{minutes} min")]
    return " ".join([text for count, text in parts if count][:2])


# What platforms say of time -------------------------------------------------------------------------------

_UNITS = {"day": DAY, "hour": timedelta(hours=1), "min": timedelta(minutes=1), "sec": timedelta(seconds=1)}
_FORMS = (
    "%A, %d %B %Y, %I:%M %p", "%A, %d %B %Y, %I:%M:%S %p", "%A, %d %B %Y, %H:%M", "%d %B %Y, %I:%M %p",
    "%Y-%m-%d %H:%M:%S %z", "%Y-%m-%d %H:%M:%S", "%Y-%m-%d %H:%M",
)  # fmt: skip


def moment(text: str, zone: tzinfo) -> datetime | None:
    """A point in time as Moodle and Gradescope write it; nothing if it is not one."""
    text = " ".join(text.split())
    for form in _FORMS:
        try:
            found = datetime.strptime(text, form)
        except ValueError:
            continue
        return found if found.tzinfo else found.replace(tzinfo=zone)
    return None


def lateness(text: str) -> timedelta | None:
    """How late, from `26:10:05` (Gradescope), or from `... 1 day 2 hours late` (Moodle); nothing if neither."""
    if match := re.fullmatch(r"\s*(\d+):(\d\d):(\d\d)\s*", text):
        hours, minutes, seconds = map(int, match.groups())
        return timedelta(hours=hours, minutes=minutes, seconds=seconds)
    match = re.search(r"((?:\d+ (?:day|hour|min|sec)s? ?)+)late", text)
    if match is None:
        return None
    said = re.findall(r"(\d+) (day|hour|min|sec)", match[1])
    return sum((int(count) * _UNITS[unit] for count, unit in said), timedelta())


def committed(folder: Path) -> datetime | None:
    """When the commit was made that is checked out in a clone, by the clock of whoever made it.

    Git reads the clone's objects only, never its configuration, which may name programs to run.
    """
    git = shutil.which("git")
    try:
        commit = _checked_out(folder / ".git") if git else None
        if git is None or commit is None:
            return None
        with tempfile.TemporaryDirectory() as empty:
            environment = {k: v for k, v in os.environ.items() if not k.startswith("GIT_")}
            own = {"GIT_CONFIG_NOSYSTEM": "1", "HOME": empty, "XDG_CONFIG_HOME": empty}
            subprocess.run(
                [git, "init", "-q", "--bare", empty], env=environment | own, check=True, timeout=30
            )
            own["GIT_OBJECT_DIRECTORY"] = str((folder / ".git" / "objects").resolve())
            said = subprocess.run(
                [git, "--git-dir", empty, "cat-file", "commit", commit], env=environment | own, check=True,
                capture_output=True, timeout=30,
            ).stdout  # fmt: skip
    except (OSError, subprocess.SubprocessError):
        return None
    match = re.search(rb"^committer .* (\d{1,11}) ([+-]\d{4})$", said.split(b"\n\n")[0], re.M)
    if match is None:
        return None
    return _at(int(match[1]), match[2].decode())


def _at(seconds: int, zone: str) -> datetime | None:
    try:
        return datetime.fromtimestamp(seconds, datetime.strptime(zone, "%z").tzinfo)
    except (ValueError, OverflowError):
        return None


def _checked_out(git: Path) -> str | None:
    """The commit that is checked out."""
    head = (git / "HEAD").read_text(encoding="utf-8", errors="replace").strip()
    if head.startswith("ref: "):
        name = head.removeprefix("ref: ")
        if not re.fullmatch(r"refs/heads/[\w./-]+", name) or ".." in name:
            return None
        loose = git / name
        if loose.is_file():
            head = loose.read_text(encoding="utf-8", errors="replace").strip()
        else:
            packed = (git / "packed-refs").read_text(encoding="utf-8", errors="replace")
            head = next((line.split()[0] for line in packed.splitlines() if line.endswith(f" {name}")), "")
    return head if re.fullmatch(r"[0-9a-f]{40}|[0-9a-f]{64}", head) else None
