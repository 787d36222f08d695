"""S3: what a forgotten derivative of the normal costs. (After S8.)

The stiffness of a triangle is minus the derivative of its forces. It is measured here from your forces by differences,
and put together as in S8, once with your `dn_dx` in dF/dq and once without.
"""

import numpy as np

import muslin
from muslin import given

f = muslin.load(".")
rng = np.random.default_rng(3)
n, mu, lam, h = 200, 1000.0, 1500.0, 1.0
X = rng.normal(size=(n, 3, 3))  # triangles, their vertices, x y z
x = X + 0.1 * rng.normal(size=X.shape)
N = np.cross(X[:, 1] - X[:, 0], X[:, 2] - X[:, 0])
area = np.linalg.norm(N, axis=1) / 2
N /= 2 * area[:, None]
dphi_dX = muslin.evaluate(f.dphi_dX, X0=X[:, 0], X1=X[:, 1], X2=X[:, 2])


def stretched(x):
    F = muslin.evaluate(f.deformation_gradient, x0=x[:, 0], x1=x[:, 1], x2=x[:, 2], dphi_dX=dphi_dX, N=N)
    return muslin.evaluate(given.svd, F=F, N=N)


def forces(x):
    U, s, V = stretched(x)
    P = muslin.evaluate(f.dpsi_dF, U=U, dpsi_ds=muslin.evaluate(f.dpsi_ds, s=s, mu=mu, lam=lam), V=V)
    grads = dphi_dX.transpose(1, 0, 2)
    return np.stack([muslin.evaluate(f.nodal_force, P=P, grad_phi=g, area=area, h=h) for g in grads], axis=1)


measured = np.zeros((n, 9, 9))
dF_dq = np.zeros((2, n, 3, 3, 9))  # without and with the part of the normal
for i, k in np.ndindex(3, 3):  # coordinate k of vertex i
    step = np.zeros((3, 3))
    step[i, k] = 1e-6
    measured[:, :, 3 * i + k] = (forces(x - step) - forces(x + step)).reshape(n, 9) / 2e-6
    dn_dx = muslin.evaluate(f.dn_dx, x0=x[:, 0], x1=x[:, 1], x2=x[:, 2], i=np.full(n, i))
    dF_dq[:, :, k, :, 3 * i + k] = dphi_dX[:, i]
    dF_dq[1, :, :, :, 3 * i + k] += dn_dx[:, :, k, None] * N[:, None, :]

U, s, V = stretched(x)
s = muslin.evaluate(given.split, s=s)
p, H = (muslin.evaluate(g, s=s, mu=mu, lam=lam) for g in (f.dpsi_ds, f.d2psi_ds2))
d2psi_dF2 = np.zeros((n, 3, 3, 3, 3))
for i, j in np.ndindex(3, 3):
    dU, ds, dV = muslin.evaluate(given.dsvd, U=U, s=s, V=V, i=np.full(n, i), j=np.full(n, j))
    d2psi_dF2[..., i, j] = muslin.evaluate(
        f.d2psi_dFij, U=U, V=V, dpsi_ds=p, d2psi_ds2=H, dU=dU, ds=ds, dV=dV
    )

for what, dF in zip(("without dn/dx", "with dn/dx"), dF_dq):
    K = h * area[:, None, None] * np.einsum("nija,nijkl,nklb->nab", dF, d2psi_dF2, dF)
    off = np.linalg.norm(K - measured, axis=(1, 2)) / np.linalg.norm(measured, axis=(1, 2))
    low, middle, high = np.quantile(off, (0.1, 0.5, 0.9))
    print(f"K {what:13}: off by {middle:.1e}, in eight of ten triangles by {low:.1e} to {high:.1e}")
