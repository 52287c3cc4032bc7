"""Prints the reference of `wheels.rs`: a body with reaction wheels whose motors act, integrated by Basilisk (PyPI `bsk` 2.12.1).

    pip install bsk==2.12.1 && python basilisk_wheels.py

Classical Runge-Kutta with steps of 1 ms, balanced wheels without friction, no gravity. The orientation is given as modified
Rodrigues parameters from the inertial frame to the body, as Basilisk has it.
"""

from Basilisk.architecture import messaging
from Basilisk.simulation import reactionWheelStateEffector, spacecraft
from Basilisk.utilities import SimulationBaseClass, macros

STEP, DURATION = 0.001, 20.0
INERTIA = [[1.2, 0.1, -0.05], [0.1, 1.5, 0.08], [-0.05, 0.08, 0.9]]
RATE = [0.05, -0.08, 0.03]
WHEELS = [  # axis, inertia, speed, torque
    ([1.0, 0.2, 0.1], 0.004, 120.0, 0.02),
    ([-0.1, 1.0, 0.3], 0.006, -90.0, -0.015),
    ([0.2, -0.3, 1.0], 0.005, 200.0, 0.01),
]


def fly(step):
    simulation = SimulationBaseClass.SimBaseClass()
    process = simulation.CreateNewProcess("process")
    process.addTask(simulation.CreateNewTask("task", macros.sec2nano(step)))
    body = spacecraft.Spacecraft()
    body.hub.mHub = 10.0
    body.hub.IHubPntBc_B = INERTIA
    body.hub.r_BcB_B = [[0.0], [0.0], [0.0]]
    body.hub.sigma_BNInit = [[0.0], [0.0], [0.0]]
    body.hub.omega_BN_BInit = [[rate] for rate in RATE]
    effector = reactionWheelStateEffector.ReactionWheelStateEffector()
    for axis, inertia, speed, _ in WHEELS:
        length = sum(part * part for part in axis) ** 0.5
        wheel = reactionWheelStateEffector.RWConfigPayload()
        wheel.rWB_B = [[0.0], [0.0], [0.0]]
        wheel.gsHat_B = [[part / length] for part in axis]
        wheel.w2Hat0_B = [[0.0], [0.0], [0.0]]
        wheel.w3Hat0_B = [[0.0], [0.0], [0.0]]
        wheel.Js, wheel.Jt, wheel.Jg = inertia, inertia / 2, inertia / 2
        wheel.Omega = speed
        wheel.RWModel = 0
        wheel.u_max = wheel.Omega_max = wheel.P_max = -1.0
        effector.addReactionWheel(wheel)
    body.addStateEffector(effector)
    command = messaging.ArrayMotorTorqueMsgPayload()
    command.motorTorque = [torque for *_, torque in WHEELS]
    message = messaging.ArrayMotorTorqueMsg().write(command)
    effector.rwMotorCmdInMsg.subscribeTo(message)
    simulation.AddModelToTask("task", effector)
    simulation.AddModelToTask("task", body)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(DURATION))
    simulation.ExecuteSimulation()
    state, wheels = body.scStateOutMsg.read(), effector.rwSpeedOutMsg.read()
    return {
        "mrp": list(state.sigma_BN),
        "rate": list(state.omega_BN_B),
        "speeds": list(wheels.wheelSpeeds)[: len(WHEELS)],
    }


end, coarse = fly(STEP), fly(2 * STEP)
print(end)
print("largest difference to twice the step:", max(abs(a - b) for key in end for a, b in zip(end[key], coarse[key])))
