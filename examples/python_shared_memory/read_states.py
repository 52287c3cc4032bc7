#!/usr/bin/env python3
"""Reads every state of a flight, at the full rate, where the propagator has written it: Python and iceoryx2.

    pip install iceoryx2==0.10.0
    python3 examples/python_shared_memory/read_states.py
    cargo run --release -- run scenes/inclination_change.toml                   # in another terminal

Prints each state as a line of JSON until the propagator has gone. Exits with 1 if one is missing.
"""

import ctypes
import hashlib
import json
import os
import sys

import iceoryx2

TOPIC = "/lgvi_propagator/state"


# The structs of `lgvi_msgs::shm`. Name, size and alignment are compared when the service is opened.
class StateHeader(ctypes.Structure):
    _fields_ = [
        ("sequence", ctypes.c_uint64),  # counts from 0 without gaps: a gap is a loss
        ("step", ctypes.c_uint64),  # integration steps since the scene's epoch
        ("time", ctypes.c_double),  # since the scene's epoch (s)
        ("stamp_nanoseconds", ctypes.c_int64),  # simulation time since the UNIX epoch (ns)
    ]

    @staticmethod
    def type_name():
        return "lgvi/StateHeader"


class BodySample(ctypes.Structure):
    _fields_ = [
        ("name", ctypes.c_char * 32),
        ("position", ctypes.c_double * 3),  # x, inertial frame (m)
        ("linear_momentum", ctypes.c_double * 3),  # γ, inertial frame (kg m/s)
        ("attitude", ctypes.c_double * 9),  # R, body to inertial, by rows
        ("angular_momentum", ctypes.c_double * 3),  # Π, body frame (kg m²/s)
    ]

    @staticmethod
    def type_name():
        return "lgvi/BodySample"


def configuration():
    """That of iceoryx2, but for the directory of the files, and their prefix, which is made from it."""
    config = iceoryx2.config.global_config()
    root = os.environ.get("LGVI_SHM_ROOT") or f"/tmp/lgvi_{os.geteuid()}"
    digest = hashlib.sha256(os.fsencode(root.rstrip("/"))).hexdigest()
    config.global_cfg.root_path = iceoryx2.Path.new(root)
    config.global_cfg.prefix = iceoryx2.FileName.new(f"lgvi_{digest[:16]}_")
    return config


def open_states(node):
    """The service of the topic. All its processes must ask for the same numbers, those of `lgvi_middleware::shm`."""
    domain = int(os.environ.get("ROS_DOMAIN_ID") or 0)
    return (
        node.service_builder(iceoryx2.ServiceName.new(f"lgvi/{domain}{TOPIC}"))
        .publish_subscribe(iceoryx2.Slice[BodySample])
        .user_header(StateHeader)
        .enable_safe_overflow(False)
        .max_publishers(1)
        .max_subscribers(8)
        .subscriber_max_buffer_size(8192)
        .history_size(1)
        .open_or_create()
    )


def state(sample):
    header, bodies = sample.user_header().contents, sample.payload()
    # Not bodies.len(): iceoryx2 0.10 for Python says there how many bytes they have.
    count = sample.header.number_of_elements
    return {
        "sequence": header.sequence,
        "step": header.step,
        "time": header.time,
        "bodies": [
            {
                "name": body.name.decode(),
                "position": list(body.position),
                "linear_momentum": list(body.linear_momentum),
                "attitude": list(body.attitude),
                "angular_momentum": list(body.angular_momentum),
            }
            for body in (bodies[index] for index in range(count))
        ],
    }


def main():
    node = iceoryx2.NodeBuilder.new().config(configuration()).create(iceoryx2.ServiceType.Ipc)
    service = open_states(node)
    subscriber = service.subscriber_builder().buffer_size(8192).create()
    print("listening to", TOPIC, file=sys.stderr, flush=True)

    expected = None
    while True:
        # The propagator first: what it has sent before it went is there to be received.
        gone = service.dynamic_config.number_of_publishers == 0
        sample = subscriber.receive()
        if sample is not None:
            found = state(sample)
            sample.delete()  # gives the memory back
            if expected is not None and found["sequence"] != expected:
                sys.exit(f"expected sample {expected}, received {found['sequence']}")
            expected = found["sequence"] + 1
            print(json.dumps(found))
        elif gone and expected is not None:
            return
        else:
            node.wait(iceoryx2.Duration.from_millis(1))


if __name__ == "__main__":
    try:
        main()
    except iceoryx2.NodeWaitFailure:
        sys.exit(130)  # Ctrl-C
