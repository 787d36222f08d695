"""The report about a class: one self-contained page, whose only script sorts and filters its table."""

from __future__ import annotations

import base64
import hashlib
import html
import statistics
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from importlib import resources

from muslin.classes.gradebook import NOTES, Row
from muslin.classes.press import SIZE, Printed
from muslin.classes.similarity import Alike
from muslin.engine import ENGINES
from muslin.grading.record import FAILED, NOT_IMPLEMENTED
from muslin.grading.views.text import one_line, points
from muslin.tasks import Assignment, Task

#: How a task can stand: name in the style sheet -> in words.
STANDS = {"full": "right", "part": "partly", "none": "wrong, or cannot be run", "open": "not implemented yet"}

#: Mistakes that are listed, and students named as examples of each.
MISTAKES, EXAMPLES = 15, 5


def render(
    rows: Sequence[Row],
    table: Assignment,
    printed: Mapping[str, Printed],
    alike: Alike,
    passed_over: Sequence[str] = (),
) -> str:
    """The page.

    Parameters
    ----------
    rows : sequence of Row
    table : Assignment
    printed : dict of Printed
        Pictures by key.
    alike : Alike
        Submissions that are alike, or like the published solution.
    passed_over : sequence of str
        What in the folder of submissions was none.
    """
    style = resources.files("muslin.grading.views").joinpath("report.css").read_text("utf-8")
    style += resources.files("muslin.classes").joinpath("class.css").read_text("utf-8")
    script = resources.files("muslin.classes").joinpath("class.js").read_text("utf-8")
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    policy = (
        f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline'; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )
    names = {row.key: row.submission.name for row in rows}
    sections = [
        ("failures", "Not graded", _failures(rows)),
        ("grades", "Grades", _grades(rows, table)),
        ("totals", "Points", _totals(rows, table)),
        ("tasks", "Tasks", _tasks(rows, table)),
        ("mistakes", "Commonest mistakes", _mistakes(rows)),
        ("pictures", "Simulations", _sheet(rows, printed)),
        ("alike", "Alike", _alike(alike, names)),
        ("others", "Beside the submissions", _list(passed_over)),
    ]
    shown = [(key, title, body) for key, title, body in sections if body]
    links = "".join(f'<a href="#{key}">{title}</a>' for key, title, _ in shown)
    body = "".join(
        f'<section aria-labelledby="{key}">\n<h2 id="{key}">{title}</h2>\n{text}\n</section>\n'
        for key, title, text in shown
    )
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="referrer" content="no-referrer">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{_line(table.title)}: the class</title>
<style>{style}</style>
</head>
<body>
<header>
<h1>{_line(table.title)}</h1>
<p class="from">The whole class</p>
<ul class="numbers">{_numbers(rows, table)}</ul>
<nav class="within" aria-label="On this page">{links}</nav>
</header>
<main>
{body}</main>
{_footer(rows, table)}
<script>{script}</script>
</body>
</html>
"""


def _line(text: str, limit: int = 200) -> str:
    return html.escape(one_line(text, limit))


def _linked(row: Row) -> str:
    name = _line(row.submission.name, 80)
    return f'<a href="reports/{row.key}.html">{name}</a>' if row.record else name


def _numbers(rows: Sequence[Row], table: Assignment) -> str:
    totals = [row.total for row in rows if row.total is not None]
    most = sum(task.points for task in table.tasks.values())
    said: list[tuple[str, str]] = [(str(len(rows)), "submission" + "s" * (len(rows) != 1))]
    if totals:
        said += [
            (points(statistics.median(totals)), f"median, of {points(most)} points"),
            (points(round(statistics.fmean(totals), 1)), "mean"),
            (str(sum(total >= most for total in totals)), "with every point"),
        ]
    counted = {
        "late": sum(row.submission.late for row in rows),
        "with scores set by hand": sum(bool(row.overrides) for row in rows),
        "not graded": sum(bool(row.error) for row in rows),
    }
    said += [(str(count), what) for what, count in counted.items() if count]
    return "".join(f"<li><strong>{number}</strong>{what}</li>" for number, what in said)


def _list(texts: Sequence[str]) -> str:
    return "".join(f"<p>{_line(text, 500)}</p>" for text in texts)


def _failures(rows: Sequence[Row]) -> str:
    failed = [row for row in rows if row.error]
    if not failed:
        return ""
    lines = "".join(
        f"<tr><th scope='row'>{_line(row.submission.name)}</th><td>{_line(row.error, 500)}</td></tr>"
        for row in failed
    )
    return f"<div class='scroll'><table><tbody>{lines}</tbody></table></div>"


def _stand(row: Row, task: Task) -> str:
    """How a task of a row stands: one of `STANDS`, or nothing."""
    score = row.score(task.name)
    if score is None:
        return ""
    if score >= task.points:
        return "full"
    if score > 0:
        return "part"
    graded = row.record is not None and row.by_hand(task.name) is None
    return "open" if graded and row.record[task.name].status == NOT_IMPLEMENTED else "none"  # type: ignore[index]


def _grades(rows: Sequence[Row], table: Assignment) -> str:
    heads = [
        '<th scope="col" aria-sort="ascending"><button>Student</button></th>',
        '<th scope="col"><button>Id</button></th>',
        '<th scope="col" class="number"><button>Points</button></th>',
        *(
            f'<th scope="col" class="task number" title="{_line(task.title)}, {points(task.points)} points">'
            f"<button>{_line(task.name)}</button></th>"
            for task in table.tasks.values()
        ),
        '<th scope="col"><button>Notes</button></th>',
    ]
    lines = "".join(_grade(row, table) for row in rows)
    return (
        '<label id="filter" hidden>Find a student<input type="search" autocomplete="off"></label>'
        '<div class="scroll grades" tabindex="0" role="region" aria-label="Grades">'
        f'<table class="sortable"><thead><tr>{"".join(heads)}</tr></thead><tbody>\n{lines}</tbody></table></div>'
    )


def _grade(row: Row, table: Assignment) -> str:
    total = "" if row.total is None else points(row.total)
    hand = " hand" if row.by_hand() is not None else ""
    cells = [
        f'<th scope="row">{_linked(row)}</th>',
        f"<td>{_line(', '.join(s.id for s in row.submission.students if s.id))}</td>",
        f'<td class="number{hand}" data-value="{total}">{total or "–"}</td>',
    ]
    for task in table.tasks.values():
        score, stand = row.score(task.name), _stand(row, task)
        said = "" if score is None else points(score)
        hand = " hand" if row.by_hand(task.name) is not None else ""
        cells.append(
            f'<td class="task {stand}{hand}" data-value="{said}" title="{_line(task.name)}: '
            f'{STANDS.get(stand, "not graded")}{", set by hand" if hand else ""}">{said or "–"}</td>'
        )
    cells.append(f'<td class="notes">{_line(row.told(), NOTES)}</td>')
    return f"<tr>{''.join(cells)}</tr>\n"


def _totals(rows: Sequence[Row], table: Assignment) -> str:
    """How many have how many points, in tenths of what there is."""
    most = sum(task.points for task in table.tasks.values())
    totals = [row.total for row in rows if row.total is not None]
    if not totals:
        return ""
    bins = [0] * 10
    for total in totals:
        bins[min(int(10 * total / most), 9)] += 1
    width, height, highest = 560, 150, max(bins)
    parts = []
    for k, count in enumerate(bins):
        tall = round(height * count / highest, 1)
        x = 4 + k * width / 10
        parts.append(
            f'<rect class="tall" x="{x:g}" y="{20 + height - tall:g}" width="{width / 10 - 4:g}" height="{tall:g}"/>'
        )
        if count:
            parts.append(
                f'<text x="{x + width / 20 - 2:g}" y="{15 + height - tall:g}" text-anchor="middle">{count}</text>'
            )
        parts.append(
            f'<text x="{x - 2:g}" y="{height + 36}" text-anchor="middle">{points(k * most / 10)}</text>'
        )
    parts.append(f'<text x="{width}" y="{height + 36}" text-anchor="middle">{points(most)}</text>')
    said = ", ".join(f"{count} from {points(k * most / 10)}" for k, count in enumerate(bins) if count)
    return (
        f'<figure class="totals"><svg viewBox="-8 0 {width + 24} {height + 42}" role="img" '
        f'aria-label="Students by points: {said}">{"".join(parts)}'
        f'<line class="axis" x1="0" x2="{width}" y1="{height + 20}" y2="{height + 20}"/></svg>'
        "<figcaption>Students by points</figcaption></figure>"
    )


def _tasks(rows: Sequence[Row], table: Assignment) -> str:
    """How each task was done, as bars."""
    key = "".join(
        f'<li><svg viewBox="0 0 10 10" aria-hidden="true"><rect class="{stand}" width="10" height="10"/></svg>'
        f"{words}</li>"
        for stand, words in STANDS.items()
    )
    charts = []
    for task in table.tasks.values():
        counts = Counter(_stand(row, task) for row in rows)
        whole = sum(counts[stand] for stand in STANDS) or 1
        bars = []
        for k, stand in enumerate(STANDS):
            long = round(160 * counts[stand] / whole, 1)
            y = 16 * k
            bars.append(
                f'<rect class="{stand}" x="0" y="{y}" width="{max(long, 1.0):g}" height="12" rx="2"/>'
            )
            bars.append(f'<text x="{long + 6:g}" y="{y + 10}">{counts[stand]}</text>')
        said = ", ".join(f"{counts[stand]} {words}" for stand, words in STANDS.items())
        charts.append(
            f'<figure><h3 class="name">{_line(task.name)}</h3><span class="title">{_line(task.title)}, '
            f"{points(task.points)} points, {100 * counts['full'] / whole:.0f}% right</span>"
            f'<svg viewBox="0 0 190 62" role="img" aria-label="{_line(task.name)}: {said}">{"".join(bars)}</svg>'
            "</figure>"
        )
    return f'<ul class="legend">{key}</ul><div class="charts">{"".join(charts)}</div>'


def _mistakes(rows: Sequence[Row]) -> str:
    """The mistakes that were recognised, by how many made them."""
    made: dict[tuple[str, str], list[Row]] = defaultdict(list)
    words: dict[tuple[str, str], tuple[str, str]] = {}
    for row in rows:
        for task in row.record or ():
            check = next((c for c in task.checks if c.status == FAILED and c.cause), None)
            if check is not None:
                made[task.name, check.cause].append(row)
                words.setdefault((task.name, check.cause), (check.diagnosis, check.advice))
    order = sorted(made, key=lambda mistake: (-len(made[mistake]), mistake))[:MISTAKES]
    items = []
    for mistake in order:
        who = made[mistake]
        examples = ", ".join(_linked(row) for row in who[:EXAMPLES])
        more = f" and {len(who) - EXAMPLES} more" if len(who) > EXAMPLES else ""
        said, advice = words[mistake]
        items.append(
            f'<li><div class="count">{len(who)}<span>student{"s" * (len(who) != 1)}</span></div><div>'
            f'<h3><span class="name">{_line(mistake[0])}</span></h3><p>{_line(said, 600)}</p>'
            + (f'<p class="quiet">Next step: {_line(advice, 600)}</p>' if advice else "")
            + f'<p class="quiet">For example: {examples}{more}</p></div></li>'
        )
    return f'<ol class="mistakes">{"".join(items)}</ol>' if items else ""


def _sheet(rows: Sequence[Row], printed: Mapping[str, Printed]) -> str:
    """Every simulation's last frame."""
    figures = []
    for row in rows:
        made = printed.get(row.key)
        if made is None:
            continue
        if made.picture:
            data = base64.b64encode(made.picture).decode()
            shown = (
                f'<img width="{SIZE[0]}" height="{SIZE[1]}" loading="lazy" '
                f'alt="Last frame of {_line(row.submission.name, 80)}" src="data:image/png;base64,{data}">'
            )
        else:
            shown = f'<div class="blank">{_line(made.why, 200)}</div>'
        figures.append(f"<figure>{shown}<figcaption>{_linked(row)}</figcaption></figure>")
    return f'<div class="sheet">{"".join(figures)}</div>' if figures else ""


def _alike(alike: Alike, names: Mapping[str, str]) -> str:
    """Advice on who may have copied, from each other or from the published solution."""
    pairs = alike.pairs
    advice = (
        "<p>Submissions that share passages few others have, stubs left out. <strong>This is advice where to look, "
        "never a verdict</strong>: there are few ways to write a right formula, and students learn together. Read "
        "both before you say a word.</p>"
    )
    advice += _published(alike, names)
    if not pairs:
        return f'{advice}<p class="quiet">No two submissions stand out.</p>'
    lines = "".join(
        f'<tr><th scope="row">{_line(names[pair.first], 80)}</th><th scope="row">{_line(names[pair.second], 80)}</th>'
        f'<td class="number">{100 * pair.share:.0f}%</td><td class="number">{pair.shared}</td>'
        f"<td>{_line(', '.join(pair.files))}</td></tr>"
        for pair in pairs
    )
    return (
        f'{advice}<div class="scroll"><table><thead><tr><th scope="col">One</th><th scope="col">Other</th>'
        '<th scope="col" class="number">Of the smaller</th><th scope="col" class="number">Passages</th>'
        f'<th scope="col">Files</th></tr></thead><tbody>{lines}</tbody></table></div>'
    )


def _published(alike: Alike, names: Mapping[str, str]) -> str:
    """Who may have handed in the published solution."""
    if alike.published is None:
        return '<p class="quiet">The published solution is not here to compare with.</p>'
    lines = "".join(
        f'<tr><th scope="row">{_line(names[key], 80)}</th><td>resembles the published solution in '
        f"{_line(', '.join(files), 500)}</td></tr>"
        for key, files in alike.published.items()
    )
    return f'<div class="scroll"><table><tbody>{lines}</tbody></table></div>' if lines else ""


def _footer(rows: Sequence[Row], table: Assignment) -> str:
    records = [row.record for row in rows if row.record]
    levels = Counter(record.safety.level for record in records)
    versions = Counter(
        ", ".join(
            f"{name} {record.environment[name]}"
            for name in ("muslin", *ENGINES, "python")
            if name in record.environment
        )
        for record in records
    )
    instructors = {record.hidden.get("instructor", 0) for record in records}
    entries = [
        ("Assignment", f"{table.name} {table.version}"),
        ("Hidden cases", f"{table.grading.hidden_cases} drawn per task"),
        ("Safety", ", ".join(f"{level}: {count}" for level, count in sorted(levels.items()))),
        ("Versions", "; ".join(sorted(versions))),
    ]
    if any(instructors):
        entries[1] = (entries[1][0], f"{entries[1][1]}, {max(instructors)} per task from the instructor")
    lines = "".join(f"<dt>{name}</dt><dd>{_line(value, 500)}</dd>" for name, value in entries if value)
    return f'<footer aria-label="How this was graded"><dl>{lines}</dl></footer>'
