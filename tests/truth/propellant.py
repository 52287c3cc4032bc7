"""Reference costs of transfers by thrusters that use propellant: discrete problems in LGVI steps with the mass as a state, stated
anew and solved by CasADi + IPOPT (PyPI casadi 3.8).

Unknowns are states, masses, forces of the thrusters and Cayley vectors (direct transcription). A step: gas flows out for h/2, half
an impulse of thrust, a drift, half an impulse, gas flows out for h/2. Inertia is in proportion to the mass. Gas that leaves a body that
turns exerts the Coriolis force and the jet damping, by the trapezoidal rule. IPOPT solves the problem with a quadratic cost first
and starts the one at minimum fuel from that solution.
Run: python3 propellant.py > propellant.json
"""

import json

import casadi as ca
import numpy as np

from minimum_fuel import PAIRS, circular, layout, rotation, skew, solved


def outflow(state, inertia, out, dt):
    """Momenta, velocity kept, after gas has flowed out for dt: of a body of mass m, whose inertia is m times `inertia`."""
    p, r, pi, m = state
    flow, lever, damping = out
    left = m - dt * flow
    rate = ca.solve(inertia, pi) / m
    damping = dt / 2 * damping
    after = ca.solve(left * inertia + damping, pi - damping @ rate)
    coriolis = dt * ca.cross(rate + after, lever) / ((m + left) / 2)
    return left * (p / m - r @ coriolis), left * inertia @ after, left


def plan(case):
    """A body with thrusters that turn with it, each from 0 to a limit, at rest at both ends or in circular orbits about GM."""
    n, h, limit, gm = case["N"], case["T"] / case["N"], case["limit"], case["gm"]
    full = case["mass"]
    inertia = ca.DM(np.diag(case["inertia"])) / full
    places, ways = (np.array(case[key]) for key in ("positions", "directions"))
    flows = np.full(len(places), 1 / case["exhaust_velocity"])
    forces, moments, count = ca.DM(ways.T), ca.DM(np.cross(places, ways).T), len(places)
    x, p, r, pi, m, f, w = (ca.MX.sym(s, k, c) for s, k, c in (
        ("x", 3, n + 1), ("p", 3, n + 1), ("r", 9, n + 1), ("l", 3, n + 1), ("m", 1, n + 1), ("f", 3, n), ("w", count, n)))
    a = [ca.SX.sym(s, k) for s, k in (("x", 3), ("p", 3), ("r", 9), ("l", 3), ("m", 1), ("f", 3), ("w", count))]
    b = [ca.SX.sym(s, k) for s, k in (("X", 3), ("P", 3), ("R", 9), ("L", 3), ("M", 1))]
    attitude, turned = ca.reshape(a[2], 3, 3), ca.reshape(b[2], 3, 3)
    turn = ca.DM.eye(3) + 2 / (1 + ca.dot(a[5], a[5])) * (skew(a[5]) + skew(a[5]) @ skew(a[5]))
    each = ca.DM(flows) * a[6]
    damping = sum((each[i] * (np.dot(q, q) * np.eye(3) - np.outer(q, q)) for i, q in enumerate(places)), ca.SX.zeros(3, 3))
    out = ca.sum1(each), ca.DM(places.T) @ each, damping
    pull = (lambda at, mass: -gm * mass * at / ca.norm_2(at) ** 3) if gm else (lambda at, mass: ca.SX.zeros(3))
    start, spin, mass = outflow((a[1], attitude, a[3], a[4]), inertia, out, h / 2)
    half = start + h / 2 * (attitude @ forces @ a[6] + pull(a[0], mass))
    spin = spin + h / 2 * moments @ a[6]
    end = half + h / 2 * (turned @ forces @ a[6] + pull(b[0], mass)), turned, turn.T @ spin + h / 2 * moments @ a[6], mass
    last = outflow(end, inertia, out, h / 2)
    step = ca.vertcat(
        b[0] - a[0] - h / mass * half,
        b[1] - last[0],
        b[2] - ca.reshape(attitude @ turn, 9, 1),
        b[3] - last[1],
        b[4] - last[2],
        h * (spin + ca.cross(spin, a[5]) + ca.dot(spin, a[5]) * a[5]) - 2 * mass * inertia @ a[5],
    )
    step = ca.Function("step", a + b, [step]).map(n)
    steps = step(x[:, :n], p[:, :n], r[:, :n], pi[:, :n], m[:, :n], f, w,
                 x[:, 1:], p[:, 1:], r[:, 1:], pi[:, 1:], m[:, 1:])
    final = rotation(np.array(case["turn"]))
    e = ca.DM(final).T @ ca.reshape(r[:, n], 3, 3)
    spins = [np.array(spin) for spin in case["spins"]]
    (x0, v0), (x1, v1) = case["start"], case["end"]
    ends = ca.vertcat(
        x[:, 0] - x0, p[:, 0] - full * np.array(v0), r[:, 0] - np.eye(3).flatten("F"),
        pi[:, 0] - full * inertia @ spins[0], m[0] - full,
        x[:, n] - x1, p[:, n] - m[n] * np.array(v1), e[2, 1] - e[1, 2], e[0, 2] - e[2, 0], e[1, 0] - e[0, 1],
        pi[:, n] - m[n] * inertia @ spins[1])
    equal = ca.vertcat(ca.vec(steps), ends)
    unknowns = ca.vertcat(*[ca.vec(part) for part in (x, p, r, pi, m, f, w)])
    t = np.linspace(0, 1, n + 1)
    turn = np.array(case["turn"])
    path = np.array([(1 - s) * np.array(x0) + s * np.array(x1) for s in t])
    speed = np.array([full * ((1 - s) * np.array(v0) + s * np.array(v1)) for s in t])
    guess = np.concatenate([
        path.flatten(), speed.flatten(),
        np.array([np.eye(3).flatten("F")] + [rotation(s * turn).flatten("F") for s in t[1:]]).flatten(),
        np.tile(np.diag(case["inertia"]) @ turn / case["T"], n + 1), np.full(n + 1, full),
        np.tile(turn / n / 2, n), np.full(count * n, limit / 10)])
    bounds = [ca.vec(w) - limit, -ca.vec(w)]
    _, start = solved(case["name"], unknowns, h / (2 * limit) * ca.sumsqr(w), equal, bounds, guess)
    # What the planner minimizes: thrusts at the mass with all propellant.
    middle = m[:n] - h / 2 * ca.mtimes(ca.DM(flows).T, w)
    spent = h * ca.sum2(ca.mtimes(ca.DM(flows).T, w) * full / middle)
    _, at = solved(case["name"], unknowns, spent, equal, bounds, start)
    masses = ca.Function("masses", [unknowns], [m])(at)
    return full - float(masses[n])


