"""S9: the filter of the lecture beside contacts that are part of the system: the energies of the same cloth.

A cloth falls on a ball twice, with your functions, and the total energy is recorded. Without the ball's friction and
with nothing driving it, it may only fall.
"""

import numpy as np

import muslin
from muslin.render import line_plot, write_png

f = muslin.load(".")
curves = {}
for contact in ("filter", "solve"):
    run = muslin.simulate("drape", functions=f, resolution=24, steps=120, contact=contact, friction=0.0)
    time, total = np.asarray(run.energies["time"]), np.asarray(run.energies["total"])
    curves[contact] = (time, total - total[0])
    print(
        f"{contact}: at most {max(total - total[0]):.2g} J above its start, at {time[total.argmax()]:.2f} s"
    )
picture = line_plot(curves, "A cloth falls on a ball", "time", "energy gained", x_unit="s", y_unit="J")
print("Drawn in", write_png("runs/experiments/contact.png", picture))
