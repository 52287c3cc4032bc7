"""Solves discrete optimal control problems of one rigid body with CasADi and IPOPT or fatrop, and says how long it took.

    casadi_peer.py

Each line of the input is a request in JSON, each line of the output its answer:

    {"build": PROBLEM, "solvers": [{"solver": "ipopt" | "fatrop", "compiled": BOOL, "tolerance": NUMBER | null}, ...]}
        -> {"build_seconds": [NUMBER, ...]}
    {"solve": INDEX, "controls": BOOL}
        -> {"seconds": CPU, "wall": WALL, "iterations": I, "success": BOOL, "status": TEXT, "cost": J, "controls": [...]}

PROBLEM has h, mass, gm, inertia (3x3), points [[mass, x, y, z], ...], weights [force 3x3, moment 3x3], initial and target
{x, gamma, R, Pi}, and the guess {states: [{x, gamma, R, Pi}, ...], controls: [[6], ...]}, which every solve starts from.

The problem is the one that lgvi solves: Lie-Euler steps (4.19)-(4.23) in central gravity, cost sum (h/2) u'Wu, both ends
fixed. What was done to be fair to the peer:

- Multiple shooting with the least unknowns that keep a step explicit, as fatrop asks: states x, gamma, the Cayley
  vector of the deviation from the guess's attitude (3 numbers, not 9) and Pi; controls and the Cayley vector of
  F_k as commands; the implicit equation (4.21) as 3 equalities a stage. Cayley vectors compose by one quotient, so there
  is no matrix algebra on attitudes.
- Exact first and second derivatives by CasADi, of one stage, mapped over all stages and put into sparse matrices, then
  compiled (gcc -O3 -march=native): all functions of the problem together take some percent of the solver's time, the rest
  is IPOPT with MUMPS or fatrop with BLASFEO. "compiled": false is what a CasADi user has without a compiler: the same
  problem expanded to scalar operations that CasADi interprets.
- Times are those of the solver's call alone, in a process that has solved the same problem before. Building, code
  generation and compilation are reported apart.
- Solvers have their default options, but for the tolerance where one is given. Linear algebra runs in one thread, as
  lgvi does; the blocks are too small to gain by more.

Needs `pip install casadi`, and gcc for compiled problems.
"""

import os

os.environ["OMP_NUM_THREADS"] = "1"
os.environ["OPENBLAS_NUM_THREADS"] = "1"

import json
import shutil
import subprocess
import sys
import tempfile
import time

import casadi as ca
import numpy as np

STATES, COMMANDS = 12, 9
STAGE = STATES + COMMANDS
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


class Stage:
    """One step, symbolically: what must vanish (the next state apart), and its derivatives."""

    def __init__(self, problem):
        h, mass = problem["h"], problem["mass"]
        inertia = ca.DM(problem["inertia"])
        x, gamma, a, pi, f = (ca.SX.sym(name, 3) for name in ("x", "gamma", "a", "pi", "f"))
        u = ca.SX.sym("u", 6)
        between, attitude = ca.SX.sym("between", 3), ca.SX.sym("attitude", 3, 3)
        self.parameters = ca.vertcat(between, ca.vec(attitude))
        self.unknowns = ca.vertcat(x, gamma, a, pi, u, f)

        next_x = x + h / mass * gamma
        next_a = composed(composed(between, a), f)
        force, moment = gravity(problem, next_x, attitude @ cayley(next_a))
        next_gamma = gamma + h * (force + u[:3])
        next_pi = cayley(f).T @ pi + h * (moment + u[3:])
        # (4.21) for F = Cay(f)
        turned = inertia @ f
        implicit = h * pi - 2 * (turned + ca.cross(f, turned)) / (1 + ca.dot(f, f))
        self.defects = ca.vertcat(-next_x, -next_gamma, -next_a, -next_pi, implicit)
        weight = ca.diagcat(*(ca.DM(weight) for weight in problem["weights"]))
        self.cost = h / 2 * ca.bilin(weight, u, u)

    def function(self):
        return ca.Function("stage", [self.unknowns, self.parameters], [self.cost, self.defects])

    def gradient(self):
        outputs = [self.cost, ca.gradient(self.cost, self.unknowns)]
        return ca.Function("stage_gradient", [self.unknowns, self.parameters], outputs)

    def jacobian(self):
        outputs = [self.defects, ca.jacobian(self.defects, self.unknowns)]
        return ca.Function("stage_jacobian", [self.unknowns, self.parameters], outputs)

    def hessian(self, triangular):
        factor, multipliers = ca.SX.sym("factor"), ca.SX.sym("multipliers", 15)
        lagrangian = factor * self.cost + ca.dot(multipliers, self.defects)
        hessian, gradient = ca.hessian(lagrangian, self.unknowns)
        outputs = [gradient, ca.triu(hessian) if triangular else hessian]
        return ca.Function("stage_hessian", [self.unknowns, self.parameters, factor, multipliers], outputs)


