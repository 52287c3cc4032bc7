"""Minimum times of reorientations in N LGVI steps, the steps (3.22)-(3.26) stated anew with a free step size and solved by
CasADi + IPOPT (PyPI casadi 3.8).

A body turns from rest to rest by an angle about a principal axis within limits of its moment, by component or by norm. Unknowns are
the step size, attitudes, angular momenta, Cayley vectors and moments of all steps. IPOPT starts from turns about the axis with
detours about both other axes; the shortest time found counts. Run: python3 minimum_time.py > minimum_time.json
"""

import itertools
import json
import math

import casadi as ca
import numpy as np

from constrained_control import cay, rotation, rotation_vector


def solve(case, n, detour):
    inertia, limit = ca.DM(np.diag(case["inertia"])), case["limit"]
    angle = np.linalg.norm(case["turn"])
    axis = np.array(case["turn"]) / angle
    duration = 2 * math.sqrt(angle * float(axis @ np.diag(case["inertia"]) @ axis) / min(limit))
    h = ca.MX.sym("h")
    r, p = ca.MX.sym("r", 9, n + 1), ca.MX.sym("p", 3, n + 1)
    f, u = ca.MX.sym("f", 3, n), ca.MX.sym("u", 3, n)
    names = (("h", 1), ("r", 9), ("p", 3), ("f", 3), ("u", 3), ("R", 9), ("P", 3))
    h1, r0, p0, f0, u0, r1, p1 = (ca.SX.sym(*name) for name in names)
    hp = h1 * (p0 + h1 / 2 * u0)
    turn = cay(f0)
    defect = ca.vertcat(
        hp + ca.cross(hp, f0) + ca.dot(hp, f0) * f0 - 2 * inertia @ f0,
        r1 - ca.reshape(ca.reshape(r0, 3, 3) @ turn, 9, 1),
        h1 * (p1 - h1 / 2 * u0) - turn.T @ hp,
    )
    step = ca.Function("step", [h1, r0, p0, f0, u0, r1, p1], [defect]).map(n)
    target = rotation(np.array(case["turn"]))
    e = ca.DM(target).T @ ca.reshape(r[:, n], 3, 3)
    equal = ca.vertcat(
        ca.vec(step(ca.repmat(h, 1, n), r[:, :n], p[:, :n], f, u, r[:, 1:], p[:, 1:])),
        r[:, 0] - np.eye(3).flatten("F"), p[:, 0], p[:, n],
        e[2, 1] - e[1, 2], e[0, 2] - e[2, 0], e[1, 0] - e[0, 1],
    )
    if case["kind"] == "moment_norm":
        unequal = ca.sum1(u**2).T - limit[0] ** 2
    else:
        unequal = ca.vertcat(ca.vec(u - ca.repmat(ca.DM(limit), 1, n)), ca.vec(-u - ca.repmat(ca.DM(limit), 1, n)))
    unknowns = (h, r, p, f, u)
    s = np.linspace(0, 1, n + 1)
    bend = 16 * s**2 * (1 - s) ** 2
    path = [rotation((3 * x**2 - 2 * x**3) * np.array(case["turn"])) @ rotation(b * np.array(detour))
            for x, b in zip(s, bend)]
    turns = np.array([rotation_vector(a.T @ b) for a, b in zip(path, path[1:])]).T
    spins = np.array(case["inertia"])[:, None] * turns * n / duration
    spins = np.hstack([np.zeros((3, 1)), (spins[:, 1:] + spins[:, :-1]) / 2, np.zeros((3, 1))])
    guess = [np.array([duration / n]), np.array([q.flatten("F") for q in path]).T, spins, turns / 2, np.zeros((3, n))]
    options = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-11, "max_iter": 500,
                                              "constr_viol_tol": 1e-12, "bound_relax_factor": 0.0}}
    # Half the time about the axis is not enough.
    unequal = ca.vertcat(unequal, duration / 2 - n * h)
    problem = {"x": ca.vertcat(*[ca.vec(part) for part in unknowns]), "f": n * h, "g": ca.vertcat(equal, unequal)}
    solver = ca.nlpsol("solver", "ipopt", problem, options)
    lower = np.concatenate([np.zeros(equal.numel()), np.full(unequal.numel(), -np.inf)])
    found = solver(x0=np.concatenate([part.flatten("F") for part in guess]), lbg=lower, ubg=0)
    # The attitude's condition also holds half a turn away from the target.
    reached = np.trace(target.T @ np.array(found["x"])[1 + 9 * n:10 + 9 * n].reshape(3, 3, order="F"))
    fine = solver.stats()["success"] and reached > 2.99
    return float(found["f"]) if fine else math.inf


HALF = math.pi
SYMMETRIC = [1.0, 1.0, 1.0]
CASES = [
    ("symmetric, 180 degrees", SYMMETRIC, [0.0, 0.0, HALF], "moment_components", [1.0] * 3, [50, 100]),
    ("symmetric, 90 degrees", SYMMETRIC, [0.0, 0.0, HALF / 2], "moment_components", [1.0] * 3, [50]),
    ("asymmetric, 150 degrees", [5621.0, 4547.0, 2364.0], [5 * HALF / 6, 0.0, 0.0], "moment_components", [50.0] * 3, [50, 100]),
    ("asymmetric under a norm", [1.0, 2.0, 2.6], [0.0, 1.2, 0.9], "moment_norm", [0.7], [50]),
]


def main():
    cases = []
    for name, inertia, turn, kind, limit, numbers in CASES:
        case = {"name": name, "inertia": inertia, "turn": turn, "kind": kind, "limit": limit}
        detours = list(itertools.product((-0.6, 0.4), repeat=3))
        times = {}
        for n in numbers:
            times[n] = min(solve(case, n, detour) for detour in detours)
        cases.append({**case, "times": times})
    about = ("Minimum times of turns from rest to rest in N LGVI steps, by minimum_time.py (CasADi %s, IPOPT, tolerance 1e-11): "
             "`turn` is the rotation vector of the target, `times` has T by N." % ca.__version__)
    print(json.dumps({"about": about, "cases": cases}, indent=1))


if __name__ == "__main__":
    main()
