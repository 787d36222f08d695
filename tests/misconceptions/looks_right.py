"""Functions that look right: some are, others miss by a guard, a floor, a limit, a constant or a rare input.

Each is a template of one function's body with a number left open, and the numbers to put in. What `muslin check`
calls right of them must get full points from the grader, but for hidden cases: see `tests/test_green_is_full.py`.
"""

from __future__ import annotations

from collections.abc import Iterator

import suite

from muslin import tasks

SMALL = ("0.0", "1e-15", "1e-12", "1e-9", "1e-7", "1e-6", "1e-5", "1e-4", "1e-3", "1e-2")

_QUOTIENTS = """
p, q = dpsi_ds[0], dpsi_ds[1]
flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
gap = s[0] - s[1]
if {gap} > {threshold}:
    flip = (p - q) / gap
return ti.Vector([flip, (p + q) / {twist}, p / {first}, q / {second}])
"""


def _quotients(gap: str = "abs(gap)", threshold: str = "1e-3", floor: str = "max({}, 1e-6)") -> str:
    denominators = {"twist": "s[0] + s[1]", "first": "s[0]", "second": "s[1]"}
    filled = {name: floor.format(value) for name, value in denominators.items()}
    return _QUOTIENTS.format(gap=gap, threshold=threshold, **filled)


