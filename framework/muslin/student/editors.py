"""What a workspace holds for editors: which Python to ask, and VS Code's tasks that turn what fails into squiggles.

`muslin check --problems` and `muslin watch --problems` write a line for each task that fails; the tasks of a workspace
(`.vscode/tasks.json`) ask for them, and their problem matcher reads them.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Any

#: A line, for VS Code (JavaScript) and for Python alike: file, line, severity, message.
PATTERN = r"^([^\s:/\\]+\.py):(\d+): (error): (.+)$"

#: What `watch` writes around the lines of one check.
BEGINS, ENDS = "muslin: checking", "muslin: checked"


def settings(folder: Path) -> dict[str, str]:
    """Settings that make completion and jump-to-definition work, and VS Code's tasks, by path.

    Editors need to know which Python has Muslin. Where its virtual environment lies in the workspace or beside
    it, that is written down *relative* to the workspace, so that moving both keeps it true. Where it lies
    elsewhere nothing is written: Pyright and VS Code then take the environment that is active, and a path of
    this machine would only go stale. Types are not checked: Taichi functions are not typed Python.
    """
    pyright = ['typeCheckingMode = "off"', 'exclude = ["runs", ".muslin"]']
    vscode: dict[str, Any] = {}
    if (environment := _environment(folder)) is not None:
        pyright += [f'venvPath = "{environment.parent.as_posix()}"', f'venv = "{environment.name}"']
        python = "Scripts/python.exe" if os.name == "nt" else "bin/python"
        vscode["python.defaultInterpreterPath"] = f"${{workspaceFolder}}/{environment.as_posix()}/{python}"
    vscode |= {"files.exclude": {"**/.muslin": True, "**/__pycache__": True}, "editor.rulers": [110]}
    return {
        "pyproject.toml": "\n".join(
            [
                "# For your editor: which Python to ask for completion, and how long lines are.",
                "[tool.pyright]", *pyright, "", "[tool.ruff]", "line-length = 110", "",
            ]
        ),
        ".vscode/settings.json": json.dumps(vscode, indent=2) + "\n",
        ".vscode/tasks.json": tasks(),
        ".vscode/extensions.json": json.dumps({"recommendations": ["ms-python.python"]}, indent=2) + "\n",
        ".gitignore": "__pycache__/\nruns/\n*.zip\n.muslin/backup/\n",
    }  # fmt: skip


def _environment(folder: Path) -> Path | None:
    """The running virtual environment, relative to the workspace, if it is in it or at most two folders up."""
    prefix, here = Path(sys.prefix), folder.resolve()
    if sys.prefix == sys.base_prefix:
        return None
    for above in (here, here.parent, here.parent.parent):
        if prefix.parent == above and above != Path(above.anchor):
            return Path(os.path.relpath(prefix, here))
    return None


def matcher(watching: bool = False) -> dict[str, Any]:
    """VS Code's problem matcher for those lines."""
    found: dict[str, Any] = {
        "owner": "muslin",
        "source": "muslin",
        "fileLocation": ["relative", "${workspaceFolder}"],
        "pattern": {"regexp": PATTERN, "file": 1, "line": 2, "severity": 3, "message": 4},
    }
    if watching:
        found["background"] = {
            "activeOnStart": True,
            "beginsPattern": f"^{BEGINS}$",
            "endsPattern": f"^{ENDS}$",
        }
    return found


def tasks() -> str:
    """`.vscode/tasks.json`: check everything (the build task), the file that is open, or whenever a file is saved."""

    def task(label: str, *words: str, **more: Any) -> dict[str, Any]:
        return {
            "label": label,
            "type": "process",
            "command": "${command:python.interpreterPath}",
            "args": ["-m", "muslin.cli", *words, "--problems"],
            "options": {"cwd": "${workspaceFolder}"},
            "problemMatcher": [matcher("isBackground" in more)],
            **more,
        }

    build = {"kind": "build", "isDefault": True}
    listed = [
        task("muslin check", "check", group=build),
        task("muslin check this file", "check", "${fileBasename}", group="build"),
        task("muslin watch", "watch", isBackground=True),
    ]
    return json.dumps({"version": "2.0.0", "tasks": listed}, indent=2) + "\n"
