"""Reference data: inputs drawn from a seed, answers from the assignment's judges, files that say so.

`data/reference/<assignment>/<task>.npz` holds one array per argument, by its name, one per result, named
`expected_<result>`, and what students measure answers against where they have no function that says so
(`muslin.judging.measured`); `provenance.json` holds the seed, versions and checksums. Public cases ship with Muslin;
an instructor makes hidden ones with the same command and a secret seed.

Inputs are drawn with Python's `random.Random`, whose stream is guaranteed, and worked out in mpmath before
they are rounded: every machine draws the same bytes. Case k is of kind k of its task, in turn, so a file
covers all kinds whatever the seed. No case sits where a right answer is badly conditioned.
"""

from __future__ import annotations

import hashlib
import io
import json
import zipfile
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from muslin import tasks
from muslin.base import paths
from muslin.base.errors import MuslinError
from muslin.base.version import __version__
from muslin.judging import exact, measured
from muslin.judging.cases import draw_inputs as draw_inputs  # handed on: public names
from muslin.judging.cases import make
from muslin.judging.cases import truth as truth

PROVENANCE = "provenance.json"
GENERATOR = "muslin.authoring.reference_data"

#: Seed and number of cases per task of the public data.
PUBLIC_SEED = "muslin public"
PUBLIC_CASES = 30

#: How closely `verify` wants the outputs reproduced, relative to the largest entry of each case.
REPRODUCED = 1e-15

#: How closely the size of terms, which is worked out in float64.
MEASURED = 1e-12


def build(
    assignment_name: str = "cloth",
    out_folder: Path | str | None = None,
    seed: int | str = PUBLIC_SEED,
    cases: int = PUBLIC_CASES,
    hidden: bool = False,
    only: Collection[str] = (),
) -> Path:
    """Write the reference data of an assignment.

    Parameters
    ----------
    assignment_name : str
        Which assignment.
    out_folder : path, optional
        Where to; default the public data.
    seed : int or str
        Keep it secret for hidden cases: it is written into the folder's provenance.
    cases : int
        Cases per task.
    hidden : bool
        Hidden data: they need a seed and a folder of their own, which nobody but their owner can read.
    only : collection of str
        Tasks to make data for, what is there of all others stays as it is. Default: all tasks.

    Returns
    -------
    Path
        The folder written.

    Raises
    ------
    MuslinError
        If hidden data would have no secret seed or lie in the checkout, or in the instructor's own folder.
    """
    if hidden:
        _require_secret(assignment_name, out_folder, seed)
    exact.precise()  # says what to install, if need be
    import mpmath

    folder = Path(out_folder) if out_folder is not None else paths.reference(assignment_name)
    folder.mkdir(parents=True, exist_ok=True)
    if hidden:
        folder.chmod(0o700)
    kept = json.loads((folder / PROVENANCE).read_text(encoding="utf-8"))["files"] if only else {}
    files = {}
    for task in tasks.assignment(assignment_name).tasks:
        if only and task not in only:
            files[f"{task}.npz"] = kept[f"{task}.npz"]
            continue
        arrays = make(assignment_name, task, seed, cases)
        _write_npz(folder / f"{task}.npz", arrays)
        files[f"{task}.npz"] = {"cases": cases, "sha256": _checksum(arrays)}
    if not hidden and not only:
        _write_simulation(assignment_name, folder)
    provenance = {
        "assignment": assignment_name,
        "generator": GENERATOR,
        "muslin": __version__,
        "mpmath": mpmath.__version__,
        "digits": exact.DIGITS,
        "seed": seed,
        "files": files,
    }
    (folder / PROVENANCE).write_text(json.dumps(provenance, indent=2) + "\n", encoding="utf-8")
    return folder


def _require_secret(assignment_name: str, out_folder: Path | str | None, seed: int | str) -> None:
    if seed == PUBLIC_SEED or not str(seed).strip():
        raise MuslinError("Hidden data need a secret seed.", "Add --seed with words nobody will guess.")
    if out_folder is None:
        raise MuslinError("Hidden data need a folder of their own.", "Add --out DIR.")
    folder = Path(out_folder).resolve()
    shared = (paths.home(assignment_name), paths.root())
    if inside := [home for home in shared if folder.is_relative_to(home.resolve())]:
        raise MuslinError(
            f"{paths.shown(folder)} lies in {paths.shown(inside[0])}, from which all else is shared.",
            "Choose a folder outside of it for --out.",
        )


def _simulated(assignment_name: str) -> Path | None:
    """Where the reference run of an assignment lies under its data, if the assignment has one."""
    made = tasks.assignment(assignment_name).simulation
    return Path("simulation") / f"{made.scene}.npz" if made is not None else None


def _write_simulation(assignment_name: str, folder: Path) -> None:
    """The run that submissions' simulations are compared with: by the framework's own element, not the solution."""
    from muslin.grading import simulating

    made = tasks.assignment(assignment_name).simulation
    if made is not None and (place := _simulated(assignment_name)) is not None:
        (folder / place).parent.mkdir(exist_ok=True)
        _write_npz(folder / place, simulating.make_reference(made))


@dataclass
class Report:
    """What `verify` found: `errors` is the largest relative difference per task, `problems` are sentences.

    `slips` are what goes wrong in the author's own functions while cases are made again.
    """

    folder: Path
    errors: dict[str, float] = field(default_factory=dict)
    problems: list[str] = field(default_factory=list)
    slips: list[MuslinError] = field(default_factory=list)

    @property
    def ok(self) -> bool:
        """Whether nothing is wrong."""
        return not self.problems and not self.slips


