"""Executes a ROS 2 launch file against the stand-in for `launch`.

Prints a JSON object: `arguments`, each launch argument's name and description, and `commands`, the command lines of
the processes that would be started, and `shutdowns`, the reasons for which the end of each would shut down a system that
runs and one that is shutting down already; the latter two only where arguments are given.
Usage: compose_launch.py FILE [name:=value …]
"""

import json
import runpy
import sys
import tempfile
from pathlib import Path

import launch_stand_in as launch


def processes(entities, given):
    """The processes in the order of their start, and the context in which they run."""
    arguments = dict(argument.split(":=", 1) for argument in given)
    declared = {entity.name for entity in entities if isinstance(entity, launch.DeclareLaunchArgument)}
    if unknown := arguments.keys() - declared:
        sys.exit(f"no launch argument is called {', '.join(sorted(unknown))}")
    context = launch.LaunchContext(arguments, Path(tempfile.mkdtemp(dir=".")).resolve())
    composed = []
    pending = list(entities)
    while pending:
        entity = pending.pop(0)
        if isinstance(entity, launch.Node):
            composed.append(entity)
        else:
            pending[:0] = entity.execute(context)
    return composed, context


def shutdowns(process, context):
    """The reasons for which its end shuts down, while the system runs and when it is shutting down."""
    reasons = []
    for context.is_shutdown in (False, True):
        reasons.append([action.reason for action in process.ended(context) if isinstance(action, launch.Shutdown)])
    return reasons


def main():
    launch.install()
    file, *given = sys.argv[1:]
    entities = runpy.run_path(file)["generate_launch_description"]().entities
    arguments = {
        entity.name: entity.description
        for entity in entities
        if isinstance(entity, launch.DeclareLaunchArgument)
    }
    composed, context = processes(entities, given) if given else ([], None)
    launched = {
        "arguments": arguments,
        "commands": [process.command(context) for process in composed],
        "shutdowns": [shutdowns(process, context) for process in composed],
    }
    json.dump(launched, sys.stdout)


if __name__ == "__main__":
    main()
