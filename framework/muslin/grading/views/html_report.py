"""One self-contained HTML page for the student and the instructor: no scripts, nothing loaded from elsewhere."""

from __future__ import annotations

import base64
import html
from collections import Counter
from importlib import resources

from muslin.errors import MuslinError
from muslin.grading.record import ERROR, FAILED, NOT_IMPLEMENTED, PASSED, SKIPPED, Check, Record, TaskResult
from muslin.grading.views import energy_plot, story
from muslin.grading.views.text import capped, one_line, points

#: What a browser may do with the page: apply its own style, show the pictures in it, and nothing else.
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'"

#: Sign and colour of a status; the words say the same.
_GLYPHS = {PASSED: "✓", FAILED: "✗", ERROR: "✗", NOT_IMPLEMENTED: "○", SKIPPED: "–"}
_TONES = {PASSED: "good", FAILED: "wrong", ERROR: "wrong", NOT_IMPLEMENTED: "open", SKIPPED: "quiet"}


def render(record: Record, quality: str = "good") -> str:
    """The record as a page.

    Parameters
    ----------
    record : Record
    quality : {"draft", "good", "best", "none"}
        Of the pictures of the simulation; "none" leaves them out and starts no renderer.
    """
    title = _line(
        f"{record.assignment.get('title', '')}: {points(record.score)} of {points(record.max_score)}"
    )
    style = resources.files("muslin.grading.views").joinpath("report.css").read_text("utf-8")
    tasks = "".join(_task(k, number, task) for k, (number, task) in enumerate(story.numbered(record), 1))
    return f"""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{POLICY}">
<meta name="referrer" content="no-referrer">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
{_header(record)}
<main>
<section aria-labelledby="tasks">
<h2 id="tasks">Tasks</h2>
{tasks}</section>
<section aria-labelledby="simulation">
<h2 id="simulation">The simulation</h2>
{_simulation(record, quality)}
</section>
</main>
{_footer(record)}
</body>
</html>
"""


def _line(text: str, limit: int = 200) -> str:
    return html.escape(one_line(text, limit))


def _text(text: str, limit: int = story.MESSAGE) -> str:
    return html.escape(capped(text, limit))


def _percent(part: float, whole: float) -> str:
    return f"{100 * min(max(part / whole, 0.0), 1.0) if whole > 0 else 0:.1f}%"


def _header(record: Record) -> str:
    segments = "".join(
        f'<a href="#task-{k}" style="flex: {max(float(task.max_score), 0.1):.2f}" '
        f'title="{_line(task.name)}: {points(task.score)} of {points(task.max_score)}" '
        f'aria-label="{_line(task.name)}: {points(task.score)} of {points(task.max_score)} points">'
        f'<span class="bar" style="width: {_percent(task.score, task.max_score)}"></span></a>'
        for k, task in enumerate(record.tasks, 1)
    )
    return f"""<header>
<h1>{_line(record.assignment.get("title", ""))}</h1>
<p class="from">{_line(record.submission.name)}</p>
<p class="score"><strong>{points(record.score)}</strong> <span>of {points(record.max_score)} points</span></p>
<nav class="whole" aria-label="Points by task">{segments}</nav>
<p class="lead">{_lead(record)}</p>
</header>"""


def _lead(record: Record) -> str:
    """Where things stand and where to go on, in two sentences."""
    counts = Counter(task.status for task in record.tasks)
    if record.tasks and counts[PASSED] == len(record.tasks):
        return "Every task is right. Well done."
    said = [
        f"{counts[status]} {word}"
        for status, word in (
            (PASSED, "passed"),
            (FAILED, "not right yet"),
            (ERROR, "cannot be run"),
            (NOT_IMPLEMENTED, "not implemented yet"),
        )
        if counts[status]
    ]
    unfinished = [(k, t) for k, t in enumerate(record.tasks, 1) if t.status != PASSED]
    started = [(k, t) for k, t in unfinished if t.status != NOT_IMPLEMENTED] or unfinished
    if not started:
        return ""
    k, task = started[0]
    verb = "Begin" if counts[NOT_IMPLEMENTED] == len(record.tasks) else "Go on"
    return (
        f"Of {len(record.tasks)} tasks: {', '.join(said)}. {verb} with "
        f'<a href="#task-{k}"><span class="name">{_line(task.name)}</span></a>, '
        f"section {_line(task.section)} of the handout."
    )


def _task(k: int, number: str, task: TaskResult) -> str:
    opened = " open" if task.status in (FAILED, ERROR) else ""
    tone, glyph, word = _TONES[task.status], _GLYPHS[task.status], story.WORDS[task.status]
    earned = f"{points(task.score)} / {points(task.max_score)}"
    share = _percent(task.score, task.max_score)
    return f"""<details class="task" id="task-{k}"{opened}>
<summary>
<span class="glyph {tone}" aria-hidden="true">{glyph}</span>
<h3><span class="name">{_line(task.name)}</span> <span class="title">{_line(task.title)}</span></h3>
<span class="word {tone}">{word}</span>
<span class="track" aria-hidden="true"><span class="bar" style="width: {share}"></span></span>
<span class="earned">{earned}</span>
</summary>
<div class="inside">
<p class="quiet">Task {number}, section {_line(task.section)} of the handout, file <code>{_line(task.file)}</code></p>
{_checks(task)}{_output(task)}</div>
</details>
"""


