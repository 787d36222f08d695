"""Records as a grading might leave them, for tests of the views: perfect, untouched, mixed, hostile, skipped."""

from __future__ import annotations

import dataclasses
from functools import cache

import numpy as np

from muslin.grading.record import (
    ERROR,
    FAILED,
    LAYERS,
    NOT_IMPLEMENTED,
    PASSED,
    SKIPPED,
    Check,
    Record,
    Safety,
    Simulation,
    Submission,
    TaskResult,
)
from muslin.tasks import Task, assignment

ASSIGNMENT = assignment("cloth")

ENVIRONMENT = {
    "muslin": "0.1.0",
    "taichi": "1.7.4",
    "numpy": "2.2.0",
    "mpmath": "1.3.0",
    "python": "3.11.9",
    "platform": "Linux x86_64",
    "precision": "f64",
    "threads": 1,
    "fast_math": False,
}

#: Attacks on whoever shows the text, in one string: page, terminal, XML, spreadsheet.
HOSTILE = (
    "<script>window.hacked=1;document.title='hacked'</script>"
    "\"'><img src=x onerror=\"window.hacked=1;document.title='hacked'\">"
    "<svg/onload=window.hacked=1></textarea></style></pre></details></title>"
    "<a href='javascript:window.hacked=1'>x</a><iframe src='javascript:parent.hacked=1'></iframe>"
    "<img src='{host}/pixel'><link rel=stylesheet href='{host}/style'>"
    "<meta http-equiv=refresh content='0;url={host}/away'>]]> --> &amp; &lt;"
    "\x1b[2J\x1b[31mscore 100\x1b[0m\x1b]0;title\x07\x1b]8;;{host}/link\x07\r\x00\x08\x0b\x7f\x9b31m\x85"
    "\u202egnp.exe\u2066\u2069\u2028\u200f\ud800\udfff\ufffe\uffff"
    "::set-output name=score::100"
)


def hostile(host: str = "http://127.0.0.1:9") -> str:
    """`HOSTILE`, calling home to `host` where it can."""
    return HOSTILE.replace("{host}", host)


def check(name: str, layer: str, status: str = PASSED, message: str = "", **more: object) -> Check:
    return Check(name, layer, status, message or f"{name}: as it should be.", **more)  # type: ignore[arg-type]


def passed(task: Task) -> TaskResult:
    said = (
        "shape, type and numbers as asked",
        "30 cases agree; worst relative error 3.1e-16.",
        "40 cases agree.",
    )
    checks = [
        check(name, layer, PASSED, message)
        for name, layer, message in zip(("form", "public cases", "hidden cases"), LAYERS, said, strict=False)
    ]
    checks.append(check("properties of the function", "properties", PASSED, "4 properties hold."))
    return _result(task, PASSED, task.points, checks)


def untouched(task: Task) -> TaskResult:
    message = f"not implemented yet: {task.name} ({task.file})"
    return _result(task, NOT_IMPLEMENTED, 0.0, [check("form", "form", FAILED, message)])


def wrong(task: Task, share: float = 0.1, output: str = "", **found: str) -> TaskResult:
    message = found.pop("message", "") or (
        "worst case 17: relative error 1.0e+00\n"
        "U        = [[0.36, -0.48, 0.8],\n            [0.8, 0.6, 0.0],\n            [-0.48, 0.64, 0.6]]\n"
        "dpsi_ds  = [1843.21, -310.552, 0.0]\n"
        "yours    = [[-663.556, -149.065, 0.0],\n"
        "            [-1474.57, 186.331, 0.0],\n            [884.741, 198.753, 0.0]]\n"
        "expected = [[663.556, 149.065, 0.0],\n"
        "            [1474.57, -186.331, 0.0],\n            [-884.741, -198.753, 0.0]]"
    )
    checks = [
        check("form", "form", PASSED, "shape, type and numbers as asked"),
        check("public cases", "public", FAILED, message, case=17, error=1.0, **found),
        check("hidden cases", "hidden", SKIPPED, "looked at when the public cases pass"),
        check("properties of the function", "properties", SKIPPED, "looked at when the public cases pass"),
    ]
    return _result(task, FAILED, round(task.points * share, 2), checks, output)


def wrong_when_hidden(task: Task) -> TaskResult:
    checks = [
        check("form", "form", PASSED, "shape, type and numbers as asked"),
        check("public cases", "public", PASSED, "30 cases agree; worst relative error 2.2e-16."),
        check("hidden cases", "hidden", FAILED, "wrong where two stretches are nearly equal"),
        check("properties of the function", "properties", SKIPPED, "looked at when the hidden cases pass"),
    ]
    return _result(task, FAILED, round(task.points * 0.5, 2), checks)


