"""What this computer has of what Muslin needs, line by line: `examine` finds out, `report` prints.

Nothing here may fail because something is missing: the engine runs in a process of its own, and whatever goes
wrong inside a check becomes its finding.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from muslin.doctor.compiling import compiler, x11
from muslin.doctor.finding import Finding, one_line
from muslin.doctor.machine import hardware, judge_python, judge_system, packages, python, system
from muslin.doctor.places import folders, shipped
from muslin.doctor.showing import fast_solver, graphics, video

__all__ = ["Finding", "examine", "judge_python", "judge_system", "report"]


def examine() -> list[Finding]:
    """Look at everything Muslin needs or can use. Takes a few seconds.

    Returns
    -------
    list of Finding
        Never empty; no error of a check gets out.
    """
    findings: list[Finding] = []
    for what, check in _CHECKS:
        try:
            found = check()
            findings += [found] if isinstance(found, Finding) else found
        except Exception as error:  # a doctor who falls ill helps nobody
            findings.append(
                Finding(
                    what,
                    False,
                    f"could not be examined: {one_line(error)}",
                    "Please report this line as a bug.",
                )
            )
    return findings


def report(
    findings: Iterable[Finding], say: Callable[[str, str], None] = lambda line, _: print(line)
) -> bool:
    """Tell the findings, one line each.

    Parameters
    ----------
    findings : iterable of Finding
    say : callable
        Prints a line in an ANSI style, where there are colours.

    Returns
    -------
    bool
        True if nothing essential is missing.
    """
    findings = list(findings)
    for finding in findings:
        say(str(finding), {True: "32", False: "1;31", None: "2"}[finding.ok])
    missing = [f.what for f in findings if f.ok is False]
    if missing:
        say(f"\nTo fix before Muslin works fully: {', '.join(missing)}.", "1;31")
    else:
        say("\nMuslin has everything it needs here.", "32")
    return not missing


# In the order a person should see to them.
_CHECKS: tuple[tuple[str, Callable[[], Finding | list[Finding]]], ...] = (
    ("Python", python),
    ("system", system),
    ("Python packages", packages),
    ("libX11", x11),
    ("engine", compiler),
    ("video encoder", video),
    ("hardware", hardware),
    ("folders", folders),
    ("shipped data", shipped),
    ("fast solver", fast_solver),
    ("graphics", graphics),
)
