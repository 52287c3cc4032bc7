"""References with drag, stated anew: orbits by the Dormand-Prince method of scipy, transfers in the LGVI's steps by CasADi + IPOPT
(PyPI casadi 3.8), and Goddard's rocket in continuous time by collocation at Gauss-Legendre points, also by CasADi + IPOPT.

The density is rho_i exp(-(r - r_i)/H_i) in the layer i, the air turns with the angular velocity omega about the origin, and
F = -1/2 rho CdA |w| w with the velocity w relative to the air. A step: gas flows out for h/2, half an impulse, half of the drag, a
drift, half of the drag, half an impulse, gas flows out for h/2. Half of the drag divides w by 1 + kappa |w| h/2, where
kappa = rho CdA/(2 m).

Goddard's rocket: E. D. Dolan, J. J. More, T. S. Munson, "Benchmarking optimization software with COPS 3.0", ANL/MCS-273 (2004), whose
final height is 1.01283. Run: python3 drag.py > drag.json
"""

import json

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from minimum_fuel import solved

EARTH = {"gm": 3.986004415e14, "radius": 6371008.4, "omega": [0.0, 0.0, 2 * np.pi / 86164.0989]}
LAYERS = [[200e3, 2.789e-10], [250e3, 7.248e-11], [300e3, 2.418e-11], [350e3, 9.518e-12], [400e3, 3.725e-12], [450e3, 1.585e-12],
          [500e3, 6.967e-13]]
GODDARD = {"name": "Goddard", "gm": 1.0, "radius": 1.0, "omega": [0.0, 0.0, 0.0], "layers": [[0.0, 620.0]], "scale_height": 0.002,
           "area": 1.0, "mass": 1.0, "limit": 3.5, "exhaust_velocity": 0.5, "start": [[1.0, 0, 0], [0.0, 0, 0]]}


def density(air, distance):
    """Of a number."""
    layers = air["layers"]
    at = distance - air["radius"]
    which = max([i for i, layer in enumerate(layers) if layer[0] <= at], default=0)
    bottom, dense = layers[which]
    if which + 1 < len(layers):
        top, thin = layers[which + 1]
        height = (top - bottom) / np.log(dense / thin)
    else:
        height = air["scale_height"]
    return dense * np.exp(-(at - bottom) / height)


def orbit(case):
    """Position and velocity after a time, with half the largest step the same to the digits given."""
    omega = np.array(case["omega"])

    def rates(_, s):
        x, v = s[:3], s[3:]
        w = v - np.cross(omega, x)
        far = np.linalg.norm(x)
        slow = -0.5 * density(case, far) * case["area"] / case["mass"] * np.linalg.norm(w) * w
        return np.concatenate([v, -case["gm"] * x / far**3 + slow])

    def end(step):
        return solve_ivp(rates, (0, case["T"]), np.concatenate(case["start"]), method="DOP853", rtol=1e-13, atol=1e-9,
                         max_step=step).y[:, -1]

    one, two = end(2.0), end(1.0)
    return {"end": [two[:3].tolist(), two[3:].tolist()], "error": float(np.linalg.norm((one - two)[:3]))}


