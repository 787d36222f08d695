"""The framework's own element: the 3x2 deformation gradient in closed form, in one fused kernel.

It uses a polar decomposition instead of a singular value decomposition and the energies' own simplified modes
instead of difference quotients: the same physics as a student's functions in another form, so that each checks
the other. It is the fast road, and stands in for functions that are not written yet.
"""

import numpy as np

from muslin.base.errors import MuslinError
from muslin.base.launch import Launch, is_small, once
from muslin.physics.elements import modes
from muslin.physics.elements.element import Element, Membrane, Rest, apart
from muslin.physics.elements.native_kernels import element, gradients_at_rest, of_invariants
from muslin.physics.invariants import weights

#: What lam weighs: (s_0 + s_1 - 2)^2 / 2 and (s_0 s_1 - 1)^2 / 2.
TERMS = {"linearised": (1.0, 0.0), "area": (0.0, 1.0), "volumetric": (0.0, 1.0)}


class NativeElement(Element):
    """Energy, gradient and Hessian of every triangle, by the framework's own closed forms.

    Parameters
    ----------
    rest : Rest
    membrane : Membrane
        On a cloth the energies "area" and "volumetric" are the same.
    """

    def __init__(self, rest: Rest, membrane: Membrane):
        chosen = weights(membrane.energy)
        if membrane.energy not in TERMS and chosen is None:
            raise MuslinError(
                f"The native element does not have the energy {membrane.energy!r}.", "Run with functions."
            )
        m = len(rest.triangles)
        super().__init__(rest.X, rest.triangles, (m, modes.LENGTH))
        kernel = element if chosen is None else of_invariants
        shares = chosen or tuple((0.0, share) for share in TERMS[membrane.energy])
        terms = (float(membrane.mu), *(float(a * membrane.mu + b * membrane.lam) for a, b in shares))
        g = rest_gradients(*apart(rest.X, rest.triangles), rest.normal)
        self._orders = np.zeros(2, dtype=np.int32)
        out = (self.energies, self.gradients, self.hessians)
        self._launch = Launch(
            kernel(is_small(m, 80)),
            self._orders,
            *self.at,
            g,
            membrane.h * rest.area,
            *terms,
            *out,
        )

    def _run(self, parts: int, project: bool) -> None:
        self._orders[:] = parts, project
        self._launch()


def rest_gradients(X: np.ndarray, triangles: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Gradient of each corner's shape function in its triangle's plane, (3 m, 3); the third entries are zero."""
    g0 = np.empty((3 * len(triangles), 3))
    once(gradients_at_rest(is_small(len(triangles), 20)), X, triangles, normal, g0)
    return g0