#: task -> (name, body with {}, what to put in).
TEMPLATES: dict[str, list[tuple[str, str, tuple[str, ...]]]] = {
    "phi": [
        ("determinant kept from zero", """
            e, f, d = X1 - X0, X2 - X0, X - X0
            det = e.dot(e) * f.dot(f) - e.dot(f) ** 2 + {}
            p = (f.dot(f) * e.dot(d) - e.dot(f) * f.dot(d)) / det
            q = (e.dot(e) * f.dot(d) - e.dot(f) * e.dot(d)) / det
            return ti.Vector([1 - p - q, p, q])
            """, ("0.0", "1e-30", "1e-15", "1e-12", "1e-9", "1e-6")),
        ("clamped far away", """
            n = (X1 - X0).cross(X2 - X0)
            p = (X - X0).cross(X2 - X0).dot(n) / n.norm_sqr()
            q = (X1 - X0).cross(X - X0).dot(n) / n.norm_sqr()
            big = {}
            p = max(min(p, big), -big)
            return ti.Vector([1 - p - q, p, q])
            """, ("1.0", "2.0", "5.0", "100.0", "1e9")),
        ("signed areas", """
            n = (X1 - X0).cross(X2 - X0)
            a = ti.Vector([(X1 - X).cross(X2 - X).dot(n), (X2 - X).cross(X0 - X).dot(n), (X0 - X).cross(X1 - X).dot(n)])
            return a / ({})
            """, ("n.norm_sqr()", "(a[0] + a[1] + a[2])")),
    ],
    "dphi_dX": [
        ("cross products", """
            n = (X1 - X0).cross(X2 - X0)
            g1, g2 = (X2 - X0).cross(n), n.cross(X1 - X0)
            return ti.Matrix.rows([-g1 - g2, g1, g2]) / (n.norm_sqr() + {})
            """, SMALL),
    ],
    "interpolate": [
        ("weights", "w = {}\nreturn w * x0 + phi[1] * x1 + phi[2] * x2",
         ("phi[0]", "1 - phi[1] - phi[2]", "max(phi[0], 0.0)", "min(phi[0], 1.0)", "abs(phi[0])", "phi[0] + 1e-12", "phi[0] + 1e-7")),
        ("edges", "return {} + phi[1] * (x1 - x0) + phi[2] * (x2 - x0)", ("x0", "(phi[0] + phi[1] + phi[2]) * x0")),
    ],
    "deformation_gradient": [
        ("normal", """
            m = (x1 - x0).cross(x2 - x0)
            n = m / {}
            return x0.outer_product(dphi_dX[0, :]) + x1.outer_product(dphi_dX[1, :]) + x2.outer_product(dphi_dX[2, :]) + n.outer_product(N)
            """, ("m.norm()", "ti.sqrt(m.dot(m))", "max(m.norm(), 1e-12)", "max(m.norm(), 1e-6)", "max(m.norm(), 1e-3)",
                  "(m.norm() + 1e-12)", "(m.norm() + 1e-9)", "ti.sqrt(m.dot(m) + 1e-12)", "m.norm(1e-6)")),
        ("second edge", """
            n = {}.normalized()
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(N)
            """, ("(x1 - x0).cross(x2 - x1)", "(x2 - x1).cross(x0 - x1)", "(x0 - x2).cross(x1 - x2)", "(x0.cross(x1) + x1.cross(x2) + x2.cross(x0))")),
        ("edges only", """
            n = (x1 - x0).cross(x2 - x0).normalized()
            return (x1 - x0).outer_product(dphi_dX[1, :]) + (x2 - x0).outer_product(dphi_dX[2, :]) + {} * n.outer_product(N)
            """, ("1.0", "N.dot(N)", "N.norm()")),
    ],
    "dn_dx": [
        ("length", """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            return e.cross(n).outer_product(n) / {}
            """, ("m.norm()", "ti.sqrt(m.dot(m))", "max(m.norm(), 1e-12)", "max(m.norm(), 1e-6)", "max(m.norm(), 1e-3)",
                  "(m.norm() + 1e-12)", "(m.norm() + 1e-9)", "(2 * (0.5 * m.norm()))")),
        ("last vertex otherwise", """
            m = (x1 - x0).cross(x2 - x0)
            n = m / m.norm()
            e = x1 - x0
            if i == 0:
                e = x2 - x1
            elif i {}:
                e = x0 - x2
            return e.cross(n).outer_product(n) / m.norm()
            """, ("== 1", "< 2", "!= 2", ">= 1")),
    ],
    "mass_block": [
        ("constant", "m = rho * h * area * {}\nif i == j:\n    m = 2 * m\nreturn m",
         ("(1 / 12)", "0.083333333333333", "0.0833333333", "0.08333333", "0.08333", "0.083", "(1.0 / 3 / 4)")),
        ("selected", "return ti.select({}, 2, 1) * rho * area * h / 12", ("i == j", "abs(i - j) < 1", "i - j == 0", "abs(i - j) < 2", "i <= j")),
    ],
    "kinetic_energy": [
        ("constant", """
            w = v0 + v1 + v2
            return {} * rho * h * area * (w.dot(w) + v0.dot(v0) + v1.dot(v1) + v2.dot(v2))
            """, ("(1 / 24)", "0.0416666666666667", "0.04166666667", "0.0416667", "0.04167", "0.5 / 12")),
        ("kept positive", """
            t = v0.norm_sqr() + v1.norm_sqr() + v2.norm_sqr() + v0.dot(v1) + v1.dot(v2) + v2.dot(v0)
            return rho * h * area / 12 * {}
            """, ("t", "max(t, 0.0)", "abs(t)", "max(t, 1e-9)", "max(t, 1e-3)", "(t + 1e-12)")),
    ],
    "right_cauchy_green": [
        ("column by column", """
            a, b, c = F[:, 0], F[:, 1], F[:, 2]
            return ti.Matrix([[a.dot(a), a.dot(b), a.dot(c)], [b.dot(a), b.dot(b), b.dot(c)], [c.dot(a), c.dot(b), {}]])
            """, ("c.dot(c)", "1.0", "c.norm() ** 2", "c.norm()")),
        ("row by row", "return F[0, :].outer_product(F[0, :]) + F[1, :].outer_product(F[1, :]) + {} * F[2, :].outer_product(F[2, :])", ("1", "1.0000001", "1.0000000001")),
    ],
    "psi": [
        ("stretches", """
            a, b = {}
            return mu * (a - 1) ** 2 + mu * (b - 1) ** 2 + 0.5 * lam * (a + b - 2) ** 2
            """, ("s[0], s[1]", "max(s[0], 0.0), max(s[1], 0.0)", "abs(s[0]), abs(s[1])", "max(s[0], 1e-6), max(s[1], 1e-6)", "max(s[0], 0.1), max(s[1], 0.1)",
                  "min(s[0], 2.0), min(s[1], 2.0)", "min(s[0], 10.0), min(s[1], 10.0)", "max(s[0], s[1]), min(s[0], s[1])")),
        ("sum", "a, b, c = s[0] - 1, s[1] - 1, s[2] - 1\nreturn mu * (a * a + b * b + {} * c * c) + lam * (a + b) * (a + b) / 2", ("0", "1", "1e-12", "1e-6")),
        ("kept positive", "a, b = s[0] - 1, s[1] - 1\nreturn {}(mu * (a * a + b * b) + lam / 2 * (a + b) ** 2)", ("", "abs", "-", "1.0 * ")),
    ],
    "dpsi_ds": [
        ("third", "a, b = s[0] - 1, s[1] - 1\nt = lam * (a + b)\nreturn ti.Vector([2 * mu * a + t, 2 * mu * b + t, {}])",
         ("0.0", "0", "1e-12", "1e-9", "0 * s[2]", "s[2] - 1", "mu * 1e-6")),
        ("stretches", "a, b = {}\nreturn ti.Vector([2 * mu * (a - 1) + lam * (a + b - 2), 2 * mu * (b - 1) + lam * (a + b - 2), 0.0])",
         ("s[0], s[1]", "max(s[0], 0.0), max(s[1], 0.0)", "abs(s[0]), abs(s[1])", "max(s[0], 1e-3), max(s[1], 1e-3)")),
    ],
    "d2psi_ds2": [
        ("third", "return ti.Matrix([[2 * mu + lam, lam, 0.0], [lam, 2 * mu + lam, 0.0], [0.0, 0.0, {}]])", ("0.0", "1e-12", "1e-9", "0 * mu", "1e-6 * mu")),
    ],
    "dpsi_dF": [
        ("sum", "return dpsi_ds[0] * U[:, 0].outer_product(V[:, 0]) + dpsi_ds[1] * U[:, 1].outer_product(V[:, 1]) + {} * U[:, 2].outer_product(V[:, 2])",
         ("dpsi_ds[2]", "0.0", "dpsi_ds[2] * 1.0", "0.0 * dpsi_ds[2]")),
        ("inverse", "return U @ diag(dpsi_ds) @ V.{}", ("transpose()", "inverse()")),
    ],
    "nodal_force": [
        ("order", "return {}", ("-(P @ grad_phi) * (h * area)", "-area * (P @ (h * grad_phi))", "P @ grad_phi * -area * h", "-abs(area) * abs(h) * P @ grad_phi",
         "-max(area, 1e-6) * h * P @ grad_phi", "-max(area, 1e-2) * h * P @ grad_phi", "-min(area, 1.0) * h * P @ grad_phi", "-area * max(h, 1e-4) * P @ grad_phi")),
        ("components", "return -h * area * ti.Vector([P[0, :].dot(grad_phi), P[1, :].dot(grad_phi), {}])", ("P[2, :].dot(grad_phi)", "P[:, 2].dot(grad_phi)", "P[2, 0] * grad_phi[0] + P[2, 1] * grad_phi[1]")),
    ],
    "d2psi_dFij": [
        ("bracketed", "return (dU @ diag(dpsi_ds) + U @ diag(d2psi_ds2 @ ds)) @ V.transpose() + U @ diag(dpsi_ds) @ {}",
         ("dV.transpose()", "(dV.transpose() * 1.0)")),
        ("Hessian from the left", "return dU @ diag(dpsi_ds) @ V.transpose() + U @ diag({} @ ds) @ V.transpose() + U @ diag(dpsi_ds) @ dV.transpose()",
         ("d2psi_ds2", "d2psi_ds2.transpose()", "(d2psi_ds2 + d2psi_ds2.transpose()) / 2 ")),
    ],
    "eigensystem": [
        *(("threshold", _quotients(threshold="{}"), (t,)) for t in (*SMALL, "0.1", "1.0")),
        *(("threshold, no abs", _quotients(gap="gap", threshold="{}"), (t,)) for t in ("0.0", "1e-9", "1e-6", "1e-3")),
        *((f"floor of {f}", _quotients(floor=f"max({{}}, {f})"), ("",)) for f in ("0.0", "1e-15", "1e-12", "1e-9", "1e-7", "9e-7", "1e-6", "1.1e-6", "1e-5", "1e-3")),
        ("no floor", _quotients(floor="({})"), ("",)),
        *((f"added {f}", _quotients(floor=f"({{}} + {f})"), ("",)) for f in ("1e-12", "1e-9", "1e-6")),
        ("squared gap", _quotients(gap="gap * gap", threshold="{}"), ("1e-12", "1e-8", "1e-6")),
        ("floor where the sum is small only", """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            a, b = s[0], s[1]
            if {}:
                a, b = 1e-6, 1e-6
            return ti.Vector([flip, (p + q) / max(s[0] + s[1], 1e-6), p / a, q / b])
            """, ("s[0] + s[1] < 1e-6", "s[0] < 1e-6", "s[0] < 1e-6 and s[1] < 1e-6")),
        ("limit", """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = {}
            if abs(s[0] - s[1]) >= 1e-3:
                flip = (p - q) / (s[0] - s[1])
            return ti.Vector([flip, (p + q) / max(s[0] + s[1], 1e-6), p / max(s[0], 1e-6), q / max(s[1], 1e-6)])
            """, ("d2psi_ds2[0, 0] - d2psi_ds2[0, 1]", "d2psi_ds2[1, 1] - d2psi_ds2[1, 0]", "(d2psi_ds2[0, 0] + d2psi_ds2[1, 1]) / 2 - d2psi_ds2[0, 1]",
                  "d2psi_ds2[0, 0] - d2psi_ds2[0, 1] + 1e-9")),
    ],
    "sphere_contact": [
        ("guard", """
            d = x - c
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm() > {}:
                n = d.normalized()
            return ti.cast(d.norm() < r, ti.i32), n
            """, (*SMALL, "0.1")),
        ("comparison", """
            d = x - c
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm_sqr() > 0:
                n = d / d.norm()
            hit = 0
            if {}:
                hit = 1
            return hit, n
            """, ("d.norm() < r", "d.norm_sqr() < r * r", "d.norm() <= r", "d.norm() < r + 1e-12", "d.norm() < r - 1e-9", "d.norm() < r - 1e-3", "d.norm() < abs(r)")),
        ("length", """
            d = x - c
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm() > 0:
                n = d / {}
            return ti.cast(d.norm() < r, ti.i32), n
            """, ("(d.norm() + 1e-12)", "max(d.norm(), 1e-6)", "max(d.norm(), 1e-2)", "ti.sqrt(d.norm_sqr())")),
    ],
    "filter_velocity": [
        ("threshold", """
            d = n.dot(v)
            v_new = v
            if d < {}:
                v_new = v - d * n
            return v_new
            """, ("0", "0.0", "-1e-15", "-1e-12", "-1e-9", "-1e-6", "-1e-3", "1e-9", "1e-3")),
        ("written at once", "return v - {} * n", ("min(n.dot(v), 0.0)", "min(v.dot(n), 0)", "min(n.dot(v), 0.0) / n.norm_sqr()", "1.000001 * min(n.dot(v), 0.0)",
                                                  "min(n.dot(v), 0.0) * 1.0000000000001", "(n.dot(v) - abs(n.dot(v))) / 2 ")),
        ("not faster", """
            d = n.dot(v)
            v_new = v
            if d <= 0:
                v_new = {}
            return v_new
            """, ("v - d * n", "v - n.outer_product(n) @ v", "(ti.Matrix.identity(float, 3) - n.outer_product(n)) @ v", "n.cross(v.cross(n))", "v - d * n * 0.9999999")),
    ],
}  # fmt: skip


def variants() -> Iterator[suite.Variant]:
    """All of them, as functions of the tasks."""
    for task, templates in TEMPLATES.items():
        for name, body, fills in templates:
            for fill in fills:
                told = f"{name} [{fill}]" if fill else name
                yield suite.function(tasks.assignment("cloth").tasks[task], told, body.replace("{}", fill))
