"""Several changes may make a function right: the one is told that leaves the rest as it is in a right one."""

import pytest
from test_grading_repairs import told

#: Ways to write a function with one thing wrong, that another change elsewhere would mend, too: what must be said.
ELSEWHERE_TOO = [
    ("nodal_force", "f = P @ grad_phi\nreturn area * h * f", "Line 4, in the force: the sign"),
    (
        "dpsi_ds",
        """
        tr = lam * (2 - (s[0] + s[1]))
        g = ti.Vector([0.0, 0.0, 0.0])
        for i in range(2):
            g[i] = 2 * mu * (s[i] - 1) + tr
        return g
        """,
        "Line 3",
    ),
    (
        "phi",
        """
        e, f, w = X1 - X0, X2 - X0, X - X0
        a, b, c = e.dot(e), e.dot(f), f.dot(f)
        det = a * c - b * b
        p = (c * e.dot(w) - b * f.dot(w)) / det
        q = (b * e.dot(w) - a * f.dot(w)) / det
        return ti.Vector([1 - p - q, p, q])
        """,
        "Line 7",
    ),
    (
        "kinetic_energy",
        """
        m = rho * h * area / 2
        T = v0.norm_sqr() + v1.norm_sqr() + v2.norm_sqr()
        T = T + v0.dot(v1) + v1.dot(v2) + v0.dot(v2)
        return m * T / 12
        """,
        "Line 3",
    ),
    (
        "dn_dx",
        """
        m = (x1 - x0).cross(x2 - x0)
        n = m.normalized()
        e = x2 - x1
        if i == 1:
            e = x0 - x2
        if i == 2:
            e = x1 - x0
        E = ti.Matrix([[0.0, e[2], -e[1]], [-e[2], 0.0, e[0]], [e[1], -e[0], 0.0]])
        return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ E / m.norm()
        """,
        "Line 10",
    ),
]


@pytest.mark.parametrize(("task", "body", "words"), ELSEWHERE_TOO)
def test_the_line_is_told_after_whose_change_the_others_come_to_what_they_should(task, body, words):
    assert words in told(task, body).mistake


def test_where_two_changes_do_as_well_both_lines_are_told():
    found = told(
        "sphere_contact",
        """
        d = x - c
        n = ti.Vector([0.0, 1.0, 0.0])
        if d.norm() > 0:
            n = d
        return ti.cast(d.norm() < r, ti.i32), n
        """,
    )
    assert "Line 6: `d` is not made of length one" in found.mistake
    assert "Or instead, line 7" in found.mistake


@pytest.mark.parametrize(
    ("task", "body", "words"),
    [
        (
            "phi",
            """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
            return ti.Vector([1 - p[0] - p[1], ti.sqrt(p[0]), p[1]])
            """,
            "sqrt should not be taken in `ti.sqrt(p[0])`",
        ),
        (
            "eigensystem",
            """
            gap = s[0] - s[1]
            flip = (d2psi_ds2[0, 0] + d2psi_ds2[1, 1]) / 2 - d2psi_ds2[0, 1]
            if abs(gap) > 1e-3:
                flip = 2 * (dpsi_ds[0] / gap - dpsi_ds[1] / gap)
            twist = (dpsi_ds[0] + dpsi_ds[1]) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, dpsi_ds[0] / max(s[0], 1e-6), dpsi_ds[1] / max(s[1], 1e-6)])
            """,
            "Line 6: `2` is multiplied by once too often",
        ),
        (
            "deformation_gradient",
            """
            n = (x2 - x1).cross(x0 - x0).normalized()
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(N)
            """,
            "where `x0 - x1` belongs",
        ),
    ],
)
def test_a_mistake_is_found_where_something_is_not_finite(task, body, words):
    """In some of the cases, in a branch that is not taken, or everywhere."""
    assert words in told(task, body).mistake


