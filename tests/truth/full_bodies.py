#!/usr/bin/env python3
"""Makes h_five_bodies.json and i_ten_bodies.json: dumbbells that attract each other, one of them heavy, about which the others
revolve. By heyoka's Taylor method in binary128 at two tolerances, whose difference is in `verification`. Needs heyoka.
"""

import json
import math
from pathlib import Path

import heyoka as hy
import numpy as np

HERE = Path(__file__).resolve().parent
TIMES = [1.0, 2.0, 5.0, 10.0, 20.0]


def rounded(values):
    """To multiples of 2⁻¹⁰, which decimals print exactly."""
    return [round(1024 * value) / 1024 for value in values]


def bodies(count):
    """Dumbbells along the first axes of their frames."""
    made = []
    for k in range(count):
        mass, half = (8.0, 0.25) if k == 0 else (0.03125 * (1 + k % 3), 0.125)
        radius, angle = (0.0, 0.0) if k == 0 else (1.5 + 0.7 * k, 2.4 * k)
        speed = 0.0 if k == 0 else math.sqrt(8.0 / radius) * (1 + 0.03 * math.cos(k))
        across = mass * (half * half + 0.00390625)
        made.append(
            {
                "name": f"body{k}",
                "mass": mass,
                "J": [mass * 0.00390625, across, across],
                "points": [[0.5 * mass, half, 0.0, 0.0], [0.5 * mass, -half, 0.0, 0.0]],
                "x": rounded([radius * math.cos(angle), radius * math.sin(angle), 0.2 * math.sin(k)]),
                "v": rounded([-speed * math.sin(angle), speed * math.cos(angle), 0.1 * math.cos(3 * k)]),
                "R": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                "Omega": rounded([0.5 * math.cos(k), 0.25 + math.sin(2 * k), 1.0 + math.cos(5 * k)]),
            }
        )
    return made


def exact(number):
    return hy.expression(hy.real128(number))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def equations(bodies):
    """Of x, v, the nine entries of R by rows, and Ω in the body frame, with G = 1."""
    names = [f"{c}{i}" for i in range(18) for c in "s"]
    states = [hy.make_vars(*(f"{name}_{k}" for name in names)) for k in range(len(bodies))]
    arms = [
        [(exact(m), exact(x), [state[6 + 3 * i] * exact(x) for i in range(3)]) for m, x, _, _ in body["points"]]
        for state, body in zip(states, bodies)
    ]
    forces = [[[] for _ in range(3)] for _ in bodies]
    # Σ x f of the points of each body, from which its moment follows
    levers = [[[] for _ in range(3)] for _ in bodies]
    for i in range(len(bodies)):
        for j in range(i):
            for m, x, arm in arms[i]:
                for n, y, other in arms[j]:
                    d = [states[i][c] + arm[c] - states[j][c] - other[c] for c in range(3)]
                    pull = -m * n * hy.sum([c * c for c in d]) ** exact(-1.5)
                    for c in range(3):
                        force = pull * d[c]
                        forces[i][c].append(force)
                        forces[j][c].append(-force)
                        levers[i][c].append(x * force)
                        levers[j][c].append(-y * force)
    rows = []
    for state, body, force, lever in zip(states, bodies, forces, levers):
        omega, moments = state[15:], body["J"]
        rows += zip(state[:3], state[3:6])
        rows += [(v, hy.sum(f) / exact(body["mass"])) for v, f in zip(state[3:6], force)]
        for i in range(3):
            row = state[6 + 3 * i : 9 + 3 * i]
            rows += zip(row, cross(row, omega))
        lever = [hy.sum(terms) for terms in lever]
        # e₁ × Rᵀ Σ x f
        along = [hy.sum([state[6 + 3 * i + c] * lever[i] for i in range(3)]) for c in range(3)]
        moment = [exact(0.0), -along[2], along[1]]
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            turning = (exact(moments[j]) - exact(moments[k])) * omega[j] * omega[k]
            rows.append((omega[i], (turning + moment[i]) / exact(moments[i])))
    return rows


def flown(bodies, tolerance):
    start = [
        c for body in bodies for c in [*body["x"], *body["v"], *(e for row in body["R"] for e in row), *body["Omega"]]
    ]
    start = np.array([hy.real128(number) for number in start], dtype=hy.real128)
    flight = hy.taylor_adaptive(
        equations(bodies), start, fp_type=hy.real128, tol=hy.real128(tolerance), compact_mode=True
    )
    states = []
    for time in TIMES:
        flight.propagate_until(hy.real128(time))
        states.append(list(flight.state))
    return states


def make(name, key, count):
    given = bodies(count)
    fine, coarse = (flown(given, tolerance) for tolerance in ("1e-30", "1e-26"))
    apart = max(float(abs(p - q)) for a, b in zip(fine, coarse) for p, q in zip(a, b))
    case = {
        "case": name,
        "key": key,
        "units": "normalized: G=1",
        "potential": "points",
        "conventions": {
            "state": "per body: x,v inertial (COM); R row-major 3x3, body->inertial; Omega body frame; J principal moments",
            "numbers": "initial conditions and parameters are binary64 numbers, printed with repr (exact round trip)",
        },
        "parameters": {"G": 1.0},
        "bodies": given,
        "states": [
            {"t": time, "y": [float(c) for c in state], "y_str": [str(c) for c in state]}
            for time, state in zip(TIMES, fine)
        ],
        "verification": f"heyoka {hy.__version__} in binary128, tolerances 1e-30 and 1e-26 differ by {apart:.1e}",
    }
    (HERE / f"{name}.json").write_text(json.dumps(case, indent=1) + "\n")
    print(name, case["verification"])


make("h_five_bodies", "h", 5)
make("i_ten_bodies", "i", 10)
