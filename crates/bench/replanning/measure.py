"""How soon a plan made in flight is there: flights in real time through the nodes, planned anew ten times a second.

    cargo build --release -p lgvi --bin lgvi
    python3 crates/bench/replanning/measure.py

The scene is flown in turns on the machine as it is and on a loaded one, where as many processes as there are cores do nothing but
compute. Table, picture and all figures are written to the directory of `--output`.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

import histogram
import report

ROOT = Path(__file__).resolve().parents[3]
SCENE = ROOT / "scenes/inclination_replan.toml"

# Wall-clock time from one plan to the next (s).
PERIOD = 0.1


class Load:
    """Processes that keep the cores busy until the end of the block."""

    def __init__(self, count):
        self.count = count

    def __enter__(self):
        spin = [sys.executable, "-c", "while True: pass"]
        self.processes = [subprocess.Popen(spin) for _ in range(self.count)]

    def __exit__(self, *_):
        for process in self.processes:
            process.kill()
        for process in self.processes:
            process.wait()


class Cores:
    """Who has had the cores since this was made."""

    def __init__(self):
        self.before = self.now()

    @staticmethod
    def now():
        # user, nice, system, idle, iowait, irq, softirq, steal
        ticks = [int(field) for field in Path("/proc/stat").read_text().split("\n", 1)[0].split()[1:9]]
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        ours = (usage.ru_utime + usage.ru_stime) * os.sysconf("SC_CLK_TCK")
        return sum(ticks), ticks[3] + ticks[4], ours

    def shares(self):
        """Of the processes that were started here and have ended, and of all others."""
        total, idle, ours = (now - then for now, then in zip(self.now(), self.before))
        return ours / total, (total - idle - ours) / total


def lgvi(arguments, directory, *command):
    """Runs the program; the JSON that it prints."""
    environment = os.environ | {
        "ROS_DOMAIN_ID": str(arguments.domain),
        "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        "LGVI_SHM_ROOT": str(directory),
    }
    nice = ["nice", "-n", str(arguments.nice)] if arguments.nice else []
    command = [*nice, str(arguments.lgvi), *map(str, command), "--json"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, cwd=directory)
    if done.returncode != 0:
        sys.exit(f"{' '.join(command)} ended with {done.returncode}:\n{done.stdout}\n{done.stderr}")
    return json.loads(done.stdout)


def fly(arguments, busy, seed):
    """One flight among `busy` other processes."""
    settings = {
        "run.steps": arguments.steps,
        "maneuver.replan.every": arguments.every,
        "maneuver.replan.deadline": arguments.deadline,
        "disturbance.seed": seed,
    }
    settings = [f"--set={key}={value}" for key, value in settings.items()]
    with tempfile.TemporaryDirectory() as name:
        step = lgvi(arguments, name, "explain", SCENE, *settings)["integrator"]["step_size"]
        factor = f"--real-time-factor={arguments.every * step / PERIOD!r}"
        with Load(busy):
            cores = Cores()
            flown = lgvi(arguments, name, "run", SCENE, factor, "--no-plot", "--output=bag", *settings)
            nodes, others = cores.shares()
    flight, replanned = flown["flight"], flown["replanned"]
    print(
        f"seed {seed}, {busy} busy processes: {replanned['published']} plans, {replanned['kept']} kept, "
        f"{flight['late_controls']} refused, miss {flight['miss']['norm']:.1e}; cores: nodes {nodes:.2f}, others {others:.2f}",
        flush=True,
    )
    return {
        "busy": busy,
        "seed": seed,
        "nodes": nodes,
        "others": others,
        "refused": flight["late_controls"],
        "overruns": flight["overruns"],
        "miss": flight["miss"]["norm"],
        "replans": replanned["replans"],
    }


def main():
    cores = len(os.sched_getaffinity(0))
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--lgvi", type=Path, default=ROOT / "target/release/lgvi", help="the program")
    parser.add_argument("--flights", type=int, default=11, help="of each kind")
    parser.add_argument("--steps", type=int, default=500, help="of a flight")
    parser.add_argument("--every", type=int, default=5, help="steps from one plan to the next, in 0.1 s")
    parser.add_argument("--deadline", type=float, default=0.08, help="seconds from a state to the plan")
    parser.add_argument("--busy", type=int, nargs="+", default=[0, cores], help="busy processes, of each kind of flight")
    parser.add_argument("--nice", type=int, default=0, help="niceness of the nodes; below 0 it needs the right to it")
    parser.add_argument("--domain", type=int, default=101, help="the DDS domain, which nobody else should use")
    parser.add_argument("--output", type=Path, default=ROOT / "target/bench")
    arguments = parser.parse_args()
    arguments.lgvi = arguments.lgvi.resolve()
    flights = [fly(arguments, busy, seed) for seed in range(1, arguments.flights + 1) for busy in arguments.busy]
    arguments.output.mkdir(parents=True, exist_ok=True)
    kinds = [report.Kind(busy, arguments, [one for one in flights if one["busy"] == busy]) for busy in arguments.busy]
    table = report.table(kinds)
    print(table)
    for kind in kinds:
        print(kind.kept_because())
    (arguments.output / "replanning.md").write_text(table)
    (arguments.output / "replanning.json").write_text(json.dumps(flights))
    histogram.draw(
        arguments.output / "replanning.svg",
        f"inclination_replan, N = {arguments.steps}: plans made in flight, every {PERIOD:g} s",
        {kind.label: [1e3 * seconds for seconds in kind.seconds] for kind in kinds},
        1e3 * arguments.deadline,
    )


if __name__ == "__main__":
    main()