@pytest.mark.parametrize(
    ("task", "body", "words"),
    [
        (
            "d2psi_ds2",
            """
            H = ti.Matrix.zero(float, 3, 3)
            for i in range(2):
                for j in range(2):
                    H[i, j] = lam
                    if i == i:
                        H[i, j] += 2 * mu
            return H
            """,
            "the index i stands in place of j in the condition",
        ),
        (
            "d2psi_ds2",
            """
            H = ti.Matrix.zero(float, 3, 3)
            for i in range(2):
                for j in range(2):
                    H[i, j] = lam
                    H[i, j] += 2 * mu
            return H
            """,
            "should only where `i == j`: the condition is missing",
        ),
        (
            "dphi_dX",
            """
            e, f = X1 - X0, X2 - X0
            ee, ef, ff = e.dot(e), e.dot(f), f.dot(f)
            det = ee * ff - ef * ef
            G = ti.Matrix.zero(float, 3, 3)
            for k in ti.static(range(3)):
                G[1, k] = (ff * e[k] - ef * f[k]) / det
                G[2, k] = ee * f[k] - ef * e[k]
                G[0, k] = -(G[1, k] + G[2, k])
            return G
            """,
            "Line 9: a division is missing",
        ),
        (
            "right_cauchy_green",
            """
            C = ti.Matrix.zero(float, 3, 3)
            for i in range(3):
                for j in range(3):
                    for k in range(3):
                        C[i, j] += F[k, j]
            return C
            """,
            "a factor is missing at `F[k, j]`: `F[k, i]`",
        ),
        (
            "mass_block",
            """
            m = rho * h * area / 12
            m = rho * h * area / 6
            return m
            """,
            "should only where `i == j`",
        ),
    ],
)
def test_what_is_missing_in_a_loop_or_a_condition_is_told(task, body, words):
    assert words in told(task, body).mistake


@pytest.mark.parametrize(
    ("task", "body", "words"),
    [
        (
            "phi",
            """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            p = 1 / (D.transpose() @ D) @ (D.transpose() @ (X - X0))
            return ti.Vector([1 - p[0] - p[1], p[0], p[1]])
            """,
            "the inverse of `D.transpose() @ D` is meant",
        ),
        (
            "phi",
            """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            p = (D.transpose() @ D) ** -1 @ (D.transpose() @ (X - X0))
            return ti.Vector([1 - p[0] - p[1], p[0], p[1]])
            """,
            "the power is taken entry by entry",
        ),
        (
            "filter_velocity",
            """
            w = v
            if v.dot(n) < 0:
                w = (1 - n.outer_product(n)) @ v
            return w
            """,
            "`1` goes into every entry",
        ),
    ],
)
def test_a_number_beside_a_matrix_is_told_where_a_matrix_is_meant(task, body, words):
    assert words in told(task, body).mistake


HESSIAN = """
J = F.determinant()
G = F.inverse().transpose()
I1 = (F.transpose() @ F).trace()
c, d = 2 * C * J ** (-2 / 3), 2 * D * J
H = ti.Matrix.zero(float, 9, 9)
for i, j, m, n in ti.ndrange(3, 3, 3, 3):
    GG = G[i, j] * G[m, n]
    turned = G[i, n] * G[m, j]
    FG = F[i, j] * G[m, n] + G[i, j] * F[m, n]
    H[3 * i + j, 3 * m + n] = c * (I1 / 9 * (2 * GG + 3 * turned) - 2 / 3 * FG)
    H[3 * i + j, 3 * m + n] += d * ((2 * J - 1) * GG - (J - 1) * turned)
    if i == m and j == n:
        H[3 * i + j, 3 * m + n] += c
return H
"""


@pytest.mark.parametrize(
    ("right", "wrong", "words"),
    [
        ("i == m and j == n", "i == n and j == m", "are exchanged in the condition"),
        ("i == m and j == n", "i == m", "asks for too little: `j == n` must hold, too"),
        ("G[i, n] * G[m, j]", "G[i, m] * G[n, j]", "Line 10: m and n are exchanged in `G[i, m] * G[n, j]`"),
    ],
)
def test_indices_exchanged_in_one_place_of_a_large_loop_are_told(right, wrong, words):
    assert words in told("d2psi_dF2", HESSIAN.replace(right, wrong, 1), "solids").mistake


@pytest.mark.parametrize(
    ("body", "words"),
    [
        (
            """
            m = rho * h * area / 12
            if i == j and i > 0:
                m = rho * h * area / 6
            return m
            """,
            "too much in `i == j and i > 0`: without `i > 0` it is right",
        ),
        (
            """
            m = rho * h * area / 12
            if i == 0 or i == j:
                m = rho * h * area / 6
            return m
            """,
            "too little in `i == 0 or i == j`: without `i == 0` it is right",
        ),
    ],
)
def test_a_condition_too_many_is_told(body, words):
    assert words in told("mass_block", body).mistake
