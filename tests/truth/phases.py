"""Reference costs of transfers in phases: discrete problems in LGVI steps (3.22)-(3.26) whose constraints hold in some steps only and
whose commands are off in others, stated anew and solved by CasADi + IPOPT (PyPI casadi 3.8).

A phase has steps [from, to). Its limits hold on the commands of these steps and on the states from `from` to `to`, but for those that
start and target fix. One problem is solved for all its switching steps: the least of them is what a search should find.
Run: python3 phases.py > phases.json
"""

import json
import math

import casadi as ca
import numpy as np

from minimum_fuel import OPTIONS, PAIRS, circular, layout, rotation, skew


# The barrier ends at a complementarity of the tolerance, beside which the costs have to be large.
SCALE = 100.0


def solved(name, unknowns, cost, equal, bounds, guess):
    """Minimum of `cost` with `equal` = 0 and `bounds` <= 0, or None if IPOPT finds none."""
    options = {**OPTIONS, "ipopt": {**OPTIONS["ipopt"], "tol": 1e-10}}
    unequal = ca.vertcat(ca.MX(0, 1), *bounds)
    solver = ca.nlpsol("solver", "ipopt", {"x": unknowns, "f": SCALE * cost, "g": ca.vertcat(equal, unequal)}, options)
    lower = np.concatenate([np.zeros(equal.numel()), np.full(unequal.numel(), -np.inf)])
    found = solver(x0=guess, lbg=lower, ubg=0)
    return (float(found["f"]) / SCALE, found["x"]) if solver.stats()["return_status"] == "Solve_Succeeded" else None


def windows(case):
    """Each phase with its first step and that after its last."""
    ends = np.cumsum([0] + [phase["steps"] for phase in case["phases"]])
    assert ends[-1] == case["N"]
    return [(phase, int(begin), int(end)) for phase, begin, end in zip(case["phases"], ends, ends[1:])]


def point(case, start=None):
    """A mass about a center of strength gm under a force of any direction."""
    n, h, m, gm = case["N"], case["T"] / case["N"], case["mass"], case["gm"]
    x, p, f = (ca.MX.sym(s, 3, c) for s, c in (("x", n + 1), ("p", n + 1), ("f", n)))
    a, b, c, u, w = (ca.SX.sym(s, 3) for s in "abcuw")
    pull = lambda at: -gm * m * at / ca.norm_2(at) ** 3 if gm else ca.SX(3, 1)
    half = b + h / 2 * (pull(a) + w)
    step = ca.vertcat(c - a - h / m * half, u - half - h / 2 * (pull(c) + w))
    step = ca.Function("step", [a, b, c, u, w], [step]).map(n)
    ends = ca.vertcat(x[:, 0] - case["start"][0], p[:, 0] - m * np.array(case["start"][1]),
                      x[:, n] - case["end"][0], p[:, n] - m * np.array(case["end"][1]))
    equal = [ca.vec(step(x[:, :n], p[:, :n], x[:, 1:], p[:, 1:], f)), ends]
    bounds = []
    for phase, begin, end in windows(case):
        for k in range(begin, end):
            equal += [f[i, k] for i in phase.get("off", [])]
            if "force_norm" in phase:
                bounds.append(ca.sumsqr(f[:, k]) - phase["force_norm"] ** 2)
        for k in range(max(begin, 1), min(end, n - 1) + 1):
            if "keep_in_sphere" in phase:
                center, radius = phase["keep_in_sphere"]
                bounds.append((ca.sumsqr(x[:, k] - center) - radius**2) / radius**2)
            if "keep_out_sphere" in phase:
                center, radius = phase["keep_out_sphere"]
                bounds.append(radius**2 - ca.sumsqr(x[:, k] - center))
            if "speed" in phase:
                bounds.append(ca.sumsqr(p[:, k]) / m**2 - phase["speed"] ** 2)
            if "relative_speed" in phase:
                limit, origin, velocity, turn = phase["relative_speed"]
                arm = x[:, k] - (np.array(origin) + k * h * np.array(velocity))
                seen = p[:, k] / m - np.array(velocity) - ca.cross(ca.DM(turn), arm)
                bounds.append(ca.sumsqr(seen) - limit**2)
    unknowns = ca.vertcat(ca.vec(x), ca.vec(p), ca.vec(f))
    if start is None:
        t = np.linspace(0, 1, n + 1)
        path = np.outer(case["start"][0], 1 - t) + np.outer(case["end"][0], t)
        speed = np.outer(case["start"][1], 1 - t) + np.outer(case["end"][1], t)
        start = np.concatenate([path.flatten("F"), m * speed.flatten("F"), np.zeros(3 * n)])
        free = solved(case["name"], unknowns, h / 2 * ca.sumsqr(f), ca.vertcat(*equal[:2]), [], start)
        start = free[1] if free else start
    return solved(case["name"], unknowns, h / 2 * ca.sumsqr(f), ca.vertcat(*equal), bounds, start)


