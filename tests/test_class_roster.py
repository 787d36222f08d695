"""The platform's own table goes in and comes out: only one column differs, and nobody gets another's score."""

from __future__ import annotations

import csv
import io
import zipfile

import grading_samples as samples
import pytest

from muslin import tasks
from muslin.base.errors import MuslinError
from muslin.classes import finding, gradebook
from muslin.classes.finding import Student, Submission
from muslin.classes.gradebook import Row
from muslin.classes.overrides import Override
from muslin.classes.returning import Desk, Wanted
from muslin.classes.roster import Roster
from muslin.classes.tables import Sheet
from muslin.grading.submission import Source

TABLE = tasks.assignment("cloth")
STUB = b"# nothing yet\n"

#: First and last names of a class of 60; every tenth in letters beyond ASCII, with marks, or with quotes.
ODD = [
    ("Zoë", "Ångström"),
    ("小龙", "李"),
    ("Tim", "O'Hara"),
    ("Ana", "Šimić-Vuković"),
    ('J. "Jay"', "van der Berg"),
    ("José", "Nuñez"),
]
CLASS = [ODD[k // 10] if k % 10 == 0 else (f"First{k}", f"Last{k}") for k in range(60)]


def letters(text):
    """As Canvas writes a name before a file."""
    return "".join(letter for letter in text.lower() if letter.isalnum())


def sortable(k):
    return f"{CLASS[k][1]}, {CLASS[k][0]}"


def quoted(cell):
    return '"' + cell.replace('"', '""') + '"' if any(letter in cell for letter in ',"') else cell


CANVAS_HEAD = [
    "Student", "ID", "SIS User ID", "SIS Login ID", "Section", "Homework 0 (4100)", "Cloth animation (4217)",
    "Assignments Current Points", "Current Score", "Final Grade",
]  # fmt: skip


def canvas_row(k, score=""):
    now = {17: "EX", 18: "12"}.get(k, "")
    return [
        sortable(k), str(90000 + k), f"s{1000 + k}", f"login{k}", "LEC0101 and TUT0102" if k % 7 == 0 else "LEC0101",
        f"{k}.50", score or now, "0", "", "F",
    ]  # fmt: skip


def canvas(scores=None):
    """Canvas' gradebook as it exports it: a mark, three rows at the head, the test student at the end."""
    scores = scores or {}
    rows = [
        CANVAS_HEAD,
        ["", "", "", "", "", "Manual Posting", "", "", "", ""],
        [
            "    Points Possible",
            "",
            "",
            "",
            "",
            "10.00",
            "100.00",
            "(read only)",
            "(read only)",
            "(read only)",
        ],
        *(canvas_row(k, scores.get(k, "")) for k in range(60)),
        ["Student, Test", "99999", "", "f3a9c0", "CSC2549 LEC0101", "", "", "0", "", "F"],
    ]
    return ("\ufeff" + "".join(",".join(map(quoted, row)) + "\r\n" for row in rows)).encode()


def handed_in(folder, absent=(), late=()):
    """A download of Canvas in which everybody but the absent has a file."""
    folder.mkdir()
    for k in range(60):
        if k not in absent:
            flag = "LATE_" if k in late else ""
            name = f"{letters(CLASS[k][1])}{letters(CLASS[k][0])}_{flag}{90000 + k}_{70000 + k}_stress.py"
            (folder / name).write_bytes(STUB)
    return finding.find(folder, TABLE)[0]


def graded(found, score=lambda k: 40 + k / 2):
    """Rows with scores as if they had been graded: by hand, so that each is another."""
    return [
        Row(s, samples.stubs(), "", (Override("", score(int(s.students[0].id) - 90000), "x", 100),))
        for s in found
    ]


def back(tmp_path, found, rows, data, name="gradebook.csv", **wanted):
    (tmp_path / name).write_bytes(data)
    desk = Desk(Wanted(roster=tmp_path / name, **wanted), found, TABLE)
    returned = desk.hand_back(tmp_path / "report", rows)
    return (tmp_path / "report" / "upload" / name).read_bytes(), returned


def told(returned):
    return dict(returned.told())


def test_canvas_gradebook_of_sixty_comes_back_with_one_column_filled_and_no_other_byte_changed(tmp_path):
    found = handed_in(tmp_path / "submissions", absent={5, 17})
    assert len(found) == 58
    filled, returned = back(tmp_path, found, graded(found), canvas())
    expected = {k: f"{40 + k / 2:g}" for k in range(60) if k not in (5, 17)}
    assert filled == canvas(
        expected
    )  # 18 had a 12 before; 17 is excused, 5 handed in nothing: both as they were
    assert told(returned) == {
        "On the roster, handed in nothing": [f"{sortable(5)} (90005)", f"{sortable(17)} (90017)"]
    }


def test_what_python_reads_of_the_filled_gradebook_differs_in_that_column_alone(tmp_path):
    found = handed_in(tmp_path / "submissions")
    filled, _ = back(tmp_path, found, graded(found), canvas())
    before, after = (
        list(csv.reader(io.StringIO(data.decode("utf-8-sig"), newline=""))) for data in (canvas(), filled)
    )
    assert len(before) == len(after) == 64
    differ = {(i, j) for i, row in enumerate(before) for j, cell in enumerate(row) if after[i][j] != cell}
    assert {column for _, column in differ} == {6}
    assert {row for row, _ in differ} == set(range(3, 63)) - {3 + 17}


def test_a_missing_score_is_written_only_if_asked_and_never_over_what_stands_there(tmp_path):
    found = handed_in(tmp_path / "submissions", absent={5, 17, 18})
    filled, returned = back(tmp_path, found, graded(found), canvas(), missing=0.0)
    expected = {k: f"{40 + k / 2:g}" for k in range(60) if k not in (5, 17, 18)} | {5: "0"}
    assert filled == canvas(expected)
    assert told(returned)["Left alone"] == [
        f"{sortable(17)}: excused, left so", f"{sortable(18)}: handed in nothing and has 12 already, left so",
    ]  # fmt: skip


def test_nobody_gets_a_zero_while_somebody_who_handed_in_is_unknown(tmp_path):
    found = handed_in(tmp_path / "submissions", absent={5})
    stranger = Submission("stranger", (Student("Nobody Known", "1"),), ())
    rows = [*graded(found), Row(stranger, samples.perfect())]
    filled, returned = back(tmp_path, [*found, stranger], rows, canvas(), missing=0.0)
    assert filled == canvas({k: f"{40 + k / 2:g}" for k in range(60) if k not in (5, 17)})
    assert told(returned)["Handed in, not on the roster"] == ["Nobody Known (1)"]
    assert "--missing 0 was written for nobody" in told(returned)["Left alone"][0]


def test_who_is_who_can_be_said_by_a_person(tmp_path):
    found = handed_in(tmp_path / "submissions", absent={5})
    stranger = Submission("stranger", (Student("Nobody Known", "1"),), ())
    (tmp_path / "class.toml").write_text('[who]\n"Nobody Known" = "s1005"\n')
    rows = [*graded(found), Row(stranger, samples.perfect())]
    filled, returned = back(
        tmp_path, [*found, stranger], rows, canvas(), missing=0.0, rules=tmp_path / "class.toml"
    )
    assert filled == canvas({k: f"{40 + k / 2:g}" for k in range(60) if k not in (5, 17)} | {5: "100"})
    assert told(returned) == {"Left alone": [f"{sortable(17)}: excused, left so"]}


def test_a_submission_without_a_score_leaves_the_cell_and_says_why(tmp_path):
    found = handed_in(tmp_path / "submissions")
    rows = graded(found)
    spoilt = next(k for k, row in enumerate(rows) if row.submission.students[0].id == "90003")
    rows[spoilt] = Row(rows[spoilt].submission, None, "the archive is damaged")
    filled, returned = back(tmp_path, found, rows, canvas())
    assert filled == canvas({k: f"{40 + k / 2:g}" for k in range(60) if k not in (3, 17)})
    assert (
        f"{sortable(3)}: handed in, and has no score: the archive is damaged" in told(returned)["Left alone"]
    )


def test_scores_are_scaled_only_if_asked_and_a_difference_is_said(tmp_path):
    found, ten = handed_in(tmp_path / "submissions"), canvas().replace(b"10.00,100.00", b"10.00,10.00")
    plain, returned = back(tmp_path, found, graded(found), ten)
    assert "gives 10 points, the assignment 100" in told(returned)["Left alone"][0]
    scaled, returned = back(tmp_path, found, graded(found), ten, scale=True)
    cells = [row[6] for row in csv.reader(io.StringIO(scaled.decode("utf-8-sig"), newline=""))][3:5]
    assert cells == ["4", "4.05"]
    assert [row[6] for row in csv.reader(io.StringIO(plain.decode("utf-8-sig"), newline=""))][3:5] == [
        "40",
        "40.5",
    ]


@pytest.mark.parametrize("wanted", ["Cloth animation", "cloth animation (4217)", "4217"])
def test_a_column_is_named_with_its_number_or_without(wanted, tmp_path):
    (tmp_path / "g.csv").write_bytes(canvas())
    assert Roster(tmp_path / "g.csv").column(TABLE, wanted) == 6


def test_a_column_that_is_not_certain_is_asked_for_and_totals_are_none(tmp_path):
    data = canvas().replace(b"Cloth animation (4217)", b"Assignment 4 (4217)")
    (tmp_path / "g.csv").write_bytes(data)
    for wanted in (None, "Current Score", "Assignment"):
        if wanted == "Assignment":
            assert Roster(tmp_path / "g.csv").column(TABLE, wanted) == 6  # a part that only one has
            continue
        with pytest.raises(MuslinError, match=r"there is: Homework 0 \(4100\), Assignment 4 \(4217\)"):
            Roster(tmp_path / "g.csv").column(TABLE, wanted)


# Moodle ----------------------------------------------------------------------------------------------------

MOODLE_HEAD = (
    "Identifier,Full name,Email address,Status,Grade,Maximum Grade,Grade can be changed,"
    "Last modified (submission),Last modified (grade),Feedback comments"
)


def moodle(scores=None, most="100.00"):
    scores, rows = scores or {}, [MOODLE_HEAD]
    for k in range(60):
        name = quoted(" ".join(CLASS[k]))
        name = name if name.startswith('"') else f'"{name}"'  # Moodle quotes what has a blank
        submitted = '"Monday, 2 March 2026, 11:58 PM"' if k else "-"
        score = scores.get(k, "")
        rows.append(
            f'"Participant {700 + k}",{name},u{k}@example.edu,"Submitted for grading",{score},"{most}",'
            f'{"No" if k == 9 else "Yes"},{submitted},-,"well,\nread this ""twice"""'
        )
    return "".join(row + "\n" for row in rows).encode()


def moodle_class(folder, absent=()):
    for k in range(60):
        if k not in absent:
            home = folder / f"{' '.join(CLASS[k]).replace('/', '')}_{700 + k}_assignsubmission_file_"
            home.mkdir(parents=True)
            (home / "stress.py").write_bytes(STUB)
    return finding.find(folder, TABLE)[0]


def moodle_rows(found):
    return [
        Row(s, None, "", (Override("", 40 + (int(s.students[0].id) - 700) / 2, "x", 100),)) for s in found
    ]


def test_moodle_worksheet_of_sixty_comes_back_with_the_grades_filled_and_no_other_byte_changed(tmp_path):
    found = moodle_class(tmp_path / "submissions", absent={0})
    filled, returned = back(tmp_path, found, moodle_rows(found), moodle())
    assert filled == moodle({k: f"{40 + k / 2:g}" for k in range(1, 60) if k != 9})
    assert told(returned) == {
        "On the roster, handed in nothing": ["Zoë Ångström (Participant 700)"],
        "Left alone": ["First9 Last9: the platform says that the grade cannot be changed"],
    }


def test_moodle_in_a_language_with_decimal_commas_gets_them(tmp_path):
    found = moodle_class(tmp_path / "submissions")
    filled, _ = back(tmp_path, found, moodle_rows(found), moodle(most="100,00"))
    assert filled == moodle(
        {
            k: f'"{40 + k / 2:g}"'.replace(".", ",") if k % 2 else f"{40 + k / 2:g}"
            for k in range(60)
            if k != 9
        },
        "100,00",
    )


def test_a_worksheet_of_another_assignment_gives_nobody_another_persons_grade(tmp_path):
    """Its numbers are others': 701 is someone else there."""
    found = moodle_class(tmp_path / "submissions")
    shifted = (
        moodle().replace(b"Participant 701", b"Participant X").replace(b"Participant 702", b"Participant 701")
    )
    shifted = shifted.replace(b"Participant X", b"Participant 702")
    filled, returned = back(tmp_path, found, moodle_rows(found), shifted)
    assert told(returned)["Not certain who it is, so nobody was matched"] == [
        "First1 Last1 (701): may be First2 Last2 (Participant 701) or First1 Last1 (Participant 702)",
        "First2 Last2 (702): may be First1 Last1 (Participant 702) or First2 Last2 (Participant 701)",
    ]
    rows = {row[1]: row[4] for row in csv.reader(io.StringIO(filled.decode(), newline=""))}
    assert (rows["First1 Last1"], rows["First2 Last2"], rows["First3 Last3"]) == ("", "", "41.5")


# Gradescope and other tables -------------------------------------------------------------------------------


def test_a_gradescope_roster_has_no_scores_and_gets_a_column_for_them(tmp_path):
    text = "First Name,Last Name,SID,Email,Role,Sections\r\n" + "".join(
        f"{quoted(CLASS[k][0])},{quoted(CLASS[k][1])},s{k},u{k}@example.edu,Student,\r\n" for k in range(60)
    ) + "Pat,Prof,,prof@example.edu,Instructor,\r\n"  # fmt: skip
    found = [Submission(f"k{k}", (Student(" ".join(CLASS[k]), f"s{k}"),), ()) for k in range(60) if k != 4]
    rows = [Row(s, samples.perfect()) for s in found]
    filled, returned = back(tmp_path, found, rows, text.encode(), "roster.csv")
    lines = text.splitlines()
    expected = [
        lines[0] + f",{TABLE.title}",
        *(line + (",100" if k != 4 else "") for k, line in enumerate(lines[1:61])),
        lines[61],
    ]
    assert filled.decode() == "".join(line + "\r\n" for line in expected)
    assert told(returned) == {"On the roster, handed in nothing": ["Last4, First4 (s4)"]}


def test_gradescope_grades_get_their_total(tmp_path):
    text = (
        "First Name,Last Name,SID,Email,Sections,Total Score,Max Points,Status,Submission ID,Submission Time\n"
        "Jane,Doe,1,j@x.edu,A,,100.0,Missing,,\n"
        "Jim,Poe,2,p@x.edu,A,,100.0,Ungraded,77,2026-03-02 23:00:00 -0500\n"
    )
    found = [Submission("jim", (Student("Jim Poe", "p@x.edu"),), ())]
    filled, _ = back(tmp_path, found, [Row(found[0], samples.perfect())], text.encode())
    assert filled.decode() == text.replace("p@x.edu,A,,", "p@x.edu,A,100,")


# Who is who ------------------------------------------------------------------------------------------------


def match(tmp_path, text, *students):
    (tmp_path / "r.csv").write_text(text, encoding="utf-8")
    entries = [(f"k{k}", Student(*student)) for k, student in enumerate(students)]
    found = Roster(tmp_path / "r.csv").match(entries)
    return (
        {entry[0]: person.name for entry, person in found.found.items()},
        {entry[0]: [person.name for person in people] for entry, people in found.ambiguous},
        [entry[0] for entry in found.nobody],
        [person.name for person in found.missing],
    )


def test_numbers_come_before_logins_and_those_before_names(tmp_path):
    text = "Name,ID,Email\nAnn Lee,1,lee@x.edu\nLee Ann,2,ann@x.edu\nBo Ek,3,bo@x.edu\n"
    assert match(tmp_path, text, ("whoever", "1"), ("ann", ""), ("EK,  bo", "")) == (
        {"k0": "Ann Lee", "k1": "Lee Ann", "k2": "Bo Ek"}, {}, [], [],
    )  # fmt: skip


def test_of_two_with_one_name_nobody_is_matched_by_it(tmp_path):
    text = "Name,ID,Email\nJane Doe,1,a@x.edu\nJane Doe,2,b@x.edu\nJim Poe,3,c@x.edu\n"
    assert match(tmp_path, text, ("Jane Doe", "2"), ("jane doe", ""), ("Jim Poe", "")) == (
        {"k0": "Jane Doe", "k2": "Jim Poe"}, {"k1": ["Jane Doe", "Jane Doe"]}, [], [],
    )  # fmt: skip


def test_two_submissions_of_one_name_are_both_left_to_a_person(tmp_path):
    assert match(tmp_path, "Name,ID\nJane Doe,1\nJim Poe,2\n", ("Jane Doe", ""), ("Doe, Jane", "")) == (
        {}, {"k0": ["Jane Doe"], "k1": ["Jane Doe"]}, [], ["Jim Poe"],
    )  # fmt: skip


def test_someone_in_two_sections_is_one_person_and_both_rows_are_filled(tmp_path):
    text = b"name,id,section,score\nJane Doe,1,A,\nJane Doe,1,B,\n"
    found = [Submission("j", (Student("Jane Doe", "1"),), ())]
    filled, _ = back(tmp_path, found, [Row(found[0], samples.perfect())], text)
    assert filled == b"name,id,section,score\nJane Doe,1,A,100\nJane Doe,1,B,100\n"


@pytest.mark.parametrize(
    ("listed", "handed"),
    [("Nuñez, José", "jose nunez"), ("O'Hara, Tim", "oharatim"), ("ÅNGSTRÖM Zoë", "Zoe Angstrom"),
     ("李, 小龙", "李小龙"), ("van der Berg, Jan", "Jan van der Berg"), ("Smith-Jones, A.", "smithjonesa")],
)  # fmt: skip
def test_names_are_the_same_however_they_are_written(listed, handed, tmp_path):
    assert match(tmp_path, f"Name\n{quoted(listed)}\nSomeone Else\n", (handed, ""))[0] == {"k0": listed}


def test_a_table_that_says_of_nobody_who_it_is_is_refused(tmp_path):
    (tmp_path / "r.csv").write_text("colour,size\nred,1\n")
    with pytest.raises(MuslinError, match="no column that says who is who"):
        Roster(tmp_path / "r.csv")
    (tmp_path / "r.csv").write_text("")
    with pytest.raises(MuslinError, match="no column that says who is who"):
        Roster(tmp_path / "r.csv")


# Bytes -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("between", [",", ";", "\t"])
def test_a_table_with_one_cell_filled_keeps_every_other_byte(encoding, end, between, tmp_path):
    lines = [
        "name{b}id{b}score{b}more",
        '"Müller{b} ""J""{e}second line"{b}1{b}{s}{b}  x ',
        '"open{b}2{b}"3"{b}',
        "",
        "short{b}3",
    ]
    text = end.join(lines) + end

    def made(said):
        return text.replace("{b}", between).replace("{e}", end).replace("{s}", said).encode(encoding)

    sheet = Sheet(made(""))
    assert sheet.filled({}) == made("")
    assert sheet.rows[1] == [f'Müller{between} "J"{end}second line', "1", "", "  x "]
    assert sheet.rows[2] == ['"open', "2", "3", ""]
    assert sheet.filled({(1, 2): "97.5"}) == made("97.5")
    grown = made("").decode(encoding).replace(f"short{between}3", f"short{between}3{between}7")
    assert sheet.filled({(4, 2): "7"}) == grown.encode(encoding)


# Feedback --------------------------------------------------------------------------------------------------


def test_feedback_is_named_as_canvas_and_moodle_named_what_was_handed_in(tmp_path):
    places = {
        "doejane_LATE_90001_70001_my_stress.py": "doejane_LATE_90001_70001_feedback.html",
        "Jane Doe_701_assignsubmission_file_": "Jane Doe_701_assignsubmission_file_/feedback.html",
        "Jim Poe_702_assignsubmission_file_cloth.zip": "Jim Poe_702_assignsubmission_file_feedback.html",
        "cloth-janedoe": None,
    }
    rows = []
    for k, name in enumerate(places):
        path = tmp_path / name
        path.mkdir() if name.endswith("file_") else path.write_bytes(STUB)
        upload = 70001 if "LATE" in name else 0
        rows.append(
            Row(Submission(f"k{k}", (Student(name),), (Source(path, "", upload),)), samples.perfect())
        )
        (tmp_path / "report" / "reports").mkdir(parents=True, exist_ok=True)
        (tmp_path / "report" / "reports" / f"k{k}.html").write_text(f"report {k}")
    desk = Desk(Wanted(feedback=True), [row.submission for row in rows], TABLE)
    (path,) = desk.hand_back(tmp_path / "report", rows).files
    with zipfile.ZipFile(path) as archive:
        packed = {name: archive.read(name).decode() for name in archive.namelist()}
    assert packed == {place: f"report {k}" for k, place in enumerate(places.values()) if place}


def test_the_newest_upload_is_what_canvas_gets_feedback_on(tmp_path):
    for upload in (70001, 70005):
        (tmp_path / f"doejane_90001_{upload}_stress.py").write_bytes(STUB)
    found, _ = finding.find(tmp_path, TABLE)
    (tmp_path / "report" / "reports").mkdir(parents=True)
    (tmp_path / "report" / "reports" / f"{found[0].key}.html").write_text("report")
    (path,) = Desk(Wanted(feedback=True), found, TABLE).hand_back(tmp_path / "report", [Row(found[0])]).files
    assert zipfile.ZipFile(path).namelist() == ["doejane_90001_70005_feedback.html"]


# Points on top ---------------------------------------------------------------------------------------------


def test_points_on_top_add_to_what_was_graded_and_everyone_can_be_meant(tmp_path):
    from muslin.classes import overrides

    found = [Submission(name, (Student(name.title()),), ()) for name in ("ann", "bo", "cy")]
    (tmp_path / "o.csv").write_text(
        "student,task,score,bonus,reason\nann,phi,,1.5,elegant\n*,psi,5,,erratum\nbo,psi,2,,copied\n*,,,2,the survey\n"
    )
    read = overrides.read(tmp_path / "o.csv", found, TABLE)
    rows = {s.key: Row(s, samples.stubs(), "", read[s.key]) for s in found}
    assert {key: row.total for key, row in rows.items()} == {"ann": 8.5, "bo": 4.0, "cy": 7.0}
    assert rows["ann"].score("phi") == 1.5
    assert rows["ann"].as_it_counts()["phi"].checks[0].message == "1.5 on top. elegant"
    assert "phi: 1.5 on top by hand: elegant" in rows["ann"].told()
    lines = list(csv.DictReader(io.StringIO(gradebook.grades_csv(list(rows.values()), TABLE))))
    assert [(line["score"], line["phi"], line["psi"]) for line in lines] == [
        ("8.5", "1.5", "5"),
        ("4", "0", "2"),
        ("7", "0", "5"),
    ]