def with_spins(case, spins=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))):
    return {**case, "spins": [list(spin) for spin in spins]}


still = [0.0, 0.0, 0.0]
BODY = {"mass": 2.0, "inertia": [1.0, 1.4, 1.9], **layout(PAIRS)}
CASES = [
    with_spins({"name": "straight in free space", "N": 60, "T": 6.0, "limit": 3.0, "gm": 0.0, "exhaust_velocity": 20.0,
                "start": [still, still], "end": [[15.0, 0.0, 0.0], still], "turn": [0.0, 0.0, 1e-6], **BODY}),
    with_spins({"name": "turned in free space", "N": 60, "T": 6.0, "limit": 0.5, "gm": 0.0, "exhaust_velocity": 6.0,
                "start": [still, still], "end": [[0.9, -0.6, 0.4], still], "turn": [0.5, 0.3, -0.4], **BODY}),
    with_spins({"name": "to another plane about a center", "N": 50, "T": 2.0, "limit": 8.0, "gm": 100.0, "exhaust_velocity": 40.0,
                "start": [[3.0, 0.0, 0.0], [0.0, 5.8, 0.0]], "end": [[-1.0, 3.0, 1.0], [-5.0, -2.0, 2.5]], "turn": [0.2, -0.1, 0.3],
                **BODY}, ((0.0, 0.0, 0.1), (0.1, 0.0, 0.0))),
    with_spins({"name": "slow gas from a body that turns", "N": 50, "T": 2.0, "limit": 0.9, "gm": 1.0, "exhaust_velocity": 5.0,
                "start": circular(3.0, 0.0), "end": [[2.6, 1.5, 0.2], [-0.3, 0.5, 0.1]], "turn": [0.1, 0.0, 0.2], **BODY}),
    with_spins({"name": "slow gas from a body that turns at both ends", "N": 50, "T": 2.0, "limit": 0.9, "gm": 1.0, "exhaust_velocity": 5.0,
                "start": circular(3.0, 0.0), "end": [[2.4, 1.6, 0.2], [-0.3, 0.5, 0.1]], "turn": [0.4, -0.5, 0.6], **BODY},
               ((0.1, 0.3, -0.2), (0.3, -0.1, 0.2))),
]


def main():
    cases = [{**case, "propellant": plan(case)} for case in CASES]
    about = ("Propellant of transfers at minimum fuel in N LGVI steps, by propellant.py (CasADi %s, IPOPT, tolerance 1e-9). A body "
             "with the inertia in proportion to its mass; turned by a rotation vector from the identity; angular velocities at both "
             "ends; thrusters with a limit." % ca.__version__)
    print(json.dumps({"about": about, "cases": cases}, indent=1))


if __name__ == "__main__":
    main()
