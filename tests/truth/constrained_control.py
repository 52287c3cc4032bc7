"""Reference costs of constrained transfers: the discrete problem of optimal_control.json under inequalities, other
terminal sets and fewer actuators, stated anew and solved by CasADi + IPOPT (PyPI casadi 3.8).

Unknowns are the states, commands and Cayley vectors f of all stages (direct transcription); the steps (4.19)-(4.23),
with the implicit (4.21) as (2.6), are constraints. IPOPT starts from a straight path, first without inequalities, then
from that solution. Run: python3 constrained_control.py > constrained_control.json
"""

import json
import math
import pathlib

import casadi as ca
import numpy as np

TRUTH = json.loads((pathlib.Path(__file__).parent / "optimal_control.json").read_text())
FULL = np.eye(6).tolist()


def skew(v):
    return ca.vertcat(
        ca.horzcat(0, -v[2], v[1]), ca.horzcat(v[2], 0, -v[0]), ca.horzcat(-v[1], v[0], 0)
    )


def cay(f):
    s = skew(f)
    return ca.DM.eye(3) + 2 / (1 + ca.dot(f, f)) * (s + s @ s)


def rotation_vector(r):
    angle = math.acos(max(-1.0, min(1.0, (np.trace(r) - 1) / 2)))
    v = np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    return v * (0.5 if angle < 1e-12 else angle / (2 * math.sin(angle)))


def rotation(v):
    angle = np.linalg.norm(v)
    s = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    if angle < 1e-12:
        return np.eye(3) + s
    return np.eye(3) + math.sin(angle) / angle * s + (1 - math.cos(angle)) / angle**2 * s @ s