def body(case):
    """A rigid body at rest in free space with thrusters that turn with it, some of which are off in each phase."""
    n, h, limit, m = case["N"], case["T"] / case["N"], case["limit"], case["mass"]
    inertia = ca.DM(np.diag(case["inertia"]))
    places, ways = (np.array(case[key]) for key in ("positions", "directions"))
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
    off = [w[i, k] for phase, begin, end in windows(case) for k in range(begin, end) for i in phase.get("off", [])]
    bounds = [ca.vec(w) - limit, -ca.vec(w)]
    for phase, begin, end in windows(case):
        for k in range(max(begin, 1), min(end, n - 1) + 1):
            if "angular_rate" in phase:
                bounds.append(ca.sumsqr(ca.solve(inertia, pi[:, k])) - phase["angular_rate"] ** 2)
            if "keep_in_sphere" in phase:
                center, radius = phase["keep_in_sphere"]
                bounds.append((ca.sumsqr(x[:, k] - center) - radius**2) / radius**2)
    unknowns = ca.vertcat(*[ca.vec(part) for part in (x, p, r, pi, f, w)])
    t = np.linspace(0, 1, n + 1)
    turn = np.array(case["turn"])
    guess = np.concatenate([np.outer(case["move"], t).flatten("F"), np.zeros(3 * n + 3),
                            np.array([np.eye(3).flatten("F")] + [rotation(s * turn).flatten("F") for s in t[1:]]).flatten(),
                            np.tile(np.diag(case["inertia"]) @ turn / case["T"], n + 1),
                            np.tile(turn / n / 2, n), np.full(count * n, limit / 10)])
    cost = h / 2 * ca.sumsqr(w)
    free = solved(case["name"], unknowns, cost, ca.vertcat(ca.vec(steps), ends), bounds[:2], guess)
    return solved(case["name"], unknowns, cost, ca.vertcat(ca.vec(steps), ends, *off), bounds, free[1] if free else guess)


REST = [0.0, 0.0, 0.0]
POINTS = [
    {"name": "off in the middle", "N": 45, "T": 3.0, "mass": 2.0, "gm": 0.0, "start": [REST, REST], "end": [[1.0, 0.5, 0.0], REST],
     "phases": [{"steps": 15}, {"steps": 15, "off": [0, 1, 2]}, {"steps": 15}]},
    {"name": "hold, then a slow leg", "N": 60, "T": 6.0, "mass": 2.0, "gm": 0.0, "start": [[-3.0, 1.0, 0.5], REST],
     "end": [[0.2, 0.0, 0.0], REST],
     "phases": [{"steps": 26, "force_norm": 3.0, "keep_out_sphere": [[0.0, 0.0, 0.0], 0.8]},
                {"steps": 12, "keep_in_sphere": [[-1.2, 0.1, 0.0], 0.2]},
                {"steps": 22, "off": [1], "speed": 0.7}]},
    {"name": "about a center", "N": 60, "T": 2.5, "mass": 1.5, "gm": 1.0, "start": circular(1.0, 0.0), "end": circular(1.4, 1.9, 0.1),
     "phases": [{"steps": 20, "force_norm": 0.45}, {"steps": 17, "off": [0, 2]}, {"steps": 23, "speed": 0.9}]},
    {"name": "slowly to a frame that drifts and turns", "N": 60, "T": 6.0, "mass": 2.0, "gm": 0.0, "start": [[-3.0, 1.0, 0.5], REST],
     "end": [[0.5, 0.0, 0.1], [0.0, 0.25, 0.0]],
     "phases": [{"steps": 30}, {"steps": 30, "relative_speed": [0.4, [0.2, -0.6, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.5]]}]},
    {"name": "slow about a center beside a frame that turns fast", "N": 50, "T": 2.5, "mass": 1.5, "gm": 1.0,
     "start": circular(1.0, 0.0), "end": circular(1.4, 1.9, 0.1),
     "phases": [{"steps": 20}, {"steps": 30, "relative_speed": [0.5, [0.95, 1.57, -0.08], [-0.6, -0.1, 0.05], [0.3, -0.4, 1.1]]}]},
]
SMALL = [[0.0, -0.3, 0.0], 1.6]
BODIES = [
    {"name": "thrusters toward the target off at the end", "N": 60, "T": 6.0, "limit": 1.0, "mass": 2.0, "inertia": [1.0, 1.4, 1.9],
     "move": [0.9, -0.6, 0.4], "turn": [0.5, 0.3, -0.4], **layout(PAIRS),
     "phases": [{"steps": 25}, {"steps": 15, "angular_rate": 0.14}, {"steps": 20, "off": [0, 2, 5]}]},
    {"name": "coasting in the middle, held in a sphere", "N": 50, "T": 5.0, "limit": 1.5, "mass": 2.0, "inertia": [1.0, 1.4, 1.9],
     "move": [-0.4, 0.7, 0.5], "turn": [-0.2, 0.6, 0.3], **layout(PAIRS),
     "phases": [{"steps": 20}, {"steps": 10, "off": list(range(12))},
                {"steps": 20, "keep_in_sphere": [[-0.4, 0.7, 0.5], 0.3]}]},
]
SEARCH = {"name": "approach, hold, dock", "N": 24, "T": 6.0, "mass": 2.0, "gm": 0.0, "start": [[-3.0, 1.2, 0.4], [0.3, 0.5, 0.0]],
          "end": [[0.2, 0.0, 0.0], REST],
          "phases": [{"range": [5, 16]}, {"range": [4, 8], "keep_in_sphere": [[-1.2, 0.3, 0.0], 0.25]},
                     {"range": [4, 15], "off": [2], "speed": 0.9}]}


