"""What goes back to the platform: its own table with the scores in it, and each student's report, named for upload."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from muslin.authoring.wheel import read_toml, write_zip
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.base.text import one_line
from muslin.classes import late, overrides
from muslin.classes.finding import Submission, tidy_name
from muslin.classes.gradebook import Row
from muslin.classes.late import Handing, Lateness
from muslin.classes.layouts import claimed
from muslin.classes.ledger import write
from muslin.classes.roster import Entry, Match, Person, Roster
from muslin.grading.archives import readable
from muslin.grading.views.text import points
from muslin.tasks import Assignment

#: Where it lies in the report, and the names of what is in it.
UPLOAD, FEEDBACK, REPORT = "upload", "feedback.zip", "feedback.html"


@dataclass(frozen=True)
class Wanted:
    """What an instructor asks for.

    Attributes
    ----------
    roster : path, optional
        The platform's table of the class.
    column : str, optional
        Its column of scores; default the one that looks like it.
    scale : bool
        Whether scores are scaled to the points the platform gives.
    missing : float, optional
        Score of who handed in nothing; default none.
    rules : path, optional
        A TOML file with `[late]` and `[who]`.
    feedback : bool
        Whether reports are put together for upload.
    """

    roster: Path | str | None = None
    column: str | None = None
    scale: bool = False
    missing: float | None = None
    rules: Path | str | None = None
    feedback: bool = False


@dataclass
class Returned:
    """What went back: files, who is who, and what a person should know."""

    files: list[Path] = field(default_factory=list)
    match: Match | None = None
    notes: list[str] = field(default_factory=list)

    def told(self) -> list[tuple[str, list[str]]]:
        """Who is missing, who matched nobody and who cannot be told apart: what it is, and whom it is about."""
        if self.match is None:
            return []
        apart = [
            f"{_entry(entry)}: may be {' or '.join(_person(p) for p in people)}"
            for entry, people in self.match.ambiguous
        ]
        said = [
            ("On the roster, handed in nothing", [_person(person) for person in self.match.missing]),
            ("Handed in, not on the roster", [_entry(entry) for entry in self.match.nobody]),
            ("Not certain who it is, so nobody was matched", apart),
            ("Left alone", self.notes),
        ]
        return [(what, whom) for what, whom in said if whom]


class Desk:
    """Everything that is to go back; what is wrong with it is said before anything is graded.

    Parameters
    ----------
    wanted : Wanted
    found : sequence of Submission
    table : Assignment

    Raises
    ------
    MuslinError
        If the roster or the rules cannot be used, or something is asked for that needs a roster.
    """

    def __init__(self, wanted: Wanted, found: Sequence[Submission], table: Assignment):
        self._wanted, self._table = wanted, table
        self._most = float(sum(task.points for task in table.tasks.values()))
        if wanted.roster is None and (wanted.column or wanted.scale or wanted.missing is not None):
            raise MuslinError("--column, --scale and --missing are about a roster.", "Name it with --roster.")
        said, policy = _rules(wanted.rules, found)
        self._policy = late.read(wanted.rules, found, self._most) if wanted.rules and policy else None
        self._roster = Roster(wanted.roster) if wanted.roster else None
        self._column, self._match = 0, None
        if self._roster:
            self._column = self._roster.column(table, wanted.column)
            entries = [(submission.key, student) for submission in found for student in submission.students]
            self._match = self._roster.match(entries, said)

    @property
    def files(self) -> tuple[Path | str | None, ...]:
        """The instructor's own files."""
        return self._wanted.roster, self._wanted.rules

    @property
    def notes(self) -> tuple[str, ...]:
        """What a person should know before all else."""
        return self._policy.notes if self._policy else ()

    def people(self, submission: Submission) -> list[Person]:
        """Who of the roster its students are, as far as that is certain."""
        found = self._match.found if self._match else {}
        return [found[entry] for s in submission.students if (entry := (submission.key, s)) in found]

    def lateness(self, submission: Submission) -> Lateness | None:
        """What the late policy makes of a submission; nothing without one."""
        if self._policy is None:
            return None
        when, by = submission.when, None
        if when is None and self._roster and self._match:
            for student in submission.students:
                if person := self._match.found.get((submission.key, student)):
                    when, by = self._roster.handing(person, self._policy.zone)
                    break
        if when is None and by is None and len(submission.sources) == 1:
            folder = submission.sources[0].path
            when = late.committed(folder) if (folder / ".git").is_dir() else None
        return self._policy.of(submission.key, Handing(when, by, submission.late))

    def hand_back(self, folder: Path, rows: Sequence[Row]) -> Returned:
        """Write what goes back into the report's folder."""
        returned = Returned(match=self._match)
        if self._roster and self._match:
            returned.files.append(self._filled(folder, rows, self._roster, self._match, returned.notes))
        if self._wanted.feedback:
            files = _feedback(folder, rows)
            if files:
                packed = io.BytesIO()
                write_zip(packed, files)
                write(folder / UPLOAD / FEEDBACK, packed.getvalue())
                returned.files.append(folder / UPLOAD / FEEDBACK)
            else:
                returned.notes.append("feedback: nothing here is named as Canvas or Moodle name it")
        return returned

    def _filled(
        self, folder: Path, rows: Sequence[Row], roster: Roster, match: Match, notes: list[str]
    ) -> Path:
        most = roster.most(self._column)
        factor = most / self._most if self._wanted.scale and most else 1.0
        if most is not None and most != self._most and not self._wanted.scale:
            notes.append(
                f"the platform gives {points(most)} points, the assignment {points(self._most)}: "
                "scores are written as they are; --scale makes them fit"
            )
        by_key = {row.key: row for row in rows}
        scores = {}
        for (key, _), person in match.found.items():
            if (score := by_key[key].counts) is None:
                notes.append(f"{person.told}: handed in, and has no score: {by_key[key].error}")
            else:
                scores[person] = round(score * factor, 2)
        missing, unsure = self._wanted.missing, len(match.nobody) + len(match.ambiguous)
        if missing is not None and unsure and match.missing:
            notes.append(
                f"--missing {points(missing)} was written for nobody: {unsure} who handed in are not matched, and "
                "may be among the missing. Say who they are in [who] of the rules"
            )
            missing = None
        data, left = roster.filled(scores, self._column, self._table.title, missing, match.missing)
        notes += left
        path = folder / UPLOAD / roster.path.name
        write(path, data)
        return path


