"""Grades @assignment@ with Muslin on Classroom 50, whose runner starts this in the student's checkout.

It installs Muslin beside this file in pinned versions, grades, and leaves `result.json` in the checkout.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

PACK = Path(__file__).resolve().parent


def installed() -> str:
    """A Python that has Muslin."""
    if ready := os.environ.get("MUSLIN_PYTHON"):  # a self-hosted runner with Muslin in its image
        return ready
    folder = Path(tempfile.mkdtemp(prefix="muslin-", dir=os.environ.get("RUNNER_TEMP")))
    subprocess.run([sys.executable, "-m", "venv", str(folder)], check=True)
    python = str(folder / "bin" / "python")
    wheel = next(PACK.glob("muslin-*.whl"))
    subprocess.run(
        [python, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", "--only-binary", ":all:",
         "--constraint", str(PACK / "constraints.txt"), str(wheel)],
        check=True,
    )  # fmt: skip
    return python


checkout = Path.cwd()
command = [installed(), "-I", "-m", "muslin.packing.grading", "classroom50"]
sys.exit(
    subprocess.run([*command, str(checkout), str(PACK), str(checkout / "result.json")], cwd="/").returncode
)
