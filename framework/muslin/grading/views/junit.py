"""JUnit XML, as Jenkins, GitLab and GitHub actions read it: one test case per task, one for the simulation."""

from __future__ import annotations

from xml.etree import ElementTree as xml

from muslin.grading.record import ERROR, PASSED, SKIPPED, Record
from muslin.grading.views import story
from muslin.grading.views.text import capped, one_line, points

#: Most characters in one element.
LIMIT = 20_000


def render(record: Record) -> str:
    """The record as JUnit XML. A task that is not implemented yet counts as a failure, never as an error."""
    statuses = [task.status for task in record.tasks] + [record.simulation.status]
    counts: dict[str, str] = {
        "tests": str(len(statuses)),
        "failures": str(sum(status not in (PASSED, SKIPPED, ERROR) for status in statuses)),
        "errors": str(statuses.count(ERROR)),
        "skipped": str(statuses.count(SKIPPED)),
        "time": f"{float(record.timing.get('seconds', 0.0)):.3f}",
    }
    root = xml.Element("testsuites", {"name": "muslin", **counts})
    suite = xml.SubElement(root, "testsuite", {"name": one_line(record.assignment.get("name", "")), **counts})
    properties = xml.SubElement(suite, "properties")
    of_tasks = ((f"score {t.name}", f"{points(t.score)} of {points(t.max_score)}") for t in record.tasks)
    total = ("score", f"{points(record.score)} of {points(record.max_score)}")
    for name, value in (total, *of_tasks, *story.circumstances(record)):
        xml.SubElement(properties, "property", name=one_line(name), value=one_line(value, 1000))

    seconds = record.timing.get("tasks", {})
    for task in record.tasks:
        case = xml.SubElement(
            suite,
            "testcase",
            classname=one_line(task.file.removesuffix(".py")),
            name=one_line(task.name),
            time=f"{float(seconds.get(task.name, 0.0)):.3f}",
        )
        if task.status != PASSED:
            _fault(case, task.status, task.message, story.task_told(task))
        if task.output:
            xml.SubElement(case, "system-out").text = capped(task.output, LIMIT)
    case = xml.SubElement(suite, "testcase", classname="simulation", name="simulation", time="0.000")
    if record.simulation.status != PASSED:
        _fault(case, record.simulation.status, record.simulation.message, story.simulation_told(record))
    xml.indent(root, " ")
    return '<?xml version="1.0" encoding="UTF-8"?>\n' + xml.tostring(root, encoding="unicode") + "\n"


def _fault(case: xml.Element, status: str, message: str, text: str) -> None:
    kind = {SKIPPED: "skipped", ERROR: "error"}.get(status, "failure")
    first = one_line(message.split("\n")[0], 300)
    about = {"message": first} if kind == "skipped" else {"message": first, "type": status}
    element = xml.SubElement(case, kind, about)
    element.text = capped(text, LIMIT)
