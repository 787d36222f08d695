"""Which tasks each part of a simulation calls, and so for which parts native code stands in.

A part is computed by a folder's functions only if all the tasks it needs may be called. If one of them is stood
in for (not written yet, or known to be wrong), the framework's own code computes that part: never a mixture
that would blame one function for another's mistake.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType

from muslin.errors import MuslinError
from muslin.tasks import Functions, assignment, failure_of

#: Tasks behind each part of a simulation: part -> names. `hessian` is the closed road.
NEEDS: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "energy": ("dphi_dX", "deformation_gradient", "psi"),
        "gradient": ("dphi_dX", "deformation_gradient", "dpsi_ds", "dpsi_dF", "nodal_force"),
        "hessian": ("dphi_dX", "deformation_gradient", "dpsi_ds", "d2psi_ds2", "eigensystem"),
        "lecture's hessian": (
            "dphi_dX", "deformation_gradient", "dpsi_ds", "d2psi_ds2", "d2psi_dFij", "dn_dx",
        ),
        "mass": ("mass_block",),
        "kinetic energy": ("kinetic_energy",),
        "detection": ("sphere_contact",),
        "response": ("filter_velocity",),
        "binding": ("phi",),
        "carrying": ("interpolate",),
    }
)  # fmt: skip

#: Tasks that only the linearised energy asks a student for.
STRAIN_ENERGY = ("psi", "dpsi_ds", "d2psi_ds2")


def needs(part: str, energy: str = "linearised", hessian: str = "closed") -> tuple[str, ...]:
    """Tasks whose functions a part of a simulation calls, with this energy and on this road to the Hessian.

    Parameters
    ----------
    part : str
        A key of `NEEDS`.
    energy, hessian : str
        As for `muslin.Cloth`.
    """
    names = NEEDS["lecture's hessian" if (part, hessian) == ("hessian", "lecture") else part]
    return names if energy == "linearised" else tuple(name for name in names if name not in STRAIN_ENERGY)


def unusable(functions: Functions) -> tuple[str, ...]:
    """Names of the tasks whose functions cannot be called: still the stub, missing, or in a broken file."""
    return tuple(name for name in functions.assignment.tasks if failure_of(functions[name]) is not None)


def checked(stand_ins: Iterable[str], functions: Functions | None) -> frozenset[str]:
    """Names of tasks that are stood in for, as a set.

    Raises
    ------
    MuslinError
        If the assignment has no task of one of these names.
    """
    chosen = frozenset([stand_ins] if isinstance(stand_ins, str) else stand_ins)
    known = list((functions.assignment if functions is not None else assignment()).tasks)
    if unknown := sorted(map(str, chosen - set(known))):
        raise MuslinError(
            f"There is no task {unknown[0]!r} that could be stood in for.", f"There is: {', '.join(known)}."
        )
    return chosen
