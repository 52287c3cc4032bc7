"""Solves discrete optimal control problems of one rigid body with CasADi and IPOPT or fatrop, and says how long it took.

    casadi_peer.py

Each line of the input is a request in JSON, each line of the output its answer:

    {"build": PROBLEM, "solvers": [{"solver": "ipopt" | "fatrop", "unknowns": "controls" | "momenta" | "states",
                                    "compiled": BOOL, "tolerance": NUMBER | null,
                                    "seconds": NUMBER | null}, ...]}
        -> {"build_seconds": [NUMBER, ...]}
    {"solve": INDEX, "controls": BOOL}
        -> {"seconds": CPU, "wall": WALL, "iterations": I, "success": BOOL, "status": TEXT, "cost": J, "controls": [...]}

PROBLEM has h, mass, gm, inertia (3x3), points [[mass, x, y, z], ...], initial and target {x, gamma, R, Pi}, constraints
[{kind, ...}, ...] as INEQUALITIES reads them, and the guess {states: [{x, gamma, R, Pi}, ...], controls: [[6], ...]}, which
every solve starts from. What is commanded is force and moment, {weights: [force 3x3, moment 3x3]}, or the thrusts of thrusters
that turn with the body, {columns: [[force, moment per thrust in the body frame], ...], limits, prices, fuel: BOOL}, or the torques
of its reaction wheels, {axes: [[3], ...], limits, prices, stored: [3], fastest: BOOL}, with the momentum that they store at the start;
what is minimized is the time where the turn is to be the fastest, with the length of all steps as one more state. For
thrusters and wheels there are only "controls", without gravity. Their steps are those of the LGVI, (3.22)-(3.26), and with wheels
those of a gyrostat, whose position stays. A solve ends after `seconds` on the processor where IPOPT is asked.

The thrusters `off`, by number, have no effect from step `off_from` on. A sphere may have `radii`, one for the end of each step.

The problem is the one that lgvi solves: Lie-Euler steps (4.19)-(4.23) in central gravity, cost sum (h/2) u'Wu or, for fuel,
sum h prices'w, both ends fixed, the inequalities in each step or at its end. What was done to be fair to the peers:

- Attitudes are the Cayley vector of the deviation from the guess's attitude (3 unknowns, not 9), and so is F_k: Cayley
  vectors compose by one quotient, and (4.21) becomes an explicit function Pi(f).
- Three choices of unknowns. "controls", the usual multiple shooting: states x, gamma, attitude, Pi; commands u and f,
  with (4.21) as equalities. "momenta": states x, gamma, attitude, f; commands the next gamma and f, from which the
  controls follow, so that steps are explicit (as fatrop asks) and there are no other equalities. "states": the same
  without commands, 12 unknowns and 6 equalities a stage, the cost coupling neighbors: the least that IPOPT can have.
- Exact first and second derivatives by CasADi, of one stage, mapped over all stages and put into sparse matrices, then
  compiled (gcc -O3 -march=native): all functions of the problem together take some percent of the solver's time, the rest
  is IPOPT with MUMPS or fatrop with BLASFEO. "compiled": false is what a CasADi user has without a compiler: the same
  problem expanded to scalar operations that CasADi differentiates and interprets.
- Times are those of the solver's call alone. Building, code generation and compilation are reported apart; problems that
  differ in numbers alone share what is compiled.
- Solvers have their default options, but for the tolerance where one is given. Linear algebra runs in one thread, as
  lgvi does; the blocks are too small to gain by more.

Needs `pip install casadi`, and gcc for compiled problems.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import hashlib
import json
import shutil
import subprocess
import sys
import tempfile
import time

import casadi as ca
import numpy as np

COMPILER = ["gcc", "-O3", "-march=native", "-fPIC", "-shared"]


def cayley_vector(r):
    """f with Cay(f) = r; not for half turns."""
    return np.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]]) / (1.0 + np.trace(r))


def cayley(f):
    hat = ca.skew(f)
    return ca.SX.eye(3) + 2 / (1 + ca.dot(f, f)) * (hat + hat @ hat)


def composed(p, q):
    """The Cayley vector of Cay(p) Cay(q)."""
    return (p + q + ca.cross(p, q)) / (1 - ca.dot(p, q))


def vectors(*names):
    return [ca.SX.sym(name, 3) for name in names]


def limited(vector, limit):
    """Where a vector's norm is at most the limit."""
    return (ca.dot(vector, vector) / limit**2 - 1) / 2


