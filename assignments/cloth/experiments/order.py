"""S10: the order of linearly implicit Euler, measured with your functions.

A small cloth swings for a tenth of a second, with ever smaller steps: longer, and folds make the motion chaotic. Each
run is held against one with much smaller steps.
"""

import numpy as np

import muslin
from muslin.render import line_plot, write_png

f = muslin.load(".")


def swung(steps):
    """Where the vertices are after 0.1 s."""
    return muslin.simulate("hang", functions=f, resolution=6, dt=0.1 / steps, steps=steps).x


truth = swung(2048)
steps = np.array([4, 8, 16, 32, 64])
errors = [np.linalg.norm(swung(k) - truth, axis=1).max() for k in steps]
print("dt [s]      error [m]   order")
for k, error in enumerate(errors):
    order = f"{np.log2(errors[k - 1] / error):.2f}" if k else ""
    print(f"{0.1 / steps[k]:<10.5f}  {error:<9.2e}   {order}")
curves = {"error": (0.1 / steps, errors), "order 1": (0.1 / steps, errors[0] * steps[0] / steps)}
picture = line_plot(
    curves, "A swinging cloth", "step", "error", "s", "m", log_x=True, log_y=True, markers=True
)
print("Drawn in", write_png("runs/experiments/order.png", picture))