def broken(task: Task, message: str = "") -> TaskResult:
    message = message or (
        f"{task.file}, line 24: {task.name} does not compile.\n"
        "    return (I - n.outer_product(n)) / l @ cross\n"
        "                                          ^^^^^\nName 'cross' is not defined."
    )
    advice = "Is the name spelled as where you assigned it? Every name must be given a value first."
    return _result(task, ERROR, 0.0, [check("form", "form", FAILED, message, advice=advice)])


def _result(task: Task, status: str, score: float, checks: list[Check], output: str = "") -> TaskResult:
    return TaskResult(
        task.name, task.title, task.file, task.section, status, float(score), float(task.points),
        tuple(checks), output,
    )  # fmt: skip


def record(
    tasks: list[TaskResult], simulation: Simulation, name: str = "ada.zip", notes: tuple[str, ...] = ()
) -> Record:
    return Record(
        assignment={"name": "cloth", "title": ASSIGNMENT.title, "version": "1.0"},
        submission=Submission(
            name, "5d41402abc4b2a76b9719d911017c5925d41402abc4b2a76b9719d911017c592",
            {file: "9f86d081884c7d659a2feaa0c55ad015" for file in dict.fromkeys(t.file for t in tasks)}, notes,
        ),
        environment=ENVIRONMENT,
        safety=Safety(
            "process", "auto", {"process group": True, "file size limit": True, "network namespace": False},
            ("This system allows no user namespaces, so the network could not be cut off.",),
        ),
        seed="5d41402abc4b2a76",
        hidden={"cases": 40, "instructor": 0},
        tasks=tuple(tasks),
        simulation=simulation,
        timing={"seconds": 5.31, "tasks": {task.name: 0.25 for task in tasks}},
    )  # fmt: skip


@cache
def simulation(status: str = PASSED, sag: float = 0.0) -> Simulation:
    """A cloth over the sphere of the scene `drape`, drawn by hand, no simulator involved."""
    n = 24
    u = np.linspace(-0.5, 0.5, n)
    x, z = (a.ravel() for a in np.meshgrid(u, u, indexing="ij"))
    grid = np.arange(n * n).reshape(n, n)
    a, b, c, d = grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]
    triangles = np.concatenate(
        [np.stack([a, d, c], -1).reshape(-1, 3), np.stack([a, c, b], -1).reshape(-1, 3)]
    )

    def cloth(sag: float) -> np.ndarray:
        r = np.hypot(x, z)
        cap = np.sqrt(np.maximum(0.303**2 - np.minimum(r, 0.27) ** 2, 0))
        folds = 0.05 * np.cos(8 * np.arctan2(z, x)) * np.clip(r - 0.25, 0, None) / 0.25
        return np.stack(
            [x * (1 - 0.12 * r), cap - (1.3 + sag) * np.clip(r - 0.27, 0, None) + folds, z * (1 - 0.12 * r)],
            1,
        )

    def energies(sag: float) -> np.ndarray:
        t = np.arange(61) / 240
        swing = 1 - np.cos((9 + 8 * sag) * t)
        return np.stack(
            [t, 0.35 * swing * (1 + sag), 0.2 * swing**2 * (1 + sag), -0.55 * swing - 0.2 * swing**2], 1
        )

    def momenta(sag: float) -> np.ndarray:
        t = np.arange(61) / 240
        turning = 1e-3 * np.outer(t, (1 + sag, 0.2, -0.5))
        return np.hstack([np.outer(np.sin((9 + 8 * sag) * t), (0.0, -0.2, 2e-6)), turning])

    def rows(table: np.ndarray) -> tuple[tuple[float, ...], ...]:
        return tuple(tuple(row) for row in table.round(6).tolist())

    failed = check(
        "energies against the reference run", "simulation", FAILED,
        "the elastic energy is 18% above the reference after 60 steps",
        diagnosis="A function that passed alone is used with other inputs than the cases cover.",
        advice="Compare the three plots: the first energy that leaves the reference tells which function to look at.",
    )  # fmt: skip
    return Simulation(
        status,
        "Your functions make a cloth that moves as the reference does."
        if status == PASSED
        else "Your cloth does not move as the reference does.",
        checks=(
            check("no net force", "simulation", PASSED, "the forces of the cloth sum to zero: 2.1e-15"),
            *([failed] if status == FAILED else []),
        ),
        uses=tuple(ASSIGNMENT.tasks),
        stand_ins=() if status == PASSED else ("d2psi_dFij", "eigensystem"),
        scene="drape",
        energies=rows(energies(sag)),
        reference_energies=rows(energies(0.0)),
        momenta=rows(momenta(sag)),
        reference_momenta=rows(momenta(0.0)),
        triangles=tuple(tuple(row) for row in triangles.tolist()),
        positions=rows(cloth(sag)),
        reference_positions=rows(cloth(0.0)),
    )


