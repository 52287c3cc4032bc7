"""REBOUND: points of mass by IAS15, WHFast and leapfrog. Needs `pip install rebound`."""

import rebound
from protocol import Stopwatch, are_points, ends, point_state, serve


def simulation(case):
    """A center that attracts is a particle, which the bodies do not move."""
    sim = rebound.Simulation()
    central = case["potential"] == "central"
    sim.G = 1.0 if central else case["parameters"]["G"]
    if central:
        sim.add(m=case["parameters"]["GM"])
    for body in case["bodies"]:
        x, v = body["x"], body["v"]
        sim.add(m=0.0 if central else body["mass"], x=x[0], y=x[1], z=x[2], vx=v[0], vy=v[1], vz=v[2])
    return sim


def states(case, sim):
    particles = list(sim.particles)[-len(case["bodies"]) :]
    return [c for p in particles for c in point_state(p.xyz, p.vxyz)]


def by_tolerance(case):
    def fly(tolerance, times):
        sim = simulation(case)
        sim.integrator = "ias15"
        sim.integrator.epsilon = tolerance
        found, seconds = [], 0.0
        for time in times:
            with Stopwatch() as watch:
                sim.integrate(time)
            seconds += watch.seconds
            found.append(states(case, sim))
        return seconds, found

    return fly


def by_steps(case, integrator):
    def fly(steps, times):
        steps = round(steps)
        sim = simulation(case)
        sim.integrator = integrator
        sim.dt = times[-1] / steps
        if integrator == "whfast":
            sim.integrator.safe_mode = 0
        made, found, seconds = 0, [], 0.0
        for end in ends(times, steps):
            if end is None:
                found.append(None)
                continue
            with Stopwatch() as watch:
                sim.steps(end - made)
                sim.synchronize()
            made, seconds = end, seconds + watch.seconds
            found.append(states(case, sim))
        return seconds, found

    return fly


def offer(case):
    if not are_points(case):
        return {}
    methods = {"leapfrog": ("steps", by_steps(case, "leapfrog")), "IAS15": ("tolerance", by_tolerance(case))}
    # a method for planets, the first body being the star
    if case["potential"] == "central" or case["bodies"][0]["mass"] > 100 * case["bodies"][-1]["mass"]:
        methods["WHFast"] = ("steps", by_steps(case, "whfast"))
    return methods


serve(f"REBOUND {rebound.__version__}", offer)
