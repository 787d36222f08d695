"""What being late costs, against a table worked by hand."""

from __future__ import annotations

import csv
import io
import subprocess
from datetime import datetime, timedelta, timezone

import grading_samples as samples
import pytest

from muslin import tasks
from muslin.base.errors import MuslinError
from muslin.classes import finding, gradebook, late
from muslin.classes.finding import Student, Submission
from muslin.classes.gradebook import Row
from muslin.classes.overrides import Override
from muslin.classes.returning import Desk, Wanted

TABLE = tasks.assignment("cloth")
TORONTO = timezone(timedelta(hours=-5))
DEADLINE = datetime(2026, 3, 2, 23, 59, tzinfo=TORONTO)

RULES = """
[late]
deadline = 2026-03-02T23:59:00-05:00
percent-per-day = 10
grace-minutes = 15
most-percent = 30

[late.extensions]
"Ext Ended" = 2
"Dated" = 2026-03-05T12:00:00-05:00
"""

#: Who, when, score before; and by hand what is taken and what is left.
BY_HAND = [
    ("Early", "2026-03-01 08:00", 80, 0, 80),
    ("To the minute", "2026-03-02 23:59", 80, 0, 80),
    ("In the grace", "2026-03-03 00:14", 80, 0, 80),
    ("After it", "2026-03-03 00:15", 80, 8, 72),  # 16 minutes: the first day has begun
    ("A day", "2026-03-03 23:59", 80, 8, 72),  # 24 h sharp: one day
    ("A day and a minute", "2026-03-04 00:00", 80, 16, 64),
    ("Three days", "2026-03-05 20:00", 80, 24, 56),  # 68 h 1 min: three days
    ("A week", "2026-03-09 23:59", 80, 24, 56),  # seven days, capped at 30 %
    ("Odd", "2026-03-03 12:00", 33.33, 3.33, 30),
    ("Nothing", "2026-03-03 12:00", 0, 0, 0),
    ("Ext Ended", "2026-03-04 23:59", 80, 0, 80),  # two days more, to the minute
    ("ext ended", "2026-03-05 12:00", 80, 8, 72),  # 12 h 1 min after the longer deadline
    ("Dated", "2026-03-05 12:10", 80, 0, 80),  # within the grace after the longer deadline
]


def submitted(name, when=None, flagged=False):
    moment = datetime.strptime(when, "%Y-%m-%d %H:%M").replace(tzinfo=TORONTO) if when else None
    return Submission(name.lower().replace(" ", "-"), (Student(name),), (), flagged, when or "", moment)


def policy(tmp_path, found, rules=RULES, **wanted):
    (tmp_path / "class.toml").write_text(rules, encoding="utf-8")
    return Desk(Wanted(rules=tmp_path / "class.toml", **wanted), found, TABLE)


def row(desk, submission, score):
    return Row(submission, samples.perfect(), "", tuple(scored(score)), (), desk.lateness(submission))


def scored(score):
    """A hundred points taken down to a score, task by task, so that the total is none set by hand."""
    left = score
    for task in TABLE.tasks.values():
        mine = min(left, task.points)
        left = round(left - mine, 2)
        yield Override(task.name, mine, "x", task.points)


@pytest.mark.parametrize(
    ("name", "when", "before", "taken", "after"), BY_HAND, ids=[line[0] for line in BY_HAND]
)
def test_the_policy_gives_what_was_worked_out_by_hand(name, when, before, taken, after, tmp_path):
    one = submitted(name, when)
    made = row(policy(tmp_path, [one]), one, before)
    assert (made.total, made.taken, made.counts) == (before, taken, after)


def test_percent_may_be_of_the_maximum_and_never_lead_below_zero(tmp_path):
    found = [submitted("A", "2026-03-03 12:00"), submitted("B", "2026-03-04 12:00")]
    desk = policy(tmp_path, found, RULES.replace("grace", 'of = "maximum"\ngrace'))
    assert [row(desk, one, score).counts for one, score in zip(found, (80, 12), strict=True)] == [70, 0]
    assert row(desk, found[1], 12).taken == 12


def test_grades_hold_the_score_before_and_after_and_the_reason(tmp_path):
    one, punctual = submitted("Three Days", "2026-03-05 20:00"), submitted("Punctual", "2026-03-01 10:00")
    desk = policy(tmp_path, [one, punctual])
    lines = list(
        csv.DictReader(
            io.StringIO(gradebook.grades_csv([row(desk, one, 80), row(desk, punctual, 80)], TABLE))
        )
    )
    assert [(x["score"], x["before late"], x["taken for late"], x["late"]) for x in lines] == [
        ("80", "80", "", ""), ("56", "80", "24", "yes"),
    ]  # fmt: skip
    assert "late by 2 days 20 h (3 days at 10%): 80 - 24 = 56" in lines[1]["notes"]
    assert "2 days 20 h" not in lines[0]["notes"]
    plain = gradebook.grades_csv([Row(one, samples.perfect())], TABLE)
    assert "before late" not in plain


