"""Count how often triangles cross in every recorded frame of the scenes whose cloth meets itself.

    python tests/benchmarks/crossings.py [--mode fast] [--scenes drape,hang,cape,pile,wrung] [--set key=value ...]

The counter is that of the tests (`tests/test_self_contact.py`): plane sides and signed volumes, nothing of the
simulator or of ipctk. For each scene: frames and crossings in all of them, how much the energy less `work` rose above
its start [J], and the kinetic energy at the end. `wrung` is for `--mode exact`.
"""

from __future__ import annotations

import argparse
import dataclasses
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np

HERE = Path(__file__).resolve()
sys.path.insert(0, str(HERE.parents[1]))

#: Scene and parameters; `pile`: a sheet that falls upright on the floor.
SCENES: dict[str, tuple[str, dict[str, Any]]] = {
    "drape": ("drape", {"steps": 960}),
    "hang": ("hang", {"steps": 240}),
    "cape": ("cape", {"steps": 1920}),
    "pile": ("drape", {
        "sphere": "off", "ground": -0.6, "floor": True, "tilt": 88.0, "start_at": (0.0, 0.0, 0.0), "resolution": 40,
        "steps": 720,
    }),
}  # fmt: skip


def measured(name: str, mode: str, more: dict[str, str]) -> str:
    """A line of the table."""
    from test_self_contact import crossings

    import muslin

    scene, parameters = SCENES[name]
    with tempfile.TemporaryDirectory() as folder:
        begin = time.process_time()
        run = muslin.simulate(scene, out=folder, self_collision=mode, **{**parameters, **more})
        seconds = time.process_time() - begin
        files = sorted((Path(folder) / "frames").iterdir())
        counts = [crossings(np.load(file), run.mesh.triangles) for file in files]
    net = run.energies.total - run.energies.work
    rise, crossed = float((net - net[0]).max()), sum(count > 0 for count in counts)
    return (
        f"| {name}, {mode} | {len(run.body.X)} | {len(counts)} | {crossed} | {sum(counts)} | {rise:.2g} "
        f"| {run.energies.kinetic[-1]:.1e} | {seconds / max(len(net) - 1, 1):.2f} |"
    )


def wrung(steps: int = 40) -> str:
    """A strip whose ends turn against each other, with a barrier, in every step."""
    from test_barrier import ALONE, turning
    from test_self_contact import crossings

    from muslin import mesh, simulation

    sheet = mesh.grid(11, 6)
    x = np.stack([sheet.vertices[:, 0], 0.5 * sheet.vertices[:, 1], np.zeros(len(sheet.vertices))], axis=1)
    sheet = mesh.Mesh.from_arrays(x, sheet.triangles, name="strip")
    settings = {**ALONE, "dt": 1 / 60, "self_gap": 4e-3}
    scene = dataclasses.replace(simulation.scenes.get("drape", **settings), carried=turning)
    ends = np.flatnonzero(np.abs(np.abs(x[:, 0]) - 0.5) < 1e-9)
    model, state = simulation.simulating.build(scene, mesh=sheet, x=x, pinned=ends)
    states = simulation.integrators.steps(model, state, 1 / 60, "backward-euler", steps)
    counts = [crossings(s.x, sheet.triangles) for s in states]
    return f"| wrung, exact | {len(x)} | {len(counts)} | {sum(c > 0 for c in counts)} | {sum(counts)} | | | |"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--mode", default="fast")
    parser.add_argument("--scenes", default="drape,hang,cape,pile")
    parser.add_argument("--set", action="append", default=[])
    chosen = parser.parse_args()
    more = dict(text.split("=", 1) for text in chosen.set)
    columns = (
        "vertices",
        "frames",
        "with crossings",
        "crossings",
        "rise of energy [J]",
        "kinetic, end [J]",
        "s/step",
    )
    print(f"| scene | {' | '.join(columns)} |")
    print("|---|---:|---:|---:|---:|---:|---:|---:|")
    for name in chosen.scenes.split(","):
        print(wrung() if name == "wrung" else measured(name, chosen.mode, more), flush=True)


if __name__ == "__main__":
    main()
