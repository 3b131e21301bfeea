"""The command `naoserver-naoqi`: serve a real robot."""

from __future__ import annotations

from contextlib import closing
from typing import Annotated, Final

import typer

from naoserver.bodies import find_body, require_family
from naoserver.bodies.nao import H25
from naoserver.hardware.serving import SERVER_DEFAULTS, serve_hardware
from naoserver.options import ServerOptions, capped
from naoserver.serving.server import JointSpeed, ResumeAfterReset, TeamName
from visualhfsm_naoqi.robot._libqi_link import connect
from visualhfsm_naoqi.robot._link import AddressError, RobotAddress
from visualhfsm_naoqi.robot._robot import Life, LifecycleOptions, NaoEnd, NaoqiRobot, NaoStart
from visualhfsm_naoqi.robot._switch import SWITCH
from visualhfsm_naoqi.robot.dead_man import DeadMansSwitch
from zenoh_ice.application.cli import with_settings
from zenoh_ice.settings import Settings

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)

_EPILOG: Final = """Examples:

naoserver-naoqi --robot tcp://nao.local                    leave the robot as it is, at start and end

naoserver-naoqi --robot tcp://192.168.1.20:9559 --start stand --end rest

NAOQI_PASSWORD=... naoserver-naoqi --robot tcps://192.168.1.20:9503 --user nao"""


@app.command(epilog=_EPILOG)
@with_settings(defaults=SERVER_DEFAULTS)
def naoserver_naoqi(
    *,
    settings: Settings,
    robot: Annotated[
        str,
        typer.Option(
            metavar="URL", help="Where NAOqi listens: tcp://HOST[:9559], or tcps://HOST[:9503] with a login."
        ),
    ],
    user: Annotated[str, typer.Option(help="User name for the login at tcps://.")] = "nao",
    password: Annotated[
        str, typer.Option(envvar="NAOQI_PASSWORD", help="Password; others can see a command line.")
    ] = "",
    start: Annotated[
        NaoStart, typer.Option(help="At the start: do nothing, hold the joints, or stand up.")
    ] = NaoStart.LEAVE,
    end: Annotated[
        NaoEnd, typer.Option(help="At the end: do nothing, crouch and go limp, or go limp at once.")
    ] = NaoEnd.LEAVE,
    life: Annotated[
        Life, typer.Option(help="Autonomous Life: leave it on, disable it, or suspend it until the end.")
    ] = Life.DISABLE,
    body: Annotated[
        str,
        typer.Option(metavar="NAME", help="The robot's body: H25, or H21, which has no wrists and hands."),
    ] = H25.name,
    joint_speed: JointSpeed = None,
    resume_after_reset: ResumeAfterReset = False,
    team: TeamName = "",
) -> None:
    """Serve a real Nao over NAOqi, with the same servants as the simulated robot.

    Prints a line that begins with 'ready' once it can be called. Ctrl-C ends it.
    """
    address = parse_address(robot, user, password)
    lifecycle, facts = LifecycleOptions(start, end, life), find_body(body)
    require_family(facts, H25.name, "naoserver-naoqi drives NAOqi, the system of the Nao")
    options = ServerOptions(safety=capped(joint_speed), team=team, resume_after_reset=resume_after_reset)
    with closing(DeadMansSwitch(SWITCH, address)) as switch:
        nao = NaoqiRobot(lambda timeout: connect(address, timeout), lifecycle, facts)
        nao.report_to_switch(switch.beat, switch.release)
        serve_hardware(nao, settings, options, lifecycle=nao.lifecycle, where=f"robot {address}")


def parse_address(robot: str, user: str, password: str) -> RobotAddress:
    """Return the address that the options give; the login only where one is wanted."""
    try:
        return RobotAddress.parse(robot, user if password else "", password)
    except AddressError as error:
        raise typer.BadParameter(str(error), param_hint="--robot") from None