class Transfer:
    """A set of optimal_control.json, or one stated like it, in n steps."""

    def __init__(self, case, n, terminal=None, actuators=FULL):
        self.case, self.n, self.h = case, n, case["T"] / n
        self.terminal = terminal or {"translation": "state", "rotation": "state"}
        self.actuators = np.array(actuators).T
        self.inertia = np.diag(case["J"])
        self.nonstandard = 0.5 * np.trace(self.inertia) * np.eye(3) - self.inertia
        self.build()

    def load(self, x, r):
        force, moment = ca.DM.zeros(3), ca.DM.zeros(3)
        mu = self.case["GM"] * self.case["m"] / 2
        if mu == 0:
            return force, moment
        for side in (0.5, -0.5):
            rho = ca.DM([side * self.case["l"], 0, 0])
            d = x + r @ rho
            f = -mu * d / ca.dot(d, d) ** 1.5
            force += f
            moment += ca.cross(rho, r.T @ f)
        return force, moment

    def build(self):
        n, h, m, bc = self.n, self.h, self.case["m"], self.case["bc"]
        count = self.actuators.shape[1]
        x, g = ca.MX.sym("x", 3, n + 1), ca.MX.sym("g", 3, n + 1)
        r, p = ca.MX.sym("r", 9, n + 1), ca.MX.sym("p", 3, n + 1)
        f, w = ca.MX.sym("f", 3, n), ca.MX.sym("w", count, n)
        a = [ca.SX.sym(s, k) for s, k in (("x", 3), ("g", 3), ("r", 9), ("p", 3), ("f", 3), ("w", count))]
        next_ = [ca.SX.sym(s, k) for s, k in (("X", 3), ("G", 3), ("R", 9), ("P", 3))]
        attitude, turned = ca.reshape(a[2], 3, 3), ca.reshape(next_[2], 3, 3)
        turn = cay(a[4])
        force, moment = self.load(next_[0], turned)
        u = ca.DM(self.actuators) @ a[5]
        hp = h * a[3]
        step = ca.vertcat(
            next_[0] - a[0] - h / m * a[1],
            next_[1] - a[1] - h * (force + u[:3]),
            next_[2] - ca.reshape(attitude @ turn, 9, 1),
            next_[3] - turn.T @ a[3] - h * (moment + u[3:]),
            hp + ca.cross(hp, a[4]) + ca.dot(hp, a[4]) * a[4] - 2 * ca.DM(self.inertia) @ a[4],
        )
        step = ca.Function("step", a + next_, [step]).map(n)
        defects = step(x[:, :n], g[:, :n], r[:, :n], p[:, :n], f, w, x[:, 1:], g[:, 1:], r[:, 1:], p[:, 1:])
        start = ca.vertcat(x[:, 0] - bc["x0"], g[:, 0] - bc["gamma0"],
                           r[:, 0] - np.array(bc["R0"]).flatten("F"), p[:, 0] - bc["Pi0"])
        self.equal = [ca.vec(defects), start] + self.end(x[:, n], g[:, n], ca.reshape(r[:, n], 3, 3), p[:, n])
        self.unknowns = (x, g, r, p, f, w)
        self.cost = h / 2 * ca.sumsqr(w)

    def end(self, x, g, r, p):
        bc, conditions = self.case["bc"], []
        kind = self.terminal["translation"]
        if kind in ("state", "position"):
            conditions.append(x - bc["xN"])
        if kind == "state":
            conditions.append(g - bc["gammaN"])
        if kind == "orbit":
            m, gm = self.case["m"], self.case["GM"]
            position, velocity = np.array(bc["xN"]), np.array(bc["gammaN"]) / m
            angular = np.cross(position, velocity)
            eccentricity = np.cross(velocity, angular) / gm - position / np.linalg.norm(position)
            along = position / np.linalg.norm(position)
            side = np.cross(angular / np.linalg.norm(angular), along)
            h = ca.cross(x, g / m)
            e = ca.cross(g / m, h) / gm - x / ca.norm_2(x)
            conditions += [h - angular, ca.dot(e - eccentricity, along), ca.dot(e - eccentricity, side)]
        kind = self.terminal["rotation"]
        target = np.array(bc["RN"])
        if kind in ("state", "attitude"):
            e = target.T @ r
            conditions.append(ca.vertcat(e[2, 1] - e[1, 2], e[0, 2] - e[2, 0], e[1, 0] - e[0, 1]))
        if kind == "spin_axis":
            axis = np.array(self.terminal["axis"])
            direction = target @ axis
            basis = np.linalg.svd(direction.reshape(1, 3))[2][1:]
            conditions.append(ca.DM(basis) @ (r @ ca.DM(axis)))
        if kind in ("state", "spin_axis"):
            conditions.append(p - bc["PiN"])
        return conditions

    def inequalities(self, constraints):
        x, g, r, p, _, w = self.unknowns
        u = ca.DM(self.actuators) @ w
        found = []
        for c in constraints:
            kind = c["kind"]
            if kind == "commands":
                found += [ca.vec(w) - c["limit"], -ca.vec(w) - c["limit"]]
            if kind in ("force_components", "moment_components"):
                part = u[:3, :] if kind == "force_components" else u[3:, :]
                for sign in (1, -1):
                    found.append(ca.vec(sign * part - ca.repmat(ca.DM(c["limit"]), 1, self.n)))
            if kind in ("force_norm", "moment_norm"):
                part = u[:3, :] if kind == "force_norm" else u[3:, :]
                found.append(ca.vec(ca.sum1(part**2)) - c["limit"] ** 2)
            for k in range(1, self.n):
                if kind == "angular_rate":
                    rate = ca.solve(ca.DM(self.inertia), p[:, k])
                    rate = ca.dot(rate, ca.DM(c["axis"])) if "axis" in c else rate
                    found.append(ca.sumsqr(rate) - c["limit"] ** 2)
                if kind == "speed":
                    found.append(ca.sumsqr(g[:, k]) / self.case["m"] ** 2 - c["limit"] ** 2)
            # What start and target decide is not for the optimizer.
            for k in range(2, self.n):
                if kind == "keep_out_sphere":
                    found.append(c["radius"] ** 2 - ca.sumsqr(x[:, k] - c["center"]))
                if kind == "keep_out_cone":
                    pointing = ca.reshape(r[:, k], 3, 3) @ ca.DM(c["axis"])
                    found.append(ca.dot(pointing, ca.DM(c["direction"])) - math.cos(c["half_angle"]))
                if kind == "keep_out_ellipsoid":
                    arm = ca.DM(np.diag(1 / np.array(c["semi_axes"])) @ np.array(c["rotation"]).T) @ (x[:, k] - c["center"])
                    found.append(1 - ca.sumsqr(arm))
                if kind in ("line_of_sight", "plume"):
                    arm = ca.DM(c["point"]) - x[:, k]
                    cosine = ca.dot(ca.reshape(r[:, k], 3, 3) @ ca.DM(c["axis"]), arm) / ca.norm_2(arm)
                    inside = (cosine - math.cos(c["half_angle"])) / math.sin(c["half_angle"])
                    if kind == "line_of_sight":
                        found.append(-inside)
                    else:
                        near = 1 - ca.norm_2(arm) / c["distance"]
                        found.append(inside + near - ca.sqrt(inside**2 + near**2 + 1e-12))
                if kind == "corridor":
                    arm = x[:, k] - c["apex"]
                    found.append(math.cos(c["half_angle"]) * ca.norm_2(arm) - ca.dot(arm, ca.DM(c["axis"])))
        return found

    def guesses(self):
        """Straight paths; where the attitude has several ways, to several of its ends and round the other way."""
        if "axis" not in self.terminal:
            return [self.guess(0.0, 0)]
        return [self.guess(spin, winding) for spin in (0.0, 1.0, 2.0, 3.0, -1.0, -2.0) for winding in (0, 1, -1)]

    def guess(self, spin, winding):
        bc, n = self.case["bc"], self.n
        start, end = np.array(bc["R0"]), np.array(bc["RN"])
        end = end @ rotation(spin * np.array(self.terminal.get("axis", [0.0, 0.0, 0.0])))
        turn = rotation_vector(start.T @ end)
        if winding:
            turn *= 1 + winding * 2 * math.pi / np.linalg.norm(turn)
        t = np.linspace(0, 1, n + 1)
        x = np.outer(bc["x0"], 1 - t) + np.outer(bc["xN"], t)
        g = np.outer(bc["gamma0"], 1 - t) + np.outer(bc["gammaN"], t)
        r = np.array([(start @ rotation(s * turn)).flatten("F") for s in t]).T
        p = np.repeat((self.inertia @ turn / self.case["T"]).reshape(3, 1), n + 1, axis=1)
        f = np.repeat((turn / n / 2).reshape(3, 1), n, axis=1)
        w = np.zeros((self.actuators.shape[1], n))
        return np.concatenate([part.flatten("F") for part in (x, g, r, p, f, w)])

    def soft(self, constraints):
        """Elastic variables of spheres with a price, what they must exceed, and their cost."""
        elastic, exceeded, cost = [], [], 0
        for c in constraints:
            depths = ca.vertcat(*self.inequalities([c])) / (2 * c["radius"] ** 2)
            elastic.append(ca.MX.sym("t", depths.numel()))
            exceeded += [-elastic[-1], depths - elastic[-1]]
            cost += self.h * c["price"] * ca.sum1(elastic[-1])
        return elastic, exceeded, cost

    def solve(self, constraints, guess):
        elastic, exceeded, price = self.soft([c for c in constraints if "price" in c])
        unknowns = ca.vertcat(*[ca.vec(part) for part in self.unknowns], *elastic)
        guess = np.concatenate([np.array(guess).flatten(), np.zeros(unknowns.numel() - np.array(guess).size)])
        hard = [c for c in constraints if "price" not in c]
        equal = ca.vertcat(*self.equal)
        unequal = ca.vertcat(ca.MX(0, 1), *self.inequalities(hard), *exceeded)
        options = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-11, "max_iter": 2000,
                                                  "constr_viol_tol": 1e-11, "bound_relax_factor": 0.0}}
        problem = {"x": unknowns, "f": self.cost + price, "g": ca.vertcat(equal, unequal)}
        solver = ca.nlpsol("solver", "ipopt", problem, options)
        lower = np.concatenate([np.zeros(equal.numel()), np.full(unequal.numel(), -np.inf)])
        found = solver(x0=guess, lbg=lower, ubg=0)
        stats = solver.stats()
        own = ca.Function("own", [unknowns], [self.cost])(found["x"])
        return float(own), found["x"], stats["return_status"], stats["iter_count"]