def outside(center, radius, x):
    return -limited(x - center, radius)


def off_cone(axis, direction, half_angle, r):
    return ca.dot(direction, r @ axis) - ca.cos(half_angle)


def in_corridor(apex, axis, half_angle, x):
    d = x - apex
    return ca.cos(half_angle) * ca.norm_2(d) - ca.dot(axis, d)


# By kind: the names of its numbers, and g <= 0 of them with the controls and the position and attitude at the step's end.
INEQUALITIES = {
    "force": (("limit",), lambda n, u, x, r: limited(u[:3], *n)),
    "moment": (("limit",), lambda n, u, x, r: limited(u[3:], *n)),
    "sphere": (("center", "radius"), lambda n, u, x, r: outside(*n, x)),
    "inside": (("center", "radius"), lambda n, u, x, r: limited(x - n[0], n[1])),
    "cone": (("axis", "direction", "half_angle"), lambda n, u, x, r: off_cone(*n, r)),
    "corridor": (("apex", "axis", "half_angle"), lambda n, u, x, r: in_corridor(*n, x)),
}


class Loads:
    """Commands that are force (inertial) and moment (body), at the end of a step."""

    before, bounds, scale, unit = 0.0, (-np.inf, np.inf), 1.0, 1.0

    def __init__(self, commanded, number, _steps, _off):
        self.count, self.name = 6, "loads"
        self.weight = ca.diagcat(*(number("weight", weight) for weight in commanded["weights"]))

    def load(self, command, _attitude):
        return command[:3], command[3:]

    def cost(self, h, command):
        return h / 2 * ca.bilin(self.weight, command, command)

    def limits(self, _turn):
        return []

    def guess(self, load, _attitude):
        return load


class Thrusters:
    """Thrusts of thrusters that turn with the body, in parts of their limits; half of each at both ends of a step.

    The cost is in parts of that of a flight at a tenth of the limits.
    """

    before, bounds = 0.5, (0.0, 1.0)

    def __init__(self, commanded, number, steps, off):
        off, off_from = off
        self.fuel, self.name = commanded["fuel"], f"thrusters, fuel {commanded['fuel']}"
        self.unit = np.array(commanded["limits"])
        self.values = np.array(commanded["columns"]).T * self.unit
        working = self.values.copy()
        working[:, off] = 0.0
        self.columns = number("columns", self.values, lambda step: working if step >= off_from else self.values)
        prices = np.array(commanded["prices"]) * (self.unit if self.fuel else self.unit**2 / 2)
        self.scale = steps * prices.sum() * (0.1 if self.fuel else 0.01)
        self.prices = number("prices", prices / self.scale)
        self.count = len(self.unit)

    def load(self, command, attitude):
        load = self.columns @ command
        return attitude @ load[:3], load[3:]

    def cost(self, h, command):
        return h * ca.dot(self.prices, command if self.fuel else command**2)

    def limits(self, turn):
        """A step turns by less than a right angle: the equations of a step have other solutions, which cost no thrust."""
        return [ca.dot(turn, turn) - 1]

    def guess(self, load, attitude):
        load = np.concatenate([attitude.T @ load[:3], load[3:]])
        least, most = self.bounds
        return np.clip(np.linalg.pinv(self.values) @ load, least + 0.02, most - 0.02)


