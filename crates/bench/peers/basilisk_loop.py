"""Times Basilisk on the loop of `scenes/wheel_slew.toml`: a satellite that turns by its reaction wheels, with a controller at 50 Hz.

    python3 -m venv target/basilisk && target/basilisk/bin/pip install bsk==2.12.1
    target/basilisk/bin/python crates/bench/peers/basilisk_loop.py [--python] [--rounds 5]

Prints the wall-clock time of each flight and its multiple of real time. Orbit, gravity with J2 and its gradient, wheels with their
limits and friction, and initial state are those of the scene; the integrator is the classical Runge-Kutta method of order 4 with
steps of 0.02 s. The controller is the chain of Basilisk's compiled modules, or with `--python` a module in Python with the law of
`crates/middleware/examples/wheel_controller.rs`. States and speeds of wheels are recorded in memory at each step. There are no sensors, no
messages to other processes, and no files.
"""

import argparse
import math
import time

import numpy as np
from Basilisk.architecture import messaging, sysModel
from Basilisk.fswAlgorithms import attTrackingError, inertial3D, mrpFeedback, rwMotorTorque
from Basilisk.simulation import GravityGradientEffector, gravityEffector, reactionWheelStateEffector, simpleNav, spacecraft
from Basilisk.utilities import RigidBodyKinematics, SimulationBaseClass, macros

STEP, DURATION = 0.02, 120.0
GM, RADIUS, J2 = 3.986004418e14, 6378137.0, 1.08262668e-3
INERTIA = [0.35, 0.3, 0.2]
WHEEL_INERTIA = 1.5e-4
WHEELS = [([1.0, 0.0, 1.0], 150.0), ([0.0, 1.0, 1.0], -520.0), ([-1.0, 0.0, 1.0], 150.0), ([0.0, -1.0, 1.0], 150.0)]
AXES = np.array([axis for axis, _ in WHEELS]) / math.sqrt(2.0)
STIFFNESS, DAMPING = 0.1, 0.5
TARGET = [0.0, math.tan(math.pi / 8), 0.0]  # modified Rodrigues parameters of a quarter turn about y


class Controller(sysModel.SysModel):
    """The law of the example in Rust, in Python."""

    def __init__(self):
        super().__init__()
        self.state = messaging.SCStatesMsgReader()
        self.torques = messaging.ArrayMotorTorqueMsg()

    def UpdateState(self, now):
        state = self.state()
        error = RigidBodyKinematics.MRP2EP(RigidBodyKinematics.subMRP(np.array(state.sigma_BN), np.array(TARGET)))
        wanted = [
            -inertia * (STIFFNESS * 2.0 * math.copysign(1.0, error[0]) * part + DAMPING * rate)
            for inertia, part, rate in zip(INERTIA, error[1:], state.omega_BN_B)
        ]
        command = messaging.ArrayMotorTorqueMsgPayload()
        command.motorTorque = list(-AXES @ (np.array(wanted) * [1.0, 1.0, 0.5]))
        self.torques.write(command, now, self.moduleID)


def satellite():
    body = spacecraft.Spacecraft()
    body.hub.mHub = 20.0
    body.hub.IHubPntBc_B = np.diag(INERTIA).tolist()
    body.hub.r_BcB_B = [[0.0], [0.0], [0.0]]
    body.hub.r_CN_NInit = [[6878137.0], [0.0], [0.0]]
    body.hub.v_CN_NInit = [[0.0], [946.0], [7553.0]]
    body.hub.sigma_BNInit = [[0.0], [0.0], [0.0]]
    body.hub.omega_BN_BInit = [[0.0], [0.0], [0.0]]
    return body


def wheels():
    effector = reactionWheelStateEffector.ReactionWheelStateEffector()
    for axis, (_, speed) in zip(AXES, WHEELS):
        wheel = reactionWheelStateEffector.RWConfigPayload()
        wheel.rWB_B = [[0.0], [0.0], [0.0]]
        wheel.gsHat_B = [[part] for part in axis]
        wheel.w2Hat0_B = [[0.0], [0.0], [0.0]]
        wheel.w3Hat0_B = [[0.0], [0.0], [0.0]]
        wheel.Js, wheel.Jt, wheel.Jg = WHEEL_INERTIA, WHEEL_INERTIA / 2, WHEEL_INERTIA / 2
        wheel.Omega = speed
        wheel.RWModel = 0
        wheel.u_max, wheel.Omega_max, wheel.P_max = 0.02, 600.0, -1.0
        wheel.fCoulomb, wheel.cViscous, wheel.betaStatic = 5e-5, 2e-7, -1.0
        effector.addReactionWheel(wheel)
    return effector


