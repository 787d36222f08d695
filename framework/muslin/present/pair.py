"""Two runs of one scene beside each other."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin import render
from muslin.present.pictures import Show
from muslin.simulation.runs import RunFolder


class Pair:
    """Two runs of one scene as one picture; the one that has come to its end earlier stands still.

    Parameters
    ----------
    left, right : RunFolder
        The right one says from where and in which colours.
    size : (width, height)
        Of the whole picture [pixels].
    labels : (str, str)
    **options
        See `Show`.
    """

    def __init__(
        self,
        left: RunFolder,
        right: RunFolder,
        size: tuple[int, int] = (1280, 720),
        labels: tuple[str, str] = ("yours", "the reference"),
        **options: Any,
    ):
        half = size[0] // 4 * 2
        self.size, self.labels, self.scene = (2 * half, size[1]), labels, right.scene
        self.shows = Show(left, (half, size[1]), **options), Show(right, (half, size[1]), **options)
        theirs, measure = self.shows
        theirs.cloth, theirs.legend, theirs._top = measure.cloth, measure.legend, measure._top
        theirs.camera = lambda k: measure.camera(min(k, len(measure.times) - 1))  # type: ignore[method-assign]
        self.times = max((show.times for show in self.shows), key=len)
        self.whole = measure.whole

    def still(self, k: int) -> np.ndarray:
        """The same as its picture in the film: two runs are compared in one frame."""
        return self.picture(k)

    def picture(self, k: int) -> np.ndarray:
        """Frame k as a picture, (height, width, 3) uint8."""
        parts = []
        for show, label in zip(self.shows, self.labels, strict=True):
            last = min(k, show.whole)
            ended = f", until {show.times[last]:.2f} s" if last < k else ""
            parts.append(render.text_overlay(show.picture(last), label + ended))
        return np.concatenate(parts, axis=1)