class Wheels(Thrusters):
    """Torques of the motors of reaction wheels, in parts of their limits, which act on the wheels and oppositely on the body."""

    bounds = (-1.0, 1.0)

    def __init__(self, commanded, number, steps, off):
        columns = [[0.0, 0.0, 0.0, *(-component for component in axis)] for axis in commanded["axes"]]
        super().__init__(commanded | {"columns": columns, "fuel": False}, number, steps, off)
        self.stored, self.fastest = np.array(commanded["stored"]), commanded["fastest"]
        self.name = f"wheels, fastest {self.fastest}"
        if self.fastest:
            self.scale = steps

    def cost(self, h, command):
        return h / self.scale if self.fastest else super().cost(h, command)


def of_steps(constraint, name):
    """What `number` takes for a number of a constraint: its value, and its values in all steps if these differ."""
    if name != "radius" or "radii" not in constraint:
        return (constraint[name],)
    radii = constraint["radii"]
    return radii[0], radii.__getitem__


def what_is_commanded(commanded, number, steps, off):
    kinds = {"weights": Loads, "columns": Thrusters, "axes": Wheels}
    kind = next(kind for key, kind in kinds.items() if key in commanded)
    return kind(commanded, number, steps, off)


class Stage:
    """What the choices of unknowns share: one step, symbolically.

    Only the unknowns in `bounded` have bounds, and the first `free` of its `states`, which are not given at the start of the flight. The
    last `ending` are given at its end.

    The problem's numbers are parameters, where they are not 0. What is compiled depends on `layout` alone.
    """

    bounded, states, ending, free = slice(0, 0), 12, 12, 0

    def __init__(self, problem):
        self.layout, symbols, values = [], [], []
        steps = len(problem["guess"]["controls"])

        def number(name, value, of_step=None):
            """A parameter, whose value in some steps may be another."""
            value = ca.sparsify(ca.DM(value))
            pattern = value.sparsity()
            symbol = ca.SX.sym(name, pattern)
            self.layout.append([name, pattern.get_triplet()])
            symbols.extend(symbol.nonzeros())
            each = [value if of_step is None else ca.project(ca.DM(of_step(step)), pattern) for step in range(steps)]
            values.append(np.array([of.nonzeros() for of in each]))
            return symbol

        self.h, self.mass, self.gm = (number(name, problem[name]) for name in ("h", "mass", "gm"))
        self.inertia = number("inertia", problem["inertia"])
        commanded = problem["commanded"]
        off = problem["off"], problem["off_from"]
        self.commanded = what_is_commanded(commanded, number, steps, off)
        self.layout.append(self.commanded.name)
        points = problem["points"] if problem["gm"] != 0 else []
        self.points = [(number("point", mass), number("place", place)) for mass, *place in points]
        self.inequalities = []
        for constraint in problem["constraints"]:
            names, value = INEQUALITIES[constraint["kind"]]
            self.layout.append(constraint["kind"])
            self.inequalities.append((value, [number(name, *of_steps(constraint, name)) for name in names]))
        self.numbers, self.values = ca.vertcat(*symbols), np.hstack(values)
        self.between, self.attitude = ca.SX.sym("between", 3), ca.SX.sym("attitude", 3, 3)
        self.parameters = ca.vertcat(self.between, ca.vec(self.attitude), self.numbers)
        self.state()

    def coordinates(self, state, deviation):
        return np.concatenate([state["x"], state["gamma"], deviation, self.spin(np.array(state["Pi"]))])

    def momentum(self, f):
        """Pi of F = Cay(f), (4.21)."""
        turned = self.inertia @ f
        return 2 / self.h * (turned + ca.cross(f, turned)) / (1 + ca.dot(f, f))

    def drift(self, x, gamma, a, f):
        """(4.19), (4.22), and gravity after it: force (inertial) and moment (body)."""
        next_x = x + self.h / self.mass * gamma
        next_a = composed(composed(self.between, a), f)
        r = self.attitude @ cayley(next_a)
        force, moment = ca.SX.zeros(3), ca.SX.zeros(3)
        for mass, place in self.points:
            d = next_x + r @ place
            pull = -self.gm * mass * d / ca.dot(d, d) ** 1.5
            force += pull
            moment += ca.cross(place, r.T @ pull)
        self.pose = next_x, r
        return next_x, next_a, force, moment

    def inverse(self, gamma, f, next_gamma, next_f, force, moment):
        """The controls of a step between known momenta, (4.20) and (4.23)."""
        kept = cayley(f).T @ self.momentum(f)
        return ca.vertcat((next_gamma - gamma) / self.h - force, (self.momentum(next_f) - kept) / self.h - moment)

    def define(self, unknowns, following, controls, constraints, turn):
        """With the unknowns of the stage, the states that follow, and the equalities; inequalities come after them."""
        values = [value(numbers, controls, *self.pose) for value, numbers in self.inequalities]
        values = ca.vertcat(*values, *self.commanded.limits(turn))
        least = [0.0] * constraints.numel() + [-np.inf] * values.numel()
        constraints = ca.vertcat(constraints, values)
        self.width, self.rows, self.least = unknowns.numel(), constraints.numel(), np.array(least)
        self.unknowns = ca.vertcat(unknowns, following)
        self.controls = ca.Function("controls", [self.unknowns, self.parameters], [controls])
        self.cost, self.constraints = self.commanded.cost(self.h, controls), constraints

    def bounds(self, which):
        """Lower (0) or upper (1) bounds of the unknowns of a stage."""
        bounds = np.full(self.width, (-np.inf, np.inf)[which])
        bounds[self.bounded] = self.commanded.bounds[which]
        bounds[: self.free] = STRETCH[which]
        return bounds

    def function(self):
        return ca.Function("stage", [self.unknowns, self.parameters], [self.cost, self.constraints])

    def gradient(self):
        outputs = [self.cost, ca.densify(ca.gradient(self.cost, self.unknowns))]
        return ca.Function("stage_gradient", [self.unknowns, self.parameters], outputs)

    def jacobian(self):
        outputs = [self.constraints, ca.jacobian(self.constraints, self.unknowns)]
        return ca.Function("stage_jacobian", [self.unknowns, self.parameters], outputs)

    def hessian(self):
        factor, multipliers = ca.SX.sym("factor"), ca.SX.sym("multipliers", self.rows)
        lagrangian = factor * self.cost + ca.dot(multipliers, self.constraints)
        hessian, gradient = ca.hessian(lagrangian, self.unknowns)
        inputs = [self.unknowns, self.parameters, factor, multipliers]
        return ca.Function("stage_hessian", inputs, [ca.densify(gradient), hessian])


