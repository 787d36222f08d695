"""From one mesh of a cloth to another of the same cloth, so that centre of mass, momentum and angular momentum stay.

Both meshes are written with the same vertex numbers; some vertices are in one of them only. What is new is the mean of
its parents, in space and in velocity; what was there is where it was. That alone keeps everything where a triangle is
only split: the surface and the field on it are the same. A flip exchanges both inside of two triangles (unless they
are in one plane, and the field is linear there), and a vertex that goes takes what it had with it. With the consistent
mass matrix M of triangles of masses m_t,

    centre   m c = sum_t m_t/3 sum_i x_i
    momentum p   = sum_t m_t/3 sum_i v_i
    angular  L   = sum_t m_t/12 (sum_i x_i x sum_j v_j + sum_i x_i x v_i)

change only in the triangles that are exchanged. These fall into *patches* that share no vertex. In each, `recentred`
shifts its new vertices (or, where a vertex went, all free ones) by one vector d, so that sum_j m_j d makes up for the
centre: without it a body that moves on would have to turn to keep its angular momentum. Then `conserved` looks for the
least change w of the patch's velocities, in the norm sum_j m_j |w_j|^2, that makes up for both momenta:

    sum_j m_j w_j = dp,    sum_j m_j c_j x w_j = dL,    m_j = sum_i M_ij,    c_j = sum_i M_ij x_i / m_j

By Lagrange's rule w_j = a + b x r_j with r_j = c_j - c, a = dp / m, and (sum_j m_j (|r_j|^2 I - r_j r_j^T)) b = dL -
c x dp, where m and c are the mass and the centre of the patch: the velocities of a rigid body that carries what is
missing. What rounding leaves (or a patch without free vertices) is made up for in the same way by all vertices
together. Energy is not kept; how much it differs is for the caller to say.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Sheet:
    """Triangles (m, 3) and the mass of each, (m,) [kg]."""

    triangles: np.ndarray
    masses: np.ndarray

    def momenta(
        self, x: np.ndarray, v: np.ndarray, rows: np.ndarray | slice = slice(None)
    ) -> tuple[np.ndarray, np.ndarray]:
        """Momentum and angular momentum about the origin of each of some triangles, (k, 3) both."""
        corners, mass = self.triangles[rows], self.masses[rows, None]
        r, u = x[corners], v[corners]
        sums = u.sum(axis=1)
        return mass / 3 * sums, mass / 12 * (
            _cross(r.sum(axis=1), sums) + sum(_cross(r[:, k], u[:, k]) for k in range(3))
        )

    def kinetic_energy(self, v: np.ndarray) -> float:
        """1/2 v^T M v [J]."""
        u = v[self.triangles]
        squares = (u.sum(axis=1) ** 2).sum(axis=1) + (u**2).sum(axis=(1, 2))
        return float(self.masses @ squares) / 24

    def times(self, v: np.ndarray, rows: np.ndarray | slice = slice(None)) -> np.ndarray:
        """M v, (n, 3), with the mass of some triangles."""
        t = self.triangles[rows]
        mass = self.masses[rows] / 12
        shared = mass[:, None] * _summed(v, t)
        own = np.bincount(t.ravel(), np.repeat(mass, 3), len(v))
        parts = [np.bincount(t.ravel(), np.repeat(shared[:, k], 3), len(v)) for k in range(3)]
        return np.stack(parts, axis=1) + own[:, None] * v

    def lumped(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Row sums of the mass matrix, m (n,), and M x / m, (n, 3)."""
        m = np.bincount(self.triangles.ravel(), np.repeat(self.masses / 3, 3), len(x))
        return m, self.times(x) / np.where(m > 0, m, 1.0)[:, None]


