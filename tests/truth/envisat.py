"""A rendezvous with a satellite like Envisat that tumbles, stated anew: the attitude of the satellite by the Dormand-Prince method of
scipy, its orbit in the LGVI's steps of a point, and the chaser's cheapest transfer in the same steps by CasADi + IPOPT (PyPI casadi 3.8).

Mass, inertia and orbit of Envisat: B. Bastida Virgili, S. Lemmens, H. Krag, "Investigation on Envisat attitude motion", e.Deorbit
workshop, 2014; it turned by some 2.7 degrees a second. The chaser comes to a point that is fixed in the satellite, 30 m from its center,
and is at rest there in axes that turn with the satellite. Run: python3 envisat.py > envisat.json
"""

import json

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from minimum_fuel import solved

GM, RADIUS = 3.986004415e14, 6371008.4 + 766e3
INERTIA = [17023.3, 124825.7, 129112.2]
MASS = 1500.0
T, N = 400.0, 200


def tumbled(attitude, rate):
    """Attitude (w, x, y, z; body to inertial) and angular velocity (body) at the end."""
    j = np.array(INERTIA)

    def rates(_, s):
        q, w = s[:4], s[4:]
        turn = 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
        return np.concatenate([turn, np.cross(j * w, w) / j])

    end = solve_ivp(rates, (0, T), np.concatenate([attitude, rate]), method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]
    return end[:4] / np.linalg.norm(end[:4]), end[4:]


def matrix(q):
    w, v = q[0], q[1:]
    s = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2 * (w * s + s @ s)


def flown(x, v, steps=N):
    """Position and velocity after the LGVI's steps."""
    h = T / N
    pull = lambda x: -GM * x / np.linalg.norm(x) ** 3
    for _ in range(steps):
        v = v + h / 2 * pull(x)
        x = x + h * v
        v = v + h / 2 * pull(x)
    return x, v


def cheapest(start, end):
    """Sum of h/2 |F|^2. Places and velocities are relative to the start, in units of 100 m, so that they keep their digits."""
    h, unit = T / N, 100.0
    origin, initial = (np.array(part) for part in start)
    x, v, f = (ca.MX.sym(s, 3, n) for s, n in (("x", N + 1), ("v", N + 1), ("f", N)))
    a, b, c, d, w = (ca.SX.sym(s, 3) for s in "abcdw")
    pull = lambda at: -GM * (origin + unit * at) / ca.norm_2(origin + unit * at) ** 3 / unit
    half = b + h / 2 * (pull(a) + w)
    step = ca.vertcat(c - a - h * half, d - half - h / 2 * (pull(c) + w))
    step = ca.Function("step", [a, b, c, d, w], [step]).map(N)
    steps = step(x[:, :N], v[:, :N], x[:, 1:], v[:, 1:], f)
    ends = [x[:, 0], v[:, 0] - initial / unit, x[:, N] - (end[0] - origin) / unit, v[:, N] - end[1] / unit]
    equal = ca.vertcat(ca.vec(steps), *ends)
    places, speeds = zip(*(flown(origin, initial, steps) for steps in range(N + 1)))
    guess = np.concatenate([((np.array(places) - origin) / unit).flatten(), (np.array(speeds) / unit).flatten(), np.zeros(3 * N)])
    unknowns = ca.vertcat(*[ca.vec(part) for part in (x, v, f)])
    scale = 1e6
    value, _ = solved("envisat", unknowns, scale * h / 2 * ca.sumsqr(f), equal, [], guess)
    return value / scale * (MASS * unit) ** 2


def main():
    tilt = np.radians(98.4)
    speed = (GM / RADIUS) ** 0.5
    place, velocity = np.array([RADIUS, 0.0, 0.0]), np.array([0.0, speed * np.cos(tilt), speed * np.sin(tilt)])
    attitude, rate = np.array([0.8, 0.2, -0.4, 0.4]), np.array([0.008, 0.043, 0.017])
    q, w = tumbled(attitude / np.linalg.norm(attitude), rate)
    x, v = flown(place, velocity)
    arm = matrix(q) @ np.array([0.0, 0.0, 30.0])
    target = [x + arm, v + np.cross(matrix(q) @ w, arm)]
    away = np.array([20.0, -95.0, 30.0])
    start = [(place + away).tolist(), velocity.tolist()]
    about = ("Rendezvous with a tumbling satellite, by envisat.py (scipy DOP853; CasADi %s, IPOPT). SI; attitudes w, x, y, z." % ca.__version__)
    print(json.dumps({"about": about, "gm": GM, "T": T, "N": N, "inertia": INERTIA, "mass": MASS,
                      "satellite": {"position": place.tolist(), "velocity": velocity.tolist(),
                                    "attitude": (attitude / np.linalg.norm(attitude)).tolist(), "rate": rate.tolist()},
                      "chaser": {"position": start[0], "velocity": start[1]},
                      "end": {"attitude": q.tolist(), "rate": w.tolist(), "position": target[0].tolist(), "velocity": target[1].tolist()},
                      "cost": cheapest(start, target)}, indent=1))


if __name__ == "__main__":
    main()
