"""S8: the singularity of the Hessian, approached.

Two stretches come closer and closer. The stiffness against turning one principal direction into the other has a limit,
2 mu here; three ways to compute it are held against that: the quotient as it stands on paper, the lecture's road with
your `d2psi_dFij`, and your closed form in `eigensystem`.
"""

import numpy as np

import muslin
from muslin import given
from muslin.render import line_plot, write_png

f = muslin.load(".")
mu, lam = 1000.0, 1500.0
gaps = 10.0 ** -np.linspace(0.5, 14, 55)
n = len(gaps)
s = np.stack([1.3 + gaps / 2, 1.3 - gaps / 2, np.ones(n)], axis=1)
rng = np.random.default_rng(8)
U, V = (R * np.linalg.det(R)[:, None, None] for R in np.linalg.qr(rng.normal(size=(2, n, 3, 3)))[0])
U, s, V = muslin.evaluate(given.svd, F=np.einsum("nik,nk,njk->nij", U, s, V), N=V[:, :, 2])

p = muslin.evaluate(f.dpsi_ds, s=s, mu=mu, lam=lam)
on_paper = (p[:, 0] - p[:, 1]) / (s[:, 0] - s[:, 1])

H = muslin.evaluate(f.d2psi_ds2, s=s, mu=mu, lam=lam)
closed = muslin.evaluate(f.eigensystem, s=s, dpsi_ds=p, d2psi_ds2=H)[:, 0]

apart = muslin.evaluate(given.split, s=s)
p, H = (muslin.evaluate(g, s=apart, mu=mu, lam=lam) for g in (f.dpsi_ds, f.d2psi_ds2))
flip = (U[:, :, 0, None] * V[:, None, :, 1] + U[:, :, 1, None] * V[:, None, :, 0]) / np.sqrt(2)
lecture = np.zeros(n)
for i, j in np.ndindex(3, 3):
    dU, ds, dV = muslin.evaluate(given.dsvd, U=U, s=s, V=V, i=np.full(n, i), j=np.full(n, j))
    column = muslin.evaluate(f.d2psi_dFij, U=U, V=V, dpsi_ds=p, d2psi_ds2=H, dU=dU, ds=ds, dV=dV)
    lecture += (flip * column).sum((1, 2)) * flip[:, i, j]

ways = {"quotient on paper": on_paper, "lecture's road": lecture, "your closed form": closed}
errors = {way: np.maximum(abs(value / (2 * mu) - 1), 1e-17) for way, value in ways.items()}
print("gap      ", *(f"{way:>20}" for way in ways))
for k in range(2, n, 8):
    print(f"{gaps[k]:.1e}  ", *(f"{error[k]:20.1e}" for error in errors.values()))
curves = {way: (gaps, error) for way, error in errors.items()}
picture = line_plot(curves, "Two stretches meet", "gap", "relative error", log_x=True, log_y=True)
print("Drawn in", write_png("runs/experiments/singularity.png", picture))
