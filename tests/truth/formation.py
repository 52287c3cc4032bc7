"""Reference costs of formations: several bodies without rotation, planned together as one discrete problem and solved by CasADi +
IPOPT (PyPI casadi 3.8).

Each body goes from rest to rest, in a frame that turns with a circular orbit if there is a center, in kick-drift-kick steps (3.22),
(3.24) with a constant force in each step. The sum of all costs is least, and no two bodies are nearer to each other than the separation
at the end of any step. Unknowns are the positions, momenta and forces of all bodies and steps. IPOPT starts from straight paths
with random detours; the file has each minimum that it finds. Run: python3 formation.py > formation.json
"""

import json
import sys

import casadi as ca
import numpy as np

STARTS = 12


def boundary(case, place, time):
    if case["gm"] == 0.0:
        return np.array(place), np.zeros(3)
    rate = (case["gm"] / case["radius"] ** 3) ** 0.5
    sin, cos = np.sin(rate * time), np.cos(rate * time)
    turn = np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]])
    position = turn @ (np.array([case["radius"], 0, 0]) + np.array(place))
    return position, np.cross([0, 0, rate], position)


def solve(case, rng):
    n, h, d = case["n"], case["duration"] / case["n"], case["separation"]
    size = case["size"]
    cost, conditions, unknowns, guess = 0, [], [], []
    places = []
    frame = [boundary(case, [0, 0, 0], h * k)[0] for k in range(n + 1)]
    for body in case["bodies"]:
        m, weight = body["mass"], body["weight"]
        (x0, v0), (x1, v1) = boundary(case, body["from"], 0), boundary(case, body["to"], case["duration"])
        # Relative to the moving place, in units of the size, so that nothing cancels.
        q, p, u = ca.MX.sym("q", 3, n + 1), ca.MX.sym("p", 3, n + 1), ca.MX.sym("u", 3, n)
        speed, force = size / case["duration"], m * size / case["duration"] ** 2

        def drift(k):
            later = boundary(case, [0, 0, 0], h * (k + 1))[0]
            return (later - frame[k]) / h

        def pull(k):
            x = frame[k] + size * q[:, k]
            return -case["gm"] * m * x / ca.norm_2(x) ** 3 if case["gm"] else ca.DM.zeros(3)

        def velocity(k):
            # That of the moving place.
            return boundary(case, [0, 0, 0], h * k)[1]

        for k in range(n):
            start = m * (velocity(k) + speed * p[:, k])
            middle = start + 0.5 * h * (force * u[:, k] + pull(k))
            end = middle + 0.5 * h * (force * u[:, k] + pull(k + 1))
            conditions.append(q[:, k + 1] - q[:, k] - h * (middle / m - drift(k)) / size)
            conditions.append(p[:, k + 1] - (end / m - velocity(k + 1)) / speed)
            cost += 0.5 * h * weight * force**2 * ca.sumsqr(u[:, k])
        conditions += [q[:, 0] - (x0 - frame[0]) / size, q[:, n] - (x1 - frame[n]) / size]
        conditions += [p[:, 0] - (v0 - velocity(0)) / speed, p[:, n] - (v1 - velocity(n)) / speed]
        unknowns += [ca.vec(q), ca.vec(p), ca.vec(u)]
        places.append(q)
        t = np.linspace(0, 1, n + 1)[:, None]
        bump = 16 * t**2 * (1 - t) ** 2
        line = (x0 - frame[0]) * (1 - t) + (x1 - frame[n]) * t
        path = line / size + d / size * bump * rng.normal(size=3)
        guess += [path.ravel(), np.zeros(3 * (n + 1)), np.zeros(3 * n)]
    equal = ca.vertcat(*conditions)
    apart = [
        ca.sumsqr((places[i] - places[j])[:, k]) * (size / d) ** 2
        for i in range(len(places))
        for j in range(i)
        for k in range(1, n)
    ]
    w = ca.vertcat(*unknowns)
    scale = case["scale"]
    problem = {"x": w, "f": cost / scale, "g": ca.vertcat(equal, *apart)}
    options = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": 0, "ipopt.tol": 1e-10, "ipopt.constr_viol_tol": 1e-10, "ipopt.max_iter": 2000}
    solver = ca.nlpsol("s", "ipopt", problem, options)
    lower = np.concatenate([np.zeros(equal.shape[0]), np.ones(len(apart))])
    upper = np.concatenate([np.zeros(equal.shape[0]), np.full(len(apart), np.inf)])
    found = solver(x0=np.concatenate(guess), lbg=lower, ubg=upper)
    return float(found["f"]) * scale if solver.stats()["success"] else None


def cases():
    rng = np.random.default_rng(11)
    for number in range(8):
        low = number % 2 == 1
        count = 2 + number % 3
        size, d = (100.0, 40.0) if low else (1.0, 0.4)
        while True:
            starts = rng.uniform(-1, 1, (count, 3))
            ends = -starts + 0.2 * rng.uniform(-1, 1, (count, 3))
            apart = lambda p: all(np.linalg.norm(p[i] - p[j]) > 0.45 for i in range(count) for j in range(i))
            if apart(starts) and apart(ends):
                break
        masses = np.exp(1.5 * rng.uniform(-1, 1, count)) * (100.0 if low else 1.0)
        weights = np.exp(rng.uniform(-1, 1, count))
        duration = 1200.0 if low else 3.0
        yield {
            "gm": 3.986e14 if low else 0.0,
            "radius": 6.778e6 if low else 0.0,
            "duration": duration,
            "n": 40,
            "separation": d,
            "size": size,
            "scale": float((masses.max() * size) ** 2 / duration**3),
            "bodies": [
                {"mass": float(m), "weight": float(w), "from": (size * s).tolist(), "to": (size * e).tolist()}
                for m, w, s, e in zip(masses, weights, starts, ends)
            ],
        }


def main():
    made = []
    for case in cases():
        rng = np.random.default_rng(5)
        costs = [cost for cost in (solve(case, rng) for _ in range(STARTS)) if cost is not None]
        minima = []
        for cost in sorted(costs):
            if not minima or cost > minima[-1] * (1 + 1e-6):
                minima.append(cost)
        print(len(case["bodies"]), minima, file=sys.stderr)
        made.append({**case, "minima": minima})
    print(json.dumps(made, indent=1))


if __name__ == "__main__":
    main()
