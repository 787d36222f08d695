"""Material: Lamé parameters. The energies of the stretches are in `energies`."""

from muslin.base.errors import MuslinError


def lame(E: float, nu: float, swap: bool = False) -> tuple[float, float]:
    """Lamé parameters (mu, lam) from Young's modulus and Poisson's ratio.

    Parameters
    ----------
    E : float
        Young's modulus [Pa], positive.
    nu : float
        Poisson's ratio, in (-1, 1/2).
    swap : bool
        Return (lam, mu) instead: the original course's starter code passed one for the other, and its
        published pictures can only be reproduced that way.

    Returns
    -------
    mu, lam : float
        [Pa]

    Raises
    ------
    MuslinError
        If E or nu is outside its range.
    """
    if not E > 0:
        raise MuslinError(f"Young's modulus E = {E} must be positive.")
    if not -1 < nu < 0.5:
        raise MuslinError(f"Poisson's ratio nu = {nu} must lie between -1 and 0.5.")
    mu = E / (2 * (1 + nu))
    lam = E * nu / ((1 + nu) * (1 - 2 * nu))
    return (lam, mu) if swap else (mu, lam)
