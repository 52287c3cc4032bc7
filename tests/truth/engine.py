"""Reference costs of transfers by an engine that uses propellant, in the LGVI's steps of a point with its mass as a state, stated
anew and solved by CasADi + IPOPT (PyPI casadi 3.8); and the transfer from Earth to Mars in continuous time, by shooting on the
costates (scipy).

Unknowns are positions, momenta, masses, forces and the norms of these (direct transcription). A step: gas flows out for h/2, half an
impulse, a drift, half an impulse, gas flows out for h/2. IPOPT solves the problem at least energy first and starts the one at minimum
fuel from that solution.

Earth to Mars: data of E. Taheri, I. Kolmanovsky, E. Atkins, "Enhanced smoothing technique for indirect optimization of minimum-fuel
low-thrust trajectories", J. Guidance, Control, and Dynamics 39 (2016), which finds a final mass of 603.94 kg.
Run: python3 engine.py > engine.json
"""

import json

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

from minimum_fuel import solved

LENGTH, GM = 149.6e6, 132712440018.0
TIME = (LENGTH**3 / GM) ** 0.5
SPEED = LENGTH / TIME
MARS = {
    "name": "Earth to Mars", "gm": 1.0, "mass": 1.0, "T": 348.795 * 86400 / TIME,
    "limit": 0.5e-3 / 1000 * TIME**2 / LENGTH, "exhaust_velocity": 2000 * 9.80665e-3 / SPEED,
    "start": [(np.array([-140699693.0, -51614428.0, 980.0]) / LENGTH).tolist(),
              (np.array([9.774596, -28.07828, 4.337725e-4]) / SPEED).tolist()],
    "end": [(np.array([-172682023.0, 176959469.0, 7948912.0]) / LENGTH).tolist(),
            (np.array([-16.427384, -14.860506, 9.21486e-2]) / SPEED).tolist()],
}


WEIGHTS = [1.0, 25.0, 4.0]

# At least energy the force is at its limit at both ends and below it in between.
BETWEEN = {"name": "between the limits in the middle", "gm": 0.2, "mass": 2.0, "N": 60, "T": 3.0, "limit": 1.2, "exhaust_velocity": 1.5,
           "start": [[3.0, 0.0, 0.0], [0.0, 0.0, 0.0]], "end": [[3.0, 1.5, 0.3], [0.0, 0.0, 0.0]]}


def plan(case, cost):
    """The propellant of a plan at least "energy" or "fuel", or least energy with `WEIGHTS` of the components, and what it costs."""
    n, h, limit, gm, c = case["N"], case["T"] / case["N"], case["limit"], case["gm"], case["exhaust_velocity"]
    full = case["mass"]
    x, p, m, f, q = (ca.MX.sym(s, k, n + e) for s, k, e in (("x", 3, 1), ("p", 3, 1), ("m", 1, 1), ("f", 3, 0), ("q", 1, 0)))
    a = [ca.SX.sym(s, k) for s, k in (("x", 3), ("p", 3), ("m", 1), ("f", 3), ("q", 1))]
    b = [ca.SX.sym(s, k) for s, k in (("X", 3), ("P", 3), ("M", 1))]
    pull = lambda at, mass: -gm * mass * at / ca.norm_2(at) ** 3
    mass = a[2] - h / 2 * a[4] / c
    half = a[1] * mass / a[2] + h / 2 * (a[3] + pull(a[0], mass))
    last = half + h / 2 * (a[3] + pull(b[0], mass))
    step = ca.vertcat(b[0] - a[0] - h / mass * half, b[1] - last * b[2] / mass, b[2] - mass + h / 2 * a[4] / c)
    step = ca.Function("step", a + b, [step]).map(n)
    steps = step(x[:, :n], p[:, :n], m[:, :n], f, q, x[:, 1:], p[:, 1:], m[:, 1:])
    (x0, v0), (x1, v1) = case["start"], case["end"]
    ends = [x[:, 0] - x0, p[:, 0] - full * np.array(v0), m[0] - full, x[:, n] - x1, p[:, n] - m[n] * np.array(v1)]
    equal = ca.vertcat(ca.vec(steps), *ends)
    unknowns = ca.vertcat(*[ca.vec(part) for part in (x, p, m, f, q)])
    squares = ca.sum1(f * f)
    # At minimum fuel nothing flows out beside the force, which is asserted.
    norm, bounds = ca.vec(squares - q * q), [ca.vec(q) - limit, -ca.vec(q)]
    t = np.linspace(0, 1, n + 1)
    angles = [np.arctan2(at[1], at[0]) for at in (x0, x1)]
    angles[1] += 2 * np.pi * (angles[1] < angles[0])
    radii = [np.hypot(at[0], at[1]) for at in (x0, x1)]
    turn, far, height = [(1 - t) * a + t * b for a, b in (angles, radii, (x0[2], x1[2]))]
    path = np.array([far * np.cos(turn), far * np.sin(turn), height]).T
    speed = np.gradient(path, case["T"] / n, axis=0)
    masses = full - (0.5 * limit / c * case["T"] * t)
    guess = np.concatenate([path.flatten(), (masses[:, None] * speed).flatten(), masses, np.full(3 * n, limit / 4),
                            np.full(n, limit / 2)])
    middle = m[:n] - h / 2 * q / c
    weights = ca.DM(WEIGHTS if cost == "weighted" else [1.0, 1.0, 1.0])
    energy = h / 2 * ca.sum2(ca.mtimes(weights.T, f * f) * (full / middle) ** 2)
    value, at = solved(case["name"], unknowns, energy, ca.vertcat(equal, norm), bounds, guess)
    if cost == "fuel":
        value, at = solved(case["name"], unknowns, h / c * ca.sum2(q * full / middle), equal, [norm, *bounds], at)
    found = ca.Function("found", [unknowns], [m[n], ca.mmax(q - ca.sqrt(squares))])
    left, loose = (float(number) for number in found(at))
    assert loose < 1e-5 * limit, loose
    return {"minimum": value, "propellant": full - left}


