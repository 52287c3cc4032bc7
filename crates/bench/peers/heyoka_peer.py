"""Integrates a reference case with heyoka, and says how long it took and how far off it ended.

    heyoka_peer.py CASE.json TIME REPEATS TOLERANCE...

Each line of the output is one tolerance as JSON: tolerance, seconds (best of the repeats, propagation only: the
integrator is compiled before), and the errors of position, attitude (Frobenius) and angular velocity at TIME, against
the reference state of the case. Attitude is a quaternion or a rotation matrix, whichever is faster here.

Needs `pip install heyoka`.
"""

import json
import sys
import time

import heyoka as hy
import numpy as np


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return hy.sum([p * q for p, q in zip(a, b)])


def matrix_of(q):
    w, x, y, z = q
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def quaternion_of(r):
    """For the cases' initial attitudes, all of them with a positive trace or half a turn about an axis."""
    r = np.array(r)
    k = np.array(
        [
            [r[0, 0] - r[1, 1] - r[2, 2], 0, 0, 0],
            [r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], 0, 0],
            [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1], 0],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], np.trace(r)],
        ]
    )
    values, vectors = np.linalg.eigh(k)
    x, y, z, w = vectors[:, np.argmax(values)]
    return [w, x, y, z]


class Body:
    """Variables, parameters and initial values of one body."""

    def __init__(self, index, data, quaternion):
        names = [f"{name}{index}" for name in ("x", "y", "z", "vx", "vy", "vz")]
        self.position = hy.make_vars(*names[:3])
        self.velocity = hy.make_vars(*names[3:])
        count = 4 if quaternion else 9
        self.attitude = hy.make_vars(*[f"q{index}_{i}" for i in range(count)])
        self.omega = hy.make_vars(*[f"w{index}_{i}" for i in range(3)])
        self.quaternion = quaternion
        self.data = data
        if quaternion:
            self.r = matrix_of(self.attitude)
        else:
            self.r = [self.attitude[3 * i : 3 * i + 3] for i in range(3)]
        start = data["R"]
        attitude = quaternion_of(start) if quaternion else [c for row in start for c in row]
        self.start = [*data["x"], *data["v"], *attitude, *data["Omega"]]

    def to_inertial(self, v):
        return [hy.sum([r * c for r, c in zip(row, v) if not isinstance(c, float) or c != 0.0]) for row in self.r]

    def to_body(self, v):
        return [hy.sum([self.r[i][j] * v[i] for i in range(3)]) for j in range(3)]

    def equations(self, force, torque, moves):
        """With the force and the torque about the origin of the body, both inertial."""
        mass, inertia, w = self.data["mass"], self.data["J"], self.omega
        zero = hy.expression(0.0)
        rows = []
        for i in range(3):
            rows.append((self.position[i], self.velocity[i] if moves else zero))
        for i in range(3):
            rows.append((self.velocity[i], force[i] / mass if moves else zero))
        if self.quaternion:
            a, b, c, d = self.attitude
            rates = [
                -0.5 * (b * w[0] + c * w[1] + d * w[2]),
                0.5 * (a * w[0] + c * w[2] - d * w[1]),
                0.5 * (a * w[1] + d * w[0] - b * w[2]),
                0.5 * (a * w[2] + b * w[1] - c * w[0]),
            ]
        else:
            rates = [cross(row, w)[j] for row in self.r for j in range(3)]
        rows += zip(self.attitude, rates)
        moment = self.to_body(torque) if torque is not None else [zero] * 3
        for i in range(3):
            j, k = (i + 1) % 3, (i + 2) % 3
            gyroscopic = (inertia[j] - inertia[k]) / inertia[i]
            rows.append((w[i], gyroscopic * w[j] * w[k] + moment[i] / inertia[i]))
        return rows


def add(a, b, sign=1.0):
    return [p + sign * q for p, q in zip(a, b)]


