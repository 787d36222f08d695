"""The words for a file that cannot be read."""

from __future__ import annotations

import re

from muslin.base.errors import MeshError

EXPORT_AGAIN = "Export the mesh again, in doubt as OBJ."


def damaged(file: str, kind: str, reason: object = "") -> MeshError:
    """The error for a file that breaks the rules of its format."""
    why = one_line(reason)
    return MeshError(
        f"{file} cannot be read as {kind}: the file is damaged, incomplete or of another format"
        f"{f' ({why})' if why else ''}.",
        EXPORT_AGAIN,
    )


def one_line(reason: object) -> str:
    """One short line, without the terminal's colours or what a traceback would begin with."""
    text = re.sub(r"\x1b\[[0-9;]*m", "", str(reason))
    text = re.sub(r"[^ -~\s]|[\x1c-\x1f]", "?", text)
    return " ".join(text.replace("Traceback", "").split())[:160].strip(" .:")