NO_SIMULATION = Simulation(
    SKIPPED,
    "Skipped: it needs deformation_gradient, dpsi_dF and nodal_force, which are not all there yet.",
    stand_ins=tuple(ASSIGNMENT.tasks),
)


def perfect() -> Record:
    return record([passed(task) for task in ASSIGNMENT.tasks.values()], simulation())


def stubs() -> Record:
    return record([untouched(task) for task in ASSIGNMENT.tasks.values()], NO_SIMULATION, "stubs")


def mixed() -> Record:
    """Some right, some wrong with a diagnosis, one wrong only when hidden, one broken, some untouched."""
    tasks = {name: passed(task) for name, task in ASSIGNMENT.tasks.items()}
    table = ASSIGNMENT.tasks
    tasks["dpsi_dF"] = wrong(
        table["dpsi_dF"], output="U = [[0.36, -0.48, 0.8], ...]\nhere 1\nhere 2\n", cause="negated",
        diagnosis="Your result is the right one with the opposite sign.",
        advice="The stress is the gradient of the energy. The minus belongs to the force, which is another task.",
    )  # fmt: skip
    tasks["psi"] = wrong(
        table["psi"], cause="factor",
        message="worst case 3: relative error 5.0e-01\nyours    = 812.25\nexpected = 1624.5",
        diagnosis="Your result is exactly half of the right one.",
        advice="Look at the factors in front of the two terms: which of them is halved?",
    )  # fmt: skip
    tasks["eigensystem"] = wrong_when_hidden(table["eigensystem"])
    tasks["dn_dx"] = broken(table["dn_dx"])
    tasks["d2psi_dFij"] = untouched(table["d2psi_dFij"])
    tasks["sphere_contact"] = untouched(table["sphere_contact"])
    notes = ("solution.pyc was in the archive and was left out.",)
    return record(list(tasks.values()), simulation(FAILED, 0.35), "ada-lovelace.zip", notes)


def nasty(host: str = "http://127.0.0.1:9") -> Record:
    """Every text that may come from a submission is hostile, and some are huge; numbers are not finite."""
    text = hostile(host)
    table = list(ASSIGNMENT.tasks.values())
    tasks = [
        wrong(task, output=text + "\n" + "=cmd|' /C calc'!A1\n" * 20_000, message=f"{text}\n{text}" + "x" * 100_000,
              cause=text, diagnosis=text, advice=text)
        for task in table[:-1]
    ]  # fmt: skip
    tasks.append(broken(table[-1], text))
    worst = dataclasses.replace(tasks[0].checks[1], error=float("inf"))
    tasks[0] = dataclasses.replace(tasks[0], checks=(tasks[0].checks[0], worst, *tasks[0].checks[2:]))
    shown = simulation(FAILED, 0.35)
    blown = dataclasses.replace(
        shown,
        message=text,
        checks=(check(text, "simulation", FAILED, text, diagnosis=text, advice=text),),
        energies=(*shown.energies[:-1], (0.25, float("inf"), float("nan"), 1e300)),
    )
    made = record(tasks, blown, f'=HYPERLINK("{host}","x"){text}', (text, text * 50))
    files = {f"{text}.py": text}
    return dataclasses.replace(
        made,
        submission=dataclasses.replace(made.submission, files=files),
        safety=dataclasses.replace(made.safety, notes=(text,)),
        seed=f"@{text}",
    )


def skipped() -> Record:
    """All but two tasks right, those two untouched: the simulation is skipped, not failed."""
    tasks = {name: passed(task) for name, task in ASSIGNMENT.tasks.items()}
    for name in ("deformation_gradient", "nodal_force"):
        tasks[name] = untouched(ASSIGNMENT.tasks[name])
    return record(list(tasks.values()), NO_SIMULATION)


SAMPLES = {"perfect": perfect, "stubs": stubs, "mixed": mixed, "nasty": nasty, "skipped": skipped}
