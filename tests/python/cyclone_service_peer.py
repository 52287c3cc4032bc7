#!/usr/bin/env python3
"""A stranger that calls a service of lgvi nodes as rmw_cyclonedds_cpp does, and never reads the reply.

    cyclone_service_peer.py --domain 7 --step /lgvi_propagator/step

Says "sent" on stderr and waits to be killed; exits with 1 when no server is found in time. Types and names are written
from the ROS 2 conventions, not taken from lgvi. Needs PyPI cyclonedds 11.0.1.
"""

import argparse
import os
import sys
import time
from dataclasses import dataclass

from cyclone_action_peer import Service
from cyclone_peer import waited_for  # sets Cyclone DDS's configuration

from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.annotations import final
from cyclonedds.idl.types import int64, uint32, uint64

STEP = "lgvi_msgs.srv.dds_.Step_"


@dataclass
@final
class StepRequest(IdlStruct, typename=f"{STEP}Request_"):
    client: uint64
    number: int64
    steps: uint32


@dataclass
@final
class StepReply(IdlStruct, typename=f"{STEP}Response_"):
    client: uint64
    number: int64
    success: bool
    message: str
    step: uint64


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--domain", type=int, default=int(os.environ.get("ROS_DOMAIN_ID") or 0))
    parser.add_argument("--step", metavar="SERVICE", required=True, help="ask for one step")
    parser.add_argument("--timeout", type=float, default=30.0, metavar="S")
    args = parser.parse_args()

    service = Service(DomainParticipant(args.domain), args.step, StepRequest, StepReply)
    if not waited_for(time.monotonic() + args.timeout, service.found):
        sys.exit("cyclone_service_peer: no server found")
    service.send(1)
    print("sent", file=sys.stderr, flush=True)
    time.sleep(args.timeout)


if __name__ == "__main__":
    main()
