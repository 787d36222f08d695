"""Energies of a sheet by two invariants, I = s_0^2 + s_1^2 and J = s_0 s_1, as four numbers.

psi = mu/2 (s_0 - s_1)^2 + a/2 (I - 2)^2 + b/2 (J - 1)^2, where a and b are each some mu plus some lam. For small
strains that is the linearised energy if 4 a + b = mu + lam.
"""

from __future__ import annotations

from muslin.base.errors import MuslinError

#: (a, b) of an energy, each as parts of (mu, lam).
Weights = tuple[tuple[float, float], tuple[float, float]]

#: St. Venant-Kirchhoff's energy, of Green's strains (s_i^2 - 1)/2; the same with (J - 1)^2 for the size; Neo-Hooke's
#: without its pole (Smith, de Goes, Kim 2018).
INVARIANTS: dict[str, Weights] = {
    "green": ((0.5, 0.25), (-1.0, 0.0)),
    "green-area": ((0.5, 0.0), (-1.0, 1.0)),
    "neo-hookean": ((0.0, 0.0), (1.0, 1.0)),
}


def weights(energy: str) -> Weights | None:
    """The four numbers of an energy: a name of `INVARIANTS`, or "name: a b c d"; None for any other energy.

    Raises
    ------
    MuslinError
        If what follows the name are not four numbers.
    """
    if not isinstance(energy, str):
        return None
    name, colon, numbers = energy.partition(":")
    if not colon:
        return INVARIANTS.get(name)
    try:
        a, b, c, d = map(float, numbers.split())
    except ValueError:
        raise MuslinError(
            f"{energy!r} is no energy.", 'Write "name: a b c d", the parts of mu and lam in a and b.'
        ) from None
    return (a, b), (c, d)


def named(name: str, found: Weights) -> str:
    """An energy of one's own as `weights` reads it."""
    return f"{name}: {' '.join(f'{number:g}' for pair in found for number in pair)}"