def gravity(problem, x, r):
    """Force (inertial) and moment (body) of the attractor at the origin on the body's points."""
    force, moment = ca.SX.zeros(3), ca.SX.zeros(3)
    for mass, *place in problem["points"]:
        d = x + r @ ca.DM(place)
        pull = -problem["gm"] * mass * d / ca.dot(d, d) ** 1.5
        force += pull
        moment += ca.cross(ca.DM(place), r.T @ pull)
    return force, moment


class Problem:
    """All stages: unknowns [s_0, v_0, s_1, v_1, ..., s_N], and constraints in fatrop's order: of each stage s_k+1 - F, then
    (the first only) s_0, then (4.21); s_N at the end.
    """

    def __init__(self, data):
        self.data, self.stage = data, Stage(data)
        states = data["guess"]["states"]
        self.n = len(states) - 1
        attitudes = [np.array(state["R"]) for state in states]
        coordinates = [self.coordinates(state, r) for state, r in zip(states, attitudes)]
        self.start = self.coordinates(data["initial"], attitudes[0])
        self.end = self.coordinates(data["target"], attitudes[-1])
        steps = list(zip(attitudes, attitudes[1:]))
        commands = [
            np.concatenate([u, cayley_vector(r.T @ s)]) for u, (r, s) in zip(data["guess"]["controls"], steps)
        ]
        pairs = [part for pair in zip(coordinates, commands) for part in pair]
        self.guess = np.concatenate([*pairs, coordinates[-1]])
        between = [np.concatenate([cayley_vector(s.T @ r), s.flatten(order="F")]) for r, s in steps]
        self.parameters = np.concatenate(between)

        first = np.arange(self.n) > 0
        self.gap_rows = 15 * np.arange(self.n) + 12 * first
        implicit_rows = 15 * np.arange(self.n) + 24
        self.rows = np.vstack([self.gap_rows + i for i in range(12)] + [implicit_rows + i for i in range(3)])
        self.width, self.height = STAGE * self.n + STATES, 15 * self.n + 24

    @staticmethod
    def coordinates(state, about):
        deviation = cayley_vector(about.T @ np.array(state["R"]))
        return np.concatenate([state["x"], state["gamma"], deviation, state["Pi"]])

    def symbols(self):
        unknowns = ca.MX.sym("x", self.width)
        parameters = ca.MX.sym("p", 12 * self.n)
        stages = ca.reshape(unknowns[: STAGE * self.n], STAGE, self.n)
        return unknowns, parameters, stages, ca.reshape(parameters, 12, self.n), unknowns[STAGE * self.n :]

    def constraints(self, defects, stages, last):
        following = ca.horzcat(stages[:STATES, 1:], last)
        defects = ca.vertcat(defects[:STATES, :] + following, defects[STATES:, :])
        all_parts = ca.vertcat(ca.vec(defects), stages[:STATES, 0] - self.start, last - self.end)
        place = np.empty(self.height, int)
        place[self.rows.T.ravel()] = np.arange(15 * self.n)
        place[12:24] = 15 * self.n + np.arange(12)
        place[-12:] = 15 * self.n + 12 + np.arange(12)
        return all_parts[place.tolist()]

    def nlp(self):
        """As CasADi takes it, with nothing but the stages."""
        unknowns, parameters, stages, per_stage, last = self.symbols()
        costs, defects = self.stage.function().map(self.n)(stages, per_stage)
        return {"x": unknowns, "p": parameters, "f": ca.sum2(costs), "g": self.constraints(defects, stages, last)}

    def jacobian(self, values):
        pattern = self.stage.jacobian().sparsity_out(1)
        row, column = (np.array(index) for index in pattern.get_triplet())
        k = np.arange(self.n)[:, None]
        i = np.arange(12)
        rows = [self.rows[row, :].T, self.gap_rows[:, None] + i, 12 + i, self.height - 12 + i]
        columns = [STAGE * k + column, STAGE * (k + 1) + i, i, STAGE * self.n + i]
        rows, columns = (np.concatenate([part.ravel() for part in index]) for index in (rows, columns))
        order = np.lexsort((rows, columns))
        starts = np.concatenate([[0], np.cumsum(np.bincount(columns, minlength=self.width))])
        sparsity = ca.Sparsity(self.height, self.width, starts.tolist(), rows[order].tolist())
        ones = ca.DM.ones(12 * self.n + 24)
        values = ca.vertcat(ca.reshape(values, -1, 1), ones)
        return ca.MX(sparsity, values.nz[order.tolist()])

    def lagrangian(self, triangular):
        unknowns, parameters, stages, per_stage, last = self.symbols()
        factor, multipliers = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", self.height)
        of_stages = ca.reshape(multipliers[self.rows.T.ravel().tolist()], 15, self.n)
        hessian = self.stage.hessian(triangular)
        factors = ca.repmat(factor, 1, self.n)
        gradients, values = hessian.map(self.n)(stages, per_stage, factors, of_stages)
        blocks = [hessian.sparsity_out(1)] * self.n + [ca.Sparsity(STATES, STATES)]
        gaps = of_stages[:STATES, :]
        before = ca.horzcat(multipliers[12:24], gaps[:, :-1])
        gradients += ca.vertcat(before, ca.MX.zeros(COMMANDS, self.n))
        gradient = ca.vertcat(ca.vec(gradients), gaps[:, -1] + multipliers[-12:])
        inputs = [unknowns, parameters, factor, multipliers]
        return inputs, gradient, ca.MX(ca.diagcat(*blocks), values.nz[:])

    def functions(self, solver):
        """The functions that CasADi's interface of the solver asks of a compiled problem, by their names."""
        triangular = solver == "ipopt"
        unknowns, parameters, stages, per_stage, last = self.symbols()
        inputs, names = [unknowns, parameters], ["x", "p"]
        costs, defects = self.stage.function().map(self.n)(stages, per_stage)
        cost, constraints = ca.sum2(costs), self.constraints(defects, stages, last)
        _, gradients = self.stage.gradient().map(self.n)(stages, per_stage)
        gradient = ca.vertcat(ca.vec(ca.densify(gradients)), ca.MX.zeros(STATES))
        defects, values = self.stage.jacobian().map(self.n)(stages, per_stage)
        linear = [self.constraints(defects, stages, last), self.jacobian(values.nz[:])]
        dual, dual_gradient, hessian = self.lagrangian(triangular)
        dual_names = names + ["lam_f", "lam_g"]
        evaluate = ca.Function("evaluate", inputs, [cost, constraints])
        whole = [*evaluate(*dual[:2]), dual_gradient, ca.MX.zeros(12 * self.n)]
        second = (["triu_hess_gamma_x_x"], [hessian])
        if not triangular:
            second = (["grad_gamma_x", "hess_gamma_x_x"], [dual_gradient, hessian])
        first = (["f", "grad_f_x"], [cost, gradient]) if triangular else (["grad_f_x"], [gradient])
        return [
            ca.Function("nlp", inputs, [cost, constraints], names, ["f", "g"]),
            ca.Function("nlp_f", inputs, [cost], names, ["f"]),
            ca.Function("nlp_g", inputs, [constraints], names, ["g"]),
            ca.Function("nlp_grad_f", inputs, first[1], names, first[0]),
            ca.Function("nlp_jac_g", inputs, linear, names, ["g", "jac_g_x"]),
            ca.Function("nlp_hess_l", dual, second[1], dual_names, second[0]),
            ca.Function("nlp_grad", dual, whole, dual_names, ["f", "g", "grad_gamma_x", "grad_gamma_p"]),
        ]

    def compiled(self, solver, directory):
        name = f"nlp_{solver}"
        generator = ca.CodeGenerator(name)
        for function in self.functions(solver):
            generator.add(function)
        generator.generate(directory + os.sep)
        library = os.path.join(directory, f"{name}.so")
        subprocess.run([*COMPILER, os.path.join(directory, f"{name}.c"), "-o", library], check=True)
        return library

    def solver(self, asked, libraries, directory):
        kind, tolerance = asked["solver"], asked["tolerance"]
        options = {"print_time": False}
        if kind == "ipopt":
            inner = {"print_level": 0, "sb": "yes"}
            if tolerance is not None:
                names = ("tol", "constr_viol_tol", "dual_inf_tol", "compl_inf_tol")
                inner |= dict.fromkeys(names, tolerance)
        else:
            inner = {"print_level": 0}
            if tolerance is not None:
                inner |= {"tolerance": tolerance}
            options |= {
                "structure_detection": "manual",
                "N": self.n,
                "nx": [STATES] * (self.n + 1),
                "nu": [COMMANDS] * self.n + [0],
                "ng": [15] + [3] * (self.n - 1) + [12],
                "equality": [True] * self.height,
            }
        options[kind] = inner
        if not asked["compiled"]:
            return ca.nlpsol("solver", kind, self.nlp(), options | {"expand": True})
        if kind not in libraries:
            libraries[kind] = self.compiled(kind, directory)
        return ca.nlpsol("solver", kind, libraries[kind], options)

    def solve(self, solver, with_controls):
        before = time.perf_counter(), time.process_time()
        found = solver(x0=self.guess, p=self.parameters, lbg=0, ubg=0)
        wall, seconds = time.perf_counter() - before[0], time.process_time() - before[1]
        stats = solver.stats()
        unknowns = np.array(found["x"]).ravel()
        commands = unknowns[: STAGE * self.n].reshape(self.n, STAGE)[:, STATES : STATES + 6]
        return {
            "seconds": seconds,
            "wall": wall,
            "iterations": stats["iter_count"],
            "success": bool(stats["success"]),
            "status": str(stats["return_status"]),
            "cost": float(found["f"]),
            "controls": commands.tolist() if with_controls else [],
        }


def main():
    problem, solvers = None, []
    directory = tempfile.mkdtemp(prefix="lgvi_casadi_")
    try:
        for index, line in enumerate(sys.stdin):
            request = json.loads(line)
            if "build" in request:
                problem, solvers, libraries, times = Problem(request["build"]), [], {}, []
                place = os.path.join(directory, str(index))
                os.mkdir(place)
                for asked in request["solvers"]:
                    before = time.perf_counter()
                    solvers.append(problem.solver(asked, libraries, place))
                    times.append(time.perf_counter() - before)
                answer = {"build_seconds": times}
            else:
                answer = problem.solve(solvers[request["solve"]], request["controls"])
            print(json.dumps(answer), flush=True)
    finally:
        shutil.rmtree(directory, ignore_errors=True)


main()
