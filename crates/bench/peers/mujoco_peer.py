"""MuJoCo: one rigid body, free or on a ball joint, by each of its integrators. Needs `pip install mujoco`."""

import os
import tempfile

import mujoco
import numpy as np
from protocol import Stopwatch, ends, matrix_of, quaternion_of, rigid_state, serve

INTEGRATORS = ["Euler", "implicit", "RK4"]

MODEL = """
<mujoco>
  <compiler autolimits="false" boundmass="0" boundinertia="0"/>
  <option integrator="{integrator}" timestep="{h!r}" gravity="0 0 {g!r}">
    <flag autoreset="disable"/>
  </option>
  <worldbody>
    <body>
      <joint type="{joint}"/>
      <inertial mass="{mass!r}" pos="{center}" fullinertia="{inertia}"/>
    </body>
  </worldbody>
</mujoco>
"""


def numbers(values):
    return " ".join(repr(float(value)) for value in values)


def model(case, integrator, h):
    (body,) = case["bodies"]
    inertia, center = np.diag(body["J"]), np.zeros(3)
    pivoted = case["potential"] == "uniform"
    if pivoted:
        # about the center of mass, not the pivot
        center = np.array(body["rho_c"])
        inertia = inertia - body["mass"] * (center @ center * np.eye(3) - np.outer(center, center))
    text = MODEL.format(
        integrator=integrator,
        h=h,
        g=float(case["parameters"].get("g", 0.0)),
        joint="ball" if pivoted else "free",
        mass=float(body["mass"]),
        center=numbers(center),
        inertia=numbers([*np.diag(inertia), inertia[0, 1], inertia[0, 2], inertia[1, 2]]),
    )
    return mujoco.MjModel.from_xml_string(text)


def method(case, integrator):
    (body,) = case["bodies"]
    start, turn = quaternion_of(body["R"]), body["Omega"]

    def fly(steps, times):
        steps = round(steps)
        flight = model(case, integrator, times[-1] / steps)
        data = mujoco.MjData(flight)
        data.qpos[-4:], data.qvel[-3:] = start, turn
        if case["potential"] == "none":
            data.qpos[:3], data.qvel[:3] = body["x"], body["v"]
        made, states, seconds = 0, [], 0.0
        for end in ends(times, steps):
            if end is None:
                states.append(None)
                continue
            with Stopwatch() as watch:
                mujoco.mj_step(flight, data, end - made)
            made, seconds = end, seconds + watch.seconds
            x, v = (data.qpos[:3], data.qvel[:3]) if case["potential"] == "none" else (np.zeros(3), np.zeros(3))
            states.append(rigid_state(x, v, matrix_of(data.qpos[-4:]), data.qvel[-3:]))
        return seconds, states

    return fly


def offer(case):
    if case["potential"] not in ("none", "uniform"):
        return {}
    return {integrator: ("steps", method(case, integrator)) for integrator in INTEGRATORS}


# where MuJoCo leaves a file of warnings
os.chdir(tempfile.gettempdir())
serve(f"MuJoCo {mujoco.__version__}", offer)
