"""Has `launch` compose the nodes of a launch file, and starts none of them.

Prints a JSON object: `arguments`, each launch argument's name and description; where arguments are given also `commands`,
the command lines of the processes that would be started, and `parameters`, what the parameter files of each of them say.
Usage: compose_launch.py FILE [name:=value …]
"""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "vendor"))
import yaml
from launch import LaunchContext
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch_ros.actions import Node


def composed(entities, context):
    """The command lines of the nodes, in the order of their start."""
    for entity in entities:
        if isinstance(entity, Node):
            Node.execute(entity, context)
            yield entity.process_details["cmd"]
        else:
            yield from composed(entity.visit(context) or [], context)


def parameters(command):
    """What each parameter file of a command line says."""
    files = [value for option, value in zip(command, command[1:]) if option == "--params-file"]
    return [yaml.safe_load(Path(file).read_text()) for file in files]


def main():
    file, *given = sys.argv[1:]
    context = LaunchContext()
    context._set_is_shutdown(True)  # A node is made ready then and not started.
    context.launch_configurations.update(argument.split(":=", 1) for argument in given)
    description = PythonLaunchDescriptionSource(file).get_launch_description(context)
    arguments = {argument.name: argument.description for argument in description.get_launch_arguments()}
    commands = list(composed(description.entities, context)) if given else []
    launched = {
        "arguments": arguments,
        "commands": commands,
        "parameters": [parameters(command) for command in commands],
    }
    json.dump(launched, sys.stdout)


if __name__ == "__main__":
    main()
