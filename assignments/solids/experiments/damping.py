"""S8: what backward Euler takes away.

A bar is wound up by an eighth of a turn and let go, with your functions, for a fifth of a second, with ever smaller
steps. A front runs along it, behind which it unwinds. Nothing rubs and nothing leaks: what the total energy loses, the
integrator has taken.
"""

import numpy as np

import muslin
from muslin.render import line_plot, write_png

f = muslin.load(".")
seconds = 0.2
steps = np.array([12, 24, 48, 96, 192])
curves, lost = {}, []
for k in steps:
    run = muslin.simulate(
        "twist", functions=f, resolution=3, turns=1 / 8, dt=seconds / k, steps=int(k), frame_every=1
    )
    total = np.asarray(run.energies["total"])
    lost.append(1 - total[-1] / total[0])
    curves[f"{k} steps"] = (np.asarray(run.energies["time"]), total / total[0])

print("dt [s]      lost in 0.2 s    of the step before")
for k, share in enumerate(lost):
    times = f"{share / lost[k - 1]:.2f}" if k else ""
    print(f"{seconds / steps[k]:<10.5f}  {100 * share:11.1f} %    {times}")
picture = line_plot(curves, "A bar is let go", "time", "energy, of the first", "s")
print("Drawn in", write_png("runs/experiments/damping.png", picture))
