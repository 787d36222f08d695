"""Ways to write `right_cauchy_green`, `psi`, `dpsi_ds`, `d2psi_ds2`: see the folder's `__init__`."""

import taichi as ti

# --- right_cauchy_green --------------------------------------------------------------------------------------


def right_cauchy_green(F):
    return F.transpose() @ F  # C


def right_cauchy_green__loops(F):
    C = ti.Matrix([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # C before the loop
    for i in range(3):  # the rows of C
        for j in range(3):  # the columns of C
            for k in range(3):  # the inner sum over the three rows of F
                C[i, j] += F[k, i] * F[k, j]  # each entry of C
    return C  # the result


def right_cauchy_green__columns(F):
    a = F[:, 0]  # column 0 of F
    b = F[:, 1]  # column 1 of F
    c = F[:, 2]  # column 2 of F
    p = ti.Vector([a.dot(a), a.dot(b), a.dot(c)])  # row 0 of C
    q = ti.Vector([b.dot(a), b.dot(b), b.dot(c)])  # row 1 of C
    t = ti.Vector([c.dot(a), c.dot(b), c.dot(c)])  # row 2 of C
    return ti.Matrix.rows([p, q, t])  # the three rows


def right_cauchy_green__dyads(F):
    C = F[0, :].outer_product(F[0, :])  # the part of row 0 of F
    C += F[1, :].outer_product(F[1, :])  # the part of row 1 of F
    C += F[2, :].outer_product(F[2, :])  # the part of row 2 of F
    return C  # the sum over the three rows of F


def right_cauchy_green__twice(F):
    """F^T F is multiplied with itself: its eigenvalues are fourth powers of the stretches.

    C is F^T F itself.
    """
    return F.transpose() @ F @ F.transpose() @ F


def right_cauchy_green__both_transposed(F):
    """Both factors are transposed.

    Put dx = F dX into dx^T dx: only the first factor is transposed.
    """
    return F.transpose() @ F.transpose()


def right_cauchy_green__inverse(F):
    """An inverse stands where a transpose belongs.

    The inverse is the transpose for rotations only.
    """
    return F.inverse() @ F.transpose()


def right_cauchy_green__inverse_transposed(F):
    """The inverse of F takes part: an inverse stands where there should be none.

    Put dx = F dX into dx^T dx: nothing is inverted.
    """
    return F.inverse().transpose() @ F


def right_cauchy_green__stretch_squared(F):
    """This is half of F^T F + F F^T: the left and the right tensor are mixed.

    Put dx = F dX into dx^T dx: the order is fixed, and the result is symmetric already.
    """
    return (F.transpose() @ F + F @ F.transpose()) / 2


def right_cauchy_green__one_row(F):
    """Only one row of F takes part.

    Every row of F changes lengths: C sums over all three.
    """
    return F[0, :].outer_product(F[0, :])


def right_cauchy_green__cofactor(F):
    """F^T F is divided or multiplied by det F.

    C needs no determinant: put dx = F dX into dx^T dx.
    """
    return F.transpose() @ F / F.determinant()


# --- psi -----------------------------------------------------------------------------------------------------


def psi(s, mu, lam):
    a = (s[0] - 1) ** 2 + (s[1] - 1) ** 2  # the sum of squares that mu weighs
    t = s[0] + s[1] - 2  # the change of size that lam weighs
    return mu * a + lam / 2 * t**2  # the sum of the mu term and the lam term


def psi__strains(s, mu, lam):
    a = s[0] - 1  # the strain of direction 0
    b = s[1] - 1  # the strain of direction 1
    return mu * (a**2 + b**2) + lam / 2 * (a + b) ** 2  # the sum of the mu term and the lam term


def psi__loop(s, mu, lam):
    a = 0.0  # the sum of squares that mu weighs
    t = 0.0  # the change of size that lam weighs
    for i in range(2):  # the sum over the stretches in the plane
        a += (s[i] - 1) ** 2  # the sum of squares that mu weighs
        t += s[i] - 1  # the change of size that lam weighs
    return mu * a + 0.5 * lam * t * t  # the sum of the mu term and the lam term


def psi__one_line(s, mu, lam):
    a = mu * (s[0] - 1) ** 2 + mu * (s[1] - 1) ** 2  # the mu term
    b = 0.5 * lam * (s[0] + s[1] - 2) ** 2  # the lam term
    return a + b  # the sum of the mu term and the lam term


def psi__brackets(s, mu, lam):
    """mu multiplies only the first of its two squares.

    Put the sum of both squares in brackets: mu weighs each of them.
    """
    return mu * (s[0] - 1) ** 2 + (s[1] - 1) ** 2 + lam / 2 * (s[0] + s[1] - 2) ** 2


def psi__difference(s, mu, lam):
    """The lam term counts the difference of the stretches, not the sum of their changes.

    What changes the size of a square: both sides longer, or one longer and the other shorter?
    """
    return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + lam / 2 * (s[0] - s[1]) ** 2


def psi__one_over(s, mu, lam):
    """lam stands below the fraction line.

    lam/2, or 0.5 * lam: a larger lam must store more.
    """
    return mu * ((s[0] - 1) ** 2 + (s[1] - 1) ** 2) + 1 / (2 * lam) * (s[0] + s[1] - 2) ** 2


def psi__logarithm(s, mu, lam):
    """The stretches come in by their logarithms: that is another material, Hencky's.

    The energy counts s - 1.
    """
    a, b = ti.log(s[0]), ti.log(s[1])
    return mu * (a * a + b * b) + lam / 2 * (a + b) ** 2


def psi__green(s, mu, lam):
    """The energy counts (s^2 - 1)/2, Green's strain: that is another material, St. Venant-Kirchhoff.

    The energy counts s - 1.
    """
    a, b = (s[0] ** 2 - 1) / 2, (s[1] ** 2 - 1) / 2
    return mu * (a * a + b * b) + lam / 2 * (a + b) ** 2


# --- dpsi_ds -------------------------------------------------------------------------------------------------


def dpsi_ds(s, mu, lam):
    t = lam * (s[0] + s[1] - 2)  # the lam term
    p = 2 * mu * (s[0] - 1) + t  # component 0
    q = 2 * mu * (s[1] - 1) + t  # component 1
    return ti.Vector([p, q, 0.0])  # the three components


def dpsi_ds__strains(s, mu, lam):
    a = s[0] - 1  # the strain of direction 0
    b = s[1] - 1  # the strain of direction 1
    p = 2 * mu * a + lam * (a + b)  # component 0
    q = 2 * mu * b + lam * (a + b)  # component 1
    return ti.Vector([p, q, 0.0])  # the three components


def dpsi_ds__loop(s, mu, lam):
    t = s[0] + s[1] - 2  # the change of size that lam weighs, the sum of both strains
    g = ti.Vector([0.0, 0.0, 0.0])  # the gradient before the loop
    for i in range(2):  # the components in the plane
        g[i] = 2 * mu * (s[i] - 1) + lam * t  # each component
    return g  # the three components


def dpsi_ds__sum_in_a_loop(s, mu, lam):
    g = ti.Vector([0.0, 0.0, 0.0])  # the gradient before the loop
    for i in range(2):  # the components in the plane
        g[i] += 2 * mu * (s[i] - 1)  # the mu term of each component
        for j in range(2):  # the sum of both strains, that couples the components
            g[i] += lam * (s[j] - 1)  # the lam term of each component
    return g  # the three components


def dpsi_ds__one_line(s, mu, lam):
    p = 2 * mu * (s[0] - 1) + lam * (s[0] + s[1] - 2)  # component 0
    q = 2 * mu * (s[1] - 1) + lam * (s[0] + s[1] - 2)  # component 1
    return ti.Vector([p, q, 0.0])  # the three components


def dpsi_ds__terms(s, mu, lam):
    a = 2 * mu * (s[0] - 1)  # the mu term of component 0
    b = 2 * mu * (s[1] - 1)  # the mu term of component 1
    t = lam * (s[0] + s[1] - 2)  # the lam term, with the sum of both stretches
    return ti.Vector([a + t, b + t, 0.0])  # the three components


def dpsi_ds__sum_of_all(s, mu, lam):
    """The third component carries the derivative of a third stretch.

    psi does not contain s_2: what is its derivative by it?
    """
    t = lam * (s[0] + s[1] - 2)
    return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, 2 * mu * (s[2] - 1) + t])