def test_a_total_set_by_hand_is_what_counts(tmp_path):
    one = submitted("A", "2026-03-05 20:00")
    made = Row(
        one,
        samples.perfect(),
        "",
        (Override("", 61, "agreed", 100),),
        (),
        policy(tmp_path, [one]).lateness(one),
    )
    assert made.counts == 61
    assert "nothing is taken off a total set by hand" in made.told()


def test_late_by_nobody_knows_how_much_costs_nothing_until_somebody_says(tmp_path):
    one = submitted("doejane", flagged=True)
    unsaid = row(policy(tmp_path, [one]), one, 80)
    assert (unsaid.counts, unsaid.was_late) == (80, True)
    assert "nobody says by how much" in unsaid.told()
    said = RULES + '[late.handed-in]\n"doejane" = 2026-03-04T12:00:00-05:00\n'
    assert row(policy(tmp_path, [one], said), one, 80).counts == 64


def test_the_clocks_going_forward_between_deadline_and_submission_make_no_hour(tmp_path):
    """Toronto's clocks went forward on 8 March 2026: noon to noon was 23 hours, and that is one day begun."""
    rules = '[late]\nzone = "America/Toronto"\ndeadline = 2026-03-07T12:00:00\npercent-per-day = 10\n'
    said = '[late.handed-in]\n"a" = 2026-03-08T12:30:00\n'
    one = submitted("a")
    made = row(policy(tmp_path, [one], rules + said), one, 80)
    assert made.taken == 8
    assert "late by 23 h 30 min" in made.told()


@pytest.mark.parametrize("day", ["2026-03-02", "'2026-03-02'", '"2026-03-02"'])
def test_a_day_alone_is_its_last_minute_quoted_or_not(day, tmp_path):
    rules = f'[late]\nzone = "America/Toronto"\ndeadline = {day}\npercent-per-day = 10\n'
    on_time, late_ = submitted("a", "2026-03-02 23:59"), submitted("b", "2026-03-03 00:00")
    desk = policy(tmp_path, [on_time, late_], rules)
    assert row(desk, on_time, 80).taken == 0
    assert row(desk, late_, 80).taken == 8
    with pytest.raises(MuslinError, match="write 2026-03-02T23:59:00-05:00"):
        policy(tmp_path, [on_time], rules.replace('zone = "America/Toronto"\n', ""))


@pytest.mark.parametrize(
    ("rules", "said"),
    [
        ("[late]\npercent-per-day = 10\n", "deadline is missing"),
        ("[late]\ndeadline = 2026-03-02T23:59:00\npercent-per-day = 10\n", "deadline has no time zone"),
        ("[late]\ndeadline = 2026-03-02T23:59:00Z\n", "percent-per-day is missing"),
        ("[late]\ndeadline = 2026-03-02T23:59:00Z\npercent-per-day = 110\n", "is no number from 0 to 100"),
        ("[late]\ndeadline = 2026-03-02T23:59:00Z\npercent_per_day = 1\n", "no entry 'percent_per_day'"),
        ("[late]\ndeadline = 'soon'\npercent-per-day = 1\n", "'soon' is no point in time"),
        ("[late]\nzone = 'Mars/Olympus'\ndeadline = 2026-03-02\npercent-per-day = 1\n", "no time zone 'Mars/Olympus'"),
        ("[late]\ndeadline = 2026-03-02T23:59:00Z\npercent-per-day = 1\nof = 'all'\n", "it is 'score' or 'maximum'"),
        (RULES + '"Twin" = 1\n', "'Twin' may be twin-1, twin-2"),
        ("[lates]\n", "no section 'lates'"),
        ("[late\n", "cannot be read"),
        ("late = 3\n", "no section [late]"),
    ],
)  # fmt: skip
def test_rules_that_cannot_be_used_are_refused_with_the_reason(rules, said, tmp_path):
    found = [Submission(f"twin-{k}", (Student("Twin", str(k)),), ()) for k in (1, 2)]
    with pytest.raises(MuslinError) as error:
        policy(tmp_path, found, rules)
    assert said in str(error.value)


def test_an_extension_for_someone_who_has_not_handed_in_yet_is_noted_and_stops_nobody(tmp_path):
    desk = policy(tmp_path, [submitted("A", "2026-03-03 12:00")])
    assert desk.notes[0] == "late policy, extensions: nobody called Ext Ended has handed in"


