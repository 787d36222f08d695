"""Steepest descent, in plain Python over NumPy arrays.  (S4)"""

import numpy as np


def descend(x, gradient, step):
    """x: array of 4 [m]; gradient: function x -> array of 4 [N]; step: [m/N]; returns the new x, and how far it is."""
    # begin solution: one step against the gradient
    way = step * gradient(x)
    return x - way, np.linalg.norm(way)
    # end solution