def _rules(path: Path | str | None, found: Sequence[Submission]) -> tuple[dict[str, str], bool]:
    """Who is who, as the rules say, by the key of the submission; and whether they have a late policy."""
    if path is None:
        return {}, False
    try:
        rules = read_toml(Path(path))
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or error
        raise MuslinError(f"The rules {paths.shown(path)} cannot be read: {why}.") from None
    try:
        if unknown := [name for name in rules if name not in ("late", "who")]:
            raise ValueError(f"there is no section {one_line(unknown[0])!r}; there is: late, who")
        who, meant = rules.get("who", {}), overrides.names(found)
        if not isinstance(who, dict) or not all(isinstance(value, (str, int)) for value in who.values()):
            raise ValueError("[who] says of a student who it is on the roster, in quotes")
        return {
            overrides.the_one(tidy_name(key), meant): str(value) for key, value in who.items()
        }, "late" in rules
    except ValueError as error:
        raise MuslinError(
            f"The rules {paths.shown(path)} cannot be used: {error}.", "docs/class.md describes them."
        ) from None


def _feedback(folder: Path, rows: Sequence[Row]) -> dict[str, bytes]:
    """Each student's report, named as the platform named what they handed in."""
    files = {}
    for row in rows:
        report = folder / "reports" / f"{row.key}.html"
        place = _place(row.submission)
        if place and report.is_file():
            files[place] = report.read_bytes()
    return dict(sorted(files.items()))


def _place(submission: Submission) -> str:
    """Where Canvas or Moodle look for feedback on a submission; nothing if neither gave it."""
    for source in sorted(submission.sources, key=lambda source: -source.upload):
        name, folder = readable(source.path.name), source.path.is_dir()
        claim = claimed(name, folder)
        if claim is None:
            continue
        if "_assignsubmission_" in name:
            return f"{name}/{REPORT}" if folder else name.removesuffix(claim.inside) + REPORT
        if source.upload:
            return name.removesuffix(claim.inside) + REPORT
    return ""


def _person(person: Person) -> str:
    """Someone on the roster, told apart from others of the name."""
    return one_line(
        " ".join(filter(None, (person.told, f"({person.numbers[0]})" if person.numbers else ""))), 80
    )


def _entry(entry: Entry) -> str:
    return one_line(" ".join(filter(None, (entry[1].name, f"({entry[1].id})" if entry[1].id else ""))), 80)