def rest_to_rest(turn, duration, inertia):
    still = [0.0, 0.0, 0.0]
    bc = {"x0": still, "gamma0": still, "R0": np.eye(3).tolist(), "Pi0": still,
          "xN": still, "gammaN": still, "RN": rotation(np.array(turn)).tolist(), "PiN": still}
    return {"T": duration, "m": 1.0, "GM": 0.0, "l": 0.0, "J": inertia, "bc": bc}


C_I, C_II = TRUTH["C_i"], TRUTH["C_ii"]
WHEELS = rest_to_rest([0.4, 0.3, 0.5], 2.0, [1.0, 1.4, 1.9])
FLYBY = rest_to_rest([0.1, 0.2, 0.3], 2.0, [1.0, 1.4, 1.9])
FLYBY["bc"].update({"x0": [-1.0, 0.0, 0.0], "xN": [1.0, 0.0, 0.0]})
CASES = [
    ("force norm", "C_i", C_I, {}, [{"kind": "force_norm", "limit": 7.5}]),
    ("force and moment components", "C_i", C_I, {},
     [{"kind": "force_components", "limit": [5.5, 6.0, 6.5]}, {"kind": "moment_components", "limit": [0.2, 0.3, 0.25]}]),
    ("commands", "C_ii", C_II, {}, [{"kind": "commands", "limit": 5.5}]),
    ("sphere", "C_i", C_I, {}, [{"kind": "keep_out_sphere", "center": [0.4, 0.44, 0.46], "radius": 0.12}]),
    ("cone", "C_i", C_I, {},
     [{"kind": "keep_out_cone", "axis": [0.0, 1.0, 0.0], "direction": [0.36, -0.8, -0.48], "half_angle": 0.3}]),
    ("corridor", "C_ii", C_II, {},
     [{"kind": "corridor", "apex": [1.0, 0.0, 0.0], "axis": [-0.8, -0.6, 0.0], "half_angle": 0.35}]),
    ("angular rate", "C_i", C_I, {}, [{"kind": "angular_rate", "limit": 4.5}]),
    ("angular rate about an axis", "C_i", C_I, {}, [{"kind": "angular_rate", "limit": 3.2, "axis": [0.0, 0.6, 0.8]}]),
    ("speed", "C_i", C_I, {}, [{"kind": "speed", "limit": 2.4}]),
    ("ellipsoid", "C_i", C_I, {},
     [{"kind": "keep_out_ellipsoid", "center": [0.4, 0.44, 0.46], "semi_axes": [0.1, 0.15, 0.25],
       "rotation": [[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]]}]),
    ("line of sight", "C_i", C_I, {},
     [{"kind": "line_of_sight", "axis": [0.0, 1.0, 0.0], "point": [0.2, 1.2, -0.3], "half_angle": 1.75}]),
    ("plume turned away", "flyby", FLYBY, {},
     [{"kind": "plume", "axis": [0.0, -1.0, 0.0], "point": [0.0, -0.8, 0.1], "half_angle": 0.3, "distance": 3.0}]),
    ("plume at a distance", "flyby", FLYBY, {},
     [{"kind": "plume", "axis": [-1.0, 0.0, 0.0], "point": [0.0, -0.8, 0.1], "half_angle": 2.4, "distance": 0.9}]),
    ("sphere with a price", "C_i", C_I, {},
     [{"kind": "keep_out_sphere", "center": [0.4, 0.44, 0.46], "radius": 0.12, "price": 27.686228648380467}]),
    ("orbit", "C_i", C_I, {"terminal": {"translation": "orbit", "rotation": "state"}}, []),
    ("position and spin axis", "C_i", C_I,
     {"terminal": {"translation": "position", "rotation": "spin_axis", "axis": [0.0, 0.0, 1.0]}}, []),
    ("position under a force norm", "C_ii", C_II,
     {"terminal": {"translation": "position", "rotation": "state"}}, [{"kind": "force_norm", "limit": 3.5}]),
    ("two wheels", "wheels", WHEELS, {"actuators": np.eye(6)[[3, 4]].tolist()}, []),
    ("two bounded wheels", "wheels", WHEELS, {"actuators": np.eye(6)[[3, 4]].tolist()},
     [{"kind": "commands", "limit": 4.0}]),
]


def main():
    n, cases = 50, []
    for name, data, case, options, constraints in CASES:
        transfer = Transfer(case, n, **options)
        found = sorted((transfer.solve([], guess) for guess in transfer.guesses()), key=lambda f: f[0])
        free, solution, *_ = found[0]
        minima = sorted({round(f[0], 8) for f in found if f[2] == "Solve_Succeeded"})
        cost, solution, status, iterations = transfer.solve(constraints, solution)
        assert status == "Solve_Succeeded", (name, status)
        cases.append({"name": name, "set": data, "N": n, **options, "constraints": constraints,
                      "free_cost": free, "free_minima": minima, "cost": cost, "ipopt_iterations": iterations})
    about = ("Costs of constrained transfers in N Lie-Euler steps, by constrained_control.py (CasADi %s, IPOPT, "
             "tolerance 1e-11). Sets are those of optimal_control.json, or given under 'sets' in its form; actuators "
             "are columns [force, moment] of unit weight." % ca.__version__)
    print(json.dumps({"about": about, "sets": {"wheels": WHEELS, "flyby": FLYBY}, "cases": cases}, indent=1))


if __name__ == "__main__":
    main()
