"""Reorientations by reaction wheels whose speeds have limits, the steps of a body with wheels stated anew with the momentum of
each wheel as a state, solved by CasADi + IPOPT (PyPI casadi 3.8).

Bodies, wheels, weights, momenta at the start and targets are drawn by lot. A step of length h exerts half of the torques u at each
end, on the wheels and oppositely on the body, and turns the body by cay(f) in between, while the wheels store s = A m:

    2 (J f + f x J f) + h (f x s - (f.s) f - |f|^2 s) = h (1 + |f|^2) P,    P the body's own angular momentum

A motor limits the speed at the end of a step, if the body turned by the reaction to that motor alone:

    |m/I - a.J^-1 P + h (1/I + a.J^-1 a) u| <= limit

The limit is 0.85 of what the cheapest turn without limits reaches. IPOPT starts from turns with detours; the least cost counts.
The shortest times, with a free step size, are those with torques up to the largest of the cheapest turn.
Run: python3 wheels.py > wheels.json
"""

import itertools
import json

import casadi as ca
import numpy as np

from constrained_control import cay, rotation, rotation_vector

N, DURATION = 40, 2.0
H = DURATION / N


def solve(case, limit, detours, most=None):
    """The least cost, or the shortest time with torques up to `most`, and the greatest speed and torque of its motors."""
    axes = np.array([wheel["axis"] for wheel in case["wheels"]]).T
    own = np.array([wheel["inertia"] for wheel in case["wheels"]])
    count = len(own)
    inertia = np.diag(case["inertia"]) - axes @ np.diag(own) @ axes.T
    inverse = np.linalg.inv(inertia)
    weights = np.array(case["weights"])
    r, p, m = ca.MX.sym("r", 9, N + 1), ca.MX.sym("p", 3, N + 1), ca.MX.sym("m", count, N + 1)
    f, u = ca.MX.sym("f", 3, N), ca.MX.sym("u", count, N)
    h = ca.MX.sym("h") if most else H
    sizes = (("h", 1), ("r", 9), ("p", 3), ("m", count), ("f", 3), ("u", count), ("R", 9), ("P", 3), ("M", count))
    h1, r0, p0, m0, f0, u0, r1, p1, m1 = (ca.SX.sym(*size) for size in sizes)
    J, A = ca.DM(inertia), ca.DM(axes)
    half = h1 / 2 * u0
    begun, stored = p0 - A @ half, A @ (m0 + half)
    jf, square = J @ f0, ca.dot(f0, f0)
    defect = ca.vertcat(
        2 * (jf + ca.cross(f0, jf)) + h1 * (ca.cross(f0, stored) - ca.dot(f0, stored) * f0 - square * stored)
        - h1 * (1 + square) * begun,
        r1 - ca.reshape(ca.reshape(r0, 3, 3) @ cay(f0), 9, 1),
        p1 - (cay(f0).T @ (begun + stored) - stored - A @ half),
        m1 - m0 - h1 * u0,
    )
    step = ca.Function("step", [h1, r0, p0, m0, f0, u0, r1, p1, m1], [defect]).map(N)
    target = rotation(np.array(case["turn"]))
    e = ca.DM(target).T @ ca.reshape(r[:, N], 3, 3)
    equal = ca.vertcat(
        ca.vec(step(ca.repmat(h, 1, N), r[:, :N], p[:, :N], m[:, :N], f, u, r[:, 1:], p[:, 1:], m[:, 1:])),
        r[:, 0] - np.eye(3).flatten("F"), p[:, 0], p[:, N], m[:, 0] - np.array(case["momenta"]),
        e[2, 1] - e[1, 2], e[0, 2] - e[2, 0], e[1, 0] - e[0, 1],
    )
    per_torque = 1 / own + np.einsum("ij,ik,kj->j", axes, inverse, axes)
    speed = ca.DM(np.diag(1 / own)) @ m[:, :N] - ca.DM(axes.T @ inverse) @ p[:, :N] + h * ca.DM(np.diag(per_torque)) @ u
    unequal = ca.vertcat(ca.vec(speed / limit - 1), ca.vec(-speed / limit - 1)) if limit else ca.MX(0, 1)
    cost = H / 2 * ca.sum1(ca.sum2(ca.repmat(ca.DM(weights), 1, N) * u**2))
    unknowns = (r, p, m, f, u)
    if most:
        cost = N * h
        unknowns = (*unknowns, h)
        # Much less than the duration of the cheapest turn is not enough.
        unequal = ca.vertcat(unequal, ca.vec(u / most - 1), ca.vec(-u / most - 1), 0.2 * DURATION - N * h)
    everything = ca.vertcat(*[ca.vec(part) for part in unknowns])
    options = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-11, "max_iter": 500,
                                              "constr_viol_tol": 1e-12, "bound_relax_factor": 0.0}}
    solver = ca.nlpsol("solver", "ipopt", {"x": everything, "f": cost, "g": ca.vertcat(equal, unequal)}, options)
    reached = ca.Function("reached", [everything], [speed, u])
    s = np.linspace(0, 1, N + 1)
    bend = 16 * s**2 * (1 - s) ** 2
    found = []
    for detour in detours:
        path = [rotation((3 * x**2 - 2 * x**3) * np.array(case["turn"])) @ rotation(b * np.array(detour))
                for x, b in zip(s, bend)]
        turns = np.array([rotation_vector(a.T @ b) for a, b in zip(path, path[1:])]).T
        spins = inertia @ turns / H
        spins = np.hstack([np.zeros((3, 1)), (spins[:, 1:] + spins[:, :-1]) / 2, np.zeros((3, 1))])
        guess = [np.array([q.flatten("F") for q in path]).T, spins, np.tile(np.array(case["momenta"])[:, None], N + 1),
                 turns / 2, np.zeros((count, N)), np.array([H])][:len(unknowns)]
        lower = np.concatenate([np.zeros(equal.numel()), np.full(unequal.numel(), -np.inf)])
        result = solver(x0=np.concatenate([part.flatten("F") for part in guess]), lbg=lower, ubg=0)
        arrived = np.trace(target.T @ np.array(result["x"])[9 * N:9 * N + 9].reshape(3, 3, order="F"))
        if solver.stats()["success"] and arrived > 2.99:
            largest = [float(np.abs(np.array(all)).max()) for all in reached(result["x"])]
            found.append((float(result["f"]), *largest))
    return min(found)


