"""The options of a component's command that concern ROS; its libraries are not needed for them."""

from __future__ import annotations

import inspect
from collections.abc import Sequence
from typing import Annotated, Any

import typer


def options() -> Sequence[inspect.Parameter]:
    """Return the options of ROS."""
    return (
        _option(
            "ros",
            bool,
            "Let ROS see and steer the component, as it does one with interfaces of ROS.",
            default=False,
        ),
        _option("ros_domain", int | None, "Domain of ROS. Default: ROS_DOMAIN_ID, or 0.", min=0, max=232),
        _option(
            "ros_connect",
            list[str] | None,
            "Endpoint of the router of ROS, where it is not that of --connect; may be repeated.",
            metavar="ENDPOINT",
        ),
        _option("ros_namespace", str, "Where relative names begin.", default="/", metavar="NAME"),
        _option(
            "remap",
            list[str] | None,
            "Use another topic, service or action, such as /cmd_vel:=/turtle1/cmd_vel; may be repeated.",
            metavar="FROM:=TO",
        ),
    )


def _option(name: str, kind: Any, text: str, default: object = None, **more: Any) -> inspect.Parameter:  # noqa: ANN401
    option = typer.Option(f"--{name.replace('_', '-')}", help=text, rich_help_panel="ROS 2", **more)
    return inspect.Parameter(
        name, inspect.Parameter.KEYWORD_ONLY, annotation=Annotated[kind, option], default=default
    )
