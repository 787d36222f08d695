"""Who is measured: Muslin with its elements and solvers, and a C++/Eigen program that does the same step."""

from __future__ import annotations

import itertools
import shutil
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Protocol

import numpy as np

from muslin.base import paths
from muslin.bench.roofline import yardstick
from muslin.simulation import scenes
from muslin.simulation import simulating as simulation
from muslin.simulation.marching import march
from muslin.simulation.model import Model
from muslin.simulation.scenes import Scene
from muslin.solve import cholmod, solvers
from muslin.tasks import Functions, load

#: Where Debian and others put Eigen's headers.
EIGEN = ("/usr/include/eigen3", "/usr/local/include/eigen3", "/opt/homebrew/include/eigen3")

#: How the C++ program is built.
FLAGS = ("-O3", "-march=native", "-std=c++17")


def throw(size: int) -> Scene:
    """The measured scene: `throw` on size x size vertices."""
    return scenes.get("throw", mesh="grid", resolution=size)


class Candidate(Protocol):
    """Somebody who simulates the scene of one size from its start."""

    name: str

    def steps(self, count: int) -> np.ndarray:
        """Take steps; (count - 1, 2) wall and CPU time of each but the first [ms]."""
        ...


@dataclass
class Ours:
    """`muslin.simulate`, everything in a step included: contacts, and the log's energies."""

    name: str
    scene: Scene
    functions: Functions | None

    def __post_init__(self) -> None:
        self.model, self.start = simulation.build(self.scene, self.functions)

    def steps(self, count: int) -> np.ndarray:
        """As for `Candidate`."""
        ticks: list[tuple[float, float]] = []

        def tick(*_: int) -> None:
            ticks.append((time.perf_counter(), time.process_time()))

        scene = replace(self.scene, steps=count)
        march(scene, self.model, self.start, on_step=tick)
        return 1e3 * np.diff(np.array(ticks), axis=0)


@dataclass
class Baseline:
    """The C++ program on a problem."""

    name: str
    program: Path
    problem: Path
    how: str = "direct"

    def steps(self, count: int) -> np.ndarray:
        """As for `Candidate`."""
        return run_baseline(self.program, self.problem, count, self.how)[0][1:]


@dataclass
class Yardstick:
    """A fixed piece of work, where there is no C++ program to be measured against."""

    name: str = "the yardstick"

    def steps(self, count: int) -> np.ndarray:
        """As for `Candidate`, of few steps: they do not depend on the cloth."""
        taken = []
        for _ in range(min(count, 5) - 1):
            wall = time.perf_counter()
            cpu = yardstick()
            taken.append((1e3 * (time.perf_counter() - wall), cpu))
        return np.array(taken)


def ours(size: int) -> list[Ours]:
    """Our candidates: both elements with the fast solver where it is installed, our own with the permissive one."""
    scene = throw(size)
    fast = solvers.choose() == "cholmod"
    found = [Ours("native", scene, None)] if fast else []
    if fast and paths.in_repository():
        found.append(Ours("student", scene, load(paths.solution("cloth"))))
    found.append(Ours("native, permissive", replace(scene, solver="multifrontal"), None))
    if not fast and paths.in_repository():
        permissive = replace(scene, solver="multifrontal")
        found.append(Ours("student, permissive", permissive, load(paths.solution("cloth"))))
    return found


# The C++ program ------------------------------------------------------------------------------------------------


def build_baseline(folder: Path) -> tuple[Path | None, str]:
    """Build the C++ program of the checkout into a folder: (program or None, why there is none)."""
    source = paths.root() / "tests" / "benchmarks" / "eigen_baseline.cpp"
    if not (paths.in_repository() and source.is_file()):
        return None, "its source is in a checkout of Muslin only"
    compiler = shutil.which("g++") or shutil.which("clang++")
    if compiler is None:
        return None, "there is no C++ compiler"
    eigen = next((path for path in EIGEN if Path(path).is_dir()), None)
    if eigen is None:
        return None, "Eigen's headers are not installed (Debian: libeigen3-dev)"
    program = folder / "eigen_baseline"
    command = [compiler, *FLAGS, f"-I{eigen}", str(source), "-o", str(program)]
    done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        return None, "it cannot be built: " + (done.stderr.strip().splitlines() or ["no reason given"])[0]
    return program, ""


def write_problem(scene: Scene, path: Path) -> None:
    """What the C++ program reads: see there."""
    model, state = simulation.build(replace(scene, solver="superlu"))
    body, (mu, lam) = model.body, scene.lame

    def line(*numbers: float) -> str:
        return " ".join(repr(float(number)) for number in numbers)

    with path.open("w") as file:
        print(len(body.X), len(body.cells), len(model.pinned), file=file)
        print(line(mu, lam, scene.rho, scene.h, scene.dt), file=file)
        print(line(*scene.gravity), file=file)
        print(line(*scene.sphere_center, scene.sphere_radius if scene.sphere else -1.0), file=file)
        for a, b in zip(body.X, state.x, strict=True):
            print(line(*a, *b), file=file)
        np.savetxt(file, body.cells, fmt="%d")
        np.savetxt(file, model.pinned, fmt="%d")


def run_baseline(program: Path, problem: Path, steps: int, how: str) -> tuple[np.ndarray, np.ndarray]:
    """((steps, 2) wall and CPU time [ms], positions (<= 20, n, 3)) of the C++ program."""
    trajectory = problem.with_suffix(".xyz")
    command = [str(program), str(problem), str(steps), str(trajectory), how]
    printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    n = int(problem.read_text().split(maxsplit=1)[0])
    return np.array(printed.split(), float).reshape(-1, 2), np.fromfile(trajectory).reshape(-1, n, 3)


# What a step must do --------------------------------------------------------------------------------------------


def bytes_moved(model: Model) -> int:
    """Bytes that assembling one step must move: every array of its kernels once, indices included."""
    element = model.body.elements["hessian"]
    parts = (element, model._assemble, model._impulse, getattr(model.body.bending, "element", None))
    launches = [getattr(part, "_launch", None) for part in parts]
    arrays = itertools.chain.from_iterable(launch.arguments for launch in launches if launch is not None)
    return sum(array.nbytes for array in arrays if isinstance(array, np.ndarray))


def factor_flops(model: Model) -> tuple[float, int] | None:
    """Flops of a numeric factorisation in our order of elimination, and the threads it uses; None where unknown."""
    triangles = getattr(model.system.solver, "_triangles", None)
    if triangles is None or not cholmod.available():
        return None
    return sum(cholmod.analysed(t.indptr, t.indices)[1] for t in triangles), len(triangles)


def alternate(
    candidates: list[Candidate], count: int, enough: Callable[[int], bool]
) -> dict[str, np.ndarray]:
    """Median wall and CPU time per step of each candidate, name -> (rounds, 2) [ms], in turns.

    Parameters
    ----------
    candidates
    count : int
        Steps per round; the first, which may compile or load something, does not count.
    enough : callable
        Told the number of rounds done, whether to stop.
    """
    times: dict[str, list[np.ndarray]] = {candidate.name: [] for candidate in candidates}
    done = 0
    while not enough(done):
        for candidate in candidates:
            times[candidate.name].append(np.median(candidate.steps(count), axis=0))
        done += 1
    return {name: np.array(rounds).reshape(-1, 2) for name, rounds in times.items()}
