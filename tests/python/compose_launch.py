"""Executes a ROS 2 launch file against the stand-in for `launch`.

Prints a JSON object: `arguments`, each launch argument's name and description, and `commands`, the command lines of
the processes that would be started; the latter only where arguments are given.
Usage: compose_launch.py FILE [name:=value …]
"""

import json
import runpy
import sys
import tempfile
from pathlib import Path

import launch_stand_in as launch


def commands(entities, given):
    """The command lines, in the order in which they are started."""
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
            composed.append(entity.command(context))
        else:
            pending[:0] = entity.execute(context)
    return composed


def main():
    launch.install()
    file, *given = sys.argv[1:]
    entities = runpy.run_path(file)["generate_launch_description"]().entities
    arguments = {
        entity.name: entity.description
        for entity in entities
        if isinstance(entity, launch.DeclareLaunchArgument)
    }
    composed = commands(entities, given) if given else []
    json.dump({"arguments": arguments, "commands": composed}, sys.stdout)


if __name__ == "__main__":
    main()