class Controls(Stage):
    def state(self):
        x, gamma, a, pi, f = vectors("x", "gamma", "a", "pi", "f")
        u, following = ca.SX.sym("u", self.commanded.count), ca.SX.sym("following", self.states)
        before, after = self.commanded.before, 1 - self.commanded.before
        push, torque = self.commanded.load(u, self.attitude @ cayley(self.between) @ cayley(a))
        begun_gamma, begun_pi = gamma + before * self.h * push, pi + before * self.h * torque
        next_x, next_a, force, moment = self.drift(x, begun_gamma, a, f)
        push, torque = self.commanded.load(u, self.pose[1])
        next_gamma = begun_gamma + self.h * (force + after * push)
        next_pi = cayley(f).T @ begun_pi + self.h * (moment + after * torque)
        step = ca.vertcat(next_x, next_gamma, next_a, next_pi)
        implicit = self.h * (begun_pi - self.momentum(f))
        constraints = ca.vertcat(following - step, implicit)
        self.define(ca.vertcat(x, gamma, a, pi, u, f), following, u, constraints, f)
        self.bounded = slice(self.states, self.states + self.commanded.count)

    def spin(self, pi):
        return pi

    def commands(self, load, turn, _following, attitude):
        return np.concatenate([self.commanded.guess(np.array(load), attitude), turn])