def dpsi_ds__third_lam(s, mu, lam):
    """The third component carries the lam term.

    psi does not contain s_2: what is its derivative by it?
    """
    t = lam * (s[0] + s[1] - 2)
    return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, t])


def dpsi_ds__half_lam_sum(s, mu, lam):
    """The brackets are missing: 1 is subtracted from 2 mu s_i, not from s_i.

    2 mu multiplies s_i - 1 as a whole.
    """
    t = lam * (s[0] + s[1] - 2)
    return ti.Vector([2 * mu * s[0] - 1 + t, 2 * mu * s[1] - 1 + t, 0.0])


def dpsi_ds__area_without_chain(s, mu, lam):
    """The lam term holds the product of the stretches: that is the area energy, and its chain rule is missing.

    Differentiate the linearised energy: the lam term is the square of a sum.
    """
    t = lam * (s[0] * s[1] - 1)
    return ti.Vector([2 * mu * (s[0] - 1) + t, 2 * mu * (s[1] - 1) + t, 0.0])


# --- d2psi_ds2 -----------------------------------------------------------------------------------------------


def d2psi_ds2(s, mu, lam):
    a = 2 * mu + lam  # the entries on the diagonal
    b = lam  # the entries off the diagonal
    return ti.Matrix([[a, b, 0.0], [b, a, 0.0], [0.0, 0.0, 0.0]])  # the nine entries


