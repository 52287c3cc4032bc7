"""Reference costs of transfers at minimum fuel: discrete problems in LGVI steps (3.22)-(3.26), stated anew and solved by
CasADi + IPOPT (PyPI casadi 3.8).

Unknowns are states, commands, Cayley vectors and, where the norm of a force has the price, its magnitude (direct
transcription). IPOPT solves the problem with a quadratic cost first and starts the one at minimum fuel from that solution.
Run: python3 minimum_fuel.py > minimum_fuel.json
"""

import json
import math

import casadi as ca
import numpy as np

OPTIONS = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-9, "max_iter": 3000,
                                          "constr_viol_tol": 1e-11, "bound_relax_factor": 0.0}}

# The barrier ends at a complementarity of the tolerance, beside which the costs have to be large.
SCALE = 30.0


def solved(name, unknowns, cost, equal, bounds, guess):
    """Minimum of `cost` with `equal` = 0 and `bounds` <= 0."""
    unequal = ca.vertcat(ca.MX(0, 1), *bounds)
    solver = ca.nlpsol("solver", "ipopt", {"x": unknowns, "f": SCALE * cost, "g": ca.vertcat(equal, unequal)}, OPTIONS)
    lower = np.concatenate([np.zeros(equal.numel()), np.full(unequal.numel(), -np.inf)])
    found = solver(x0=guess, lbg=lower, ubg=0)
    status = solver.stats()["return_status"]
    assert status == "Solve_Succeeded", (name, status)
    return float(found["f"]) / SCALE, found["x"]


def orbit(case):
    """A point mass about a center (GM = 1) with a force of any direction up to a limit, whose norm costs."""
    n, h, limit = case["N"], case["T"] / case["N"], case["limit"]
    x, p, f, size = (ca.MX.sym(s, k, c) for s, k, c in (("x", 3, n + 1), ("p", 3, n + 1), ("f", 3, n), ("t", 1, n)))
    a, b, c, u, v, w = (ca.SX.sym(s, 3) for s in "abcuvw")
    pull = lambda at: -at / ca.norm_2(at) ** 3
    half = b + h / 2 * (pull(a) + w)
    step = ca.vertcat(c - a - h * half, u - half - h / 2 * (pull(c) + w))
    step = ca.Function("step", [a, b, c, u, w], [step]).map(n)
    ends = ca.vertcat(x[:, 0] - case["start"][0], p[:, 0] - case["start"][1],
                      x[:, n] - case["end"][0], p[:, n] - case["end"][1])
    equal = ca.vertcat(ca.vec(step(x[:, :n], p[:, :n], x[:, 1:], p[:, 1:], f)), ends)
    unknowns = ca.vertcat(*[ca.vec(part) for part in (x, p, f, size)])
    angle = np.linspace(0, math.atan2(case["end"][0][1], case["end"][0][0]) % (2 * math.pi), n + 1)
    radius = np.linspace(np.linalg.norm(case["start"][0]), np.linalg.norm(case["end"][0]), n + 1)
    path = np.array([radius * np.cos(angle), radius * np.sin(angle), 0 * angle])
    speed = np.array([-np.sin(angle), np.cos(angle), 0 * angle]) / np.sqrt(radius)
    guess = np.concatenate([path.flatten("F"), speed.flatten("F"), np.zeros(3 * n), np.full(n, limit / 2)])
    norms = ca.vec(ca.sum1(f**2) - size**2)
    bounds = [norms, ca.vec(size) - limit, -ca.vec(size)]
    _, start = solved(case["name"], unknowns, h / 2 * ca.sumsqr(size), equal, bounds, guess)
    fuel, _ = solved(case["name"], unknowns, h * ca.sum2(size), equal, bounds, start)
    return fuel


def skew(v):
    return ca.vertcat(ca.horzcat(0, -v[2], v[1]), ca.horzcat(v[2], 0, -v[0]), ca.horzcat(-v[1], v[0], 0))


def rotation(v):
    angle = np.linalg.norm(v)
    s = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + math.sin(angle) / angle * s + (1 - math.cos(angle)) / angle**2 * s @ s


