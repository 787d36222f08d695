"""Packages that an extra brings, and what is said where one is missing."""

from __future__ import annotations

import importlib
from typing import Any

from muslin.base.errors import MuslinError


def require(package: str, what: str, extra: str, otherwise: str = "") -> Any:
    """An optional package, imported.

    Parameters
    ----------
    package : str
        Its name.
    what : str
        What needs it, to begin a sentence with.
    extra : str
        The extra of Muslin that brings it.
    otherwise : str
        What else there is to do.

    Raises
    ------
    MuslinError
        If it cannot be imported; names the extra.
    """
    try:
        return importlib.import_module(package)
    except ImportError as error:
        raise MuslinError(
            f"{what} needs {package}, which cannot be imported ({error}).",
            f'Install it with: pip install "muslin[{extra}]"{otherwise}',
        ) from None