def shipped():
    """The satellite of scenes/wheel_slew_plan.toml without gravity: the unit of time is 30 s, that of inertia 0.3 kg m2."""
    time, inertia = 30.0, 0.3
    own, slant = 1.5e-4, np.sqrt(0.5)
    axes = slant * np.array([[1, 0, 1], [0, 1, 1], [-1, 0, 1], [0, -1, 1]])
    target = np.array([0.5, 0.6, -0.3, 0.5477225575051661])
    turn = 2 * np.arccos(target[0]) * target[1:] / np.linalg.norm(target[1:])
    case = {
        "inertia": [0.35 / inertia, 0.3 / inertia, 0.2 / inertia],
        "wheels": [{"axis": list(axis), "inertia": own / inertia} for axis in axes],
        "weights": [1.0] * 4,
        "momenta": [own * speed * time / inertia for speed in (150, -200, 150, 150)],
        "turn": list(turn),
    }
    detours = list(itertools.product((-0.5, 0.4), repeat=3))
    torque = 9e-4 * time**2 / inertia
    times = {"time": 220 * time, "free_time": None}
    return {name: time * solve(case, limit, detours, torque)[0] for name, limit in times.items()}


def main():
    lot = np.random.default_rng(21)
    detours = list(itertools.product((-0.5, 0.4), repeat=3))
    cases = []
    for at in range(12):
        count = 3 + at % 4
        a, b, c = 0.3 + lot.random(3)
        axes = lot.normal(size=(count, 3))
        axes /= np.linalg.norm(axes, axis=1)[:, None]
        case = {
            "inertia": [b + c, c + a, a + b],
            "wheels": [{"axis": list(axis), "inertia": 0.01 + 0.02 * lot.random()} for axis in axes],
            "weights": list(0.5 + lot.random(count)),
            "momenta": list(0.2 * (2 * lot.random(count) - 1)),
            "turn": list(lot.uniform(-1.2, 1.2, size=3)),
        }
        free, fastest, torque = solve(case, None, detours)
        limit = 0.85 * fastest
        cost, *_ = solve(case, limit, detours)
        free_time, *_ = solve(case, None, detours, torque)
        time, *_ = solve(case, limit, detours, torque)
        times = {"torque": torque, "free_time": free_time, "time": time}
        cases.append({**case, "limit": limit, "free": free, "cost": cost, **times})
    about = ("Reorientations from rest to rest by reaction wheels with limits of speed, in N = 40 steps of 0.05, by wheels.py (CasADi "
             "%s, IPOPT, tolerance 1e-11): `inertia` is that of body and wheels about the principal axes, `turn` the rotation "
             "vector of the target, `limit` that of all speeds, `free` the cost without it; `time` is the shortest with torques up "
             "to `torque`, `free_time` that without the limit of speeds." % ca.__version__)
    about += " `shipped` has the shortest times (s) of the turn of scenes/wheel_slew_plan.toml without gravity, in 40 steps."
    print(json.dumps({"about": about, "cases": cases, "shipped": shipped()}, indent=1))


if __name__ == "__main__":
    main()
