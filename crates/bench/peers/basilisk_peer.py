"""Basilisk: a spacecraft's rigid hub, free or about a center, by its default integrator and those with error control. Needs `pip install bsk`."""

import importlib.metadata

import numpy as np
from Basilisk.simulation import spacecraft, svIntegrators
from Basilisk.utilities import RigidBodyKinematics, SimulationBaseClass, simIncludeGravBody
from protocol import Failed, Stopwatch, are_points, ends, rigid_state, serve

STEPPED = {"RK4": svIntegrators.svIntegratorRK4}
ADAPTIVE = {"RKF45": svIntegrators.svIntegratorRKF45, "RKF78": svIntegrators.svIntegratorRKF78}

SECOND = 1_000_000_000


class Mission:
    """A simulation of the case, whose task has a period in nanoseconds."""

    def __init__(self, case, integrator, period):
        (body,) = case["bodies"]
        self.simulation = SimulationBaseClass.SimBaseClass()
        process = self.simulation.CreateNewProcess("process")
        process.addTask(self.simulation.CreateNewTask("task", period))
        self.craft = spacecraft.Spacecraft()
        hub = self.craft.hub
        hub.mHub = body["mass"]
        hub.r_BcB_B = [[0.0], [0.0], [0.0]]
        hub.IHubPntBc_B = np.diag(body["J"]).tolist()
        hub.r_CN_NInit, hub.v_CN_NInit = column(body["x"]), column(body["v"])
        # Basilisk's attitude turns from inertial to body
        hub.sigma_BNInit = column(RigidBodyKinematics.C2MRP(np.array(body["R"]).T))
        hub.omega_BN_BInit = column(body["Omega"])
        if case["potential"] == "central":
            self.factory = simIncludeGravBody.gravBodyFactory()
            center = self.factory.createCustomGravObject("center", case["parameters"]["GM"])
            center.isCentralBody = True
            self.factory.addBodiesTo(self.craft)
        self.integrator = integrator(self.craft)
        self.craft.setIntegrator(self.integrator)
        self.simulation.AddModelToTask("task", self.craft)
        self.simulation.InitializeSimulation()

    def fly(self, until):
        """Time (s) that it takes to get there."""
        self.simulation.ConfigureStopTime(until)
        with Stopwatch() as watch:
            self.simulation.ExecuteSimulation()
        return watch.seconds

    def state(self):
        at = self.craft.scStateOutMsg.read()
        return rigid_state(at.r_CN_N, at.v_CN_N, RigidBodyKinematics.MRP2C(np.array(at.sigma_BN)).T, at.omega_BN_B)


def column(vector):
    return [[float(number)] for number in vector]


def nanoseconds(seconds):
    whole = round(seconds * SECOND)
    if abs(whole - seconds * SECOND) > 1e-6:
        raise Failed(f"{seconds} s are not a whole number of nanoseconds")
    return whole


def by_steps(case, integrator):
    def fly(steps, times):
        steps = round(steps)
        mission = Mission(case, integrator, nanoseconds(times[-1] / steps))
        seconds, states = 0.0, []
        for time, end in zip(times, ends(times, steps)):
            if end is None:
                states.append(None)
                continue
            seconds += mission.fly(nanoseconds(time))
            states.append(mission.state())
        return seconds, states

    return fly


def by_tolerance(case, integrator):
    def fly(tolerance, times):
        # the task's period bounds the steps: that of the first time, of which the others are multiples
        mission = Mission(case, integrator, nanoseconds(case["times"][0]))
        mission.integrator.relTol = tolerance
        mission.integrator.absTol = tolerance
        seconds, states = 0.0, []
        for time in times:
            seconds += mission.fly(nanoseconds(time))
            states.append(mission.state())
        return seconds, states

    return fly


def offer(case):
    if case["potential"] != "none" and not (case["potential"] == "central" and are_points(case)):
        return {}
    methods = {name: ("steps", by_steps(case, integrator)) for name, integrator in STEPPED.items()}
    for name, integrator in ADAPTIVE.items():
        methods[name] = ("tolerance", by_tolerance(case, integrator))
    return methods


serve(f"Basilisk {importlib.metadata.version('bsk')}", offer)