def d2psi_ds2__dyad(s, mu, lam):
    e = ti.Vector([1.0, 1.0, 0.0])  # the vector (1, 1, 0)
    A = ti.Matrix([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]])  # the identity of the plane
    return 2 * mu * A + lam * e.outer_product(e)  # the sum of the mu part and the lam part


def d2psi_ds2__loop(s, mu, lam):
    H = ti.Matrix([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # the matrix before the loop
    for i in range(2):  # the rows
        for j in range(2):  # the columns
            H[i, j] += lam  # the lam part, on and off the diagonal
        H[i, i] += 2 * mu  # the mu part on the diagonal
    return H  # the nine entries


def d2psi_ds2__condition(s, mu, lam):
    H = ti.Matrix([[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])  # the matrix before the loop
    for i in range(2):  # the rows
        for j in range(2):  # the columns
            H[i, j] = lam  # the entries off the diagonal
            if i == j:
                H[i, j] = 2 * mu + lam  # the entries on the diagonal
    return H  # the nine entries


def d2psi_ds2__entries(s, mu, lam):
    H = [[2 * mu + lam, lam, 0.0], [lam, 2 * mu + lam, 0.0], [0.0, 0.0, 0.0]]  # the nine entries
    return ti.Matrix(H)  # the result


def d2psi_ds2__mu_and_lam(s, mu, lam):
    """The factor 2 of mu has been applied to lam, too.

    The mu term and the lam term come from different squares: differentiate each by itself.
    """
    a = 2 * (mu + lam)
    return ti.Matrix([[a, lam, 0.0], [lam, a, 0.0], [0.0, 0.0, 0.0]])


def d2psi_ds2__mu_and_lam_everywhere(s, mu, lam):
    """The factor 2 of mu has been applied to lam, too.

    The mu term and the lam term come from different squares: differentiate each by itself.
    """
    a, b = 2 * (mu + lam), 2 * lam
    return ti.Matrix([[a, b, 0.0], [b, a, 0.0], [0.0, 0.0, 0.0]])
