"""The command `visualhfsm emergency-stop`: the operator's red button in a terminal."""

from __future__ import annotations

from typing import Annotated, Final

import typer

from zenoh_ice.command import with_settings
from zenoh_ice.settings import Settings

__all__ = ["EPILOG", "emergency_stop"]

EPILOG: Final = """Examples:

visualhfsm emergency-stop

visualhfsm emergency-stop "it walks towards the stairs" --realm robot2

visualhfsm emergency-stop --reset"""


@with_settings(defaults={"clock": "wall"})
def emergency_stop(
    *,
    settings: Settings,
    reason: Annotated[
        str, typer.Argument(metavar="REASON", help="What the robot tells everybody whom it refuses.")
    ] = "visualhfsm emergency-stop",
    reset: Annotated[bool, typer.Option("--reset", help="Let the robot take commands again.")] = False,
) -> None:
    """Stop the robot of a realm, and have it refuse every command.

    It holds its joints, ends its walk and its motions, and takes no command
    from anybody until --reset. Components run on: `visualhfsm stop` ends one.
    """
    from interfaces.nao import SafetyPrx
    from zenoh_ice import initialize

    with initialize(settings) as communicator:
        safety = SafetyPrx.checkedCast(communicator.stringToProxy("Safety"))
        if reset:
            safety.resetEmergencyStop()
            typer.echo("reset: the robot takes commands again")
        else:
            safety.emergencyStop(reason)
            typer.echo("stopped: the robot takes no command until `visualhfsm emergency-stop --reset`")
