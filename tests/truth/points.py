#!/usr/bin/env python3
"""Makes f_outer_planets.json and g_kepler.json, reference trajectories of points of mass. Needs heyoka and mpmath.

f: Sun and five planets, by heyoka's Taylor method in binary128 at two tolerances, whose difference is in `verification`.
The data are those of E. Hairer, C. Lubich and G. Wanner, Geometric Numerical Integration, table I.2.2.
g: one body about a fixed center, by Kepler's equation to 50 digits; heyoka in binary128 beside it.
"""

import json
from pathlib import Path

import heyoka as hy
import mpmath as mp
import numpy as np

HERE = Path(__file__).resolve().parent
mp.mp.dps = 50

CONVENTIONS = {
    "state": "per body: x,v inertial (COM); R row-major 3x3, body->inertial; Omega body frame; the bodies do not turn",
    "numbers": "initial conditions and parameters are binary64 numbers, printed with repr (exact round trip), taken as exact",
}
STILL = [1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]

PLANETS = [
    ("Sun", 1.00000597682, [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
    ("Jupiter", 0.000954786104043, [-3.5023653, -3.8169847, -1.5507963], [0.00565429, -0.00412490, -0.00190589]),
    ("Saturn", 0.000285583733151, [9.0755314, -3.0458353, -1.6483708], [0.00168318, 0.00483525, 0.00192462]),
    ("Uranus", 0.0000437273164546, [8.3101420, -16.2901086, -7.2521278], [0.00354178, 0.00137102, 0.00055029]),
    ("Neptune", 0.0000517759138449, [11.4707666, -25.7294829, -10.8169456], [0.00288930, 0.00114527, 0.00039677]),
    ("Pluto", 1.0 / 1.3e8, [-15.5387357, -25.2225594, -3.1902382], [0.00276725, -0.00170702, -0.00136504]),
]
CONSTANT = 2.95912208286e-4


def norm_squared(d):
    return hy.sum([c * c for c in d])


def exact(number):
    return hy.expression(hy.real128(number))


def equations(masses, constant, center):
    variables = [
        (hy.make_vars(*(f"{c}{i}" for c in "xyz")), hy.make_vars(*(f"v{c}{i}" for c in "xyz")))
        for i in range(len(masses))
    ]
    rows = []
    for i, (x, v) in enumerate(variables):
        pulls = [[] for _ in range(3)]
        if center is not None:
            scale = -exact(center) * norm_squared(x) ** exact(-1.5)
            pulls = [[scale * c] for c in x]
        for j, mass in enumerate(masses):
            if j == i or constant is None:
                continue
            d = [p - q for p, q in zip(x, variables[j][0])]
            scale = -exact(constant) * exact(mass) * norm_squared(d) ** exact(-1.5)
            pulls = [[*pull, scale * c] for pull, c in zip(pulls, d)]
        rows += [*zip(x, v), *((component, hy.sum(pull)) for component, pull in zip(v, pulls))]
    return rows


def flown(rows, start, times, tolerance):
    """States at the times, in binary128 by a Taylor method."""
    start = np.array([hy.real128(number) for number in start], dtype=hy.real128)
    flight = hy.taylor_adaptive(rows, start, fp_type=hy.real128, tol=hy.real128(tolerance), compact_mode=True)
    states = []
    for time in times:
        flight.propagate_until(hy.real128(time))
        states.append([mp.mpf(str(number)) for number in flight.state])
    return states


def kepler(x, v, gm, times):
    """States at the times, by Kepler's equation in universal form E − e sin E = M."""
    x, v = [[mp.mpf(c) for c in vector] for vector in (x, v)]
    r = mp.sqrt(sum(c * c for c in x))
    a = 1 / (2 / r - sum(c * c for c in v) / gm)
    n = mp.sqrt(gm / a**3)
    along, across = sum(p * q for p, q in zip(x, v)) / mp.sqrt(gm * a), 1 - r / a
    states = []
    for time in times:
        mean = n * mp.mpf(time)
        # E is counted from the start: M = E + along (1 − cos E) − across sin E
        turn = mp.findroot(lambda e: e + along * (1 - mp.cos(e)) - across * mp.sin(e) - mean, mean)
        cos, sin = mp.cos(turn), mp.sin(turn)
        radius = a * (1 - across * cos + along * sin)
        f, g = 1 - a / r * (1 - cos), mp.mpf(time) + (sin - turn) / n
        df, dg = -mp.sqrt(gm * a) / (radius * r) * sin, 1 - a / radius * (1 - cos)
        states.append([f * p + g * q for p, q in zip(x, v)] + [df * p + dg * q for p, q in zip(x, v)])
    return states


def apart(one, other):
    return max(float(max(abs(p - q) for p, q in zip(a, b))) for a, b in zip(one, other))


def written(name, key, about, bodies, times, states, parameters, potential, verification):
    def row(state):
        flat = [mp.mpf(c) for i in range(len(bodies)) for c in [*state[6 * i : 6 * i + 6], *STILL]]
        return {"y": [float(c) for c in flat], "y_str": [mp.nstr(c, 33) for c in flat]}

    case = {
        "case": name,
        "key": key,
        "units": about,
        "potential": potential,
        "conventions": CONVENTIONS,
        "parameters": parameters,
        "bodies": [
            {
                "name": label,
                "mass": mass,
                "J": [mass] * 3,
                "points": [[mass, 0.0, 0.0, 0.0]],
                "x": x,
                "v": v,
                "R": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
                "Omega": [0.0, 0.0, 0.0],
            }
            for label, mass, x, v in bodies
        ],
        "states": [{"t": time, **row(state)} for time, state in zip(times, states)],
        "verification": verification,
    }
    (HERE / f"{name}.json").write_text(json.dumps(case, indent=1) + "\n")
    print(name, verification)


def planets():
    times = [1000.0, 10000.0, 50000.0, 100000.0, 200000.0]
    rows = equations([mass for _, mass, _, _ in PLANETS], CONSTANT, None)
    start = [c for _, _, x, v in PLANETS for c in (*x, *v)]
    fine, coarse = (flown(rows, start, times, tolerance) for tolerance in ("1e-33", "1e-29"))
    written(
        "f_outer_planets",
        "f",
        "AU, days, solar masses",
        PLANETS,
        times,
        fine,
        {"G": CONSTANT},
        "points",
        f"heyoka {hy.__version__} in binary128, tolerances 1e-33 and 1e-29 differ by {apart(fine, coarse):.1e}",
    )


def orbit():
    times = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]
    x, v = [0.5, 0.0, 0.0], [0.0, 1.625, 0.625]
    states = kepler(x, v, mp.mpf(1), times)
    beside = flown(equations([1.0], None, 1.0), [*x, *v], times, "1e-33")
    written(
        "g_kepler",
        "g",
        "normalized: GM=1",
        [("body", 1.0, x, v)],
        times,
        states,
        {"G": 1.0, "GM": 1.0},
        "central",
        f"closed form to {mp.mp.dps} digits; heyoka {hy.__version__} in binary128 differs by {apart(states, beside):.1e}",
    )


planets()
orbit()
