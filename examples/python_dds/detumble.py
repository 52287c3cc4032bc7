#!/usr/bin/env python3
"""Stops the spacecraft's rotation, and watches it: Python and Cyclone DDS, without ROS and without any code of lgvi.

    pip install cyclonedds==11.0.1
    cargo run --release -- run scenes/inclination_change.toml --no-planner      # waits for controls
    python3 examples/python_dds/detumble.py                                     # in another terminal

The controls are a feedback law, moment = -DAMPING times the angular momentum, which the propagator evaluates at each
step. Prints angular velocity and energy of each published step, until the flight is over.
"""

import math
import os
import time

# The loopback interface alone, as `lgvi run` has it, and no multicast. Leave it out to talk to other hosts.
os.environ.setdefault("CYCLONEDDS_URI", """
<CycloneDDS><Domain id="any">
  <General>
    <Interfaces><NetworkInterface name="lo"/></Interfaces>
    <AllowMulticast>false</AllowMulticast>
  </General>
  <Discovery>
    <ParticipantIndex>auto</ParticipantIndex>
    <Peers><Peer address="localhost"/></Peers>
  </Discovery>
</Domain></CycloneDDS>""")

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic
from cyclonedds.util import duration

from messages import BodyState, ControlLimits, ControlSequence, Header, Invariants, Odometry, Time, Vector3

BODY = "spacecraft"
STEPS = 1000
STEP_SIZE = 0.902976 / STEPS  # the scene's, in seconds
DAMPING = 50.0  # 1/s

# ROS 2 speaks plain CDR. Reliable: nothing is lost. Transient local: a propagator that starts later gets the controls.
PLAIN_CDR = Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False)
RELIABLE = Qos(PLAIN_CDR, Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepAll)
LATCHED = Qos(Policy.Durability.TransientLocal, base=RELIABLE)


def detumbling():
    """The law u = u* - K dz, with u* = 0, at rest as the reference, and only moment and angular momentum coupled."""
    gain = [0.0] * 72  # K: 6 rows (force, moment) by 12 columns (position, momentum, attitude, angular momentum)
    for axis in range(3):
        gain[12 * (3 + axis) + 9 + axis] = DAMPING
    nothing = [Vector3(0.0, 0.0, 0.0)] * STEPS
    rest = BodyState(BODY, [0.0] * 3, [0.0] * 3, [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0], [0.0] * 3)
    unbounded = ControlLimits([math.inf] * 3, [math.inf] * 3, math.inf, math.inf)
    # A stamp of 0 is none: the recorder logs the sequence at the last stamp of the flight, or waits for the first.
    return ControlSequence(
        Header(Time(0, 0), ""), BODY, 0, STEP_SIZE, nothing, nothing, [rest] * STEPS, gain * STEPS, unbounded
    )


def main():
    participant = DomainParticipant(int(os.environ.get("ROS_DOMAIN_ID") or 0))

    def topic(name, kind):  # a ROS topic is called rt/... in DDS
        return Topic(participant, "rt/lgvi_propagator/" + name, kind)

    odometry = DataReader(participant, topic(f"odometry/{BODY}", Odometry), qos=RELIABLE)
    invariants = DataReader(participant, topic("invariants", Invariants), qos=RELIABLE)
    controls = DataWriter(participant, topic("control_sequence", ControlSequence), qos=LATCHED)

    # Who listens before the controls are there sees the flight from its first step.
    while not (odometry.get_matched_publications() and invariants.get_matched_publications()):
        time.sleep(0.01)
    controls.write(detumbling())

    waiting = {}  # samples by their stamp, until both of a step are there
    flying = True
    while flying:
        time.sleep(0.01)
        flying = bool(odometry.get_matched_publications())
        for reader in (odometry, invariants):
            for sample in reader.take(1000):
                if isinstance(sample, (Odometry, Invariants)):
                    stamp = sample.header.stamp.sec, sample.header.stamp.nanosec
                    waiting.setdefault(stamp, {})[type(sample)] = sample
        for stamp in sorted(waiting):
            if len(waiting[stamp]) == 2:
                samples = waiting.pop(stamp)
                rate = samples[Odometry].twist.twist.angular
                print("%d.%09d" % stamp, rate.x, rate.y, rate.z, samples[Invariants].energy)


if __name__ == "__main__":
    main()
