"""SciPy: `solve_ivp` by DOP853 over a right-hand side in NumPy, as it is commonly used.

Attitude is a quaternion. Needs `pip install scipy`.
"""

import numpy as np
import scipy
from protocol import Failed, Stopwatch, are_points, matrix_of, point_state, quaternion_of, rigid_state, serve
from scipy.integrate import solve_ivp


def cross(a, b):
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def largest(vectors):
    """What errors of such vectors are relative to."""
    return np.abs(vectors).max() or 1.0


def points_only(case):
    """Points of mass, all pairs at once."""
    bodies = case["bodies"]
    count = len(bodies)
    masses = np.array([body["mass"] for body in bodies])
    apart = ~np.eye(count, dtype=bool)

    def mutual(_, y):
        x, v = y.reshape(2, count, 3)
        d = x[None] - x[:, None]
        squared = np.einsum("ijk,ijk->ij", d, d)
        pull = np.zeros((count, count))
        np.power(squared, -1.5, out=pull, where=apart)
        return np.concatenate([v.ravel(), np.einsum("ij,ijk->ik", constant * pull * masses, d).ravel()])

    def central(_, y):
        x, v = y.reshape(2, count, 3)
        radii = np.einsum("ik,ik->i", x, x) ** -1.5
        return np.concatenate([v.ravel(), (-gm * radii[:, None] * x).ravel()])

    constant, gm = case["parameters"].get("G"), case["parameters"].get("GM")
    places, speeds = [body["x"] for body in bodies], [body["v"] for body in bodies]
    start = np.concatenate([places, speeds]).ravel()
    scale = np.repeat([largest(places), largest(speeds)], 3 * count)

    def states(y):
        x, v = y.reshape(2, count, 3)
        return [c for one in zip(x, v) for c in point_state(*one)]

    return (central if case["potential"] == "central" else mutual), start, scale, states


def rigid(case):
    """Rigid bodies: x, v, quaternion and angular velocity of each."""
    bodies, parameters, potential = case["bodies"], case["parameters"], case["potential"]
    inertias = [np.array(body["J"]) for body in bodies]
    masses = [body["mass"] for body in bodies]
    clouds = [np.array(body["points"]).reshape(-1, 4) for body in bodies]
    moves = potential not in ("uniform", "none")

    def loads(x, r):
        """Force and torque about the origin of each body, inertial."""
        if potential == "none":
            return [np.zeros(3)], [np.zeros(3)]
        if potential == "uniform":
            weight = np.array([0.0, 0.0, masses[0] * parameters["g"]])
            return [weight], [cross(r[0] @ bodies[0]["rho_c"], weight)]
        if potential == "central":
            arms = clouds[0][:, 1:] @ r[0].T
            d = x[0] + arms
            pulls = (-parameters["GM"] * clouds[0][:, 0] * np.einsum("ij,ij->i", d, d) ** -1.5)[:, None] * d
            return [pulls.sum(0)], [np.cross(arms, pulls).sum(0)]
        if potential == "points":
            arms = [cloud[:, 1:] @ matrix.T for cloud, matrix in zip(clouds, r)]
            on = [np.zeros_like(arm) for arm in arms]
            for i in range(len(arms)):
                for j in range(i):
                    d = (x[i] + arms[i])[:, None] - (x[j] + arms[j])[None]
                    weights = -parameters["G"] * np.outer(clouds[i][:, 0], clouds[j][:, 0])
                    pulls = (weights * np.einsum("ijk,ijk->ij", d, d) ** -1.5)[..., None] * d
                    on[i] += pulls.sum(1)
                    on[j] -= pulls.sum(0)
            return [f.sum(0) for f in on], [np.cross(arm, f).sum(0) for arm, f in zip(arms, on)]
        return second_order(x, r)

    def second_order(x, r):
        d = x[0] - x[1]
        inverse = (d @ d) ** -0.5
        constant = parameters["G"]
        force = -constant * masses[0] * masses[1] * inverse**3 * d
        torques = []
        for index, inertia in enumerate(inertias):
            e = r[index].T @ d
            je = inertia * e
            outward = r[index] @ je
            scale = constant * masses[1 - index] * inverse**5
            radial = -1.5 * inertia.sum() * scale + 7.5 * (e @ je) * scale * inverse**2
            force = force + radial * d - 3.0 * scale * outward
            torques.append(3.0 * scale * cross(d, outward))
        return [force, -force], torques

    def rates(_, y):
        rows = y.reshape(-1, 13)
        r = [np.array(matrix_of(row[6:10])) for row in rows]
        forces, torques = loads(rows[:, :3], r)
        out = np.zeros_like(rows)
        for row, change, mass, inertia, matrix, force, torque in zip(rows, out, masses, inertias, r, forces, torques):
            q, w = row[6:10], row[10:]
            if moves:
                change[:3], change[3:6] = row[3:6], force / mass
            change[6] = -0.5 * (q[1:] @ w)
            change[7:10] = 0.5 * (q[0] * w + cross(q[1:], w))
            change[10:] = (matrix.T @ torque - cross(w, inertia * w)) / inertia
        return out.ravel()

    start = [[*body["x"], *body["v"], *quaternion_of(body["R"]), *body["Omega"]] for body in bodies]

    def states(y):
        return [c for row in y.reshape(-1, 13) for c in rigid_state(row[:3], row[3:6], matrix_of(row[6:10]), row[10:])]

    start = np.array(start)
    kinds = [largest(start[:, :3]), largest(start[:, 3:6]), 1.0, largest(start[:, 10:])]
    scale = np.tile(np.repeat(kinds, [3, 3, 4, 3]), len(bodies))
    return rates, start.ravel(), scale, states


def offer(case):
    rates, start, scale, states = points_only(case) if are_points(case) else rigid(case)

    def fly(tolerance, times):
        with Stopwatch() as watch:
            span = (0.0, times[-1])
            found = solve_ivp(rates, span, start, "DOP853", t_eval=times, rtol=tolerance, atol=tolerance * scale)
        if not found.success:
            raise Failed(found.message)
        return watch.seconds, [states(y) for y in found.y.T]

    return {"DOP853": ("tolerance", fly)}


serve(f"SciPy {scipy.__version__}", offer)