# Lower and upper bound of the length of steps, in parts of that of the guess.
STRETCH = (0.05, 20.0)


class Slew(Controls):
    """The states are the momentum that the wheels store, the attitude and the momentum of the body; the first is free at the end."""

    states, ending = 9, 6

    def state(self):
        first = self.stretch()
        stored, a, pi, f = vectors("stored", "a", "pi", "f")
        u, following = ca.SX.sym("u", self.commanded.count), ca.SX.sym("following", self.states)
        half = self.h / 2 * self.commanded.load(u, self.attitude)[1]
        begun, middle = pi + half, stored - half
        next_a = composed(composed(self.between, a), f)
        self.pose = ca.SX.zeros(3), self.attitude @ cayley(next_a)
        next_pi = cayley(f).T @ (begun + middle) - middle + half
        step = ca.vertcat(*first, stored - 2 * half, next_a, next_pi)
        square = ca.dot(f, f)
        gyroscopic = (ca.cross(f, middle) - ca.dot(f, middle) * f - square * middle) / (1 + square)
        implicit = self.h * (begun - self.momentum(f) - gyroscopic)
        constraints = ca.vertcat(following - step, implicit)
        self.define(ca.vertcat(*first, stored, a, pi, u, f), following, u, constraints, f)
        self.bounded = slice(self.states, self.states + self.commanded.count)

    def coordinates(self, state, deviation):
        return np.concatenate([self.commanded.stored, deviation, state["Pi"]])

    def stretch(self):
        """States before the others."""
        return []


class Fastest(Slew):
    """The length of steps, in parts of that of the guess, is a state that does not change."""

    states, free = 10, 1

    def stretch(self):
        length = ca.SX.sym("length")
        self.h = length * self.h
        return [length]

    def coordinates(self, state, deviation):
        return np.concatenate([[1.0], super().coordinates(state, deviation)])


class Momenta(Stage):
    def state(self):
        x, gamma, a, f, next_gamma, next_f = vectors("x", "gamma", "a", "f", "next_gamma", "next_f")
        following = ca.SX.sym("following", self.states)
        next_x, next_a, force, moment = self.drift(x, gamma, a, f)
        controls = self.inverse(gamma, f, next_gamma, next_f, force, moment)
        step = ca.vertcat(next_x, next_gamma, next_a, next_f)
        self.define(ca.vertcat(x, gamma, a, f, next_gamma, next_f), following, controls, following - step, f)

    def spin(self, pi):
        """f with momentum(f) = pi."""
        f, given = vectors("f", "given")
        others = ca.vertcat(given, self.numbers)
        residual = ca.Function("residual", [f, others], [self.momentum(f) - given])
        root = ca.rootfinder("root", "newton", residual)
        return np.array(root(np.zeros(3), np.concatenate([pi, self.values[0]]))).ravel()

    def commands(self, _load, _turn, following, _attitude):
        return np.concatenate([following[3:6], following[9:]])


class States(Momenta):
    def state(self):
        x, gamma, a, f = vectors("x", "gamma", "a", "f")
        following = ca.SX.sym("following", self.states)
        next_x, next_a, force, moment = self.drift(x, gamma, a, f)
        controls = self.inverse(gamma, f, following[3:6], following[9:], force, moment)
        constraints = ca.vertcat(following[:3] - next_x, following[6:9] - next_a)
        self.define(ca.vertcat(x, gamma, a, f), following, controls, constraints, f)

    def commands(self, _load, _turn, _following, _attitude):
        return np.empty(0)


UNKNOWNS = {"controls": Controls, "momenta": Momenta, "states": States}


