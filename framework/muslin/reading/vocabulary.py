"""What people call things elsewhere (NumPy, MATLAB, GLSL, Eigen), and what it is called here."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from types import ModuleType

#: Another library's name -> what to write.
INSTEAD = {
    "dot": "a.dot(b) for vectors, A @ B for matrices", "inner": "a.dot(b)", "vdot": "a.dot(b)",
    "matmul": "A @ B", "mm": "A @ B", "mul": "A @ B for matrices, a * b for numbers",
    "transpose": "A.transpose()", "T": "A.transpose(); for vectors a.dot(b) is a^T b, and a.outer_product(b) is a b^T",
    "transposed": "A.transpose()", "tr": "A.trace()",
    "cross": "a.cross(b)", "outer": "a.outer_product(b)", "outer_product": "a.outer_product(b)",
    "outerProduct": "a.outer_product(b)", "tensor": "a.outer_product(b)",
    "norm": "a.norm()", "length": "a.norm()", "magnitude": "a.norm()", "mag": "a.norm()", "len": "a.norm()",
    "norm2": "a.norm_sqr()", "sqr_norm": "a.norm_sqr()", "squaredNorm": "a.norm_sqr()", "squared_norm": "a.norm_sqr()",
    "norm_squared": "a.norm_sqr()", "length2": "a.norm_sqr()", "dot2": "a.norm_sqr()",
    "normalize": "n = m.normalized()", "normalise": "n = m.normalized()", "normalised": "n = m.normalized()",
    "unit_vector": "n = m.normalized()",
    "inv": "A.inverse()", "inverse": "A.inverse()", "pinv": "A.transpose() and A.inverse(): the normal equations",
    "det": "A.determinant()", "determinant": "A.determinant()", "trace": "A.trace()",
    "eye": "ti.Matrix.identity(float, 3)", "identity": "ti.Matrix.identity(float, 3)",
    "Identity": "ti.Matrix.identity(float, 3)", "I": "ti.Matrix.identity(float, 3)",
    "zeros": "ti.Matrix.zero(float, 3, 3), or ti.Vector([0.0, 0.0, 0.0])",
    "zero": "ti.Matrix.zero(float, 3, 3), or ti.Vector([0.0, 0.0, 0.0])", "ones": "ti.Vector([1.0, 1.0, 1.0])",
    "array": "ti.Vector([...]) or ti.Matrix([...])", "asarray": "ti.Vector([...]) or ti.Matrix([...])",
    "vector": "ti.Vector([a, b, c])", "vec": "ti.Vector([a, b, c])", "vec2": "ti.Vector([a, b])",
    "vec3": "ti.Vector([a, b, c])", "vec4": "ti.Vector([a, b, c, d])", "Vec3": "ti.Vector([a, b, c])",
    "matrix": "ti.Matrix([[a, b], [c, d]])", "mat": "ti.Matrix([[a, b], [c, d]])",
    "mat2": "ti.Matrix([[a, b], [c, d]])", "mat3": "ti.Matrix([[...], [...], [...]])",
    "diag": "diag(v), after from muslin.given import diag", "diagonal": "diag(v), after from muslin.given import diag",
    "svd": "svd(F, N), after from muslin.given import svd",
    "column_stack": "ti.Matrix.cols([a, b])", "hstack": "ti.Matrix.cols([a, b])", "columns": "ti.Matrix.cols([a, b])",
    "stack": "ti.Matrix.rows([a, b])", "vstack": "ti.Matrix.rows([a, b])", "concatenate": "ti.Matrix.rows([a, b])",
    "sum": "v.sum()", "mean": "v.sum() / 3", "prod": "v[0] * v[1] * v[2]",
    "square": "a ** 2", "sqr": "a ** 2", "power": "a ** b", "absolute": "abs(a)", "fabs": "abs(a)", "abs": "abs(a)",
    "maximum": "ti.max(a, b)", "fmax": "ti.max(a, b)", "amax": "v.max()", "minimum": "ti.min(a, b)",
    "fmin": "ti.min(a, b)", "amin": "v.min()", "clip": "ti.min(ti.max(a, low), high)",
    "clamp": "ti.min(ti.max(a, low), high)", "where": "ti.select(condition, a, b)",
    "arccos": "ti.acos", "arcsin": "ti.asin", "arctan2": "ti.atan2", "arctan": "ti.atan2", "sqrtf": "ti.sqrt",
    "isclose": "abs(a - b) < 1e-9", "allclose": "abs(a - b) < 1e-9", "isnan": "a test before the division",
    "row": "A[i, :]", "rowwise": "A[i, :]", "col": "A[:, j]", "column": "A[:, j]", "copy": "nothing: y = x is a copy",
    "shape": "the number itself: vectors have 3 entries here", "size": "the number itself: vectors have 3 entries here",
    "append": "all entries at once: ti.Vector([a, b, c])", "reshape": "the matrix at once: ti.Matrix([[...], [...]])",
    "flatten": "the entries: ti.Vector([A[0, 0], A[0, 1]])", "pi": "3.141592653589793", "einsum": "the sum itself",
    "array_equal": "a comparison of the entries", "hypot": "ti.sqrt(a * a + b * b)", "function": "ti.func",
}  # fmt: skip

#: Greek letters as they are called in code.
GREEK = {
    "\u03bc": "mu", "\u03bb": "lam", "\u03c6": "phi", "\u03c8": "psi", "\u03c1": "rho", "\u03c3": "s", "\u03b5": "eps",
    "\u03b1": "alpha", "\u03b2": "beta", "\u0394": "d", "\u2207": "grad_", "\u03a8": "psi", "\u03a6": "phi",
}  # fmt: skip


def near(word: str, words: Iterable[str]) -> str:
    """The word most like another, or nothing; a letter's case counts least."""
    pool = sorted(set(words) - {word})
    same = [other for other in pool if other.lower() == word.lower()]
    if not same and len(word) > 2:
        same = difflib.get_close_matches(word, pool, n=1, cutoff=0.7)
    if not same and len(word) > 2:
        lower = {other.lower(): other for other in pool}
        same = [lower[w] for w in difflib.get_close_matches(word.lower(), lower, n=1, cutoff=0.7)]
    return same[0] if same else ""


def taichi() -> ModuleType:
    """Taichi, to ask which names there are; it need not be started."""
    from muslin.base import engine

    module: ModuleType = engine.load()
    return module


def parts() -> frozenset[str]:
    """What may stand after the dot of a vector or matrix."""
    return frozenset(name for name in dir(taichi().Matrix) if not name.startswith("_")) | {"n", "m"}


def methods() -> list[str]:
    """The methods of vectors and matrices, without components like `xyz`."""
    return [name for name in parts() if len(name) > 2 and not set(name) <= set("xyzwrgbastpq")]