def plan(case, cost):
    """What a plan in N steps minimizes: the energy of a body of constant mass, or the propellant of an engine."""
    n, h, gm = case["N"], case["T"] / case["N"], case["gm"]
    full, c = case["mass"], case.get("exhaust_velocity", np.inf)
    x, p, m, f, q = (ca.MX.sym(s, k, n + e) for s, k, e in (("x", 3, 1), ("p", 3, 1), ("m", 1, 1), ("f", 3, 0), ("q", 1, 0)))
    a = [ca.SX.sym(s, k) for s, k in (("x", 3), ("p", 3), ("m", 1), ("f", 3), ("q", 1))]
    b = [ca.SX.sym(s, k) for s, k in (("X", 3), ("P", 3), ("M", 1))]
    (bottom, dense), = case["layers"]
    omega = ca.DM(case["omega"])

    def slowed(at, momentum, mass):
        wind = ca.cross(omega, at)
        w = momentum / mass - wind
        kappa = 0.5 * dense * case["area"] / mass * ca.exp(-(ca.norm_2(at) - case["radius"] - bottom) / case["scale_height"])
        return mass * (wind + w / (1 + h / 2 * kappa * ca.sqrt(ca.sumsqr(w) + 1e-24)))

    pull = lambda at, mass: -gm * mass * at / ca.norm_2(at) ** 3
    mass = a[2] - h / 2 * a[4] / c
    begun = slowed(a[0], a[1] * mass / a[2] + h / 2 * (a[3] + pull(a[0], mass)), mass)
    last = slowed(b[0], begun, mass) + h / 2 * (a[3] + pull(b[0], mass))
    step = ca.vertcat(b[0] - a[0] - h / mass * begun, b[1] - last * b[2] / mass, b[2] - mass + h / 2 * a[4] / c)
    step = ca.Function("step", a + b, [step]).map(n)
    steps = step(x[:, :n], p[:, :n], m[:, :n], f, q, x[:, 1:], p[:, 1:], m[:, 1:])
    (x0, v0), (x1, v1) = case["start"], case["end"]
    ends = [x[:, 0] - x0, p[:, 0] - full * np.array(v0), m[0] - full, x[:, n] - x1, p[:, n] - m[n] * np.array(v1)]
    equal = ca.vertcat(ca.vec(steps), *ends)
    unknowns = ca.vertcat(*[ca.vec(part) for part in (x, p, m, f, q)])
    t = np.linspace(0, 1, n + 1)[:, None]
    path = (1 - t) * np.array(x0) + t * np.array(x1)
    limit = case.get("limit", 1.0)
    speed = (np.array(x1) - np.array(x0)) / case["T"]
    masses = full * (1 - 0.3 * t[:, 0]) if cost == "fuel" else np.full(n + 1, full)
    guess = np.concatenate([path.flatten(), (masses[:, None] * speed).flatten(), masses, np.full(3 * n, limit / 8), np.full(n, limit / 4)])
    if cost == "energy":
        value, _ = solved(case["name"], unknowns, h / 2 * ca.sumsqr(f) + ca.sumsqr(q), equal, [], guess)
        return value
    norm, bounds = ca.vec(ca.sum1(f * f) - q * q), [ca.vec(q) - limit, -ca.vec(q)]
    _, at = solved(case["name"], unknowns, h / 2 * ca.sumsqr(f), ca.vertcat(equal, norm), bounds, guess)
    # In proportion to the mass, as the planner minimizes it.
    part = h / c * ca.sum2(q * full / (m[:n] - h / 2 * q / c))
    value, at = solved(case["name"], unknowns, part, equal, [norm, *bounds], at)
    return {"minimum": value, "propellant": full - float(ca.Function("left", [unknowns], [m[n]])(at))}


