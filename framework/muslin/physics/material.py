"""Material: Lamé parameters. The energies of the stretches are in `energies`."""

from muslin.base.errors import MuslinError, choices

#: What E and nu of a sheet mean: see `lame`.
PLANES = ("stress", "strain", "course")


def lame(E: float, nu: float, swap: bool = False, plane: str = "strain") -> tuple[float, float]:
    """Lamé parameters (mu, lam) from Young's modulus and Poisson's ratio.

    Parameters
    ----------
    E : float
        Young's modulus [Pa], positive.
    nu : float
        Poisson's ratio, in (-1, 1/2).
    swap : bool
        The same as `plane="course"`.
    plane : {"stress", "strain", "course"}
        What a sheet does across its plane. In plane stress nothing holds its thickness, so that a strip pulled along
        has the stress E times its strain and becomes nu times as much narrower: lam = E nu / (1 - nu^2). In plane
        strain its thickness is held: lam = E nu / ((1 + nu) (1 - 2 nu)), which is also that of solids. The original
        course's starter code took plane strain and passed one for the other, (lam, mu); its published pictures can only
        be reproduced that way.

    Returns
    -------
    mu, lam : float
        [Pa]

    Raises
    ------
    MuslinError
        If E or nu is outside its range, or there is no such plane.
    """
    if not E > 0:
        raise MuslinError(f"Young's modulus E = {E} must be positive.")
    if not -1 < nu < 0.5:
        raise MuslinError(f"Poisson's ratio nu = {nu} must lie between -1 and 0.5.")
    if plane not in PLANES:
        raise MuslinError(f"plane = {plane!r} is not understood.", choices(plane, PLANES))
    mu = E / (2 * (1 + nu))
    if plane == "stress" and not swap:
        return mu, E * nu / (1 - nu**2)
    lam = E * nu / ((1 + nu) * (1 - 2 * nu))
    return (lam, mu) if swap or plane == "course" else (mu, lam)