def thrusters(case):
    """A rigid body at rest in free space with thrusters that turn with it, each from 0 to a limit at its own price."""
    n, h, limit, m = case["N"], case["T"] / case["N"], case["limit"], case["mass"]
    inertia = ca.DM(np.diag(case["inertia"]))
    places, ways, prices = (np.array(case[key]) for key in ("positions", "directions", "prices"))
    forces, moments, count = ca.DM(ways.T), ca.DM(np.cross(places, ways).T), len(places)
    x, p, r, pi, f, w = (ca.MX.sym(s, k, c) for s, k, c in (
        ("x", 3, n + 1), ("p", 3, n + 1), ("r", 9, n + 1), ("l", 3, n + 1), ("f", 3, n), ("w", count, n)))
    a = [ca.SX.sym(s, k) for s, k in (("x", 3), ("p", 3), ("r", 9), ("l", 3), ("f", 3), ("w", count))]
    b = [ca.SX.sym(s, k) for s, k in (("X", 3), ("P", 3), ("R", 9), ("L", 3))]
    attitude, turned = ca.reshape(a[2], 3, 3), ca.reshape(b[2], 3, 3)
    turn = ca.DM.eye(3) + 2 / (1 + ca.dot(a[4], a[4])) * (skew(a[4]) + skew(a[4]) @ skew(a[4]))
    half, spin = a[1] + h / 2 * attitude @ forces @ a[5], a[3] + h / 2 * moments @ a[5]
    step = ca.vertcat(
        b[0] - a[0] - h / m * half,
        b[1] - half - h / 2 * turned @ forces @ a[5],
        b[2] - ca.reshape(attitude @ turn, 9, 1),
        b[3] - turn.T @ spin - h / 2 * moments @ a[5],
        h * (spin + ca.cross(spin, a[4]) + ca.dot(spin, a[4]) * a[4]) - 2 * inertia @ a[4],
    )
    step = ca.Function("step", a + b, [step]).map(n)
    steps = step(x[:, :n], p[:, :n], r[:, :n], pi[:, :n], f, w, x[:, 1:], p[:, 1:], r[:, 1:], pi[:, 1:])
    e = ca.DM(rotation(np.array(case["turn"]))).T @ ca.reshape(r[:, n], 3, 3)
    ends = ca.vertcat(x[:, 0], p[:, 0], r[:, 0] - np.eye(3).flatten("F"), pi[:, 0], x[:, n] - case["move"], p[:, n],
                      e[2, 1] - e[1, 2], e[0, 2] - e[2, 0], e[1, 0] - e[0, 1], pi[:, n])
    equal = ca.vertcat(ca.vec(steps), ends)
    unknowns = ca.vertcat(*[ca.vec(part) for part in (x, p, r, pi, f, w)])
    t = np.linspace(0, 1, n + 1)
    turn = np.array(case["turn"])
    guess = np.concatenate([np.outer(case["move"], t).flatten("F"), np.zeros(3 * n + 3),
                            np.array([np.eye(3).flatten("F")] + [rotation(s * turn).flatten("F") for s in t[1:]]).flatten(),
                            np.tile(np.diag(case["inertia"]) @ turn / case["T"], n + 1),
                            np.tile(turn / n / 2, n), np.full(count * n, limit / 10)])
    bounds = [ca.vec(w) - limit, -ca.vec(w)]
    weighted = ca.mtimes(ca.DM(prices).T, w)
    squares = ca.mtimes(ca.DM(prices).T, w**2)
    _, start = solved(case["name"], unknowns, h / (2 * limit) * ca.sum2(squares), equal, bounds, guess)
    fuel, _ = solved(case["name"], unknowns, h * ca.sum2(weighted), equal, bounds, start)
    return fuel


def circular(radius, angle, tilt=0.0):
    way = np.array([math.cos(angle), math.sin(angle), tilt])
    side = np.array([-math.sin(angle), math.cos(angle), 0.0])
    return [(radius * way).tolist(), (side / math.sqrt(radius)).tolist()]


PAIRS = [(arm * np.eye(3)[(axis + 1) % 3] * 0.8, sign * np.eye(3)[axis])
         for axis in range(3) for arm in (1, -1) for sign in (1, -1)]


def layout(all_):
    return {"positions": [p.tolist() for p, _ in all_], "directions": [(d / np.linalg.norm(d)).tolist() for _, d in all_]}


ORBITS = [
    {"name": "to a higher orbit", "N": 100, "T": 4.0, "limit": 0.4, "start": circular(1.0, 0.0), "end": circular(1.5, 2.5, 0.1)},
    {"name": "phasing", "N": 120, "T": 6.0, "limit": 0.1, "start": circular(1.0, 0.0), "end": circular(1.0, 5.6)},
]
BODIES = [
    {"name": "opposite thrusters", "N": 60, "T": 6.0, "limit": 1.0, "mass": 2.0, "inertia": [1.0, 1.4, 1.9],
     "prices": [1.0] * 12, "move": [0.9, -0.6, 0.4], "turn": [0.5, 0.3, -0.4], **layout(PAIRS)},
    {"name": "thrusters at different prices", "N": 60, "T": 5.0, "limit": 1.5, "mass": 2.0, "inertia": [1.0, 1.4, 1.9],
     "prices": [1.0, 1.5] * 6, "move": [-0.4, 0.7, 0.5], "turn": [-0.2, 0.6, 0.3], **layout(PAIRS)},
]


def main():
    orbits = [{**case, "fuel": orbit(case)} for case in ORBITS]
    bodies = [{**case, "fuel": thrusters(case)} for case in BODIES]
    about = ("Costs at minimum fuel of transfers in N LGVI steps, by minimum_fuel.py (CasADi %s, IPOPT, tolerance 1e-9). "
             "Orbits: position and momentum of a unit mass about GM = 1, limit of the force's norm. Bodies: from rest at the "
             "origin to rest, moved and turned by a rotation vector; thrusters with a limit and a price each."
             % ca.__version__)
    print(json.dumps({"about": about, "orbits": orbits, "bodies": bodies}, indent=1))


if __name__ == "__main__":
    main()
