"""Neo-Hookean elasticity: how the cases are drawn, what is true, and what students get wrong.

Longer than others: it mirrors a file of the students', and a task's judge is to be read in one piece.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.judging import Case, Mistake
from muslin.judging.arrays import transposed
from muslin.judging.exact import Matrix, gradient, hessian

from .energies import neo_hookean
from .tetrahedra import conditions_strained, draw_strained


def _entries(F: Matrix) -> list[Any]:
    return [entry for row in F for entry in row]


def truth_psi(F: Matrix, C: Any, D: Any) -> Any:
    """The energy itself."""
    return neo_hookean(_entries(F), C, D)


def truth_dpsi_dF(F: Matrix, C: Any, D: Any) -> Matrix:
    """The energy, differentiated in the nine entries of F."""
    P = gradient(lambda at: neo_hookean(at, C, D), _entries(F))
    return [P[:3], P[3:6], P[6:]]


def truth_d2psi_dF2(F: Matrix, C: Any, D: Any) -> Matrix:
    """The energy, differentiated twice in the nine entries of F."""
    return hessian(lambda at: neo_hookean(at, C, D), _entries(F))


draw_psi = draw_dpsi_dF = draw_d2psi_dF2 = draw_strained

conditions_psi = conditions_dpsi_dF = conditions_d2psi_dF2 = conditions_strained


class Parts:
    """What the energy of a batch of cases is made of: numbers (b,), matrices (b, 3, 3), and products (b, 9, 9)."""

    def __init__(self, a: Case, G: Any = None):
        self.F, self.C, self.D = a.F, a.C, a.D
        self.J = np.linalg.det(a.F)
        self.G = transposed(np.linalg.inv(a.F)) if G is None else G
        self.I = np.sum(a.F**2, axis=(1, 2))
        self.a = self.J ** (-2 / 3)
        self.eye = np.broadcast_to(np.eye(9), (len(self.J), 9, 9))
        f, g = self.F.reshape(-1, 9), self.G.reshape(-1, 9)
        self.GG, self.FG = g[:, :, None] * g[:, None, :], f[:, :, None] * g[:, None, :]
        self.turned = np.einsum("bin,bmj->bijmn", self.G, self.G).reshape(-1, 9, 9)

    def psi(self, a: Any = None, I: Any = None, three: float = 3, volume: Any = None) -> np.ndarray:  # noqa: E741
        """The energy with other parts."""
        a, I = (self.a if a is None else a), (self.I if I is None else I)  # noqa: E741
        return self.C * (a * I - three) + self.D * ((self.J - 1) ** 2 if volume is None else volume)

    def stress(self, shape: Any = None, volume: Any = None) -> np.ndarray:
        """C times one part, plus D times another."""
        m = lambda x: x[:, None, None]  # noqa: E731
        shape = 2 * m(self.a) * (self.F - m(self.I) / 3 * self.G) if shape is None else shape
        volume = m(2 * (self.J - 1) * self.J) * self.G if volume is None else volume
        return m(self.C) * shape + m(self.D) * volume

    def hessian(self, fg: float = 1, gf: float = 1, gg: float = 1, turn: float = 1, one: float = 1,
                more: float = 1, less: float = 1) -> np.ndarray:  # fmt: skip
        """The Hessian, each of its seven terms times a number."""
        m = lambda x: x[:, None, None]  # noqa: E731
        shape = (
            one * self.eye
            - 2 / 3 * (fg * self.FG + gf * transposed(self.FG))
            + m(self.I) / 9 * (2 * gg * self.GG + 3 * turn * self.turned)
        )
        J = self.J
        volume = more * m((2 * J - 1) * J) * self.GG - less * m((J - 1) * J) * self.turned
        return m(2 * self.C * self.a) * shape + 2 * m(self.D) * volume


def _m(x: np.ndarray) -> np.ndarray:
    return x[:, None, None]


def _psi_powers(a: Case) -> tuple[np.ndarray, ...]:
    p = Parts(a)
    return tuple(p.psi(a=p.J**power) for power in (2 / 3, -1 / 3, 1 / 3, -2, -1, -4 / 3, -3 / 2))


def _psi_volumes(a: Case) -> tuple[np.ndarray, ...]:
    p = Parts(a)
    J = p.J
    return tuple(
        p.psi(volume=v)
        for v in (
            J - 1,
            np.abs(J - 1),
            J**2 - 1,
            J**2,
            np.log(J) ** 2,
            np.log(J),
            (J + 1) ** 2,
        )
    )


def _log_model(a: Case) -> tuple[np.ndarray, ...]:
    """The other Neo-Hookean energy, with a logarithm: mu/2 (I - 3) - mu log J + lam/2 log^2 J."""
    p = Parts(a)
    L = np.log(p.J)
    return (
        p.C * (p.I - 3) - 2 * p.C * L + p.D * L**2,
        p.C * (p.I - 3) - 2 * p.C * L + p.D * (p.J - 1) ** 2,
        p.C * (p.I - 3 - 2 * L) + p.D / 2 * L**2,
    )


mistakes_psi = (
    Mistake(
        "un-barred",
        "J^(-2/3) is missing: your energy mixes the change of volume into that of shape, and is not least at rest.",
        "Blow a tetrahedron up without changing its shape: the term with C must not notice.",
        lambda a: Parts(a).psi(a=1.0),
    ),
    Mistake(
        "wrong power",
        "J has another power than -2/3.",
        "J^(-1/3) F has determinant one. What does that make of tr(F^T F), which is quadratic in F?",
        _psi_powers,
    ),
    Mistake(
        "rest at three",
        "Your energy does not vanish at rest: another number than 3 is subtracted, or none.",
        "What is tr(F^T F) for a rotation?",
        lambda a: tuple(Parts(a).psi(three=n) for n in (0, 1, 2, -3, 9)),
    ),
    Mistake(
        "three outside",
        "The three is multiplied with J^(-2/3), too.",
        "First the invariant is freed of J, then three is subtracted.",
        lambda a: Parts(a).psi(I=Parts(a).I - 3, three=0),
    ),
    Mistake(
        "not squared",
        "The term with D is not D (J - 1)^2.",
        "It must vanish where J = 1 and grow both ways.",
        _psi_volumes,
    ),
    Mistake(
        "sum of F",
        "In place of tr(F^T F) stands another number made of F.",
        "tr(F^T F) is the sum of the squares of all nine entries.",
        lambda a: tuple(
            Parts(a).psi(I=number)
            for number in (
                np.trace(a.F, axis1=1, axis2=2),
                np.trace(a.F @ a.F, axis1=1, axis2=2),
                np.sqrt(Parts(a).I),
                np.einsum("bii->b", a.F**2),
                np.trace(a.F, axis1=1, axis2=2) ** 2,
                a.F.sum(axis=(1, 2)),
            )
        ),
    ),
    Mistake(
        "logarithm",
        "This is the other Neo-Hookean energy, with a logarithm of J.",
        "The formula of this assignment has no logarithm.",
        _log_model,
    ),
    Mistake(
        "half D",
        "The term with D is half or twice of the right one: D is taken for lam, or lam/2 put in again.",
        "D stands alone before (J - 1)^2; that it comes from kappa/2 is nothing to put in once more.",
        lambda a: (
            Parts(a).psi(volume=(Parts(a).J - 1) ** 2 / 2),
            Parts(a).psi(volume=2 * (Parts(a).J - 1) ** 2),
        ),
    ),
    Mistake(
        "half C",
        "The term with C is half or twice of the right one: C is taken for mu, or mu/2 put in again.",
        "C stands alone before the bracket; that it comes from mu/2 is nothing to put in once more.",
        lambda a: tuple(
            a.right + (factor - 1) * a.C * (Parts(a).a * Parts(a).I - 3) for factor in (0.5, 2.0)
        ),
    ),
    Mistake(
        "exchanged:C,D",
        "C and D are exchanged.",
        "C weighs the change of shape, D that of volume.",
        lambda a: a.truth(C=a.D, D=a.C),
    ),
    Mistake(
        "clamped J",
        "J is limited: your energy stops growing where the tetrahedron is pressed hard, or blown up.",
        "The formula holds for every J > 0. What keeps a solid from collapsing is that its energy grows without end.",
        lambda a: tuple(
            Parts(a).C * (np.clip(Parts(a).J, *span) ** (-2 / 3) * Parts(a).I - 3)
            + Parts(a).D * ((Parts(a).J if part else np.clip(Parts(a).J, *span)) - 1) ** 2
            for span in ((0.1, np.inf), (0.5, np.inf), (0.2, np.inf), (1.0, np.inf), (0.0, 1.0))
            for part in (False, True)
        ),
    ),
)


said_psi = {
    "swapped:C,D": ("C and D are exchanged.", "C weighs the change of shape, D that of volume."),
    "missing:C": ("The term with C is missing.", "The first term resists a change of shape."),
    "missing:D": ("The term with D is missing.", "The second term resists a change of volume."),
    "doubled:D": ("The term with D is twice too large.", "D stands alone before (J - 1)^2."),
    "halved:D": ("The term with D is half of the right one.", "D stands alone before (J - 1)^2."),
    "doubled:C": ("The term with C is twice too large.", "C stands alone before the bracket."),
    "halved:C": ("The term with C is half of the right one.", "C stands alone before the bracket."),
}


def _stress_shapes(*makes: Any) -> Any:
    return lambda a: tuple(Parts(a).stress(shape=make(Parts(a))) for make in makes)


def _stress_volumes(*makes: Any) -> Any:
    return lambda a: tuple(Parts(a).stress(volume=make(Parts(a))) for make in makes)


mistakes_dpsi_dF = (
    Mistake(
        "un-barred",
        "This is the stress of the energy without J^(-2/3): it does not vanish at rest.",
        "J^(-2/3) depends on F, too: differentiate the product.",
        _stress_shapes(lambda p: 2 * p.F),
    ),
    Mistake(
        "J held fixed",
        "J^(-2/3) is treated as a constant: its own derivative is missing, and there is stress at rest.",
        "The first term is a product: both J^(-2/3) and tr(F^T F) depend on F.",
        _stress_shapes(lambda p: 2 * _m(p.a) * p.F),
    ),
    Mistake(
        "not transposed",
        "F^(-1) stands where F^(-T) belongs.",
        "The derivative of det F are its cofactors, J F^(-T): look at F = diag and at a shear.",
        lambda a: (
            Parts(a).stress(
                shape=2 * _m(Parts(a).a) * (a.F - _m(Parts(a).I) / 3 * transposed(Parts(a).G)),
                volume=_m(2 * (Parts(a).J - 1) * Parts(a).J) * transposed(Parts(a).G),
            ),
            Parts(a).stress(shape=2 * _m(Parts(a).a) * (a.F - _m(Parts(a).I) / 3 * transposed(Parts(a).G))),
            Parts(a).stress(volume=_m(2 * (Parts(a).J - 1) * Parts(a).J) * transposed(Parts(a).G)),
        ),
    ),
    Mistake(
        "J missing",
        "In the term with D the factor J of the derivative of det F is missing.",
        "dJ/dF is J F^(-T), not F^(-T).",
        _stress_volumes(lambda p: _m(2 * (p.J - 1)) * p.G, lambda p: _m(2 * (p.J - 1) * p.J**2) * p.G),
    ),
    Mistake(
        "wrong derivative of J^(-2/3)",
        "The derivative of J^(-2/3) is wrong by a factor, a sign, or a power of J.",
        "Its derivative in J is -2/3 J^(-5/3), and dJ/dF has a factor J: what is left?",
        _stress_shapes(
            *(
                lambda p, c=c, q=q: 2 * _m(p.a) * p.F + c * _m(p.J**q * p.I) * p.G
                for c in (-2 / 3, 2 / 3, -1 / 3, -2, -1, 1 / 3, -4 / 3)
                for q in (-2 / 3, -5 / 3, 1 / 3, -1, -8 / 3)
                if (c, q) != (-2 / 3, -2 / 3)
            )
        ),
    ),
    Mistake(
        "cauchy",
        "This is the Cauchy or the second Piola-Kirchhoff stress, not dpsi/dF.",
        "Nothing is multiplied to dpsi/dF any more, neither F nor its inverse.",
        lambda a: (
            a.right @ transposed(a.F) / _m(Parts(a).J),
            np.linalg.inv(a.F) @ a.right,
            a.right @ transposed(a.F),
            transposed(a.F) @ a.right,
        ),
    ),
    Mistake(
        "halved",
        "One of the factors 2 of the squares is missing.",
        "Both terms hold a square: each derivative brings a 2.",
        lambda a: (
            Parts(a).stress(shape=_m(Parts(a).a) * (a.F - _m(Parts(a).I) / 3 * Parts(a).G)),
            Parts(a).stress(volume=_m((Parts(a).J - 1) * Parts(a).J) * Parts(a).G),
            a.right / 2,
            Parts(a).stress(shape=_m(Parts(a).a) * (a.F - 2 * _m(Parts(a).I) / 3 * Parts(a).G)),
        ),
    ),
    Mistake(
        "exchanged:C,D",
        "C and D are exchanged.",
        "C weighs the change of shape, D that of volume.",
        lambda a: a.truth(C=a.D, D=a.C),
    ),
    Mistake(
        "transposed",
        "This is P transposed.",
        "Turn the deformed solid, F -> R F: the stress must turn in the same way, P -> R P.",
        lambda a: transposed(a.right),
    ),
    Mistake(
        "undeformed pressure",
        "The term with D pulls along F, or along the identity, where the cofactors of F belong.",
        "How does det F change when one entry of F does? By its cofactor.",
        _stress_volumes(
            lambda p: _m(2 * (p.J - 1)) * p.F,
            lambda p: _m(2 * (p.J - 1)) * np.eye(3),
            lambda p: _m(2 * (p.J - 1) * p.J) * np.eye(3),
            lambda p: _m(2 * (p.J - 1) * p.J) * p.F,
        ),
    ),
    Mistake(
        "other energy",
        "This is the stress of the other Neo-Hookean energy, with a logarithm of J.",
        "The formula of this assignment has no logarithm.",
        lambda a: (
            Parts(a).stress(shape=2 * (a.F - Parts(a).G), volume=2 * _m(np.log(Parts(a).J)) * Parts(a).G),
            Parts(a).stress(shape=2 * (a.F - Parts(a).G)),
        ),
    ),
)


said_dpsi_dF = {
    "swapped:C,D": ("C and D are exchanged.", "C weighs the change of shape, D that of volume."),
    "missing:C": ("The term with C is missing.", "The first term resists a change of shape."),
    "missing:D": ("The term with D is missing.", "The second term resists a change of volume."),
    "negated": (
        "This is minus the gradient.",
        "The gradient of psi points uphill; the sign of a force comes later.",
    ),
    "transposed": (
        "This is P transposed: F^(-1) may stand where F^(-T) belongs.",
        "Turn the deformed solid, F -> R F: the stress must turn in the same way, P -> R P.",
    ),
}


def _columns(H: np.ndarray) -> np.ndarray:
    """Rows and columns numbered column by column of F."""
    order = np.arange(9).reshape(3, 3).T.ravel()
    return H[:, order][:, :, order]


def _hessians(*changes: dict[str, float]) -> Any:
    return lambda a: tuple(Parts(a).hessian(**change) for change in changes)


#: Factors a term may have too much.
FACTORS = (0.5, 2.0, -1.0, 3.0, 1.5, 1 / 3)

#: Numbers of entry (i, j), and others that come of a slip in them.
ROW_BY_ROW = np.arange(9)
NUMBERS = tuple(
    np.array([number(*divmod(k, 3)) for k in range(9)])
    for number in (lambda i, j: i + j, lambda i, j: i + 3 * j, lambda i, j: 2 * i + j)
)


def _numbered(a: Case, rows: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, ...]:
    """What comes where it does not belong, added up or the last; the identity as it belongs, or by equal numbers."""
    p = Parts(a)
    equal = (rows[:, None] == columns).astype(np.float64)
    by_number = p.hessian(one=0) + _m(2 * p.C * p.a) * equal
    added, last, equals = np.zeros_like(a.right), np.zeros_like(a.right), np.zeros_like(a.right)
    for k, row in enumerate(rows):
        for m, column in enumerate(columns):
            added[:, row, column] += a.right[:, k, m]
            equals[:, row, column] += by_number[:, k, m]
            last[:, row, column] = a.right[:, k, m]
    return added, last, equals


def _straight(shape: float, volume: float, indices: str = "bim,bjn") -> Any:
    """dG_ij/dF_mn = -G_im G_jn, or with other indices, in one term or in both."""

    def makes(a: Case) -> np.ndarray:
        p = Parts(a)
        more = np.einsum(f"{indices}->bijmn", p.G, p.G).reshape(-1, 9, 9) - p.turned
        return (
            a.right
            + shape * _m(2 * p.C * p.a * p.I / 3) * more
            - volume * _m(2 * p.D * (p.J - 1) * p.J) * more
        )

    return makes


def _projected(least: float, instead: float) -> Any:
    """Eigenvalues below some number replaced."""

    def makes(a: Case) -> np.ndarray:
        values, vectors = np.linalg.eigh((a.right + transposed(a.right)) / 2)
        values = np.where(values < least, instead, values)
        return (vectors * values[:, None, :]) @ transposed(vectors)

    return makes


def _magnitudes(a: Case) -> np.ndarray:
    """Eigenvalues without their signs."""
    values, vectors = np.linalg.eigh((a.right + transposed(a.right)) / 2)
    return (vectors * np.abs(values)[:, None, :]) @ transposed(vectors)


mistakes_d2psi_dF2 = (
    Mistake(
        "projected",
        "The negative eigenvalues are taken away: this is another matrix, and no second derivative.",
        "Return the Hessian as it is; the simulator projects it where Newton's method needs that.",
        lambda a: (_projected(0.0, 0.0)(a), _projected(1e-6, 1e-3)(a), _magnitudes(a)),
    ),
    Mistake(
        "column by column",
        "Rows and columns are numbered column by column of F; asked is row by row.",
        "Entry F_ij has the number 3 i + j.",
        lambda a: (_columns(a.right), a.right[:, np.arange(9).reshape(3, 3).T.ravel()]),
    ),
    Mistake(
        "not transposed",
        "F^(-1) stands where F^(-T) belongs.",
        "The derivative of det F are its cofactors, J F^(-T): look at F = diag and at a shear.",
        lambda a: Parts(a, np.linalg.inv(a.F)).hessian(),
    ),
    Mistake(
        "G held fixed",
        "F^(-T) is treated as a constant: it changes with F, too.",
        "From G F^T = I follows dG = -G dF^T G.",
        _hessians({"turn": 0, "less": 0}, {"turn": 0}, {"less": 0}),
    ),
    Mistake(
        "sign of dG",
        "The derivative of F^(-T) has the wrong sign.",
        "dG = -G dF^T G. Both of its terms carry the sign.",
        _hessians({"turn": -1, "less": -1}, {"turn": -1}, {"less": -1}),
    ),
    Mistake(
        "indices of dG",
        "The indices in the derivative of F^(-T) are in another order.",
        "dG_ij / dF_mn = -G_in G_mj: outer index with outer, inner with inner.",
        lambda a: tuple(
            _straight(*terms, indices)(a)
            for indices in (
                "bim,bjn",
                "bim,bnj",
                "bmi,bnj",
                "bmi,bjn",
                "bni,bjm",
                "bni,bmj",
                "bin,bjm",
                "bij,bmn",
            )
            for terms in ((1, 1), (1, 0), (0, 1))
        ),
    ),
    Mistake(
        "one of a pair",
        "F_ij G_mn and G_ij F_mn belong together: one of them is missing, or the matrix would be symmetric.",
        "The product rule meets J^(-2/3) in front of F, and tr(F^T F) in front of G.",
        _hessians({"fg": 0}, {"gf": 0}, {"fg": 2, "gf": 0}, {"fg": 0, "gf": 2}, {"fg": 0, "gf": 0}),
    ),
    Mistake(
        "identity missing",
        "The derivative of F itself is missing.",
        "dF_ij/dF_mn is 1 where i = m and j = n: the first term of P has it.",
        _hessians({"one": 0}, {"one": 0.5}, {"one": 2}),
    ),
    Mistake(
        "second derivative of J^(-2/3)",
        "The term with G_ij G_mn of the change of shape is missing, or wrong by a factor.",
        "J^(-2/3) before the bracket depends on F, too, where tr(F^T F) G is what it multiplies.",
        _hessians({"gg": 0}, {"gg": -1}, {"gg": 0.5}, {"gg": 2}, {"gg": 1.5}, {"gg": 3}),
    ),
    Mistake(
        "J(J - 1) held fixed",
        "In the term with D the factor J (J - 1) is not differentiated as a product.",
        "The derivative of J^2 - J in J is 2 J - 1.",
        lambda a: (
            Parts(a).hessian(more=0),
            *(
                a.right
                + 2 * _m(Parts(a).D * (new(Parts(a).J) - (2 * Parts(a).J - 1)) * Parts(a).J) * Parts(a).GG
                for new in (
                    lambda J: J,
                    lambda J: 1 + 0 * J,
                    lambda J: J - 1,
                    lambda J: 2 * J,
                    lambda J: 2 * J + 1,
                    lambda J: 2 * (J - 1),
                    lambda J: (2 * J - 1) / J,
                )
            ),
        ),
    ),
    Mistake(
        "derivative of the invariant",
        "The term with G_ij F_mn, from the derivative of tr(F^T F), is wrong by a factor or has the wrong sign.",
        "The derivative of tr(F^T F) by F_mn is 2 F_mn.",
        _hessians(*({"gf": factor} for factor in FACTORS)),
    ),
    Mistake(
        "derivative of the power",
        "The terms from the derivative of J^(-2/3), with F_ij G_mn, are wrong by a factor or have the wrong sign.",
        "The derivative of J^(-2/3) by F_mn is -2/3 J^(-2/3) G_mn.",
        _hessians(
            *({"fg": factor} for factor in FACTORS),
            *({"fg": factor, "gg": factor} for factor in (0.0, *FACTORS)),
        ),
    ),
    Mistake(
        "derivative of J",
        "The term with G_ij G_mn of the change of volume is wrong by a factor or has the wrong sign.",
        "It is 2 D (2 J - 1) J G_ij G_mn: the derivative of J by F_mn is J G_mn.",
        _hessians(*({"more": factor} for factor in FACTORS)),
    ),
    Mistake(
        "factor of dG",
        "A term from the derivative of F^(-T), with G_in G_mj, is wrong by a factor.",
        "dG_ij/dF_mn = -G_in G_mj, times what stands before G in each term.",
        _hessians(*({"turn": factor} for factor in FACTORS), *({"less": factor} for factor in FACTORS)),
    ),
    Mistake(
        "other numbers",
        "Rows or columns have other numbers than 3 i + j and 3 m + n: some entries lie on others, and some stay zero.",
        "Entry F_ij has the number 3 i + j, F_mn the number 3 m + n.",
        lambda a: tuple(
            made
            for number in NUMBERS
            for rows, columns in ((number, ROW_BY_ROW), (ROW_BY_ROW, number))
            for made in _numbered(a, rows, columns)
        ),
    ),
    Mistake(
        "un-barred",
        "This is the Hessian of the energy without J^(-2/3).",
        "J^(-2/3) depends on F, too: differentiate the product.",
        lambda a: (
            a.truth(C=0 * a.C) + 2 * _m(a.C) * Parts(a).eye,
            a.truth(C=0 * a.C) + 2 * _m(a.C * Parts(a).a) * Parts(a).eye,
        ),
    ),
    Mistake(
        "halved",
        "One of the factors 2 is missing.",
        "Both terms hold a square: each derivative brings a 2.",
        lambda a: (
            a.right / 2,
            a.truth(C=a.C / 2),
            a.truth(D=a.D / 2),
            a.right * 2,
            a.truth(C=a.C * 2),
            a.truth(D=a.D * 2),
        ),
    ),
    Mistake(
        "exchanged:C,D",
        "C and D are exchanged.",
        "C weighs the change of shape, D that of volume.",
        lambda a: a.truth(C=a.D, D=a.C),
    ),
    Mistake(
        "clamped",
        "Negative eigenvalues have been taken away, or small ones replaced.",
        "The projection is done later, and not by you: return the true second derivatives.",
        lambda a: (_clamped(a.right, 0.0, 0.0), _clamped(a.right, 1e-6, 1e-3), np.abs(a.right)),
    ),
)


def _clamped(H: np.ndarray, below: float, to: float) -> np.ndarray:
    """Eigenvalues below one number replaced by another."""
    values, V = np.linalg.eigh(H)
    return (V * np.where(values < below, to, values)[:, None, :]) @ transposed(V)


said_d2psi_dF2 = {
    **{
        f"{what} permuted:0,3,6,1,4,7,2,5,8": (
            f"The {what} are numbered column by column of F; asked is row by row.",
            "Entry F_ij has the number 3 i + j.",
        )
        for what in ("rows", "columns")
    },
    "swapped:C,D": ("C and D are exchanged.", "C weighs the change of shape, D that of volume."),
    "missing:C": ("The terms with C are missing.", "The first term resists a change of shape."),
    "missing:D": ("The terms with D are missing.", "The second term resists a change of volume."),
    "diagonal": ("", "Every entry of the stress depends on every entry of F, through J."),
    "upper triangle only": ("", "Second derivatives do not care about their order: the matrix is symmetric."),
    "lower triangle only": ("", "Second derivatives do not care about their order: the matrix is symmetric."),
}
