#!/usr/bin/env python3
"""A controller that stops the rotation of a body: Python and Cyclone DDS, without ROS and without any code of lgvi.

    pip install cyclonedds==11.0.1
    cargo run --release -- run scenes/free_body.toml --await-wrench body --control-period 0.1
    python3 examples/python_dds/detumble.py         # in another terminal, in any order: the flight waits for each answer

Prints the time (s, since 1970) and the angular velocity (rad/s) every second of the flight. What to look for: the moment is -GAIN times the angular velocity,
on moments of inertia of 1, 2 and 3 kg m^2, so the rotation fades by a factor e within 6 s at most, from 1.35 rad/s to less
than 1e-6 rad/s after 100 s.
"""

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

from messages import Header, Odometry, Vector3, Wrench, WrenchStamped

BODY = "body"
GAIN = 0.5  # N m s

# ROS 2 speaks plain CDR. Reliable: nothing is lost.
PLAIN_CDR = Policy.DataRepresentation(use_cdrv0_representation=True, use_xcdrv2_representation=False)
RELIABLE = Qos(PLAIN_CDR, Policy.Reliability.Reliable(duration(seconds=1)), Policy.History.KeepAll)


def answer(odometry):
    """The stamp says which state it answers, the frame that the moment is in the axes of the body."""
    rate = odometry.twist.twist.angular
    moment = Vector3(-GAIN * rate.x, -GAIN * rate.y, -GAIN * rate.z)
    return WrenchStamped(Header(odometry.header.stamp, odometry.child_frame_id), Wrench(Vector3(0.0, 0.0, 0.0), moment))


def main():
    participant = DomainParticipant(int(os.environ.get("ROS_DOMAIN_ID") or 0))

    def topic(name, kind):  # a ROS topic is called rt/... in DDS
        return Topic(participant, f"rt/lgvi_propagator/{name}/{BODY}", kind)

    states = DataReader(participant, topic("odometry", Odometry), qos=RELIABLE)
    wrenches = DataWriter(participant, topic("wrench", WrenchStamped), qos=RELIABLE)

    while not states.get_matched_publications():
        time.sleep(0.01)
    while states.get_matched_publications():
        for odometry in states.take_iter(timeout=duration(seconds=1)):
            if isinstance(odometry, Odometry):
                wrenches.write(answer(odometry))
                stamp, rate = odometry.header.stamp, odometry.twist.twist.angular
                if stamp.nanosec == 0:
                    print(stamp.sec, rate.x, rate.y, rate.z, flush=True)


if __name__ == "__main__":
    main()