def shooting(case):
    """The final mass in continuous time, from costates by which the thrust is switched ever more sharply."""
    limit, c, T = case["limit"], case["exhaust_velocity"], case["T"]
    (x0, v0), (x1, v1) = case["start"], case["end"]

    def rates(t, s, rho):
        r, v, m, lr, lv, lm = s[:3], s[3:6], s[6], s[7:10], s[10:13], s[13]
        primer, far = np.linalg.norm(lv), np.linalg.norm(r)
        switch = c * primer / m + lm - 1
        thrust = limit * 0.5 * (1 + np.tanh(switch / rho))
        by_r = -lv / far**3 + 3 * r * (r @ lv) / far**5
        return np.concatenate([v, -r / far**3 - thrust / m * lv / primer, [-thrust / c], -by_r, -lr, [-thrust * primer / m**2]])

    def miss(costates, rho):
        s = solve_ivp(rates, (0, T), np.concatenate([x0, v0, [1.0], costates]), args=(rho,), method="DOP853",
                      rtol=1e-11, atol=1e-12).y[:, -1]
        return np.concatenate([s[:3] - x1, s[3:6] - v1, [s[13]]]), s[6]

    rng = np.random.default_rng(1)
    for _ in range(200):
        costates, rho = np.append(rng.uniform(-1, 1, 6) * 0.5, 0.5), 1.0
        while rho > 2e-5:
            found = root(lambda l: miss(l, rho)[0], costates, method="hybr", tol=1e-12)
            if np.abs(found.fun).max() > 1e-8:
                break
            costates, rho = found.x, rho * 0.5
        else:
            return miss(costates, 2 * rho)[1]
    raise RuntimeError("no costates")


def at_random(seed):
    rng = np.random.default_rng(seed)
    place, way = rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 3)
    start = [[3.0, 0.0, 0.0], [0.0, 0.57, 0.0]]
    end = [(np.array([1.5, 2.6, 0.0]) + 0.3 * place).tolist(), (np.array([-0.49, 0.28, 0.0]) + 0.1 * way).tolist()]
    return {"name": f"at random {seed}", "gm": 1.0, "mass": 2.0, "N": 60, "T": 6.0, "limit": 0.35, "exhaust_velocity": 1.5,
            "start": start, "end": end}


def main():
    cases = [at_random(seed) for seed in range(1, 5)] + [BETWEEN] + [{**MARS, "N": n} for n in (100,)]
    cases = [{**case, **{cost: plan(case, cost) for cost in ("energy", "weighted", "fuel")}} for case in cases]
    about = ("Transfers by an engine in N LGVI steps, by engine.py (CasADi %s, IPOPT, tolerance 1e-9): what is minimized and the "
             "propellant. From Earth to Mars also the final mass in continuous time." % ca.__version__)
    print(json.dumps({"about": about, "cases": cases, "earth_mars": {"final_mass": shooting(MARS)}}, indent=1))


if __name__ == "__main__":
    main()