def earth():
    planet = gravityEffector.GravBodyData()
    planet.planetName, planet.mu, planet.radEquator = "earth", GM, RADIUS
    planet.isCentralBody = True
    field = gravityEffector.SphericalHarmonicsGravityModel()
    field.radEquator, field.muBody, field.maxDeg = RADIUS, GM, 2
    # Normalized: J2 = -sqrt(5) C20.
    field.cBar = [[1.0], [0.0, 0.0], [-J2 / math.sqrt(5.0), 0.0, 0.0]]
    field.sBar = [[0.0], [0.0, 0.0], [0.0, 0.0, 0.0]]
    planet.gravityModel = field
    return planet


def modules(body, effector):
    """Basilisk's compiled chain: navigation without errors, error of attitude, law, torques of the wheels."""
    navigation = simpleNav.SimpleNav()
    navigation.scStateInMsg.subscribeTo(body.scStateOutMsg)
    reference = inertial3D.inertial3D()
    reference.sigma_R0N = TARGET
    error = attTrackingError.attTrackingError()
    error.attNavInMsg.subscribeTo(navigation.attOutMsg)
    error.attRefInMsg.subscribeTo(reference.attRefOutMsg)
    vehicle = messaging.VehicleConfigMsgPayload()
    vehicle.ISCPntB_B = np.diag(INERTIA).flatten().tolist()
    configuration = messaging.RWArrayConfigMsgPayload()
    configuration.GsMatrix_B = AXES.flatten().tolist()
    configuration.JsList, configuration.uMax = [WHEEL_INERTIA] * 4, [0.02] * 4
    configuration.numRW = 4
    messages = [messaging.VehicleConfigMsg().write(vehicle), messaging.RWArrayConfigMsg().write(configuration)]
    law = mrpFeedback.mrpFeedback()
    # Four parameters make an angle; the gains are those of an inertia of 0.3 kg m^2.
    law.K, law.P, law.Ki, law.integralLimit = 4 * STIFFNESS * 0.3, DAMPING * 0.3, -1.0, 0.0
    law.guidInMsg.subscribeTo(error.attGuidOutMsg)
    law.vehConfigInMsg.subscribeTo(messages[0])
    shares = rwMotorTorque.rwMotorTorque()
    shares.controlAxes_B = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    shares.vehControlInMsg.subscribeTo(law.cmdTorqueOutMsg)
    shares.rwParamsInMsg.subscribeTo(messages[1])
    effector.rwMotorCmdInMsg.subscribeTo(shares.rwMotorTorqueOutMsg)
    return [navigation, reference, error, law, shares], messages


def script(body, effector):
    controller = Controller()
    controller.state.subscribeTo(body.scStateOutMsg)
    effector.rwMotorCmdInMsg.subscribeTo(controller.torques)
    return [controller], []


def fly(controller):
    """Time that a flight takes (s), and where the satellite points at its end."""
    simulation = SimulationBaseClass.SimBaseClass()
    process = simulation.CreateNewProcess("process")
    process.addTask(simulation.CreateNewTask("task", macros.sec2nano(STEP)))
    body, effector, gradient = satellite(), wheels(), GravityGradientEffector.GravityGradientEffector()
    body.addStateEffector(effector)
    planet = earth()
    body.gravField.gravBodies = spacecraft.GravBodyVector([planet])
    gradient.addPlanetName(planet.planetName)
    body.addDynamicEffector(gradient)
    chain, _kept = controller(body, effector)
    recorders = [body.scStateOutMsg.recorder(), effector.rwSpeedOutMsg.recorder()]
    # The controller answers the state at the beginning of a step.
    for module in [effector, body, *chain, *recorders]:
        simulation.AddModelToTask("task", module)
    simulation.InitializeSimulation()
    simulation.ConfigureStopTime(macros.sec2nano(DURATION))
    begun = time.perf_counter()
    simulation.ExecuteSimulation()
    return time.perf_counter() - begun, recorders


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--python", action="store_true", help="with the controller in Python")
    parser.add_argument("--rounds", type=int, default=5)
    options = parser.parse_args()
    for _ in range(options.rounds):
        seconds, (states, speeds) = fly(script if options.python else modules)
        rotation = RigidBodyKinematics.MRP2C(states.sigma_BN[-1]) @ RigidBodyKinematics.MRP2C(np.array(TARGET)).T
        miss = math.acos(max(-1.0, min(1.0, (np.trace(rotation) - 1.0) / 2.0)))
        largest = np.abs(speeds.wheelSpeeds[:, 1]).max()
        print(
            f"{seconds:.3f} s for {DURATION:.0f} s: {DURATION / seconds:.0f} times real time, {len(states.times())} states; "
            f"{math.degrees(miss):.3f} degrees from the target, second wheel at most {largest:.1f} rad/s"
        )


if __name__ == "__main__":
    main()