def verify(
    assignment_name: str = "cloth",
    folder: Path | str | None = None,
    regenerate: bool = True,
    simulation: bool = True,
) -> Report:
    """Make reference data again from the seed on record and compare.

    Inputs must come out byte for byte, outputs to `REPRODUCED`; checksums and the list of files must agree.

    Parameters
    ----------
    assignment_name : str
        Which assignment.
    folder : path, optional
        Default the public data.
    regenerate : bool
        False compares checksums and the list of files only.
    simulation : bool
        Whether the reference run that may lie beside the public data is made again, too; half a minute.

    Returns
    -------
    Report
        `report.ok`, and `report.problems` in words.

    Raises
    ------
    MuslinError
        If the folder has no readable provenance.
    """
    folder = Path(folder) if folder is not None else paths.reference(assignment_name)
    try:
        provenance = json.loads((folder / PROVENANCE).read_text(encoding="utf-8"))
        seed, files = provenance["seed"], provenance["files"]
    except (OSError, ValueError, KeyError) as error:
        where = paths.shown(folder / PROVENANCE)
        raise MuslinError(f"{where} cannot be read ({error}).", "Build the reference data first.") from None
    report = Report(folder)
    expected = {f"{task}.npz" for task in tasks.assignment(assignment_name).tasks}
    for name in sorted(expected ^ set(files)):
        report.problems.append(f"{name}: {'not on record' if name in expected else 'no such task'}.")
    for name in sorted(expected & set(files)):
        try:
            with np.load(folder / name, allow_pickle=False) as data:
                found = {key: data[key] for key in data.files}
        except (OSError, ValueError, zipfile.BadZipFile) as error:
            report.problems.append(f"{name}: cannot be read ({error}).")
            continue
        if _checksum(found) != files[name]["sha256"]:
            report.problems.append(f"{name}: its content is not what the provenance says (sha256 differs).")
        if not regenerate:
            continue
        task = name.removesuffix(".npz")
        try:
            made = make(assignment_name, task, seed, files[name]["cases"])
        except MuslinError as error:
            report.slips.append(error)
            continue
        report.errors[task] = _compare(name, found, made, report.problems)
    if folder != paths.reference(assignment_name):
        return report
    if regenerate and simulation and (place := _simulated(assignment_name)) is not None:
        report.problems += _verify_simulation(assignment_name, str(place))
    return report


def _verify_simulation(assignment_name: str, name: str) -> list[str]:
    """Run the reference simulation again; only its first steps are comparable between machines."""
    from muslin.grading import simulating

    asked, found = tasks.assignment(assignment_name).simulation, simulating.reference(assignment_name)
    if found is None or asked is None:
        return [f"{name}: missing."]
    made, rows = simulating.make_reference(asked), asked.compared_steps + 1
    error, tolerance = simulating.compare_energies(found["energies"][:rows], made["energies"][:rows])
    same = np.array_equal(found["triangles"], made["triangles"]) and error <= tolerance
    return [] if same else [f"{name}: the simulation differs (energies by {error:.1e}, relative)."]


def _compare(
    name: str, found: Mapping[str, np.ndarray], made: Mapping[str, np.ndarray], problems: list[str]
) -> float:
    """Largest relative difference of the outputs; what is wrong goes to `problems`."""
    worst = 0.0
    for key in sorted(set(found) | set(made)):
        if key not in found or key not in made:
            problems.append(f"{name}: {key} is {'missing' if key in made else 'unknown'}.")
        elif found[key].shape != made[key].shape or found[key].dtype != made[key].dtype:
            problems.append(f"{name}: {key} has another shape or type than the generator makes.")
        elif key != measured.TERMS and not key.startswith("expected_"):
            if found[key].tobytes() != made[key].tobytes():
                problems.append(f"{name}: {key} is not what the seed gives.")
        else:
            flat = made[key].reshape(len(made[key]), -1).astype(float)
            difference = np.abs(found[key].reshape(flat.shape) - flat).max(axis=1)
            scale = np.abs(flat).max(axis=1)
            error = float(np.max(difference / np.where(scale > 0, scale, 1.0), initial=0.0))
            worst = max(worst, error)
            if not error <= (MEASURED if key == measured.TERMS else REPRODUCED):
                problems.append(f"{name}: {key} differs from the truth by {error:.1e} (relative).")
    return worst


def _checksum(arrays: Mapping[str, np.ndarray]) -> str:
    """sha256 of names, types, shapes and little-endian bytes."""
    digest = hashlib.sha256()
    for name in sorted(arrays):
        array = np.ascontiguousarray(arrays[name])
        array = array.astype(array.dtype.newbyteorder("<"), copy=False)
        digest.update(f"{name} {array.dtype.str} {array.shape}\n".encode())
        digest.update(array.tobytes())
    return digest.hexdigest()


def _write_npz(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """`numpy.savez`, with the same bytes on every machine: no time stamps, nothing compressed."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_STORED) as archive:
        for name, array in arrays.items():
            buffer = io.BytesIO()
            little = np.ascontiguousarray(array)
            little = little.astype(little.dtype.newbyteorder("<"), copy=False)
            np.lib.format.write_array(buffer, little, version=(1, 0), allow_pickle=False)
            entry = zipfile.ZipInfo(f"{name}.npy")
            entry.create_system = 3
            archive.writestr(entry, buffer.getvalue())
