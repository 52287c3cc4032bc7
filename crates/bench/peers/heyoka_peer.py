"""heyoka: Taylor methods of adaptive step and order, compiled for the case before the flight.

Attitude is a quaternion or a rotation matrix, whichever is faster here. Needs `pip install heyoka`.
"""

import heyoka as hy
import numpy as np
from protocol import Failed, Stopwatch, are_points, matrix_of, point_state, quaternion_of, rigid_state, serve


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def dot(a, b):
    return hy.sum([p * q for p, q in zip(a, b)])


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
        constant = parameters["G"]
        pulls, turns = [[] for _ in bodies], [[] for _ in bodies]
        arms = [[(p[0], body.to_inertial(p[1:])) for p in body.data["points"]] for body in bodies]
        for i in range(len(bodies)):
            for j in range(i):
                separation = add(bodies[i].position, bodies[j].position, -1.0)
                for m, arm in arms[i]:
                    for n, other_arm in arms[j]:
                        d = add(add(separation, arm), other_arm, -1.0)
                        pull = -constant * m * n * dot(d, d) ** -1.5
                        pair = [pull * c for c in d]
                        pulls[i].append(pair)
                        pulls[j].append([-c for c in pair])
                        turns[i].append(cross(arm, pair))
                        turns[j].append([-c for c in cross(other_arm, pair)])
        forces = [[hy.sum(list(terms)) for terms in zip(*each)] for each in pulls]
        torques = [[hy.sum(list(terms)) for terms in zip(*each)] for each in turns]
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
        raise Failed(f"unknown potential {kind!r}")
    return forces, torques


def points(case):
    """Equations of points of mass, which do not turn."""
    bodies = case["bodies"]
    variables = [
        (hy.make_vars(*(f"{c}{i}" for c in "xyz")), hy.make_vars(*(f"v{c}{i}" for c in "xyz"))) for i in range(len(bodies))
    ]
    accelerations = [[hy.expression(0.0)] * 3 for _ in bodies]
    if case["potential"] == "central":
        for i, (x, _) in enumerate(variables):
            pull = -case["parameters"]["GM"] * dot(x, x) ** -1.5
            accelerations[i] = [pull * c for c in x]
    else:
        constant = case["parameters"]["G"]
        for i, (x, _) in enumerate(variables):
            for j in range(i):
                d = add(x, variables[j][0], -1.0)
                pull = dot(d, d) ** -1.5
                accelerations[i] = add(accelerations[i], [-constant * bodies[j]["mass"] * pull * c for c in d])
                accelerations[j] = add(accelerations[j], [constant * bodies[i]["mass"] * pull * c for c in d])
    equations, start = [], []
    for (x, v), acceleration, body in zip(variables, accelerations, bodies):
        equations += [*zip(x, v), *zip(v, acceleration)]
        start += [*body["x"], *body["v"]]
    return equations, start


def rigid(case, quaternion):
    bodies = [Body(i, data, quaternion) for i, data in enumerate(case["bodies"])]
    forces, torques = loads(case, bodies)
    equations, start = [], []
    moves = case["potential"] not in ("uniform", "none")
    for body, force, torque in zip(bodies, forces, torques):
        equations += body.equations(force, torque, moves)
        start += body.start
    return equations, start


class Flight:
    """The integrators of one case, each made when its tolerance is asked for first."""

    def __init__(self, case):
        self.case = case
        if are_points(case):
            self.forms = {"point": points(case)}
        else:
            self.forms = {"quaternion": rigid(case, True), "matrix": rigid(case, False)}
        self.integrators = {}

    def fly(self, tolerance, times):
        if tolerance not in self.integrators:
            self.integrators[tolerance] = self.fastest(tolerance)
        form, integrator = self.integrators[tolerance]
        return self.once(form, integrator, times)

    def fastest(self, tolerance):
        """Of the forms; the first integrator that is made decides for all."""
        # Without loops, the code of many full bodies takes too long to compile.
        loops = "point" not in self.forms and len(self.case["bodies"]) > 2
        made = [
            (form, hy.taylor_adaptive(*equations, tol=tolerance, compact_mode=loops))
            for form, equations in self.forms.items()
        ]
        best = min(made, key=lambda one: min(self.once(*one, self.case["times"][-1:])[0] for _ in range(3)))
        self.forms = {best[0]: self.forms[best[0]]}
        return best

    def once(self, form, integrator, times):
        integrator.state[:] = self.forms[form][1]
        integrator.time = 0.0
        with Stopwatch() as watch:
            outcome, *_, states = integrator.propagate_grid([0.0, *times])
        if outcome != hy.taylor_outcome.time_limit:
            raise Failed(str(outcome))
        return watch.seconds, [self.state(form, np.asarray(row, dtype=float)) for row in states[1:]]

    def state(self, form, row):
        bodies = row.reshape(len(self.case["bodies"]), -1)
        if form == "point":
            return [c for body in bodies for c in point_state(body[:3], body[3:])]
        attitude = {"quaternion": lambda a: matrix_of(a), "matrix": lambda a: a.reshape(3, 3)}[form]
        return [c for b in bodies for c in rigid_state(b[:3], b[3:6], attitude(b[6:-3]), b[-3:])]


def offer(case):
    return {"Taylor": ("tolerance", Flight(case).fly)}


serve(f"heyoka {hy.__version__}", offer)
