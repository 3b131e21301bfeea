"""Start the command: `naoserver-ros2`, or `python -m visualhfsm_ros2.gateway`."""

from __future__ import annotations

from typing import NoReturn

from zenoh_ice.application import begin_loading, end_without, missing_package


def main() -> NoReturn:
    """Run the command, or report the missing package."""
    begin_loading()
    try:
        from visualhfsm_ros2.gateway._command import EXPECTED, app
        from zenoh_ice.application.cli import run
    except ImportError as error:
        cause = error.__cause__ or error
        if not isinstance(cause, ModuleNotFoundError):
            raise
        end_without(
            "naoserver-ros2",
            "Show any robot server, simulated or real, to ROS 2.",
            missing_package(cause, "ros2"),
        )
    run(app, expected=EXPECTED)


if __name__ == "__main__":
    main()
