#: Other energies that people write: (key, what it is, advice, energy of all three stretches).
WRONG: tuple[tuple[str, str, str, Any], ...]


def _differentiated(part: str, energy: Any) -> Any:
    """What a task's answer is with another energy."""
    parts = {"psi": lambda f, s: f(s), "dpsi_ds": gradient, "d2psi_ds2": hessian}

    def makes(a: Case) -> np.ndarray:
        def answer(s: Vector, mu: Any, lam: Any) -> Any:
            return parts[part](lambda t: energy(t, mu, lam), s)

        return answers(answer, {"s": a.s, "mu": a.mu, "lam": a.lam})[0]

    return makes


def _mistaken(part: str) -> tuple[Mistake, ...]:
    return tuple(Mistake(*said, _differentiated(part, energy)) for *said, energy in WRONG)


mistakes_psi = _mistaken("psi")

said_psi = {
    "missing:lam": ("The lam term is missing.", "The second term resists a change of size."),
    "missing:mu": ("The mu term is missing.", "The first term resists each stretch."),
}


mistakes_dpsi_ds = (
    *_mistaken("dpsi_ds"),
    Mistake(
        "missing chain rule",
        "The chain rule is missing: what stands inside a square depends on s in its own way.",
        "Differentiate the square, then multiply with the derivative of what is inside.",
        lambda a: (a.right / a.s, a.right / a.s[:, [1, 0, 2]]),
    ),
    Mistake(
        "stretches",
        "These are the stretches themselves, not the derivative of psi.",
        "Differentiate psi by s_0 with s_1 fixed.",
        lambda a: (a.s, a.s * np.array([1.0, 1.0, 0.0]), a.s - 1),
    ),
)

said_dpsi_ds = {
    "negated": (
        "This is minus the gradient.",
        "The gradient of psi points uphill; the sign of a force comes later.",
    ),
    "swapped components": ("The components are exchanged.", "Component 0 is the derivative by s_0."),
}


mistakes_d2psi_ds2 = (
    *_mistaken("d2psi_ds2"),
    Mistake(
        "third row and column",
        "There is something in the third row and column.",
        "psi does not contain s_2: what are its second derivatives by it?",
        lambda a: a.right + np.diag([0.0, 0.0, 1.0]),
    ),
    Mistake(
        "exchanged diagonal",
        "The two entries on the diagonal are exchanged.",
        "Entry 0, 0 is the second derivative by s_0.",
        lambda a: a.right + (a.right[:, [1, 0, 2]][:, :, [1, 0, 2]] - a.right) * np.eye(3),
    ),
)

said_d2psi_ds2 = {
    "upper triangle only": ("", "It does not matter which stretch comes first: the matrix is symmetric."),
    "lower triangle only": ("", "It does not matter which stretch comes first: the matrix is symmetric."),
    "diagonal only": (
        "The matrix is diagonal: the coupling of the stretches is missing.",
        "Differentiate the first component of the gradient by the other stretch.",
    ),
    "off the diagonal": ("", "Differentiate the first component of the gradient by the other stretch."),
}


conditions_psi = conditions_dpsi_ds = conditions_d2psi_ds2 = conditions_stretches
