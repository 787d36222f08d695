"""Attack 19: a derivative by finite differences, or a library call, where the derivation is asked.

Defence: a policy, not a trick: the limit is finer than plain differences with a small step reach. Those that are exact
(large steps of a polynomial, complex steps) pass, and are against the rules of the course; a library call that is right
is a right answer. Nothing is refused silently.
"""

FD = """
import taichi as ti

@ti.func
def value(s, mu, lam):
    d = s - ti.Vector([1.0, 1.0, 1.0])
    t = d.sum()
    return mu * d.dot(d) + 0.5 * lam * t * t

@ti.func
def dpsi_ds(s, mu, lam):
    e = 1e-6
    g = ti.Vector([0.0, 0.0, 0.0])
    for k in ti.static(range(3)):
        u = s
        l = s
        u[k] += e
        l[k] -= e
        g[k] = (value(u, mu, lam) - value(l, mu, lam)) / (2 * e)
    return g
"""


def test_finite_differences_are_not_exact_enough(attack):
    record = attack({"strain_energy.py": FD}, spoils=("right_cauchy_green", "psi", "dpsi_ds", "d2psi_ds2"))
    assert record["dpsi_ds"].score == 0
