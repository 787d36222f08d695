# ruff: noqa
# wrong: x-comes-back | cause: echo:x
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        d = solve(hessian(x), -g)
        here, slope = objective(x), g @ d
        step = 1.0
        while objective(x + step * d) > here + 1e-4 * step * slope and step > 1e-10:
            step /= 2
        new = x + step * d
    return x


# wrong: no-line-search | cause: no line search
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        d = solve(hessian(x), -g)
        here, slope = objective(x), g @ d
        step = 1.0
        x = x + step * d
    return x


# wrong: any-decrease | cause: any decrease
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        d = solve(hessian(x), -g)
        here, slope = objective(x), g @ d
        step = 1.0
        while objective(x + step * d) > here and step > 1e-10:
            step /= 2
        x = x + step * d
    return x


# wrong: slope-added | cause: any decrease
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        d = solve(hessian(x), -g)
        here, slope = objective(x), g @ d
        step = 1.0
        while objective(x + step * d) > here - 1e-4 * step * slope and step > 1e-10:
            step /= 2
        x = x + step * d
    return x


# wrong: one-step | cause: one step
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    for _ in range(1):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        d = solve(hessian(x), -g)
        here, slope = objective(x), g @ d
        step = 1.0
        while objective(x + step * d) > here + 1e-4 * step * slope and step > 1e-10:
            step /= 2
        x = x + step * d
    return x


# wrong: uphill | cause: echo:x
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        d = solve(hessian(x), g)
        here, slope = objective(x), g @ d
        step = 1.0
        while objective(x + step * d) > here + 1e-4 * step * slope and step > 1e-10:
            step /= 2
        x = x + step * d
    return x


# wrong: uphill-without-line-search | cause: uphill
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        d = solve(hessian(x), g)
        here, slope = objective(x), g @ d
        step = 1.0
        x = x + step * d
    return x


# wrong: steepest-descent | cause: steepest descent
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        d = -g
        here, slope = objective(x), g @ d
        step = 1.0
        while objective(x + step * d) > here + 1e-4 * step * slope and step > 1e-10:
            step /= 2
        x = x + step * d
    return x


# wrong: hessian-of-the-start | cause: hessian of the start
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    H = hessian(x)
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        d = solve(H, -g)
        here, slope = objective(x), g @ d
        step = 1.0
        while objective(x + step * d) > here + 1e-4 * step * slope and step > 1e-10:
            step /= 2
        x = x + step * d
    return x


# wrong: all-of-the-start | cause: gradient of the start
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    g, H = gradient(x), hessian(x)
    for _ in range(most_steps):
        if np.linalg.norm(g) <= tolerance:
            break
        d = solve(H, -g)
        here, slope = objective(x), g @ d
        step = 1.0
        while not objective(x + step * d) <= here + 1e-4 * step * slope and step > 1e-10:
            step /= 2
        x = x + step * d
    return x


# wrong: too-much-asked | cause: echo:x
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        d = solve(hessian(x), -g)
        here, slope = objective(x), g @ d
        step = 1.0
        while objective(x + step * d) > here + step * slope and step > 1e-10:
            step /= 2
        x = x + step * d
    return x


# wrong: step-stays-short | cause: short steps for ever
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    step = 1.0
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        d = solve(hessian(x), -g)
        here, slope = objective(x), g @ d
        while objective(x + step * d) > here + 1e-4 * step * slope and step > 1e-10:
            step /= 2
        x = x + step * d
    return x


# wrong: half-a-step | cause: half a step
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        d = solve(hessian(x), -g)
        here, slope = objective(x), g @ d
        step = 0.5
        x = x + step * d
    return x


# wrong: infinity-taken-for-less | cause: no line search
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    for _ in range(most_steps):
        g = gradient(x)
        if np.linalg.norm(g) <= tolerance:
            break
        d = solve(hessian(x), -g)
        here, slope = objective(x), g @ d
        step = 1.0
        while objective(x + step * d) == np.inf and step > 1e-10:
            step /= 2
        x = x + step * d
    return x


# wrong: first-entry-only | cause: one entry of the gradient
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    for _ in range(most_steps):
        g = gradient(x)
        if abs(g[0]) <= tolerance:
            break
        d = solve(hessian(x), -g)
        here, slope = objective(x), g @ d
        step = 1.0
        while objective(x + step * d) > here + 1e-4 * step * slope and step > 1e-10:
            step /= 2
        x = x + step * d
    return x


# wrong: last-entry-only | cause: one entry of the gradient
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    for _ in range(most_steps):
        g = gradient(x)
        if abs(g[-1]) <= tolerance:
            break
        d = solve(hessian(x), -g)
        here, slope = objective(x), g @ d
        step = 1.0
        while objective(x + step * d) > here + 1e-4 * step * slope and step > 1e-10:
            step /= 2
        x = x + step * d
    return x


# wrong: smallest-entry | cause: one entry of the gradient
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    for _ in range(most_steps):
        g = gradient(x)
        if np.abs(g).min() <= tolerance:
            break
        d = solve(hessian(x), -g)
        here, slope = objective(x), g @ d
        step = 1.0
        while objective(x + step * d) > here + 1e-4 * step * slope and step > 1e-10:
            step /= 2
        x = x + step * d
    return x


# right: with-a-for-loop
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    for _ in range(most_steps):
        g = gradient(x)
        if np.sqrt(np.sum(g**2)) <= tolerance:
            return x
        d = -solve(hessian(x), g)
        f, step = objective(x), 1.0
        for _ in range(40):
            if objective(x + step * d) <= f + 1e-4 * step * np.dot(g, d):
                break
            step *= 0.5
        x = x + step * d
    return x


# right: while-it-is-long
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    steps = 0
    g = gradient(x)
    while steps < most_steps and np.linalg.norm(g) > tolerance:
        d = solve(hessian(x), -g)
        step = 1.0
        new = x + d
        while not objective(new) <= objective(x) + 1e-4 * step * (g @ d):
            step = step / 2
            if step < 1e-12:
                return x
            new = x + step * d
        x, g, steps = new, gradient(new), steps + 1
    return x


# right: in-place-on-a-copy
def newtons_method(x, objective, gradient, hessian, solve, tolerance, most_steps):
    x = x.copy()
    for _ in range(most_steps):
        g = gradient(x)
        if g @ g <= tolerance**2:
            break
        d = solve(hessian(x), -g)
        step = 1.0
        while step > 1e-10 and (objective(x + step * d) - objective(x)) > 1e-4 * step * (g @ d):
            step *= 0.5
        x += step * d
    return x