def highest(case, n, degree=3):
    """The greatest height of Goddard's rocket with the propellant 0.4, and the time that it takes."""
    points = np.array(ca.collocation_points(degree, "legendre"))
    nodes = np.append(0.0, points)
    basis = [np.poly1d([1.0])] * (degree + 1)
    for j in range(degree + 1):
        for k in range(degree + 1):
            if k != j:
                basis[j] = np.poly1d([1, -nodes[k]]) * basis[j] / (nodes[j] - nodes[k])
    slopes = np.array([[np.polyder(one)(point) for point in points] for one in basis])
    ends = np.array([one(1.0) for one in basis])
    state, force = ca.SX.sym("s", 3), ca.SX.sym("f")
    height, speed, mass = state[0], state[1], state[2]
    drag = 0.5 * 620.0 * speed**2 * ca.exp(-(height - 1) / 0.002)
    rates = ca.Function("rates", [state, force], [ca.vertcat(speed, (force - drag) / mass - 1 / height**2, -force / 0.5)])
    opti = ca.Opti()
    time = opti.variable()
    at = opti.variable(3, n + 1)
    inner = [opti.variable(3, n) for _ in points]
    forces = opti.variable(1, n)
    h = time / n
    for j, point in enumerate(inner):
        own = at[:, :n] * slopes[0, j]
        for i, other in enumerate(inner):
            own += other * slopes[i + 1, j]
        opti.subject_to(own == h * rates.map(n)(point, forces))
    end = at[:, :n] * ends[0]
    for i, other in enumerate(inner):
        end += other * ends[i + 1]
    opti.subject_to(at[:, 1:] == end)
    opti.subject_to(at[:, 0] == [1, 0, 1])
    opti.subject_to(at[2, n] == 0.6)
    opti.subject_to(opti.bounded(0, forces, 3.5))
    opti.subject_to(opti.bounded(0.1, time, 0.3))
    opti.minimize(-at[0, n])
    t = np.linspace(0, 1, n + 1)
    opti.set_initial(time, 0.2)
    opti.set_initial(at, np.array([1 + 0.012 * t, 0.3 * t * (1 - t), 1 - 0.4 * t]))
    for point in inner:
        opti.set_initial(point, np.array([1 + 0.012 * t, 0.3 * t * (1 - t), 1 - 0.4 * t])[:, :n])
    opti.set_initial(forces, 1.0)
    opti.solver("ipopt", {"print_time": False}, {"print_level": 0, "tol": 1e-10, "max_iter": 3000, "sb": "yes"})
    found = opti.solve()
    return {"height": float(found.value(at[0, n])), "T": float(found.value(time))}


def at_random(seed):
    rng = np.random.default_rng(seed)
    way = lambda size: (rng.uniform(-1, 1, 3) * size).tolist()
    start = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]
    turn = 0.8
    end = [[np.cos(turn), np.sin(turn), 0.0], [-np.sin(turn), np.cos(turn), 0.0]]
    start, end = [[(np.array(v) + way(0.1)).tolist() for v in both] for both in (start, end)]
    return {"name": f"at random {seed}", "gm": 1.0, "radius": 0.9, "omega": way(0.3), "layers": [[0.05, 0.8 + rng.uniform()]],
            "scale_height": 0.1, "area": 0.8 + rng.uniform(), "mass": 1.5, "N": 40, "T": 1.0, "start": start, "end": end}


def main():
    base = {**EARTH, "layers": LAYERS, "scale_height": 63822.0, "area": 4.4, "mass": 120.0}
    far = EARTH["radius"] + 300e3
    speed = (EARTH["gm"] / far) ** 0.5
    tilt = np.radians(51.6)
    circular = [[far, 0.0, 0.0], [0.0, speed * np.cos(tilt), speed * np.sin(tilt)]]
    low = EARTH["radius"] + 240e3
    fast = (EARTH["gm"] * (2 / low - 2 / (2 * EARTH["radius"] + 240e3 + 700e3))) ** 0.5
    eccentric = [[0.0, low, 0.0], [-fast * np.cos(1.7), 0.0, fast * np.sin(1.7)]]
    one = {**base, "layers": [[300e3, 2.418e-11]], "scale_height": 53628.0}
    orbits = [{**one, "name": "circular", "T": 43200.0, "start": circular},
              {**base, "name": "eccentric", "T": 43200.0, "start": eccentric}]
    orbits = [{**case, **orbit(case)} for case in orbits]
    top = highest(GODDARD, 600)
    goddard = {**GODDARD, **top, "N": 100, "end": [[top["height"], 0, 0], [0.0, 0, 0]]}
    goddard["fuel"] = plan(goddard, "fuel")
    transfers = [at_random(seed) for seed in range(1, 6)]
    transfers = [{**case, "energy": plan(case, "energy")} for case in transfers]
    about = ("Orbits and transfers with drag, and Goddard's rocket, by drag.py (scipy DOP853; CasADi %s, IPOPT). Units: those of each case; "
             "orbits in SI." % ca.__version__)
    print(json.dumps({"about": about, "orbits": orbits, "transfers": transfers, "goddard": goddard}, indent=1))


if __name__ == "__main__":
    main()