def drawn(seed):
    """A problem by lot: three phases, each with a limit or a component off, about a center."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(40, 71))
    first, second = sorted(int(k) for k in rng.integers(8, n - 8, 2))
    second = max(second, first + 5)
    angle = float(rng.uniform(0.8, 1.6))
    case = {"name": f"by lot {seed}", "N": n, "T": float(rng.uniform(1.5, 3.0)), "mass": float(rng.uniform(0.5, 3.0)), "gm": 1.0,
            "start": circular(1.0, 0.0), "end": circular(float(rng.uniform(0.9, 1.5)), angle, float(rng.uniform(-0.2, 0.2))),
            "phases": [{"steps": first}, {"steps": second - first}, {"steps": n - second}]}
    _, free = point(case)
    free = np.array(free).flatten()
    x, f = free[:3 * n + 3].reshape(n + 1, 3), free[6 * n + 6:].reshape(n, 3)
    for phase, begin, end in windows(case):
        kind = rng.integers(0, 4)
        if kind == 0:
            phase["off"] = [int(rng.integers(0, 3))]
        elif kind == 1:
            phase["force_norm"] = float(0.85 * np.linalg.norm(f[begin:end], axis=1).max())
        elif kind == 2 and 0 < begin and end < n:
            center = x[(begin + end) // 2] + rng.normal(size=3) * 0.05
            phase["keep_in_sphere"] = [center.tolist(), float(0.9 * np.linalg.norm(x[begin:end + 1] - center, axis=1).max())]
    return case


def searched(case):
    """The cost for all switching steps, or None where there is no plan."""
    ranges, costs, start = [phase["range"] for phase in case["phases"]], [], None
    for first in range(ranges[0][0], ranges[0][1] + 1):
        for hold in range(ranges[1][0], ranges[1][1] + 1):
            rest = case["N"] - first - hold
            if ranges[2][0] <= rest <= ranges[2][1]:
                phases = [{**phase, "steps": steps} for phase, steps in zip(case["phases"], (first, hold, rest))]
                found = point({**case, "phases": phases})
                costs.append([first, first + hold, found and found[0]])
    return costs


def main():
    points = [{**case, "cost": point(case)[0]} for case in POINTS]
    lots = [(case, point(case)) for case in map(drawn, [*range(2), *range(3, 16)])]
    points += [{**case, "cost": found[0]} for case, found in lots if found]
    bodies = [{**case, "cost": body(case)[0]} for case in BODIES]
    search = {**SEARCH, "costs": searched(SEARCH)}
    about = ("Costs of transfers in phases in N LGVI steps, by phases.py (CasADi %s, IPOPT, tolerance 1e-10). Points: position and "
             "velocity at both ends, forces of any direction; bodies: from rest at the origin to rest, moved and turned by a rotation "
             "vector, by thrusters within a limit. `off` are the components or thrusters that are off in a phase. Search: the cost "
             "by the first steps of the second and the third phase." % ca.__version__)
    print(json.dumps({"about": about, "points": points, "bodies": bodies, "search": search}, indent=1))


if __name__ == "__main__":
    main()
