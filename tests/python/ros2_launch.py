"""Launches a file as `ros2 launch` does: ros2_launch.py FILE [name:=value …]."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent / "vendor"))
from launch import LaunchDescription, LaunchService
from launch.actions import IncludeLaunchDescription
from launch.launch_description_sources import PythonLaunchDescriptionSource


def main():
    file, *arguments = sys.argv[1:]
    service = LaunchService(argv=arguments)
    included = IncludeLaunchDescription(
        PythonLaunchDescriptionSource(file),
        launch_arguments=[argument.split(":=", 1) for argument in arguments],
    )
    service.include_launch_description(LaunchDescription([included]))
    sys.exit(service.run())


if __name__ == "__main__":
    main()
