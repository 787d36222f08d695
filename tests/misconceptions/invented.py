"""Mistakes for developing the diagnosis: invented from the handout alone, before its tables were read.

Each is the whole body of one cloth function, as a student could have written it with one thing wrong. They were
written down from `solutions/cloth/README.md` without a look at `muslin.grading`, and then used to see what is not
named yet: so what they measure is in-sample, unlike a suite that nobody looks at while working on the diagnosis.
"""

INVENTED: dict[str, dict[str, str]] = {
    "phi": {
        "sign of an off-diagonal entry of the 2x2 inverse": """
            e1, e2, d = X1 - X0, X2 - X0, X - X0
            a, b, c = e1.dot(e1), e1.dot(e2), e2.dot(e2)
            det = a * c - b * b
            r1, r2 = e1.dot(d), e2.dot(d)
            p1 = (c * r1 + b * r2) / det
            p2 = (a * r2 - b * r1) / det
            return ti.Vector([1 - p1 - p2, p1, p2])
        """,
        "both off-diagonal signs of the 2x2 inverse": """
            e1, e2, d = X1 - X0, X2 - X0, X - X0
            a, b, c = e1.dot(e1), e1.dot(e2), e2.dot(e2)
            det = a * c - b * b
            r1, r2 = e1.dot(d), e2.dot(d)
            p1 = (c * r1 + b * r2) / det
            p2 = (a * r2 + b * r1) / det
            return ti.Vector([1 - p1 - p2, p1, p2])
        """,
        "diagonal of the 2x2 inverse not swapped": """
            e1, e2, d = X1 - X0, X2 - X0, X - X0
            a, b, c = e1.dot(e1), e1.dot(e2), e2.dot(e2)
            det = a * c - b * b
            r1, r2 = e1.dot(d), e2.dot(d)
            p1 = (a * r1 - b * r2) / det
            p2 = (c * r2 - b * r1) / det
            return ti.Vector([1 - p1 - p2, p1, p2])
        """,
        "determinant with a plus": """
            e1, e2, d = X1 - X0, X2 - X0, X - X0
            a, b, c = e1.dot(e1), e1.dot(e2), e2.dot(e2)
            det = a * c + b * b
            r1, r2 = e1.dot(d), e2.dot(d)
            p1 = (c * r1 - b * r2) / det
            p2 = (a * r2 - b * r1) / det
            return ti.Vector([1 - p1 - p2, p1, p2])
        """,
        "determinant with b not squared": """
            e1, e2, d = X1 - X0, X2 - X0, X - X0
            a, b, c = e1.dot(e1), e1.dot(e2), e2.dot(e2)
            det = a * c - b
            r1, r2 = e1.dot(d), e2.dot(d)
            p1 = (c * r1 - b * r2) / det
            p2 = (a * r2 - b * r1) / det
            return ti.Vector([1 - p1 - p2, p1, p2])
        """,
        "determinant forgotten": """
            e1, e2, d = X1 - X0, X2 - X0, X - X0
            a, b, c = e1.dot(e1), e1.dot(e2), e2.dot(e2)
            r1, r2 = e1.dot(d), e2.dot(d)
            p1 = c * r1 - b * r2
            p2 = a * r2 - b * r1
            return ti.Vector([1 - p1 - p2, p1, p2])
        """,
        "the 3x3 matrix of the vertices": """
            return ti.Matrix.cols([X0, X1, X2]).inverse() @ X
        """,
        "the 3x3 matrix of the vertices as rows": """
            return ti.Matrix.rows([X0, X1, X2]).inverse() @ X
        """,
        "X0 not subtracted": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            p = (D.transpose() @ D).inverse() @ (D.transpose() @ X)
            return ti.Vector([1 - p[0] - p[1], p[0], p[1]])
        """,
        "areas without a sign": """
            A = (X1 - X0).cross(X2 - X0).norm()
            a0 = (X1 - X).cross(X2 - X).norm()
            a1 = (X2 - X).cross(X0 - X).norm()
            a2 = (X0 - X).cross(X1 - X).norm()
            return ti.Vector([a0, a1, a2]) / A
        """,
        "phi_0 last": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
            return ti.Vector([p[0], p[1], 1 - p[0] - p[1]])
        """,
        "phi_1 and phi_2 exchanged": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
            return ti.Vector([1 - p[0] - p[1], p[1], p[0]])
        """,
        "unit edges": """
            d = X - X0
            p1 = d.dot((X1 - X0).normalized())
            p2 = d.dot((X2 - X0).normalized())
            return ti.Vector([1 - p1 - p2, p1, p2])
        """,
        "one edge at a time": """
            d, e1, e2 = X - X0, X1 - X0, X2 - X0
            p1 = d.dot(e1) / e1.dot(e1)
            p2 = d.dot(e2) / e2.dot(e2)
            return ti.Vector([1 - p1 - p2, p1, p2])
        """,
        "edges X1-X0 and X2-X1": """
            D = ti.Matrix.cols([X1 - X0, X2 - X1])
            p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
            return ti.Vector([1 - p[0] - p[1], p[0], p[1]])
        """,
        "edges backwards": """
            D = ti.Matrix.cols([X0 - X1, X0 - X2])
            p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
            return ti.Vector([1 - p[0] - p[1], p[0], p[1]])
        """,
        "X0 - X on the right": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X0 - X))
            return ti.Vector([1 - p[0] - p[1], p[0], p[1]])
        """,
        "phi_0 with a plus": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
            return ti.Vector([1 - p[0] + p[1], p[0], p[1]])
        """,
        "phi_0 is zero": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
            return ti.Vector([0.0, p[0], p[1]])
        """,
        "the inverse left out": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            p = D.transpose() @ (X - X0)
            return ti.Vector([1 - p[0] - p[1], p[0], p[1]])
        """,
        "D D^T's normal equations without the inverse": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            p = (D.transpose() @ D) @ (D.transpose() @ (X - X0))
            return ti.Vector([1 - p[0] - p[1], p[0], p[1]])
        """,
        "the plane z = 0": """
            D = ti.Matrix([[X1[0] - X0[0], X2[0] - X0[0]], [X1[1] - X0[1], X2[1] - X0[1]]])
            p = D.inverse() @ ti.Vector([X[0] - X0[0], X[1] - X0[1]])
            return ti.Vector([1 - p[0] - p[1], p[0], p[1]])
        """,
        "negative ones clamped": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X0))
            return ti.Vector([max(1 - p[0] - p[1], 0.0), max(p[0], 0.0), max(p[1], 0.0)])
        """,
        "X1 subtracted": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            p = (D.transpose() @ D).inverse() @ (D.transpose() @ (X - X1))
            return ti.Vector([1 - p[0] - p[1], p[0], p[1]])
        """,
        "areas halved": """
            N = (X1 - X0).cross(X2 - X0)
            p1 = 0.5 * (X - X0).cross(X2 - X0).dot(N) / N.norm_sqr()
            p2 = 0.5 * (X1 - X0).cross(X - X0).dot(N) / N.norm_sqr()
            return ti.Vector([1 - p1 - p2, p1, p2])
        """,
        "norm instead of squared norm": """
            N = (X1 - X0).cross(X2 - X0)
            p1 = (X - X0).cross(X2 - X0).dot(N) / N.norm()
            p2 = (X1 - X0).cross(X - X0).dot(N) / N.norm()
            return ti.Vector([1 - p1 - p2, p1, p2])
        """,
    },
    "dphi_dX": {
        "transposed": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            G = (D.transpose() @ D).inverse() @ D.transpose()
            g1, g2 = G[0, :], G[1, :]
            return ti.Matrix.cols([-g1 - g2, g1, g2])
        """,
        "row 0 zero": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            G = (D.transpose() @ D).inverse() @ D.transpose()
            g1, g2 = G[0, :], G[1, :]
            return ti.Matrix.rows([0.0 * g1, g1, g2])
        """,
        "row 0 last": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            G = (D.transpose() @ D).inverse() @ D.transpose()
            g1, g2 = G[0, :], G[1, :]
            return ti.Matrix.rows([g1, g2, -g1 - g2])
        """,
        "rows 1 and 2 exchanged": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            G = (D.transpose() @ D).inverse() @ D.transpose()
            g1, g2 = G[0, :], G[1, :]
            return ti.Matrix.rows([-g1 - g2, g2, g1])
        """,
        "row 0 without minus": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            G = (D.transpose() @ D).inverse() @ D.transpose()
            g1, g2 = G[0, :], G[1, :]
            return ti.Matrix.rows([g1 + g2, g1, g2])
        """,
        "row 0 g1 - g2": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            G = (D.transpose() @ D).inverse() @ D.transpose()
            g1, g2 = G[0, :], G[1, :]
            return ti.Matrix.rows([g1 - g2, g1, g2])
        """,
        "row 0 one minus": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            G = (D.transpose() @ D).inverse() @ D.transpose()
            g1, g2 = G[0, :], G[1, :]
            return ti.Matrix.rows([1 - g1 - g2, g1, g2])
        """,
        "D D^T inverted": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            G = D.transpose() @ (D @ D.transpose()).inverse()
            g1, g2 = G[0, :], G[1, :]
            return ti.Matrix.rows([-g1 - g2, g1, g2])
        """,
        "inverse forgotten": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            G = D.transpose()
            g1, g2 = G[0, :], G[1, :]
            return ti.Matrix.rows([-g1 - g2, g1, g2])
        """,
        "inverse of D^T D without the inverse": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            G = (D.transpose() @ D) @ D.transpose()
            g1, g2 = G[0, :], G[1, :]
            return ti.Matrix.rows([-g1 - g2, g1, g2])
        """,
        "edges X1-X0, X2-X1": """
            D = ti.Matrix.cols([X1 - X0, X2 - X1])
            G = (D.transpose() @ D).inverse() @ D.transpose()
            g1, g2 = G[0, :], G[1, :]
            return ti.Matrix.rows([-g1 - g2, g1, g2])
        """,
        "edges backwards": """
            D = ti.Matrix.cols([X0 - X1, X0 - X2])
            G = (D.transpose() @ D).inverse() @ D.transpose()
            g1, g2 = G[0, :], G[1, :]
            return ti.Matrix.rows([-g1 - g2, g1, g2])
        """,
        "edges to X2": """
            D = ti.Matrix.cols([X0 - X2, X1 - X2])
            G = (D.transpose() @ D).inverse() @ D.transpose()
            g1, g2 = G[0, :], G[1, :]
            return ti.Matrix.rows([-g1 - g2, g1, g2])
        """,
        "sign in the 2x2 inverse": """
            e1, e2 = X1 - X0, X2 - X0
            a, b, c = e1.dot(e1), e1.dot(e2), e2.dot(e2)
            det = a * c - b * b
            g1 = (c * e1 + b * e2) / det
            g2 = (a * e2 - b * e1) / det
            return ti.Matrix.rows([-g1 - g2, g1, g2])
        """,
        "determinant missing": """
            e1, e2 = X1 - X0, X2 - X0
            a, b, c = e1.dot(e1), e1.dot(e2), e2.dot(e2)
            g1 = c * e1 - b * e2
            g2 = a * e2 - b * e1
            return ti.Matrix.rows([-g1 - g2, g1, g2])
        """,
        "root of the determinant": """
            e1, e2 = X1 - X0, X2 - X0
            a, b, c = e1.dot(e1), e1.dot(e2), e2.dot(e2)
            det = ti.sqrt(a * c - b * b)
            g1 = (c * e1 - b * e2) / det
            g2 = (a * e2 - b * e1) / det
            return ti.Matrix.rows([-g1 - g2, g1, g2])
        """,
        "unit gradients": """
            D = ti.Matrix.cols([X1 - X0, X2 - X0])
            G = (D.transpose() @ D).inverse() @ D.transpose()
            g1, g2 = G[0, :], G[1, :]
            g0 = -g1 - g2
            return ti.Matrix.rows([g0.normalized(), g1.normalized(), g2.normalized()])
        """,
        "normal unnormalised in the cross product": """
            N = (X1 - X0).cross(X2 - X0)
            a = N.norm()
            return ti.Matrix.rows([N.cross(X2 - X1) / a, N.cross(X0 - X2) / a, N.cross(X1 - X0) / a])
        """,
        "cross product the wrong way round": """
            N = (X1 - X0).cross(X2 - X0)
            a = N.norm_sqr()
            return ti.Matrix.rows([(X2 - X1).cross(N) / a, (X0 - X2).cross(N) / a, (X1 - X0).cross(N) / a])
        """,
        "area instead of twice the area": """
            N = (X1 - X0).cross(X2 - X0)
            a = 0.5 * N.norm()
            n = N.normalized()
            return ti.Matrix.rows([n.cross(X2 - X1) / a, n.cross(X0 - X2) / a, n.cross(X1 - X0) / a])
        """,
        "inverse of the vertices": """
            return ti.Matrix.cols([X0, X1, X2]).inverse()
        """,
        "plane z = 0": """
            E = ti.Matrix([[X1[0] - X0[0], X2[0] - X0[0]], [X1[1] - X0[1], X2[1] - X0[1]]]).inverse()
            g1 = ti.Vector([E[0, 0], E[0, 1], 0.0])
            g2 = ti.Vector([E[1, 0], E[1, 1], 0.0])
            return ti.Matrix.rows([-g1 - g2, g1, g2])
        """,
    },
    "interpolate": {
        "order reversed": "return phi[2] * x0 + phi[1] * x1 + phi[0] * x2",
        "order rotated": "return phi[1] * x0 + phi[2] * x1 + phi[0] * x2",
        "1 and 2 exchanged": "return phi[0] * x0 + phi[2] * x1 + phi[1] * x2",
        "edges without x0": "return phi[1] * (x1 - x0) + phi[2] * (x2 - x0)",
        "edges with the wrong base": "return x1 + phi[1] * (x1 - x0) + phi[2] * (x2 - x0)",
        "minus in the last term": "return phi[0] * x0 + phi[1] * x1 - phi[2] * x2",
        "the plain average": "return (x0 + x1 + x2) / 3",
        "divided by three": "return (phi[0] * x0 + phi[1] * x1 + phi[2] * x2) / 3",
        "last term missing": "return phi[0] * x0 + phi[1] * x1",
        "first term missing": "return phi[1] * x1 + phi[2] * x2",
        "x1 twice": "return phi[0] * x0 + phi[1] * x1 + phi[2] * x1",
        "phi_1 twice": "return phi[0] * x0 + phi[1] * x1 + phi[1] * x2",
        "vertices as rows": "return ti.Matrix.rows([x0, x1, x2]) @ phi",
        "entry by entry": "return phi * x0 + phi * x1 + phi * x2",
        "weights squared": "return phi[0] ** 2 * x0 + phi[1] ** 2 * x1 + phi[2] ** 2 * x2",
        "x0 added once more": "return x0 + phi[0] * x0 + phi[1] * x1 + phi[2] * x2",
        "edge to x1": "return x0 + phi[1] * (x1 - x0) + phi[2] * (x2 - x1)",
    },
    "deformation_gradient": {
        "vertices as rows": """
            n = (x1 - x0).cross(x2 - x0).normalized()
            return ti.Matrix.rows([x0, x1, x2]) @ dphi_dX + n.outer_product(N)
        """,
        "gradients transposed": """
            n = (x1 - x0).cross(x2 - x0).normalized()
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX.transpose() + n.outer_product(N)
        """,
        "the product the other way round": """
            n = (x1 - x0).cross(x2 - x0).normalized()
            return dphi_dX @ ti.Matrix.cols([x0, x1, x2]) + n.outer_product(N)
        """,
        "transposed": """
            n = (x1 - x0).cross(x2 - x0).normalized()
            return (ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(N)).transpose()
        """,
        "normal not normalised": """
            n = (x1 - x0).cross(x2 - x0)
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(N)
        """,
        "N used twice": """
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + N.outer_product(N)
        """,
        "n used twice": """
            n = (x1 - x0).cross(x2 - x0).normalized()
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(n)
        """,
        "edges in the wrong order": """
            n = (x2 - x0).cross(x1 - x0).normalized()
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(N)
        """,
        "outer product the wrong way round": """
            n = (x1 - x0).cross(x2 - x0).normalized()
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + N.outer_product(n)
        """,
        "a dot product added": """
            n = (x1 - x0).cross(x2 - x0).normalized()
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.dot(N)
        """,
        "entry by entry": """
            n = (x1 - x0).cross(x2 - x0).normalized()
            return ti.Matrix.cols([x0, x1, x2]) * dphi_dX + n.outer_product(N)
        """,
        "normal of the vertices": """
            n = x1.cross(x2).normalized()
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(N)
        """,
        "no normal term": "return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX",
        "minus the normal term": """
            n = (x1 - x0).cross(x2 - x0).normalized()
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX - n.outer_product(N)
        """,
        "identity instead of the normal term": """
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + ti.Matrix.identity(float, 3)
        """,
        "edges in the place of vertices": """
            n = (x1 - x0).cross(x2 - x0).normalized()
            return ti.Matrix.cols([x1 - x0, x2 - x0, n]) @ dphi_dX
        """,
        "normal from x0 and x1": """
            n = (x1 - x0).cross(x2 - x1).normalized() * 0.5
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(N)
        """,
        "x1 - x2 in the normal": """
            n = (x1 - x0).cross(x1 - x2).normalized()
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(N)
        """,
        "vertices in the wrong order": """
            n = (x1 - x0).cross(x2 - x0).normalized()
            return ti.Matrix.cols([x1, x2, x0]) @ dphi_dX + n.outer_product(N)
        """,
        "divided by the squared length": """
            m = (x1 - x0).cross(x2 - x0)
            n = m / m.norm_sqr()
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(N)
        """,
        "the normal by entry-wise product": """
            n = ((x1 - x0) * (x2 - x0)).normalized()
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(N)
        """,
        "sum of edges for the normal": """
            n = ((x1 - x0) + (x2 - x0)).normalized()
            return ti.Matrix.cols([x0, x1, x2]) @ dphi_dX + n.outer_product(N)
        """,
    },
    "dn_dx": {
        "no projection": """
            m = (x1 - x0).cross(x2 - x0)
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return E / m.norm()
        """,
        "no division": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ E
        """,
        "I - m m^T": """
            m = (x1 - x0).cross(x2 - x0)
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return (ti.Matrix.identity(float, 3) - m.outer_product(m)) @ E / m.norm()
        """,
        "I + n n^T": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return (ti.Matrix.identity(float, 3) + n.outer_product(n)) @ E / m.norm()
        """,
        "n n^T alone": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return n.outer_product(n) @ E / m.norm()
        """,
        "1 - n.n": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return (1 - n.dot(n)) * E / m.norm()
        """,
        "divided by the squared norm": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ E / m.norm_sqr()
        """,
        "cross matrix transposed": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            E = ti.Matrix([[0, e[2], -e[1]], [-e[2], 0, e[0]], [e[1], -e[0], 0]])
            return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ E / m.norm()
        """,
        "one sign in the cross matrix": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, e[0]], [-e[1], e[0], 0]])
            return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ E / m.norm()
        """,
        "sign of the edge for i = 1": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x2 - x0
            if i == 2:
                e = x1 - x0
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ E / m.norm()
        """,
        "edges 1 and 2 exchanged": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 2:
                e = x0 - x2
            if i == 1:
                e = x1 - x0
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ E / m.norm()
        """,
        "only vertex 0": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ E / m.norm()
        """,
        "vertices counted from 1": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 2:
                e = x0 - x2
            if i == 3:
                e = x1 - x0
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ E / m.norm()
        """,
        "edges at the vertex": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x1 - x0
            if i == 1:
                e = x2 - x1
            if i == 2:
                e = x0 - x2
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ E / m.norm()
        """,
        "transposed": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return ((ti.Matrix.identity(float, 3) - n.outer_product(n)) @ E / m.norm()).transpose()
        """,
        "projection on the right": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return E @ (ti.Matrix.identity(float, 3) - n.outer_product(n)) / m.norm()
        """,
        "normal from the vertices": """
            m = x1.cross(x2)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ E / m.norm()
        """,
        "unit edge": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            e = e.normalized()
            E = ti.Matrix([[0, -e[2], e[1]], [e[2], 0, -e[0]], [-e[1], e[0], 0]])
            return (ti.Matrix.identity(float, 3) - n.outer_product(n)) @ E / m.norm()
        """,
        "outer product with e instead of the cross matrix": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            return n.outer_product(e.cross(n)) / m.norm()
        """,
        "area instead of twice the area": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            return e.cross(n).outer_product(n) / (0.5 * m.norm())
        """,
        "n cross e": """
            m = (x1 - x0).cross(x2 - x0)
            n = m.normalized()
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            return n.cross(e).outer_product(n) / m.norm()
        """,
        "plane z = 0": """
            m = (x1 - x0).cross(x2 - x0)
            n = ti.Vector([0.0, 0.0, 1.0])
            e = x2 - x1
            if i == 1:
                e = x0 - x2
            if i == 2:
                e = x1 - x0
            return e.cross(n).outer_product(n) / m.norm()
        """,
    },
    "mass_block": {
        "a half and a quarter": """
            m = rho * h * area / 4
            if i == j:
                m = rho * h * area / 2
            return m
        """,
        "lumped": """
            m = 0.0
            if i == j:
                m = rho * h * area / 3
            return m
        """,
        "no thickness": """
            m = rho * area / 12
            if i == j:
                m = rho * area / 6
            return m
        """,
        "no density": """
            m = h * area / 12
            if i == j:
                m = h * area / 6
            return m
        """,
        "area doubled": """
            m = rho * h * 2 * area / 12
            if i == j:
                m = rho * h * 2 * area / 6
            return m
        """,
        "half of T": """
            m = 0.5 * rho * h * area / 12
            if i == j:
                m = 0.5 * rho * h * area / 6
            return m
        """,
        "exchanged": """
            m = rho * h * area / 6
            if i == j:
                m = rho * h * area / 12
            return m
        """,
        "the same everywhere": "return rho * h * area / 12",
        "a ninth": "return rho * h * area / 9",
        "off the diagonal zero": """
            m = 0.0
            if i == j:
                m = rho * h * area / 6
            return m
        """,
        "1/24 off the diagonal": """
            m = rho * h * area / 24
            if i == j:
                m = rho * h * area / 12
            return m
        """,
        "area squared": """
            m = rho * h * area ** 2 / 12
            if i == j:
                m = rho * h * area ** 2 / 6
            return m
        """,
        "divided by the thickness": """
            m = rho / h * area / 12
            if i == j:
                m = rho / h * area / 6
            return m
        """,
        "minus off the diagonal": """
            m = -rho * h * area / 12
            if i == j:
                m = rho * h * area / 6
            return m
        """,
        "off diagonal as the diagonal": "return rho * h * area / 6",
        "neighbours only": """
            m = rho * h * area / 12
            if i == j:
                m = rho * h * area / 6
            if i - j == 2 or j - i == 2:
                m = 0.0
            return m
        """,
        "a tetrahedron's fractions": """
            m = rho * h * area / 20
            if i == j:
                m = rho * h * area / 10
            return m
        """,
        "a whole number": """
            m = 0
            if i == j:
                m = rho * h * area / 6
            else:
                m = rho * h * area / 12
            return m
        """,
    },
    "kinetic_energy": {
        "squares only": "return rho * h * area / 12 * (v0.dot(v0) + v1.dot(v1) + v2.dot(v2))",
        "mixed terms once": """
            squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
            products = v0.dot(v1) + v1.dot(v2) + v2.dot(v0)
            return rho * h * area / 12 * (squares + products / 2)
        """,
        "no half": """
            squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
            products = v0.dot(v1) + v1.dot(v2) + v2.dot(v0)
            return rho * h * area / 6 * (squares + products)
        """,
        "half twice": """
            squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
            products = v0.dot(v1) + v1.dot(v2) + v2.dot(v0)
            return rho * h * area / 24 * (squares + products)
        """,
        "lumped": "return 0.5 * rho * h * area / 3 * (v0.dot(v0) + v1.dot(v1) + v2.dot(v2))",
        "velocity of the centre": """
            v = (v0 + v1 + v2) / 3
            return 0.5 * rho * h * area * v.dot(v)
        """,
        "norms not squared": "return rho * h * area / 12 * (v0.norm() + v1.norm() + v2.norm())",
        "one pair missing": """
            squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
            return rho * h * area / 12 * (squares + v0.dot(v1) + v1.dot(v2))
        """,
        "one pair twice": """
            squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
            return rho * h * area / 12 * (squares + v0.dot(v1) + v1.dot(v2) + v1.dot(v2))
        """,
        "v0 in place of v2": """
            squares = v0.dot(v0) + v1.dot(v1) + v0.dot(v0)
            products = v0.dot(v1) + v1.dot(v2) + v2.dot(v0)
            return rho * h * area / 12 * (squares + products)
        """,
        "mixed terms doubled": """
            squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
            products = v0.dot(v1) + v1.dot(v2) + v2.dot(v0)
            return rho * h * area / 12 * (squares + 2 * products)
        """,
        "minus": """
            squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
            products = v0.dot(v1) + v1.dot(v2) + v2.dot(v0)
            return rho * h * area / 12 * (squares - products)
        """,
        "no h": """
            squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
            products = v0.dot(v1) + v1.dot(v2) + v2.dot(v0)
            return rho * area / 12 * (squares + products)
        """,
        "norm of the sum": """
            v = v0 + v1 + v2
            return rho * h * area / 12 * v.dot(v)
        """,
        "no area": """
            squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
            products = v0.dot(v1) + v1.dot(v2) + v2.dot(v0)
            return rho * h / 12 * (squares + products)
        """,
        "cross products": """
            squares = v0.dot(v0) + v1.dot(v1) + v2.dot(v2)
            products = v0.cross(v1).norm() + v1.cross(v2).norm() + v2.cross(v0).norm()
            return rho * h * area / 12 * (squares + products)
        """,
    },
    "right_cauchy_green": {
        "F F^T": "return F @ F.transpose()",
        "F F": "return F @ F",
        "entry by entry": "return F.transpose() * F",
        "Green strain": "return 0.5 * (F.transpose() @ F - ti.Matrix.identity(float, 3))",
        "C - I": "return F.transpose() @ F - ti.Matrix.identity(float, 3)",
        "halved": "return 0.5 * F.transpose() @ F",
        "symmetric part": "return 0.5 * (F + F.transpose())",
        "F itself": "return F",
        "F^T F^T": "return F.transpose() @ F.transpose()",
        "inverse": "return (F.transpose() @ F).inverse()",
        "F^-T F": "return F.inverse().transpose() @ F",
        "sum": "return F.transpose() + F",
        "squared again": "return F.transpose() @ F @ F.transpose() @ F",
        "rows": "return F[0, :].outer_product(F[0, :])",
        "no third": """
            C = F.transpose() @ F
            C[2, 2] = 1.0
            return C
        """,
    },
    "psi": {
        "mu and lambda exchanged": "return lam * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + mu / 2 * (s[0] + s[1] - 2) ** 2",
        "three stretches": """
            return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2 + (s[2] - 1) ** 2) + lam / 2 * (s[0] + s[1] - 2) ** 2
        """,
        "three in both": """
            a = (s[0] - 1) ** 2 + (s[1] - 1) ** 2 + (s[2] - 1) ** 2
            return mu * a + lam / 2 * (s[0] + s[1] + s[2] - 3) ** 2
        """,
        "squared stretches": """
            return mu * ((s[0] ** 2 - 1) ** 2 + (s[1] ** 2 - 1) ** 2) + lam / 2 * (s[0] ** 2 + s[1] ** 2 - 2) ** 2
        """,
        "minus 1": "return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam / 2 * (s[0] + s[1] - 1) ** 2",
        "lambda whole": "return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam * (s[0] + s[1] - 2) ** 2",
        "mu halved": "return mu / 2 * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam / 2 * (s[0] + s[1] - 2) ** 2",
        "the area energy": "return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam / 2 * (s[0] * s[1] - 1) ** 2",
        "sum squared": "return mu * (s[0] + s[1] - 2) ** 2 + lam / 2 * (s[0] + s[1] - 2) ** 2",
        "not squared": "return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam / 2 * (s[0] + s[1] - 2)",
        "mu not squared": "return mu * ((s[0] - 1) + (s[1] - 1)) + lam / 2 * (s[0] + s[1] - 2) ** 2",
        "s_0 only": "return mu * (s[0] - 1) ** 2 + lam / 2 * (s[0] + s[1] - 2) ** 2",
        "s_1 and s_2": "return mu * ((s[1] - 1) ** 2 + (s[2] - 1) ** 2) + lam / 2 * (s[1] + s[2] - 2) ** 2",
        "minus lambda": "return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) - lam / 2 * (s[0] + s[1] - 2) ** 2",
        "s plus 1": "return mu * ((s[0] + 1) ** 2 + (s[1] + 1) ** 2) + lam / 2 * (s[0] + s[1] - 2) ** 2",
        "s_0 - s_1": "return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam / 2 * (s[0] - s[1]) ** 2",
        "sum of squares for lambda": """
            return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam / 2 * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2)
        """,
        "no lambda": "return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2)",
        "brackets of mu": "return mu * (s[0] - 1) ** 2 + (s[1] - 1) ** 2 + lam / 2 * (s[0] + s[1] - 2) ** 2",
        "the square outside": "return mu * ((s[0] - 1) + (s[1] - 1)) ** 2 + lam / 2 * (s[0] + s[1] - 2) ** 2",
        "lam over 2 times": "return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + 1 / (2 * lam) * (s[0] + s[1] - 2) ** 2",
        "cubed": "return mu * ((s[0] - 1) ** 3 + (s[1] - 1) ** 3) + lam / 2 * (s[0] + s[1] - 2) ** 2",
        "without -1": "return mu * (s[0] ** 2 + s[1] ** 2) + lam / 2 * (s[0] + s[1] - 2) ** 2",
        "two mu": "return 2 * mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam / 2 * (s[0] + s[1] - 2) ** 2",
    },
    "dpsi_ds": {
        "no 2 at mu": """
            t = lam * (s[0] + s[1] - 2)
            return ti.Vector([mu * (s[0] - 1) + t, mu * (s[1] - 1) + t, 0.0])
        """,
        "half left at lambda": """
            t = lam / 2 * (s[0] + s[1] - 2)
            return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, 0.0])
        """,
        "two at lambda": """
            t = 2 * lam * (s[0] + s[1] - 2)
            return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, 0.0])
        """,
        "lambda in the first only": """
            t = lam * (s[0] + s[1] - 2)
            return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1), 0.0])
        """,
        "lambda s_i - 1": """
            return ti.Vector([(2 * mu + lam) * (s[0] - 1), (2 * mu + lam) * (s[1] - 1), 0.0])
        """,
        "third not zero": """
            t = lam * (s[0] + s[1] - 2)
            return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, 2 * mu * (s[2] - 1) + t])
        """,
        "third is lambda's": """
            t = lam * (s[0] + s[1] - 2)
            return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, t])
        """,
        "area energy": """
            t = lam * (s[0] * s[1] - 1)
            return ti.Vector([2 * mu * (s[0] - 1) + t * s[1], 2 * mu * (s[1] - 1) + t * s[0], 0.0])
        """,
        "exchanged constants": """
            t = mu * (s[0] + s[1] - 2)
            return ti.Vector([2 * lam * (s[0] - 1) + t, 2 * lam * (s[1] - 1) + t, 0.0])
        """,
        "components exchanged": """
            t = lam * (s[0] + s[1] - 2)
            return ti.Vector([2 * mu * (s[1] - 1) + t, 2 * mu * (s[0] - 1) + t, 0.0])
        """,
        "minus 1 in lambda's": """
            t = lam * (s[0] + s[1] - 1)
            return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, 0.0])
        """,
        "still squared": """
            t = lam * (s[0] + s[1] - 2)
            return ti.Vector([2 * mu * (s[0] - 1) ** 2 + t, 2 * mu * (s[1] - 1) ** 2 + t, 0.0])
        """,
        "lambda's still squared": """
            t = lam * (s[0] + s[1] - 2) ** 2
            return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, 0.0])
        """,
        "three stretches": """
            t = lam * (s[0] + s[1] + s[2] - 3)
            return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, 0.0])
        """,
        "minus lambda": """
            t = lam * (s[0] + s[1] - 2)
            return ti.Vector([2 * mu * (s[0] - 1) - t, 2 * mu * (s[1] - 1) - t, 0.0])
        """,
        "2 mu s - 1": """
            t = lam * (s[0] + s[1] - 2)
            return ti.Vector([2 * mu * s[0] - 1 + t, 2 * mu * s[1] - 1 + t, 0.0])
        """,
        "s_1 in both": """
            t = lam * (s[0] + s[1] - 2)
            return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[0] - 1) + t, 0.0])
        """,
        "minus the gradient": """
            t = lam * (s[0] + s[1] - 2)
            return -ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, 0.0])
        """,
        "no lambda": "return ti.Vector([2 * mu * (s[0] - 1), 2 * mu * (s[1] - 1), 0.0])",
        "1 - s": """
            t = lam * (s[0] + s[1] - 2)
            return ti.Vector([2 * mu * (1 - s[0]) + t, 2 * mu * (1 - s[1]) + t, 0.0])
        """,
    },
    "d2psi_ds2": {
        "diagonal": "return ti.Matrix([[2 * mu + lam, 0.0, 0.0], [0.0, 2 * mu + lam, 0.0], [0.0, 0.0, 0.0]])",
        "third row": """
            a = 2 * mu + lam
            return ti.Matrix([[a, lam, lam], [lam, a, lam], [lam, lam, a]])
        """,
        "third diagonal": """
            a = 2 * mu + lam
            return ti.Matrix([[a, lam, 0.0], [lam, a, 0.0], [0.0, 0.0, a]])
        """,
        "third 1": """
            a = 2 * mu + lam
            return ti.Matrix([[a, lam, 0.0], [lam, a, 0.0], [0.0, 0.0, 1.0]])
        """,
        "times s": """
            a = 2 * mu + lam
            return ti.Matrix([[a * s[0], lam * s[1], 0.0], [lam * s[0], a * s[1], 0.0], [0.0, 0.0, 0.0]])
        """,
        "no 2": """
            a = mu + lam
            return ti.Matrix([[a, lam, 0.0], [lam, a, 0.0], [0.0, 0.0, 0.0]])
        """,
        "exchanged constants": """
            a = 2 * lam + mu
            return ti.Matrix([[a, mu, 0.0], [mu, a, 0.0], [0.0, 0.0, 0.0]])
        """,
        "2 (mu + lam)": """
            a = 2 * (mu + lam)
            return ti.Matrix([[a, lam, 0.0], [lam, a, 0.0], [0.0, 0.0, 0.0]])
        """,
        "half a lambda": """
            a = 2 * mu + lam / 2
            return ti.Matrix([[a, lam / 2, 0.0], [lam / 2, a, 0.0], [0.0, 0.0, 0.0]])
        """,
        "lambda off the diagonal only": """
            return ti.Matrix([[2 * mu, lam, 0.0], [lam, 2 * mu, 0.0], [0.0, 0.0, 0.0]])
        """,
        "area energy": """
            o = lam * (2 * s[0] * s[1] - 1)
            return ti.Matrix([[2 * mu + lam * s[1] ** 2, o, 0.0], [o, 2 * mu + lam * s[0] ** 2, 0.0], [0.0, 0.0, 0.0]])
        """,
        "minus lambda off the diagonal": """
            a = 2 * mu + lam
            return ti.Matrix([[a, -lam, 0.0], [-lam, a, 0.0], [0.0, 0.0, 0.0]])
        """,
        "one off-diagonal missing": """
            a = 2 * mu + lam
            return ti.Matrix([[a, lam, 0.0], [0.0, a, 0.0], [0.0, 0.0, 0.0]])
        """,
        "2 mu off the diagonal": """
            a = 2 * mu + lam
            return ti.Matrix([[lam, a, 0.0], [a, lam, 0.0], [0.0, 0.0, 0.0]])
        """,
        "2 mu - lam": """
            a = 2 * mu - lam
            return ti.Matrix([[a, lam, 0.0], [lam, a, 0.0], [0.0, 0.0, 0.0]])
        """,
        "lam off by two": """
            a = 2 * mu + lam
            return ti.Matrix([[a, 2 * lam, 0.0], [2 * lam, a, 0.0], [0.0, 0.0, 0.0]])
        """,
        "no lambda on second": """
            return ti.Matrix([[2 * mu + lam, lam, 0.0], [lam, 2 * mu, 0.0], [0.0, 0.0, 0.0]])
        """,
    },
    "dpsi_dF": {
        "V not transposed": "return U @ diag(dpsi_ds) @ V",
        "U and V exchanged": "return V @ diag(dpsi_ds) @ U.transpose()",
        "U transposed": "return U.transpose() @ diag(dpsi_ds) @ V",
        "U transposed too": "return U.transpose() @ diag(dpsi_ds) @ V.transpose()",
        "entry by entry": "return U * diag(dpsi_ds) * V.transpose()",
        "no diag": "return U @ V.transpose()",
        "U twice": "return U @ diag(dpsi_ds) @ U.transpose()",
        "V twice": "return V @ diag(dpsi_ds) @ V.transpose()",
        "diag first": "return diag(dpsi_ds) @ U @ V.transpose()",
        "diag last": "return U @ V.transpose() @ diag(dpsi_ds)",
        "no V": "return U @ diag(dpsi_ds)",
        "minus": "return -U @ diag(dpsi_ds) @ V.transpose()",
        "doubled": "return 2 * U @ diag(dpsi_ds) @ V.transpose()",
        "outer product of the vectors": "return (U @ dpsi_ds).outer_product(V @ dpsi_ds)",
        "rows for columns": """
            P = ti.Matrix.zero(float, 3, 3)
            for k in ti.static(range(3)):
                P += dpsi_ds[k] * U[k, :].outer_product(V[k, :])
            return P
        """,
        "reversed outer products": """
            P = ti.Matrix.zero(float, 3, 3)
            for k in ti.static(range(3)):
                P += dpsi_ds[k] * V[:, k].outer_product(U[:, k])
            return P
        """,
        "first only": "return dpsi_ds[0] * U[:, 0].outer_product(V[:, 0])",
        "the second twice": """
            return dpsi_ds[0] * U[:, 0].outer_product(V[:, 0]) + dpsi_ds[1] * U[:, 1].outer_product(V[:, 0])
        """,
        "first exchanged": """
            return dpsi_ds[0] * V[:, 0].outer_product(U[:, 0]) + dpsi_ds[1] * U[:, 1].outer_product(V[:, 1])
        """,
    },
    "nodal_force": {
        "sign": "return h * area * P @ grad_phi",
        "no h": "return -area * P @ grad_phi",
        "no area": "return -h * P @ grad_phi",
        "P transposed": "return -h * area * P.transpose() @ grad_phi",
        "halved": "return -0.5 * h * area * P @ grad_phi",
        "divided by h": "return -area / h * P @ grad_phi",
        "divided by area": "return -h / area * P @ grad_phi",
        "doubled": "return -2 * h * area * P @ grad_phi",
        "thirds": "return -h * area / 3 * P @ grad_phi",
        "area squared": "return -h * area * area * P @ grad_phi",
        "neither": "return -P @ grad_phi",
        "h for area": "return -h * h * P @ grad_phi",
        "unit gradient": "return -h * area * P @ grad_phi.normalized()",
        "diagonal only": "return -h * area * ti.Vector([P[0, 0], P[1, 1], P[2, 2]]) * grad_phi",
        "sum": "return -(h + area) * P @ grad_phi",
        "one component missing": """
            f = -h * area * P @ grad_phi
            return ti.Vector([f[0], f[1], 0.0])
        """,
        "symmetric P": "return -h * area * 0.5 * (P + P.transpose()) @ grad_phi",
    },
    "d2psi_dFij": {
        "dV not transposed": """
            return (dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(d2psi_ds2 @ ds) @ V.transpose()
                    + U @ diag(dpsi_ds) @ dV)
        """,
        "V not transposed in the first": """
            return (dU @ diag(dpsi_ds) @ V + U @ diag(d2psi_ds2 @ ds) @ V.transpose()
                    + U @ diag(dpsi_ds) @ dV.transpose())
        """,
        "ds alone": """
            return (dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(ds) @ V.transpose()
                    + U @ diag(dpsi_ds) @ dV.transpose())
        """,
        "first missing": "return U @ diag(d2psi_ds2 @ ds) @ V.transpose() + U @ diag(dpsi_ds) @ dV.transpose()",
        "middle missing": "return dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(dpsi_ds) @ dV.transpose()",
        "last missing": "return dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(d2psi_ds2 @ ds) @ V.transpose()",
        "middle alone": "return U @ diag(d2psi_ds2 @ ds) @ V.transpose()",
        "entry-wise": """
            H = ti.Matrix.zero(float, 3, 3)
            for k in ti.static(range(3)):
                H[k, k] = d2psi_ds2[k, k] * ds[k]
            return dU @ diag(dpsi_ds) @ V.transpose() + U @ H @ V.transpose() + U @ diag(dpsi_ds) @ dV.transpose()
        """,
        "U and V swapped in the middle": """
            return (dU @ diag(dpsi_ds) @ V.transpose() + V @ diag(d2psi_ds2 @ ds) @ U.transpose()
                    + U @ diag(dpsi_ds) @ dV.transpose())
        """,
        "U and V swapped in the last": """
            return (dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(d2psi_ds2 @ ds) @ V.transpose()
                    + V @ diag(dpsi_ds) @ dU.transpose())
        """,
        "dU and dV swapped": """
            return (dV @ diag(dpsi_ds) @ V.transpose() + U @ diag(d2psi_ds2 @ ds) @ V.transpose()
                    + U @ diag(dpsi_ds) @ dU.transpose())
        """,
        "minus the last": """
            return (dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(d2psi_ds2 @ ds) @ V.transpose()
                    - U @ diag(dpsi_ds) @ dV.transpose())
        """,
        "product of derivatives": "return dU @ diag(d2psi_ds2 @ ds) @ dV.transpose()",
        "middle with dpsi_ds": """
            return (dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(dpsi_ds) @ V.transpose()
                    + U @ diag(dpsi_ds) @ dV.transpose())
        """,
        "hessian without diag": """
            return (dU @ diag(dpsi_ds) @ V.transpose() + U @ d2psi_ds2 @ V.transpose()
                    + U @ diag(dpsi_ds) @ dV.transpose())
        """,
        "dV in the middle": """
            return (dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(d2psi_ds2 @ ds) @ dV.transpose()
                    + U @ diag(dpsi_ds) @ dV.transpose())
        """,
        "last with ds": """
            return (dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(d2psi_ds2 @ ds) @ V.transpose()
                    + U @ diag(ds) @ dV.transpose())
        """,
        "dU transposed": """
            return (dU.transpose() @ diag(dpsi_ds) @ V.transpose() + U @ diag(d2psi_ds2 @ ds) @ V.transpose()
                    + U @ diag(dpsi_ds) @ dV.transpose())
        """,
        "middle twice": """
            return (dU @ diag(dpsi_ds) @ V.transpose() + 2 * U @ diag(d2psi_ds2 @ ds) @ V.transpose()
                    + U @ diag(dpsi_ds) @ dV.transpose())
        """,
        "first twice instead of last": """
            return (2 * dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(d2psi_ds2 @ ds) @ V.transpose())
        """,
        "everything transposed": """
            return (dU @ diag(dpsi_ds) @ V.transpose() + U @ diag(d2psi_ds2 @ ds) @ V.transpose()
                    + U @ diag(dpsi_ds) @ dV.transpose()).transpose()
        """,
    },
    "eigensystem": {
        "no limit": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p / max(s[0], 1e-6), q / max(s[1], 1e-6)])
        """,
        "flip and twist exchanged": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([twist, flip, p / max(s[0], 1e-6), q / max(s[1], 1e-6)])
        """,
        "no abs": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if s[0] - s[1] > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p / max(s[0], 1e-6), q / max(s[1], 1e-6)])
        """,
        "limit where the gap is large": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) < 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p / max(s[0], 1e-6), q / max(s[1], 1e-6)])
        """,
        "projected": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            a, b = p / max(s[0], 1e-6), q / max(s[1], 1e-6)
            return ti.Vector([max(flip, 0.0), max(twist, 0.0), max(a, 0.0), max(b, 0.0)])
        """,
        "s_i - 1": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p / (s[0] - 1), q / (s[1] - 1)])
        """,
        "s_i - 1, floored": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p / max(s[0] - 1, 1e-6), q / max(s[1] - 1, 1e-6)])
        """,
        "s_i + 1": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p / (s[0] + 1), q / (s[1] + 1)])
        """,
        "s_i - s_2": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p / (s[0] + s[2]), q / (s[1] + s[2])])
        """,
        "plus over minus": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p + q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p / max(s[0], 1e-6), q / max(s[1], 1e-6)])
        """,
        "minus over plus": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p - q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p / max(s[0], 1e-6), q / max(s[1], 1e-6)])
        """,
        "no floor": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            return ti.Vector([flip, (p + q) / (s[0] + s[1]), p / s[0], q / s[1]])
        """,
        "floor of 1e-12": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-12)
            return ti.Vector([flip, twist, p / max(s[0], 1e-12), q / max(s[1], 1e-12)])
        """,
        "floor of 1e-3": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-3)
            return ti.Vector([flip, twist, p / max(s[0], 1e-3), q / max(s[1], 1e-3)])
        """,
        "floor added": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / (s[0] + s[1] + 1e-6)
            return ti.Vector([flip, twist, p / (s[0] + 1e-6), q / (s[1] + 1e-6)])
        """,
        "zero at collapse": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist, a, b = 0.0, 0.0, 0.0
            if s[0] + s[1] > 1e-6:
                twist = (p + q) / (s[0] + s[1])
            if s[0] > 1e-6:
                a = p / s[0]
            if s[1] > 1e-6:
                b = q / s[1]
            return ti.Vector([flip, twist, a, b])
        """,
        "limit without the coupling": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p / max(s[0], 1e-6), q / max(s[1], 1e-6)])
        """,
        "limit with a plus": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] + d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p / max(s[0], 1e-6), q / max(s[1], 1e-6)])
        """,
        "limit zero": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = 0.0
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p / max(s[0], 1e-6), q / max(s[1], 1e-6)])
        """,
        "out exchanged": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, q / max(s[1], 1e-6), p / max(s[0], 1e-6)])
        """,
        "denominators exchanged": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p / max(s[1], 1e-6), q / max(s[0], 1e-6)])
        """,
        "out not divided": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p, q])
        """,
        "halved twist": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = 0.5 * (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p / max(s[0], 1e-6), q / max(s[1], 1e-6)])
        """,
        "stretches squared": """
            p, q = dpsi_ds[0], dpsi_ds[1]
            flip = d2psi_ds2[0, 0] - d2psi_ds2[0, 1]
            if abs(s[0] - s[1]) > 1e-3:
                flip = (p - q) / (s[0] - s[1])
            twist = (p + q) / max(s[0] + s[1], 1e-6)
            return ti.Vector([flip, twist, p / max(s[0] ** 2, 1e-6), q / max(s[1] ** 2, 1e-6)])
        """,
    },
    "sphere_contact": {
        "squared distance": """
            d = x - c
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm() > 0:
                n = d.normalized()
            return ti.cast(d.norm_sqr() < r, ti.i32), n
        """,
        "squared distance, no guard": """
            d = x - c
            return ti.cast(d.norm_sqr() < r, ti.i32), d.normalized()
        """,
        "inward": """
            d = c - x
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm() > 0:
                n = d.normalized()
            return ti.cast(d.norm() < r, ti.i32), n
        """,
        "not of length one": """
            d = x - c
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm() > 0:
                n = d
            return ti.cast(d.norm() < r, ti.i32), n
        """,
        "divided by r": """
            d = x - c
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm() > 0:
                n = d / r
            return ti.cast(d.norm() < r, ti.i32), n
        """,
        "integers": """
            d = x - c
            n = ti.Vector([0, 1, 0])
            if d.norm() > 0:
                n = d.normalized()
            return ti.cast(d.norm() < r, ti.i32), n
        """,
        "<=": """
            d = x - c
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm() > 0:
                n = d.normalized()
            return ti.cast(d.norm() <= r, ti.i32), n
        """,
        ">": """
            d = x - c
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm() > 0:
                n = d.normalized()
            return ti.cast(d.norm() > r, ti.i32), n
        """,
        "no guard": """
            d = x - c
            return ti.cast(d.norm() < r, ti.i32), d.normalized()
        """,
        "z up at the centre": """
            d = x - c
            n = ti.Vector([0.0, 0.0, 1.0])
            if d.norm() > 0:
                n = d.normalized()
            return ti.cast(d.norm() < r, ti.i32), n
        """,
        "zero at the centre": """
            d = x - c
            n = ti.Vector([0.0, 0.0, 0.0])
            if d.norm() > 0:
                n = d.normalized()
            return ti.cast(d.norm() < r, ti.i32), n
        """,
        "up without a hit": """
            d = x - c
            n = ti.Vector([0.0, 1.0, 0.0])
            hit = 0
            if d.norm() < r:
                hit = 1
                if d.norm() > 0:
                    n = d.normalized()
            return hit, n
        """,
        "c not subtracted": """
            n = ti.Vector([0.0, 1.0, 0.0])
            if x.norm() > 0:
                n = x.normalized()
            return ti.cast(x.norm() < r, ti.i32), n
        """,
        "c not subtracted in the distance": """
            d = x - c
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm() > 0:
                n = d.normalized()
            return ti.cast(x.norm() < r, ti.i32), n
        """,
        "guard of a hundredth": """
            d = x - c
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm() > 0.01:
                n = d.normalized()
            return ti.cast(d.norm() < r, ti.i32), n
        """,
        "diameter": """
            d = x - c
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm() > 0:
                n = d.normalized()
            return ti.cast(d.norm() < 2 * r, ti.i32), n
        """,
        "r squared with the distance": """
            d = x - c
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm() > 0:
                n = d.normalized()
            return ti.cast(d.norm() < r * r, ti.i32), n
        """,
        "normal by squared length": """
            d = x - c
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm() > 0:
                n = d / d.norm_sqr()
            return ti.cast(d.norm() < r, ti.i32), n
        """,
        "epsilon in the denominator": """
            d = x - c
            n = d / (d.norm() + 1e-6)
            return ti.cast(d.norm() < r, ti.i32), n
        """,
        "x + c": """
            d = x + c
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm() > 0:
                n = d.normalized()
            return ti.cast(d.norm() < r, ti.i32), n
        """,
        "always a hit": """
            d = x - c
            n = ti.Vector([0.0, 1.0, 0.0])
            if d.norm() > 0:
                n = d.normalized()
            return 1, n
        """,
    },
    "filter_velocity": {
        "always": "return v - n.dot(v) * n",
        "reflection": """
            d = n.dot(v)
            v_new = v
            if d < 0:
                v_new = v - 2 * d * n
            return v_new
        """,
        "plus": """
            d = n.dot(v)
            v_new = v
            if d < 0:
                v_new = v + d * n
            return v_new
        """,
        "stops": """
            v_new = v
            if n.dot(v) < 0:
                v_new = ti.Vector([0.0, 0.0, 0.0])
            return v_new
        """,
        "along v": """
            d = n.dot(v)
            v_new = v
            if d < 0:
                v_new = v - d * v
            return v_new
        """,
        "along v's direction": """
            d = n.dot(v)
            v_new = v
            if d < 0:
                v_new = v - d * v.normalized()
            return v_new
        """,
        "outgoing filtered": """
            d = n.dot(v)
            v_new = v
            if d > 0:
                v_new = v - d * n
            return v_new
        """,
        "not at all": "return v",
        "only the normal part": """
            d = n.dot(v)
            v_new = v
            if d < 0:
                v_new = d * n
            return v_new
        """,
        "minus n": """
            d = n.dot(v)
            v_new = v
            if d < 0:
                v_new = v - n
            return v_new
        """,
        "bounce of a half": """
            d = n.dot(v)
            v_new = v
            if d < 0:
                v_new = v - 1.5 * d * n
            return v_new
        """,
        "half": """
            d = n.dot(v)
            v_new = v
            if d < 0:
                v_new = v - 0.5 * d * n
            return v_new
        """,
        "friction": """
            d = n.dot(v)
            v_new = v
            if d < 0:
                v_new = 0.9 * (v - d * n)
            return v_new
        """,
        "absolute value": """
            d = n.dot(v)
            v_new = v
            if d < 0:
                v_new = v - abs(d) * n
            return v_new
        """,
        "cross product": """
            v_new = v
            if n.dot(v) < 0:
                v_new = n.cross(v)
            return v_new
        """,
        "entry by entry": """
            d = n * v
            v_new = v
            if n.dot(v) < 0:
                v_new = v - d * n
            return v_new
        """,
        "d squared": """
            d = n.dot(v)
            v_new = v
            if d < 0:
                v_new = v - d * d * n
            return v_new
        """,
        "threshold": """
            d = n.dot(v)
            v_new = v
            if d < -0.1:
                v_new = v - d * n
            return v_new
        """,
        "zero when leaving": """
            d = n.dot(v)
            v_new = ti.Vector([0.0, 0.0, 0.0])
            if d < 0:
                v_new = v - d * n
            return v_new
        """,
        "the vertical component": """
            v_new = v
            if v[1] < 0:
                v_new = ti.Vector([v[0], 0.0, v[2]])
            return v_new
        """,
    },
}