def loads(case, bodies):
    """Force and torque on each body, inertial."""
    kind, parameters = case["potential"], case["parameters"]
    zero = [hy.expression(0.0)] * 3
    forces, torques = [zero] * len(bodies), [None] * len(bodies)
    if kind == "points":
        (one, other), constant = bodies, parameters["G"]
        forces, torques = [zero, zero], [zero, zero]
        arms = [[(p[0], body.to_inertial(p[1:])) for p in body.data["points"]] for body in bodies]
        separation = add(one.position, other.position, -1.0)
        for m, arm in arms[0]:
            for n, other_arm in arms[1]:
                d = add(add(separation, arm), other_arm, -1.0)
                pull = -constant * m * n * dot(d, d) ** -1.5
                pair = [pull * c for c in d]
                forces = [add(forces[0], pair), add(forces[1], pair, -1.0)]
                torques = [
                    add(torques[0], cross(arm, pair)),
                    add(torques[1], cross(other_arm, pair), -1.0),
                ]
    elif kind == "central":
        forces, torques = [zero], [zero]
        for m, *place in bodies[0].data["points"]:
            arm = bodies[0].to_inertial(place)
            d = add(bodies[0].position, arm)
            pull = -parameters["GM"] * m * dot(d, d) ** -1.5
            pair = [pull * c for c in d]
            forces[0] = add(forces[0], pair)
            torques[0] = add(torques[0], cross(arm, pair))
    elif kind == "uniform":
        body = bodies[0]
        arm = body.to_inertial(body.data["rho_c"])
        weight = [hy.expression(0.0), hy.expression(0.0), hy.expression(body.data["mass"] * parameters["g"])]
        forces, torques = [weight], [cross(arm, weight)]
    elif kind == "macc2":
        constant = parameters["G"]
        d = add(bodies[0].position, bodies[1].position, -1.0)
        squared = dot(d, d)
        inverse = squared**-0.5
        m0, m1 = (body.data["mass"] for body in bodies)
        pull = -constant * m0 * m1 * inverse**3
        force = [pull * c for c in d]
        for index, body in enumerate(bodies):
            inertia, other = body.data["J"], bodies[1 - index].data["mass"]
            e = body.to_body(d)
            je = [j * c for j, c in zip(inertia, e)]
            je_inertial = body.to_inertial(je)
            scale = constant * other * inverse**5
            radial = -1.5 * sum(inertia) * scale + 7.5 * dot(e, je) * scale * inverse**2
            force = add(force, [radial * c for c in d])
            force = add(force, [-3.0 * scale * c for c in je_inertial])
            torques[index] = [3.0 * scale * c for c in cross(d, je_inertial)]
        forces = [force, [-c for c in force]]
    elif kind != "none":
        sys.exit(f"unknown potential {kind!r}")
    return forces, torques


def integrator(case, tolerance, quaternion):
    bodies = [Body(i, data, quaternion) for i, data in enumerate(case["bodies"])]
    forces, torques = loads(case, bodies)
    equations, start = [], []
    moves = case["potential"] not in ("uniform", "none")
    for body, force, torque in zip(bodies, forces, torques):
        equations += body.equations(force, torque, moves)
        start += body.start
    return hy.taylor_adaptive(equations, start, tol=tolerance), start


def errors(case, state, at, quaternion):
    width = 13 if quaternion else 18
    worst = [0.0, 0.0, 0.0]
    for index in range(len(case["bodies"])):
        found = np.array(state[index * width : (index + 1) * width])
        expected = np.array(at["y"][index * 18 : (index + 1) * 18])
        r = np.array(matrix_of(found[6:10])) if quaternion else found[6:15].reshape(3, 3)
        differences = [
            found[:3] - expected[:3],
            r.astype(float) - expected[6:15].reshape(3, 3),
            found[-3:] - expected[15:],
        ]
        worst = [max(w, float(np.linalg.norm(d))) for w, d in zip(worst, differences)]
    return dict(zip(("position", "attitude", "angular_velocity"), worst))


def measure(case, at, repeats, tolerance, quaternion):
    flight, start = integrator(case, tolerance, quaternion)
    best = float("inf")
    for _ in range(repeats):
        flight.state[:] = start
        flight.time = 0.0
        before = time.perf_counter()
        flight.propagate_until(at["t"])
        best = min(best, time.perf_counter() - before)
    return {"tolerance": tolerance, "seconds": best, **errors(case, flight.state, at, quaternion)}


def main():
    path, at, repeats, *tolerances = sys.argv[1:]
    with open(path) as file:
        case = json.load(file)
    (at,) = [state for state in case["states"] if state["t"] == float(at)]
    for tolerance in map(float, tolerances):
        both = [measure(case, at, int(repeats), tolerance, quaternion) for quaternion in (True, False)]
        print(json.dumps(min(both, key=lambda result: result["seconds"])), flush=True)


main()