def _summed(values: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Sum of each triangle's corners, (m, 3)."""
    a, b, c = triangles.T
    return np.asarray(values[a] + values[b] + values[c])


class Exchange:
    """A mesh that takes another's place.

    Parameters
    ----------
    before, after : Sheet
        In one numbering of vertices.
    n : int
        Number of vertices, in either.
    free : (n,) bool, optional
        Vertices that may be moved and made to move; default all.
    rows : pair of int arrays, optional
        Triangles that are only in the one, and only in the other, where that is known.

    Attributes
    ----------
    patch : (n,) int
        Of each vertex; -1 where nothing is exchanged.
    """

    def __init__(
        self,
        before: Sheet,
        after: Sheet,
        n: int,
        free: np.ndarray | None = None,
        rows: tuple[np.ndarray, np.ndarray] | None = None,
    ):
        self.before, self.after, self.n = before, after, n
        one, other = before.triangles, after.triangles
        self.rows = (_only_in(one, other), _only_in(other, one)) if rows is None else rows
        self.patch = _patches(before.triangles[self.rows[0]], after.triangles[self.rows[1]], n)
        self.patches = int(self.patch.max(initial=-1)) + 1
        used = [np.bincount(sheet.triangles.ravel(), minlength=n) > 0 for sheet in (before, after)]
        self.free = used[1] if free is None else free & used[1]
        self._gone, self._new = used[0] & ~used[1], used[1] & ~used[0]

    def _missing(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """Of what each triangle has (k, 3), how much each patch has less of after than before."""
        out = np.zeros((self.patches, 3))
        for sign, sheet, rows, values in zip(
            (1, -1), (self.before, self.after), self.rows, (before, after), strict=True
        ):
            out += sign * _gathered(values, self.patch[sheet.triangles[rows, 0]], self.patches)
        return out

    def recentred(self, x: np.ndarray) -> np.ndarray:
        """Positions (n, 3) near x with the centre of mass of the mesh before."""
        if not self.patches:
            return x
        lost = np.zeros(self.patches, dtype=bool)
        lost[self.patch[self._gone]] = True
        moves = np.flatnonzero((self.patch >= 0) & self.free & (self._new | lost[self.patch]))
        m, _ = self.after.lumped(x)
        mass = np.bincount(self.patch[moves], m[moves], self.patches)
        moments = [
            sheet.masses[rows, None] / 3 * x[sheet.triangles[rows]].sum(axis=1)
            for sheet, rows in zip((self.before, self.after), self.rows, strict=True)
        ]
        shift = self._missing(*moments) / np.where(mass > 0, mass, 1.0)[:, None]
        shift[np.abs(shift).max(axis=1) < ROUNDING * np.abs(x).max(initial=0.0)] = 0.0
        moved = x.copy()
        moved[moves] += shift[self.patch[moves]]
        return moved

    def conserved(
        self, x_before: np.ndarray, x_after: np.ndarray, v_before: np.ndarray, v_after: np.ndarray
    ) -> np.ndarray:
        """Velocities (n, 3) near `v_after` whose momenta on the mesh after are those of `v_before` before."""
        m, c = self.after.lumped(x_after)
        v = v_after.copy()
        if self.patches:
            old = self.before.momenta(x_before, v_before, self.rows[0])
            new = self.after.momenta(x_after, v, self.rows[1])
            missing = self._missing(old[0], new[0]), self._missing(old[1], new[1])
            a, b, t = (self.patch[corner] >= 0 for corner in self.after.triangles.T)
            kept = a | b | t
            kept[self.rows[1]] = False  # triangles that stay turn about their corners that were shifted
            inside = np.flatnonzero(self.patch >= 0)
            turned = _cross((x_after - x_before)[inside], self.after.times(v, np.flatnonzero(kept))[inside])
            missing[1][...] -= _gathered(turned, self.patch[inside], self.patches)
            v += _Rigid(np.where(self.free, self.patch, -1), self.patches, m, c).velocities(*missing)
        whole, all_free = _total(*self.before.lumped(x_before), v_before), np.where(self.free, 0, -1)
        together = _Rigid(all_free, 1, m, c)
        for _ in range(2):
            v += together.velocities(*(was - now for was, now in zip(whole, _total(m, c, v), strict=True)))
        return v


#: Shifts below this part of the largest coordinate are rounding, and are left out.
ROUNDING = 1e-14


def _only_in(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Rows of triangles that are not among the others, whichever corner comes first."""
    n = 1 + max(int(one.max(initial=0)), int(other.max(initial=0)))

    def keys(triangles: np.ndarray) -> np.ndarray:
        a, b, c = np.sort(triangles.astype(np.int64), axis=1).T
        return np.asarray((a * n + b) * n + c)

    return np.flatnonzero(~np.isin(keys(one), keys(other)))


def _patches(gone: np.ndarray, come: np.ndarray, n: int) -> np.ndarray:
    """Number of the patch each vertex is in, (n,); -1 where nothing changed."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    t = np.concatenate([gone, come])
    pairs = np.concatenate([t[:, :2], t[:, 1:]])
    graph = coo_matrix((np.ones(len(pairs), dtype=np.int8), pairs.T), shape=(n, n))
    _, label = connected_components(graph, directed=False)
    used = np.unique(t)
    patch = np.full(n, -1)
    patch[used] = np.unique(label[used], return_inverse=True)[1].ravel()
    return patch


def _total(m: np.ndarray, c: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Momentum and angular momentum of all, (1, 3) both: of velocities with what `Sheet.lumped` gives."""
    p = m[:, None] * v
    return p.sum(axis=0)[None], _cross(c, p).sum(axis=0)[None]


class _Rigid:
    """Rigid bodies, one for each of `count` patches, of masses m (n,) at c (n, 3); -1 where there is none."""

    def __init__(self, patch: np.ndarray, count: int, m: np.ndarray, c: np.ndarray):
        self._n, self._inside = len(patch), np.flatnonzero(patch >= 0)
        self._which = which = patch[self._inside]
        weight = m[self._inside]
        mass = np.bincount(which, weight, count)
        self._massive, self._mass = mass[:, None] > 0, np.where(mass > 0, mass, 1.0)[:, None]
        self._centre = _gathered(weight[:, None] * c[self._inside], which, count) / self._mass
        self._r = r = c[self._inside] - self._centre[which]
        x, y, z = r.T
        squares = np.stack([x * x, y * y, z * z, x * y, x * z, y * z], axis=1) * weight[:, None]
        xx, yy, zz, xy, xz, yz = _gathered(squares, which, count).T
        self._inertia = np.stack([yy + zz, xx + zz, xx + yy, -xy, -xz, -yz])

    def velocities(self, dp: np.ndarray, dL: np.ndarray) -> np.ndarray:
        """Velocities (n, 3) with which they have these momenta (count, 3); 0 where there is none."""
        a = np.where(self._massive, dp / self._mass, 0.0)
        b = _turning(self._inertia, dL - _cross(self._centre, dp))
        w = np.zeros((self._n, 3))
        w[self._inside] = a[self._which] + _cross(b[self._which], self._r)
        return w


#: Part of what it is for a ball from which the determinant of an inertia is inverted as it is.
SOUND = 1e-5


def _turning(inertia: np.ndarray, spin: np.ndarray) -> np.ndarray:
    """What turns bodies of inertias (xx, yy, zz, xy, xz, yz) (6, k) so that they have spins (k, 3): (k, 3).

    Where a body is a rod or a point, nothing about the axes it has no inertia about.
    """
    xx, yy, zz, xy, xz, yz = inertia
    # the adjugate
    aa, bb, cc = yy * zz - yz * yz, xx * zz - xz * xz, xx * yy - xy * xy
    ab, ac, bc = xz * yz - xy * zz, xy * yz - xz * yy, xy * xz - xx * yz
    det = xx * aa + xy * ab + xz * ac
    sound = det > SOUND * ((xx + yy + zz) / 3) ** 3
    sx, sy, sz = spin.T
    out = np.stack(
        [aa * sx + ab * sy + ac * sz, ab * sx + bb * sy + bc * sz, ac * sx + bc * sy + cc * sz], axis=1
    )
    out /= np.where(sound, det, 1.0)[:, None]
    if not sound.all():
        rest = np.flatnonzero(~sound)
        matrix = inertia[:, rest][[0, 3, 4, 3, 1, 5, 4, 5, 2]].T.reshape(-1, 3, 3)
        inverse = np.linalg.pinv(matrix, rcond=1e-10, hermitian=True)
        out[rest] = np.einsum("kij,kj->ki", inverse, spin[rest])
    return out


def _gathered(values: np.ndarray, which: np.ndarray, count: int) -> np.ndarray:
    """Sums (count, d) of the rows (k, d) that are of the same one."""
    return np.stack([np.bincount(which, column, count) for column in values.T], axis=1)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Cross products of rows (k, 3), in a third of the time of NumPy's."""
    (ax, ay, az), (bx, by, bz) = a.T, b.T
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=1)
