"""The framework's own element: the 3x2 deformation gradient in closed form, in one fused kernel.

It uses a polar decomposition instead of a singular value decomposition and the energies' own simplified modes
instead of difference quotients: the same physics as a student's functions in another form, so that each checks
the other. It is the fast road, and stands in for functions that are not written yet.
"""

import numpy as np

from muslin.base import runtime
from muslin.base.errors import MuslinError
from muslin.base.launch import Launch, is_small
from muslin.physics.elements import modes
from muslin.physics.elements.element import Element, Membrane, Rest, apart
from muslin.physics.elements.native_kernels import element, gradients_at_rest, of_invariants

#: What lam weighs: (s_0 + s_1 - 2)^2 / 2 and (s_0 s_1 - 1)^2 / 2.
TERMS = {"linearised": (1.0, 0.0), "area": (0.0, 1.0), "volumetric": (0.0, 1.0)}

#: Energies mu/2 (s_0 - s_1)^2 + a/2 (I - 2)^2 + b/2 (J - 1)^2 of I = s_0^2 + s_1^2 and J = s_0 s_1: a and b, each as
#: parts of (mu, lam). St. Venant-Kirchhoff's, of Green's strains (s_i^2 - 1)/2; the same with (J - 1)^2 for the size;
#: Neo-Hooke's without its pole (Smith, de Goes, Kim 2018). For small strains all are the linearised one.
INVARIANTS = {
    "green": ((0.5, 0.25), (-1.0, 0.0)),
    "green-area": ((0.5, 0.0), (-1.0, 1.0)),
    "neo-hookean": ((0.0, 0.0), (1.0, 1.0)),
}


class NativeElement(Element):
    """Energy, gradient and Hessian of every triangle, by the framework's own closed forms.

    Parameters
    ----------
    rest : Rest
    membrane : Membrane
        On a cloth the energies "area" and "volumetric" are the same.
    """

    def __init__(self, rest: Rest, membrane: Membrane):
        if membrane.energy not in TERMS and membrane.energy not in INVARIANTS:
            raise MuslinError(
                f"The native element does not have the energy {membrane.energy!r}.", "Run with functions."
            )
        m = len(rest.triangles)
        super().__init__(rest.X, rest.triangles, (m, modes.LENGTH))
        kernel, weights = element, [(0.0, share) for share in TERMS.get(membrane.energy, ())]
        if membrane.energy in INVARIANTS:
            kernel, weights = of_invariants, list(INVARIANTS[membrane.energy])
        terms = (float(membrane.mu), *(float(a * membrane.mu + b * membrane.lam) for a, b in weights))
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
    runtime.call(gradients_at_rest, X, triangles, normal, g0)
    return g0