class Problem:
    """All stages: unknowns [s_0, v_0, s_1, v_1, ..., s_N]; constraints of stage 0, s_0, of the other stages, s_N."""

    def __init__(self, data, unknowns):
        kind = UNKNOWNS[unknowns]
        if "axes" in data["commanded"]:
            kind = Fastest if data["commanded"]["fastest"] else Slew
        self.stage, self.name = kind(data), unknowns
        self.states, self.ending, self.free = kind.states, kind.ending, kind.free
        self.off, self.off_from = data["off"], data["off_from"]
        states = data["guess"]["states"]
        self.n = len(states) - 1
        attitudes = [np.array(state["R"]) for state in states]
        coordinates = [self.coordinates(state, r) for state, r in zip(states, attitudes)]
        start = self.coordinates(data["initial"], attitudes[0])[self.free :]
        end = self.coordinates(data["target"], attitudes[-1])[-self.ending :]
        steps = list(zip(attitudes, attitudes[1:]))
        turns = [cayley_vector(r.T @ s) for r, s in steps]
        commands = map(self.stage.commands, data["guess"]["controls"], turns, coordinates[1:], attitudes[1:])
        pairs = [part for pair in zip(coordinates, commands) for part in pair]
        self.guess = np.concatenate([*pairs, coordinates[-1]])
        between = [np.concatenate([cayley_vector(s.T @ r), s.flatten(order="F")]) for r, s in steps]
        self.of_stages = np.hstack([between, self.stage.values])
        self.parameters = np.concatenate([self.of_stages.ravel(), start, end])
        own = [self.stage.least] * self.n
        self.least = np.concatenate([own[0], 0 * start, *own[1:], 0 * end])
        free = np.full(self.states, np.inf)
        self.bounds = [np.concatenate([*[self.stage.bounds(which)] * self.n, (2 * which - 1) * free]) for which in (0, 1)]
        self.width = self.stage.width * self.n + self.states
        self.begun = self.states - self.free
        self.given = self.begun + self.ending
        self.height = self.stage.rows * self.n + self.given

    def coordinates(self, state, about):
        return self.stage.coordinates(state, cayley_vector(about.T @ np.array(state["R"])))

    def symbols(self):
        """Unknowns and parameters, whole and by stages; a stage's unknowns with the states that follow."""
        unknowns, parameters = ca.MX.sym("x", self.width), ca.MX.sym("p", len(self.parameters))
        last = unknowns[-self.states :]
        stages = ca.reshape(unknowns[: -self.states], self.stage.width, self.n)
        following = ca.horzcat(stages[: self.states, 1:], last)
        of_stages = ca.reshape(parameters[: -self.given], -1, self.n)
        return [unknowns, parameters], [ca.vertcat(stages, following), of_stages]

    def constraints(self, unknowns, parameters, values):
        start, end = parameters[-self.given : -self.ending], parameters[-self.ending :]
        ends = unknowns[self.free : self.states] - start, unknowns[-self.ending :] - end
        return ca.vertcat(values[:, 0], ends[0], ca.vec(values[:, 1:]), ends[1])

    def gradient(self, parts):
        """From the gradients of all stages, where those of the states that follow are added to the next stage's."""
        width = self.stage.width
        rest = ca.MX.zeros(width - self.states, self.n)
        shifted = ca.vertcat(parts[width:, :], rest)
        before = ca.horzcat(ca.MX.zeros(width, 1), shifted[:, :-1])
        return ca.vertcat(ca.vec(parts[:width, :] + before), parts[width:, -1])

    def placed(self, pattern, rows, values, keep, fixed=()):
        """The sparse matrix of all stages' blocks with this pattern, stage k in the rows from rows[k]."""
        row, column = (np.array(index) for index in pattern.get_triplet())
        k = np.arange(self.n)[:, None]
        row, column = (rows[:, None] + row).ravel(), (self.stage.width * k + column).ravel()
        row = np.concatenate([row, *(index for index, _ in fixed)]).astype(int)
        column = np.concatenate([column, *(index for _, index in fixed)]).astype(int)
        height = self.height if fixed else self.width
        kept = np.flatnonzero(keep(row, column))
        places, which = np.unique(column[kept] * height + row[kept], return_inverse=True)
        starts = np.searchsorted(places // height, np.arange(self.width + 1))
        sparsity = ca.Sparsity(height, self.width, starts.tolist(), (places % height).tolist())
        columns = np.searchsorted(kept, np.arange(len(row) + 1))
        sums = ca.Sparsity(len(places), len(row), columns.tolist(), which.tolist())
        values = ca.reshape(values, -1, 1)
        if fixed:
            values = ca.vertcat(values, ca.DM.ones(len(row) - values.numel()))
        return ca.MX(sparsity, ca.DM(sums, 1) @ values)

    def nlp(self):
        """As CasADi takes it, with nothing but the stages."""
        (unknowns, parameters), stages = self.symbols()
        costs, values = self.stage.function().map(self.n)(*stages)
        constraints = self.constraints(unknowns, parameters, values)
        return {"x": unknowns, "p": parameters, "f": ca.sum2(costs), "g": constraints}

    def functions(self, triangular):
        """The functions that CasADi's interface of the solver asks of a compiled problem, by their names."""
        inputs, stages = self.symbols()
        n, stage = self.n, self.stage
        costs, values = stage.function().map(n)(*stages)
        cost, constraints = ca.sum2(costs), self.constraints(*inputs, values)
        gradient = self.gradient(stage.gradient().map(n)(*stages)[1])

        rows = stage.rows * np.arange(n) + self.begun * (np.arange(n) > 0)
        i, j = np.arange(self.begun), np.arange(-self.ending, 0)
        ends = [(stage.rows + i, self.free + i), (self.height + j, self.width + j)]
        values, blocks = stage.jacobian().map(n)(*stages)
        pattern = stage.jacobian().sparsity_out(1)
        jacobian = self.placed(pattern, rows, blocks.nz[:], lambda row, _: row >= 0, ends)
        first = [self.constraints(*inputs, values), jacobian]

        dual = [*inputs, ca.MX.sym("lam_f"), ca.MX.sym("lam_g", self.height)]
        of_stages = [dual[3][: stage.rows], dual[3][stage.rows + self.begun : -self.ending]]
        multipliers = ca.reshape(ca.vertcat(*of_stages), stage.rows, n)
        parts, blocks = stage.hessian().map(n)(*stages, ca.repmat(dual[2], 1, n), multipliers)
        before, between = ca.MX.zeros(self.free), ca.MX.zeros(self.width - self.states - self.ending)
        ends = ca.vertcat(before, dual[3][stage.rows : stage.rows + self.begun], between, dual[3][-self.ending :])
        dual_gradient = self.gradient(parts) + ends
        keep = (lambda row, column: row <= column) if triangular else (lambda row, _: row >= 0)
        pattern = stage.hessian().sparsity_out(1)
        hessian = self.placed(pattern, stage.width * np.arange(n), blocks.nz[:], keep)

        names, dual_names = ["x", "p"], ["x", "p", "lam_f", "lam_g"]
        slope = {"f": cost, "grad_f_x": gradient} if triangular else {"grad_f_x": gradient}
        second = {"grad_gamma_x": dual_gradient, "hess_gamma_x_x": hessian}
        if triangular:
            second = {"triu_hess_gamma_x_x": hessian}
        whole = [cost, constraints, dual_gradient, ca.MX.zeros(len(self.parameters))]
        return [
            ca.Function("nlp", inputs, [cost, constraints], names, ["f", "g"]),
            ca.Function("nlp_f", inputs, [cost], names, ["f"]),
            ca.Function("nlp_g", inputs, [constraints], names, ["g"]),
            ca.Function("nlp_grad_f", inputs, list(slope.values()), names, list(slope)),
            ca.Function("nlp_jac_g", inputs, first, names, ["g", "jac_g_x"]),
            ca.Function("nlp_hess_l", dual, list(second.values()), dual_names, list(second)),
            ca.Function("nlp_grad", dual, whole, dual_names, ["f", "g", "grad_gamma_x", "grad_gamma_p"]),
        ]

    def compiled(self, solver, directory):
        layout = hashlib.sha256(json.dumps([self.n, self.stage.layout]).encode()).hexdigest()[:16]
        name = f"nlp_{solver}_{self.name}_{layout}"
        library = os.path.join(directory, f"{name}.so")
        if not os.path.exists(library):
            generator = ca.CodeGenerator(name)
            for function in self.functions(solver == "ipopt"):
                generator.add(function)
            generator.generate(directory + os.sep)
            subprocess.run([*COMPILER, os.path.join(directory, f"{name}.c"), "-o", library], check=True)
        return library

    def options(self, solver, tolerance, seconds):
        inner = {"print_level": 0}
        if solver == "ipopt":
            names = ("tol", "constr_viol_tol", "dual_inf_tol", "compl_inf_tol")
            structure = {}
            inner |= {"sb": "yes"}
            if seconds is not None:
                inner["max_cpu_time"] = seconds
        else:
            names = ("tolerance",)
            others = self.stage.rows - self.states
            structure = {
                "structure_detection": "manual",
                "N": self.n,
                "nx": [self.states] * (self.n + 1),
                "nu": [self.stage.width - self.states] * self.n + [0],
                "ng": [others + self.begun] + [others] * (self.n - 1) + [self.ending],
                "equality": [bool(least == 0) for least in self.least],
            }
        if tolerance is not None:
            inner |= dict.fromkeys(names, tolerance)
        return {"print_time": False, solver: inner, **structure}

    def solver(self, asked, directory):
        kind = asked["solver"]
        options = self.options(kind, asked["tolerance"], asked["seconds"])
        if not asked["compiled"]:
            return ca.nlpsol("solver", kind, self.nlp(), options | {"expand": True})
        return ca.nlpsol("solver", kind, self.compiled(kind, directory), options)

    def solve(self, solver, with_controls):
        before = time.perf_counter(), time.process_time()
        found = solver(x0=self.guess, p=self.parameters, lbx=self.bounds[0], ubx=self.bounds[1], lbg=self.least, ubg=0)
        wall, seconds = time.perf_counter() - before[0], time.process_time() - before[1]
        stats = solver.stats()
        return {
            "seconds": seconds,
            "wall": wall,
            "iterations": stats["iter_count"],
            "success": bool(stats["success"]),
            "status": str(stats["return_status"]),
            "cost": float(found["f"]) * self.stage.commanded.scale,
            "controls": self.controls(np.array(found["x"]).ravel()) if with_controls else [],
        }

    def controls(self, unknowns):
        stages = unknowns[: -self.states].reshape(self.n, -1)
        following = np.vstack([stages[1:, : self.states], unknowns[-self.states :]])
        controls = self.stage.controls.map(self.n)(np.hstack([stages, following]).T, self.of_stages.T)
        controls = np.array(controls).T * self.stage.commanded.unit
        # What has no effect is left at some small value.
        controls[self.off_from :, self.off] = 0.0
        return controls.tolist()


def main():
    directory = tempfile.mkdtemp(prefix="lgvi_casadi_")
    try:
        for line in sys.stdin:
            request = json.loads(line)
            if "build" in request:
                problems, solvers, times = {}, [], []
                for asked in request["solvers"]:
                    before = time.perf_counter()
                    name = asked["unknowns"]
                    if name not in problems:
                        problems[name] = Problem(request["build"], name)
                    problem = problems[name]
                    solvers.append((problem, problem.solver(asked, directory)))
                    times.append(time.perf_counter() - before)
                answer = {"build_seconds": times}
            else:
                problem, solver = solvers[request["solve"]]
                answer = problem.solve(solver, request["controls"])
            print(json.dumps(answer), flush=True)
    finally:
        shutil.rmtree(directory, ignore_errors=True)


main()