def _checks(task: TaskResult) -> str:
    if task.status == NOT_IMPLEMENTED:
        return (
            "<p>Not implemented yet. When you have written it, grade again: "
            "its checks and any advice will appear here.</p>\n"
        )
    return "".join(_check(check) for check in task.checks)


def _check(check: Check, heading: str = "h4") -> str:
    first, _, rest = check.message.partition("\n")
    glyph = f'<span class="glyph {_TONES[check.status]}" aria-hidden="true">{_GLYPHS[check.status]}</span>'
    said = f'<span class="aloud">{check.status}: </span>'
    parts = [f"<{heading}>{glyph} {said}{_line(check.name)}</{heading}>", f"<p>{_text(first)}</p>"]
    if rest:
        name = _line(f"{check.name}: numbers")
        parts.append(f'<pre tabindex="0" role="region" aria-label="{name}">{_text(rest)}</pre>')
    advice = [("Likely mistake", check.diagnosis), ("Next step", check.advice)]
    if any(text for _, text in advice):
        entries = "".join(f"<dt>{term}</dt><dd>{_text(text, 1500)}</dd>" for term, text in advice if text)
        parts.append(f'<dl class="help">{entries}</dl>')
    return f'<div class="check {check.status}">{"".join(parts)}</div>\n'


def _output(task: TaskResult) -> str:
    if not task.output:
        return ""
    return (
        '<div class="check"><h4>Your code printed</h4>'
        f'<pre tabindex="0" role="region" aria-label="Output of {_line(task.name)}">'
        f"{_text(task.output, story.OUTPUT)}</pre></div>\n"
    )


def _simulation(record: Record, quality: str) -> str:
    simulation = record.simulation
    tone, glyph = _TONES[simulation.status], _GLYPHS[simulation.status]
    parts = [
        f'<p><span class="glyph {tone}" aria-hidden="true">{glyph}</span> '
        f'<span class="{tone}">{story.WORDS[simulation.status].capitalize()}.</span> '
        f"{_text(simulation.message)}</p>"
    ]
    if simulation.stand_ins and simulation.status != SKIPPED:
        names = ", ".join(f"<code>{_line(name)}</code>" for name in simulation.stand_ins[:50])
        parts.append(f'<p class="quiet">Muslin’s own code stood in for {names}.</p>')
    parts += [_check(check, "h3") for check in simulation.checks]
    if simulation.status != SKIPPED or simulation.positions:
        parts += [_pictures(record, quality), _energies(record)]
    return "\n".join(part for part in parts if part)


def _pictures(record: Record, quality: str) -> str:
    if quality == "none":
        return ""
    try:
        from muslin.grading.views import pictures  # brings Taichi, which nothing else here needs

        yours, reference = pictures.draw(record.simulation, quality=quality)
    except MuslinError as error:
        return f'<p class="instead">No picture: {_text(str(error), 500)}</p>'
    except Exception as error:  # a report without pictures is better than none
        return f'<p class="instead">No picture: the renderer failed ({_line(type(error).__name__)}).</p>'
    scene = _line(record.simulation.scene)
    said = (
        ("student", yours, "Your cloth", f"The cloth at the end of the scene {scene}, with your functions"),
        ("reference", reference, "The reference", f"The reference cloth at the end of the scene {scene}"),
    )
    figures = "".join(
        f'<figure><img id="{key}-picture" alt="{alt}" width="640" height="480" '
        f'src="data:image/png;base64,{base64.b64encode(png).decode("ascii")}">'
        f"<figcaption>{caption}</figcaption></figure>"
        for key, png, caption, alt in said
    )
    return (
        f'<div class="pair">{figures}</div>'
        '<p class="key">Draping is chaotic: folds that fall a little differently are no mistake.</p>'
    )


def _energies(record: Record) -> str:
    simulation = record.simulation
    if not simulation.energies and not simulation.reference_energies:
        return ""
    figures = "".join(
        f"<figure><h3>{name.capitalize()} energy [J]</h3>{svg}"
        + (f"<figcaption>{_line(note)}</figcaption>" if note else "")
        + "</figure>"
        for name, svg, note in energy_plot.plots(simulation.energies, simulation.reference_energies)
    )
    return (
        f'<div class="plots" id="energy-plot">{figures}</div>'
        '<p class="key"><span><i class="yours"></i>yours</span><span><i class="reference"></i>reference</span></p>'
    )


def _footer(record: Record) -> str:
    entries = [*story.circumstances(record)]
    defences = record.safety.defences
    given = [name for name, there in defences.items() if there]
    missing = [name for name, there in defences.items() if not there]
    entries.append(("Defences", ", ".join(given) or "none"))
    if missing:
        entries.append(("Not available here", ", ".join(missing)))
    if "seconds" in record.timing:
        entries.append(("Time", f"{float(record.timing['seconds']):.1f} s"))
    files = [f"{name} {digest[:12]}" for name, digest in list(record.submission.files.items())[:50]]
    if files:
        entries.append(("Files", ", ".join(one_line(file, 120) for file in files)))
    rows = "".join(f"<dt>{_line(name)}</dt><dd>{_line(value, 2000)}</dd>" for name, value in entries)
    return f'<footer aria-label="How this was graded"><dl>{rows}</dl></footer>'
