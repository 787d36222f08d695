"""The course's cloth, thrown forwards over the sphere."""

from dataclasses import replace

from muslin.simulation.scenes.course import SCENE as COURSE

SCENE = replace(
    COURSE,
    name="throw",
    title="The course's square, thrown onto the sphere",
    gravity=(0.0, -1273.4, 1273.4),
    still=0.05,
)
