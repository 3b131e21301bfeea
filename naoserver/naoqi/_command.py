"""The command `naoserver-naoqi`: serve a real robot."""

from __future__ import annotations

from contextlib import closing
from functools import partial
from typing import Annotated, Final

import typer

from naoserver.bodies import find_body
from naoserver.bodies.nao import H25, require_nao
from naoserver.latch import latch_of
from naoserver.naoqi._dead_man import DeadMansSwitch
from naoserver.naoqi._libqi import connect
from naoserver.naoqi._link import AddressError, RobotAddress
from naoserver.naoqi._robot import End, Life, LifecycleOptions, NaoqiRobot, Start
from naoserver.options import ServerOptions, capped
from naoserver.server import JointSpeed, ResumeAfterReset, problem_of, serve
from zenoh_ice import initialize
from zenoh_ice.application.cli import report_ready, stop_on_signals, with_settings
from zenoh_ice.settings import DEFAULT_ENDPOINT, Settings

app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)

_EPILOG: Final = """Examples:

naoserver-naoqi --robot tcp://nao.local                    leave the robot as it is, at start and end

naoserver-naoqi --robot tcp://192.168.1.20:9559 --start stand --end rest

NAOQI_PASSWORD=... naoserver-naoqi --robot tcps://192.168.1.20:9503 --user nao"""


@app.command(epilog=_EPILOG)
@with_settings(defaults={"listen": (DEFAULT_ENDPOINT,), "connect": (), "clock": "wall"})
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
        Start, typer.Option(help="At the start: do nothing, hold the joints, or stand up.")
    ] = Start.LEAVE,
    end: Annotated[
        End, typer.Option(help="At the end: do nothing, crouch and go limp, or go limp at once.")
    ] = End.LEAVE,
    life: Annotated[
        Life, typer.Option(help="Autonomous Life: leave it on, disable it, or suspend it until the end.")
    ] = Life.DISABLE,
    body: Annotated[
        str,
        typer.Option(metavar="NAME", help="The robot's body: H25, or H21, which has no wrists and hands."),
    ] = H25.name,
    joint_speed: JointSpeed = None,
    resume_after_reset: ResumeAfterReset = False,
) -> None:
    """Serve a real Nao over NAOqi, with the same servants as the simulated robot.

    Prints a line that begins with 'ready' once it can be called. Ctrl-C ends it.
    """
    address = parse_address(robot, user, password)
    lifecycle, facts = LifecycleOptions(start, end, life), find_body(body)
    require_nao(facts, "naoserver-naoqi drives NAOqi")
    with (
        stop_on_signals() as stop,
        initialize(settings) as communicator,
        latch_of(settings) as latch,
        closing(DeadMansSwitch(address)) as switch,
        closing(
            NaoqiRobot(
                lambda timeout: connect(address, timeout),
                lifecycle,
                facts,
                stopped=latch is not None and bool(latch.found.stop),
            )
        ) as nao,
    ):
        nao.report_to_switch(switch.beat, switch.release)
        nao.start()
        adapter = communicator.createObjectAdapter("NaoServer")
        options = ServerOptions(safety=capped(joint_speed), resume_after_reset=resume_after_reset)
        with serve(nao, adapter, options, latch=latch) as assembly:
            nao.report_to(assembly)
            adapter.activate()
            served = f"realm {settings.realm}, {', '.join(settings.reached_at)}, robot {address}"
            report_ready(f"ready: {served}").wait(stop, partial(problem_of, communicator, assembly))


def parse_address(robot: str, user: str, password: str) -> RobotAddress:
    """Return the address that the options give; the login only where one is wanted."""
    try:
        return RobotAddress.parse(robot, user if password else "", password)
    except AddressError as error:
        raise typer.BadParameter(str(error), param_hint="--robot") from None
