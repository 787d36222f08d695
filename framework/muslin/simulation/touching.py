"""Contacts in backward Euler: what keeps vertices from moving inwards is part of what a step minimises.

To the function of the velocities v that is minimised each contact adds k/2 min(0, n^T (v - v_c))^2, with the contact's
normal n, the collider's velocity v_c there and a stiffness k so large that next to nothing is left for the filter
afterwards. It is convex and has no jump in its gradient, so that Newton's method finds by itself which contacts press.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from muslin.physics.colliders import Contacts
from muslin.simulation.model import Model

#: How much harder a contact is than the hardest vertex of the body in this step.
HARDER = 1e4


@dataclass(frozen=True)
class Touching:
    """Contacts of a step: vertices (c,), normals (c, 3), least normal velocities (c,) and a stiffness [kg]."""

    vertices: np.ndarray
    normals: np.ndarray
    least: np.ndarray
    stiffness: float

    @classmethod
    def of(cls, model: Model, contacts: list[Contacts], dt: float) -> Touching | None:
        """Those of a step of dt from where the body is; None where a model filters them afterwards, or has none."""
        if model.contact != "solve" or not contacts:
            return None
        vertices = np.concatenate([contact.vertices for contact in contacts])
        n = np.concatenate([contact.normals for contact in contacts])
        least = np.einsum("ij,ij->i", n, np.concatenate([contact.velocities for contact in contacts]))
        body = model.body
        hardest = (body.mass_data + dt**2 * body.stiffness_here(model.project))[body.pattern.diagonal].max()
        return cls(vertices, n, least, HARDER * float(hardest))

    def _inwards(self, v: np.ndarray) -> np.ndarray:
        """How much each contact's vertex moves inwards, (c,), negative; 0 where it does not [m/s]."""
        moving = np.einsum("ij,ij->i", self.normals, v.reshape(-1, 3)[self.vertices])
        return np.minimum(moving - self.least, 0.0)

    def value(self, v: np.ndarray) -> float:
        """What is added to the function [J]."""
        return self.stiffness / 2 * float((self._inwards(v) ** 2).sum())

    def gradient(self, v: np.ndarray) -> np.ndarray:
        """Its gradient, like v [N s]."""
        r = np.zeros((v.size // 3, 3))
        np.add.at(r, self.vertices, self.stiffness * self._inwards(v)[:, None] * self.normals)
        return r.ravel()

    def blocks(self, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Its Hessian: distinct vertices (k,) and their blocks (k, 3, 3)."""
        presses = self._inwards(v) < 0
        n = self.normals[presses]
        active, which = np.unique(self.vertices[presses], return_inverse=True)
        blocks = np.zeros((len(active), 3, 3))
        np.add.at(blocks, which, self.stiffness * n[:, :, None] * n[:, None, :])
        return active, blocks