# What platforms say of time --------------------------------------------------------------------------------


def test_moodles_worksheet_says_when_and_gradescopes_grades_how_late(tmp_path):
    """Moodle: 1 day and 4 h 1 min after the deadline; Gradescope: 26 h 10 min after its own."""
    worksheet = (
        "Identifier,Full name,Email address,Status,Grade,Maximum Grade,Grade can be changed,"
        "Last modified (submission)\n"
        'Participant 1,A B,a@x,Submitted for grading,,100,Yes,"Wednesday, 4 March 2026, 4:00 AM"\n'
        'Participant 2,C D,c@x,Submitted for grading - 1 day 2 hours late,,100,Yes,-\n'
        'Participant 3,E F,e@x,Submitted for grading,,100,Yes,-\n'
    )  # fmt: skip
    grades = (
        "First Name,Last Name,SID,Total Score,Max Points,Lateness (H:M:S)\n"
        "A,B,1,,100,26:10:05\nC,D,2,,100,00:00:00\nE,F,3,,100,\n"
    )
    found = [
        Submission(name, (Student(name, number),), ())
        for name, number in (("a b", "1"), ("c d", "2"), ("e f", "3"))
    ]
    for text, percents in ((worksheet, [20, 20, 0]), (grades, [20, 0, 0])):
        (tmp_path / "roster.csv").write_text(text)
        desk = policy(tmp_path, found, roster=tmp_path / "roster.csv")
        assert [desk.lateness(one).percent for one in found] == percents


def test_gradescopes_metadata_say_when(tmp_path):
    (tmp_path / "in" / "submission_1").mkdir(parents=True)
    (tmp_path / "in" / "submission_1" / "stress.py").write_text("#\n")
    (tmp_path / "in" / "submission_metadata.yml").write_text(
        "---\nsubmission_1:\n  :submitters:\n  - :name: Jane\n    :sid: '7'\n  :created_at: 2026-03-04 05:00:30 Z\n"
    )
    (one,), _ = finding.find(tmp_path / "in", TABLE)
    assert one.when == datetime(2026, 3, 4, 5, 0, 30, tzinfo=timezone.utc)
    assert policy(tmp_path, [one]).lateness(one).percent == 20  # a day and a minute and a half


def git(folder, *words, **more):
    environment = {"GIT_CONFIG_GLOBAL": "/dev/null", "HOME": str(folder), "PATH": "/usr/bin:/bin", **more}
    subprocess.run(["git", "-C", str(folder), *words], check=True, capture_output=True, env=environment)


@pytest.mark.parametrize("packed", [False, True], ids=["loose", "packed"])
def test_a_clone_says_when_its_commit_was_made_and_runs_nothing(packed, tmp_path):
    clone = tmp_path / "in" / "cloth-jane"
    clone.mkdir(parents=True)
    git(clone, "init", "-q", "-b", "main")
    (clone / "stress.py").write_text("#\n")
    when = {"GIT_COMMITTER_DATE": "2026-03-03T12:00:00-0500", "GIT_AUTHOR_DATE": "2020-01-01T00:00:00-0500"}
    git(clone, "add", "stress.py")
    git(clone, "-c", "user.name=J", "-c", "user.email=j@x", "commit", "-q", "-m", "committer 9 +0000", **when)
    if packed:
        git(clone, "gc", "-q")
        git(clone, "pack-refs", "--all")
    trap = tmp_path / "ran"
    (clone / "evil").write_text(f"#!/bin/sh\ntouch {trap}\n")
    (clone / "evil").chmod(0o755)
    with open(clone / ".git" / "config", "a") as config:
        config.write(
            f"[core]\n fsmonitor = {clone}/evil\n pager = {clone}/evil\n[log]\n showSignature = true\n"
        )
        config.write(f"[gpg]\n program = {clone}/evil\n")
    assert late.committed(clone) == datetime(2026, 3, 3, 12, 0, tzinfo=TORONTO)
    (tmp_path / "in" / "cloth-jim").mkdir()
    (tmp_path / "in" / "cloth-jim" / "stress.py").write_text("#\n")
    found, _ = finding.find(tmp_path / "in", TABLE)
    assert [policy(tmp_path, found).lateness(one).percent for one in found] == [10, 0]
    assert not trap.exists()


@pytest.mark.parametrize(
    "head", ["", "ref: refs/heads/../../../x", "ref: refs/heads/gone", "0" * 40, "--help"]
)
def test_a_clone_that_is_none_says_nothing(head, tmp_path):
    (tmp_path / ".git" / "objects").mkdir(parents=True)
    (tmp_path / ".git" / "HEAD").write_text(head)
    assert late.committed(tmp_path) is None
