#!/usr/bin/env python3
"""A stranger that tells the time: publishes on /clock through Cyclone DDS alone, over the loopback interface.

    cyclone_clock_peer.py --domain 7

Takes a time in nanoseconds a line and publishes it as rclcpp's ClockQoS has it: best effort, depth 1. Says on stderr
when it has found a subscription; exits with 0 when its input ends, with 1 when it has found none in time. Types and
names are written from the ROS 2 conventions, not taken from lgvi. Needs PyPI cyclonedds 11.0.1.
"""

import argparse
import os
import sys
import time
from dataclasses import dataclass

from cyclone_peer import PLAIN_CDR, Time, waited_for  # sets Cyclone DDS's configuration

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.pub import DataWriter
from cyclonedds.topic import Topic

CLOCK = Qos(PLAIN_CDR, Policy.Reliability.BestEffort, Policy.Durability.Volatile, Policy.History.KeepLast(1))
SECOND = 1_000_000_000


@dataclass
@final
class Clock(IdlStruct, typename="rosgraph_msgs.msg.dds_.Clock_"):
    clock: Time


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--domain", type=int, default=int(os.environ.get("ROS_DOMAIN_ID") or 0))
    parser.add_argument("--timeout", type=float, default=30.0, metavar="S")
    args = parser.parse_args()

    participant = DomainParticipant(args.domain)
    writer = DataWriter(participant, Topic(participant, "rt/clock", Clock, qos=CLOCK), qos=CLOCK)
    if not waited_for(time.monotonic() + args.timeout, writer.get_matched_subscriptions):
        sys.exit("cyclone_clock_peer: no subscription found")
    print("matched", file=sys.stderr, flush=True)
    for line in sys.stdin:
        seconds, nanoseconds = divmod(int(line), SECOND)
        writer.write(Clock(Time(seconds, nanoseconds)))


if __name__ == "__main__":
    main()
