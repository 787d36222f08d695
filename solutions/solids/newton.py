"""Newton's method with a backtracking line search, plain Python over NumPy arrays.  (S7; "Newton's Method")"""

import numpy as np


def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    """Where an objective is least, step by step from x.

    x          : array, where to begin [m]; leave it as it is
    objective  : function, x -> a number [J]; infinite where x is not allowed
    gradient   : function, x -> array like x [N]
    hessian    : function, x -> positive definite matrix [N/m]
    solve      : function, (H, b) -> array d with H d = b
    tolerance  : stop when the gradient is at most this long [N]
    most_steps : or after this many steps
    returns    : x, array [m]

    Of Newton's step take the whole, 1/2, 1/4 ...: the first part that lowers the objective by at least 1e-4 of what
    the slope promises for it.
    """
    # begin solution: gradient, stop?, direction d = solve(H, -g), halve the step until it is good enough, go
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        d = solve(hessian(x), -g)
        here, slope = objective(x), g @ d
        step = 1.0
        while not objective(x + step * d) <= here + 1e-4 * step * slope and step > 1e-10:
            step /= 2
        if step <= 1e-10 and np.isfinite(objective(x + d)):
            step = 1.0  # so near the minimum that rounding hides the way down: nothing is better than the whole step
        x = x + step * d
    return x
    # end solution
