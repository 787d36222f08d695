"""Triangles that derivatives are taken on: fat ones, stretched ones, and deformed ones whose stretches lie apart."""

from __future__ import annotations

from typing import Any

import numpy as np

from muslin.judging.differences import CASES, flat, longest

Array = np.ndarray


def fattest(x0: Array, x1: Array, x2: Array) -> Array:
    """Numbers of the triangles that are least thin."""
    a, b = x1 - x0, x2 - x0
    height = np.linalg.norm(np.cross(a, b), axis=1) / longest(a, b, b - a) ** 2
    return np.argsort(-height, kind="stable")[:CASES]


def stretched(io: Any) -> dict[str, Array]:
    a = io.cases("dpsi_ds")
    far = np.argsort(-np.abs(a["s"] - 1).max(axis=1), kind="stable")[:CASES]
    return {key: value[far] for key, value in a.items()}


class Deformed:
    """Triangles with stretches well apart from each other and from 1."""

    def __init__(self, io: Any):
        from muslin import given
        from muslin.tasks.batch import evaluate

        rng = io.rng
        frames = [np.linalg.qr(rng.normal(size=(CASES, 3, 3)))[0] for _ in range(2)]
        R, Q = (f * np.sign(np.linalg.det(f))[:, None, None] for f in frames)
        s = np.stack([rng.uniform(1.3, 1.6, CASES), rng.uniform(0.6, 0.8, CASES), np.ones(CASES)], axis=1)
        self.F, self.N = (R * s[:, None, :]) @ Q.transpose(0, 2, 1), Q[:, :, 2]
        self.U, self.s, self.V = evaluate(given.svd, F=self.F, N=self.N)
        self.mu, self.lam = np.full(CASES, 1000.0), np.full(CASES, 1500.0)
        self.p = io.true("dpsi_ds", s=self.s, mu=self.mu, lam=self.lam)
        self.H = io.true("d2psi_ds2", s=self.s, mu=self.mu, lam=self.lam)

    def psi(self, io: Any, F: Array) -> Array:
        """Psi of F (c, k, 3, 3) through its singular values in the plane."""
        plane = F @ self.V[:, None, :, :2]
        s = np.linalg.svd(plane, compute_uv=False)
        s = np.concatenate([s, np.ones((*s.shape[:-1], 1))], axis=-1)
        return flat(
            lambda **v: io.best("psi", **v), F.shape[1],
            s=(s, True), mu=(self.mu, False), lam=(self.lam, False),
        )  # fmt: skip

    def stress(self, io: Any, F: Array) -> Array:
        """P of F (c, k, 3, 3): U diag(dpsi_ds) V^T with NumPy's decomposition, the normal's stretch last."""
        U, s, Vt = np.linalg.svd(F)
        last = np.abs(np.einsum("ckij,cj->cki", Vt, self.N)).argmax(axis=-1)
        order = np.argsort(np.arange(3) == last[..., None], axis=-1, kind="stable")
        s = np.take_along_axis(s, order, -1)
        U = np.take_along_axis(U, order[..., None, :], -1)
        Vt = np.take_along_axis(Vt, order[..., :, None], -2)
        p = flat(
            lambda **v: io.best("dpsi_ds", **v), F.shape[1],
            s=(s, True), mu=(self.mu, False), lam=(self.lam, False),
        )  # fmt: skip
        return (U * p[..., None, :]) @ Vt
