"""How a peer of `lgvi_bench precision` talks: lines of JSON on standard input and output.

When it is ready it says `{"peer": "name version"}`. Then each line that it reads is answered by one line:

    {"case": {...}}                     {"methods": [{"name": "...", "tuning": "tolerance" | "steps"}, ...]}
    {"fly": "...", "setting": 1e-9}     {"seconds": 0.1, "states": [[...] | null, ...]}
    {"time": "...", "setting": 1e-9}    {"seconds": 0.1}

or by `{"failed": "why"}`. A case is a file of tests/truth with `times` in place of its states. Methods are those that can
fly it, each tuned by a tolerance or by the number of steps to the last time. `seconds` is time of the process on the
processor, without setting up; `states` has one entry a time: x, v, R (row-major) and Omega of all bodies, nothing where a
fixed step does not end there. What is timed goes to the last time without a stop.
"""

import json
import os
import sys
import time
import traceback

import numpy as np


# Least time (s) for which a flight is repeated to be timed once; a shorter first one warms up.
TIMED = 5e-3


class Failed(Exception):
    """A flight that does not reach its end."""


class Stopwatch:
    """Time of this process on the processor, in seconds: some peers fly in threads of their own."""

    def __enter__(self):
        self.begun = time.process_time()
        return self

    def __exit__(self, *_):
        self.seconds = time.process_time() - self.begun


def serve(peer, offer):
    """Answers until the input ends.

    `offer(case)` gives `{name: (tuning, fly)}`, `fly(setting, times)` seconds and states at some of the case's times.
    """
    # what a library prints is none of the answers
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())

    def say(answer):
        print(json.dumps(answer), file=answers, flush=True)

    say({"peer": peer})
    methods, times = {}, []
    for line in sys.stdin:
        request = json.loads(line)
        try:
            if "case" in request:
                times = request["case"]["times"]
                methods = offer(request["case"])
                say({"methods": [{"name": name, "tuning": tuning} for name, (tuning, _) in methods.items()]})
            elif "time" in request:
                say(timed(methods[request["time"]][1], request["setting"], times[-1:]))
            else:
                say(flown(methods[request["fly"]][1], request["setting"], times))
        except Failed as why:
            say({"failed": str(why)})
        except Exception as error:
            traceback.print_exc()
            say({"failed": f"{type(error).__name__}: {error}"})


def timed(fly, setting, end):
    seconds, _ = fly(setting, end)
    if seconds >= TIMED:
        return {"seconds": seconds}
    seconds, flights = 0.0, 0
    while seconds < TIMED:
        seconds += fly(setting, end)[0]
        flights += 1
    return {"seconds": seconds / flights}


def flown(fly, setting, times):
    seconds, states = fly(setting, times)
    rows = [None if state is None else [float(number) for number in state] for state in states]
    if not all(np.isfinite(row).all() for row in rows if row is not None):
        raise Failed("it is no longer finite")
    return {"seconds": seconds, "states": rows}


def ends(times, steps):
    """For each time the number of steps after which it is reached, None where no step ends there."""
    last = times[-1]
    counts = [time * steps / last for time in times]
    return [round(count) if abs(count - round(count)) < 1e-9 * steps else None for count in counts]


def are_points(case):
    """Whether the bodies are points of mass that do not turn."""
    return case["potential"] in ("points", "central") and all(
        not np.any(body["Omega"]) and not np.any(np.array(body["points"])[:, 1:]) for body in case["bodies"]
    )


def matrix_of(q):
    """The rotation matrix of a unit quaternion, scalar first."""
    w, x, y, z = q
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]


def quaternion_of(matrix):
    """The unit quaternion of a rotation matrix, scalar first."""
    r = np.array(matrix)
    k = np.array(
        [
            [r[0, 0] - r[1, 1] - r[2, 2], 0, 0, 0],
            [r[0, 1] + r[1, 0], r[1, 1] - r[0, 0] - r[2, 2], 0, 0],
            [r[0, 2] + r[2, 0], r[1, 2] + r[2, 1], r[2, 2] - r[0, 0] - r[1, 1], 0],
            [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], np.trace(r)],
        ]
    )
    _, vectors = np.linalg.eigh(k)
    x, y, z, w = vectors[:, -1]
    return np.array([w, x, y, z])


def point_state(x, v):
    """A state of a point of mass, whose attitude stays."""
    return [*x, *v, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]


def rigid_state(x, v, matrix, omega):
    return [*x, *v, *(number for row in matrix for number in row), *omega]
