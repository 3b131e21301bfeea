"""The command `naoserver-sim`: simulate and serve a robot, or several, each in its realm."""

from __future__ import annotations

import dataclasses
import math
import re
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import ExitStack, closing
from functools import partial
from pathlib import Path
from typing import Annotated, Any, Final, NamedTuple

import msgspec
import typer
from typer.core import TyperCommand

from naoserver.bodies import BODY_NAMES, DEFAULT_BODY, is_body_file
from naoserver.bodies.parts import CameraFacts
from naoserver.errors import RobotError
from naoserver.options import CameraOptions, ServerOptions, capped
from naoserver.safety.latch import latch_of
from naoserver.serving.entrances import Entrance, Served, find_entrances, flag, later_port, options_of
from naoserver.serving.server import JointSpeed, ResumeAfterReset, TeamName, problem_of, serve
from naoserver.soccer_field import Field
from naoserver_sim.arena import Arena
from naoserver_sim.named_body import named_body, own_robots
from naoserver_sim.robot import SimulatedRobot
from naoserver_sim.world import DEFAULT_WORLD, bundled_worlds, load_world, side_by_side
from zenoh_ice import ConfigurationException, initialize
from zenoh_ice.application import tether_command
from zenoh_ice.application.cli import lean, report_ready, stop_on_signals, with_options, with_settings
from zenoh_ice.settings import DEFAULT_ENDPOINT, Security, Settings

MOST_ROBOTS: Final = 16

_CAMERA_OPTION: Final = re.compile(
    r"(?P<name>\w+)=(?P<width>\d{1,5})x(?P<height>\d{1,5})(?:@(?P<rate>\d+(?:\.\d+)?))?"
)
_EPILOG: Final = """Examples:

naoserver-sim                                              one robot, on the default endpoint

naoserver-sim --speed 5                                    five times as fast; behaviors keep pace

naoserver-sim --camera Camera=640x480@15                   larger images

naoserver-sim --world soccer --noise                       on a field, with noise like a real robot's

naoserver-sim --body T1                                    another robot: a Booster T1

naoserver-sim --body arm.urdf                              your own robot, by its model

naoserver-sim --robots 3                                   three robots, in the realms nao, nao2 and nao3

naoserver-sim --world match                                two teams of two in one world

naoserver-sim --realm two --listen tcp/127.0.0.1:7448      a second robot beside a running one"""
# After this time, a computing thread hands over Python's global lock; with the default of 5 ms, serving
# would delay control ticks, which are 0.5 ms apart at 20 times real time.
_SWITCH_INTERVAL: Final = 0.0005  # s
_CHECK_PERIOD: Final = 0.5  # s
_WITH_SETTINGS: Final = with_settings(
    defaults={"listen": (DEFAULT_ENDPOINT,), "connect": (), "clock": "wall"}
)

_Speed = Annotated[
    str, typer.Option(metavar="FACTOR|max", help="Robot seconds per wall second, such as 1, 5 or 20.")
]
_World = Annotated[
    str,
    typer.Option(
        metavar="NAME|FILE",
        help=f"World around the robot: {', '.join(bundled_worlds())}, "
        "or a TOML file (docs/how-to/worlds.md).",
    ),
]
_Robots = Annotated[
    int,
    typer.Option(
        min=1, max=MOST_ROBOTS, help="Simulate several robots, side by side in one world, each in its realm."
    ),
]
_Apart = Annotated[bool, typer.Option("--apart", help="With --robots, give each its own process and world.")]
_Skin = Annotated[bool, typer.Option("--skin/--no-skin", help="Show the robot's shell, or its bare blocks.")]
_Noise = Annotated[
    bool,
    typer.Option(
        "--noise/--no-noise", help="Make sensors, pictures and gears as imperfect as a real robot's."
    ),
]
_Seed = Annotated[
    int | None,
    typer.Option(min=0, help="Scatter the balls, and draw the noise; the same seed, the same numbers."),
]
_Body = Annotated[
    str,
    typer.Option(
        metavar="NAME|FILE",
        help=f"What the robot is: {', '.join(BODY_NAMES)}, or your own by its model (URDF, xacro, MJCF), "
        "a TOML file or facts in JSON (plugins/own_robots/docs/own-robot.md).",
    ),
]
_Hang = Annotated[
    bool, typer.Option("--hang", help="Hang the robot up by its trunk, its feet in the air, as on a gantry.")
]
_WriteBody = Annotated[
    Path | None,
    typer.Option(
        metavar="FILE",
        dir_okay=False,
        help="Write what --body is to a file, and serve nothing: TOML to edit, in which each guess about a "
        "model has its reason, or facts in JSON.",
    ),
]
_Xacro = Annotated[
    list[str] | None,
    typer.Option(metavar="NAME:=VALUE", help="Argument of --body in xacro, such as dof:=7; may be repeated."),
]
_Force = Annotated[bool, typer.Option("--force", help="Overwrite the file of --write-body.")]
_Sight = Annotated[
    bool, typer.Option("--sight/--no-sight", help="Serve what the robot sees, or leave that to `nao eyes`.")
]
_Cameras = Annotated[
    list[str] | None,
    typer.Option(
        metavar="NAME=WIDTHxHEIGHT[@RATE]",
        help="Images that a camera (Camera, CameraBottom, CameraOutside) starts with, ready for the first"
        " one; may be repeated. Without it: 320x240@10, or its first size, made ready when somebody looks.",
    ),
]


def make_app() -> typer.Typer:
    """Return the command, which asks plug-ins for their entrances only where its line needs them."""
    return _app((), lean(lambda: _app(find_entrances())))


def __getattr__(name: str) -> typer.Typer:
    if name == "app":  # the whole command, for its reference
        return _app(find_entrances())
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def _app(entrances: Sequence[Entrance], cls: type[TyperCommand] | None = None) -> typer.Typer:
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)
    epilog = "\n\n".join((_EPILOG, *("{:<59}{}".format(*each.example) for each in entrances)))
    with_entrances = with_options("entered", options_of(entrances), partial(_Entered, entrances))
    app.command(cls=cls, epilog=epilog)(_WITH_SETTINGS(with_entrances(naoserver_sim)))
    return app


class _Entered(NamedTuple):
    """The entrances of a command, and the values of their options."""

    entrances: Sequence[Entrance]
    options: dict[str, Any]


def naoserver_sim(
    *,
    settings: Settings,
    entered: _Entered,
    speed: _Speed = "1",
    world: _World = DEFAULT_WORLD,
    robots: _Robots = 1,
    apart: _Apart = False,
    skin: _Skin = True,
    noise: _Noise = False,
    seed: _Seed = None,
    body: _Body = DEFAULT_BODY,
    xacro: _Xacro = None,
    hang: _Hang = False,
    write_body: _WriteBody = None,
    force: _Force = False,
    camera: _Cameras = None,
    sight: _Sight = True,
    joint_speed: JointSpeed = None,
    resume_after_reset: ResumeAfterReset = False,
    team: TeamName = "",
) -> None:
    """Simulate a robot and its surroundings in MuJoCo, and serve them.

    Prints a line that begins with 'ready' once it can be called. Ctrl-C ends it.
    """
    factor = parse_speed(speed)
    options = ServerOptions(
        safety=capped(joint_speed),
        cameras=parse_cameras(camera or ()),
        sight=sight,
        team=team,
        resume_after_reset=resume_after_reset,
    )
    arguments = parse_arguments(xacro or ())
    surroundings = load_world(world)
    if robots > 1 and surroundings.robots and not apart:
        message = f"the world {world} lists its robots: leave out --robots, or give each a world by --apart"
        raise typer.BadParameter(message, param_hint="--robots")
    if write_body is not None:
        if not is_body_file(body):
            message = f"{body} is no file: this writes a robot of your own, --body robot.urdf"
            raise typer.BadParameter(message, param_hint="--write-body")
        write = own_robots(Path(body)).write_own_body
        write(Path(body), write_body, arguments=arguments, force=force, say=typer.echo)
        return
    facts = named_body(body, arguments=arguments, say=typer.echo)
    if hang:
        facts = msgspec.structs.replace(facts, mounted=True)
    entrances = [entrance for entrance in entered.entrances if entrance.is_wanted(entered.options)]
    programs = [entrance for entrance in entrances if entrance.serve is not None]
    if programs and settings.security != Security():
        asked = flag(programs[0].asked_by)
        raise ConfigurationException(
            f"{asked} beside [security]: programs of {programs[0].programs} have no passwords, so that any"
            f" would do what no role grants; leave out {asked}, or serve the robot without [security]"
        )
    if robots > 1 and apart:
        own = {
            name: partial(of, entered.options[name]) for each in entrances for name, of in each.apart.items()
        }
        with stop_on_signals() as stop:
            run_team(team_commands(sys.argv[1:], robots, settings, seed=seed, apart=own), stop)
        return
    if robots > 1:
        surroundings = side_by_side(surroundings, robots, settings.realm)
    sys.setswitchinterval(_SWITCH_INTERVAL)
    kind = Arena if surroundings.robots and not apart else SimulatedRobot
    with (
        stop_on_signals() as stop,
        closing(
            kind(speed=factor, world=surroundings, skin=skin, noise=noise, seed=seed, body=facts)
        ) as arena,
    ):
        for robot in arena.robots:
            check_cameras(options.cameras, robot.cameras)
            robot.faults.restart = stop.begin_again
        arena.start(
            cameras=bool(options.cameras)
        )  # first: clients that find the server wait only briefly for its servants
        _serve(
            arena, settings, options, entered._replace(entrances=entrances), stop, field=surroundings.field
        )


def _serve(
    arena: Arena | SimulatedRobot,
    settings: Settings,
    options: ServerOptions,
    entered: _Entered,
    stop: threading.Event,
    *,
    field: Field | None,
) -> None:
    """Serve started robots until `stop` is set, each in its realm, also by entrances."""
    with ExitStack() as also:
        served, robots = [], []
        for number, robot in enumerate(arena.robots):
            own = settings
            if isinstance(arena, Arena):
                own = of_robot(settings, number, robot.name)
            communicator = also.enter_context(initialize(own))
            latch = also.enter_context(latch_of(own, body=robot.body.name))
            adapter = communicator.createObjectAdapter("NaoServer")
            teamed = dataclasses.replace(options, team=robot.team or options.team)
            assembly = also.enter_context(serve(robot, adapter, teamed, latch=latch))
            robots.append(Served(robot, assembly, adapter, teamed.team))
            served.append((own, robot, partial(problem_of, communicator, assembly)))
            for entrance in entered.entrances:
                if entrance.serve is None:
                    continue
                values = {
                    name: entrance.apart[name](value, number) if number and name in entrance.apart else value
                    for name, value in entered.options.items()
                }
                typer.echo(
                    f"{entrance.programs}: {also.enter_context(entrance.serve(robot, assembly, values))}"
                )
        for entrance in entered.entrances:
            if entrance.serve_world is not None:
                said = also.enter_context(entrance.serve_world(robots, field, entered.options))
                typer.echo(f"{entrance.programs}: {said}")
        for each in robots:
            each.adapter.activate()
        text = "; ".join(
            f"realm {own.realm}, {', '.join(own.reached_at)}, {len(robot.cameras)} cameras"
            for own, robot, _ in served
        )
        watchdog = report_ready(f"ready: {text}")
        while not stop.wait(_CHECK_PERIOD):
            arena.check()
            watchdog.report(lambda: next(filter(None, (problem() for _, _, problem in served)), ""))


def of_robot(settings: Settings, number: int, realm: str) -> Settings:
    """Return the settings of a robot among several: its realm, and after the first one the next ports.

    All connect to the first, so that clients connected to it find every realm.
    """
    first = [endpoint for endpoint in settings.listen if number and not endpoint.endswith(":0")]
    return msgspec.structs.replace(
        settings,
        realm=realm,
        listen=tuple(later_port(endpoint, number) for endpoint in settings.listen),
        connect=(*settings.connect, *first),
    )


def parse_speed(text: str) -> float:
    """Return the factor that `text` gives: a number above 0, or infinity for `max`."""
    if text == "max":
        return math.inf
    try:
        factor = float(text)
    except ValueError:
        factor = math.nan
    if not (factor > 0 and math.isfinite(factor)):
        message = f"{text!r} is not a speed: give a factor above 0, such as 5, or 'max'"
        raise typer.BadParameter(message, param_hint="--speed")
    return factor


def parse_arguments(texts: Sequence[str]) -> dict[str, str]:
    """Return the arguments of a xacro that options such as `dof:=7` give, by name."""
    pairs = [text.partition(":=") for text in texts]
    for name, sign, value in pairs:
        if not (name.isidentifier() and sign):
            message = f"{name + sign + value!r} is no argument of a xacro: write NAME:=VALUE, such as dof:=7"
            raise typer.BadParameter(message, param_hint="--xacro")
    return {name: value for name, _, value in pairs}


def parse_cameras(texts: Sequence[str]) -> dict[str, CameraOptions]:
    """Return the settings that options such as `Camera=640x480@15` give, by camera."""
    options = {}
    for text in texts:
        match = _CAMERA_OPTION.fullmatch(text)
        if match is None:
            message = (
                f"{text!r} is not a camera setting: write NAME=WIDTHxHEIGHT@RATE, such as Camera=640x480@15"
            )
            raise typer.BadParameter(message, param_hint="--camera")
        given = CameraOptions(width=int(match["width"]), height=int(match["height"]))
        if match["rate"]:
            given = dataclasses.replace(given, rate=float(match["rate"]))
        options[match["name"]] = given
    return options


def check_cameras(requested: Mapping[str, CameraOptions], cameras: Sequence[CameraFacts]) -> None:
    """Raise typer.BadParameter when a requested camera, size or rate does not exist."""
    known = {camera.name: dict(zip(camera.sizes, camera.rates, strict=True)) for camera in cameras}
    for name, options in requested.items():
        if name not in known:
            message = f"there is no camera {name!r}; there are {', '.join(known)}"
            raise typer.BadParameter(message, param_hint="--camera")
        rates = known[name]
        if not 0 < options.rate <= rates.get((options.width, options.height), 0.0):
            offered = ", ".join(f"{w}x{h} up to {rate:g}/s" for (w, h), rate in rates.items())
            wanted = f"{options.width}x{options.height} at {options.rate:g}/s"
            message = f"{name} gives no images of {wanted}; it gives {offered}"
            raise typer.BadParameter(message, param_hint="--camera")


_REPLACED: Final = ("--robots", "--realm", "--listen", "--connect", "--seed")
"""Options with a value that is different for each robot."""
_POLL_PERIOD: Final = 0.1  # s
_END_LIMIT: Final = 5.0  # s for a robot's process to end on request


def team_commands(
    options: Sequence[str],
    robots: int,
    settings: Settings,
    *,
    seed: int | None = None,
    apart: Mapping[str, Callable[[int], object]] | None = None,
) -> list[list[str]]:
    """Return the command of each robot: the given options, except those that differ between robots.

    Their settings are those of `of_robot`, with a 2, 3 and so on appended to the realm. `apart` has the
    values of other options that differ, by the number of the robot.
    """
    shared = _without(options, (*_REPLACED, *map(flag, apart or {})))
    commands = []
    for number in range(robots):
        of = of_robot(settings, number, settings.realm + (str(number + 1) if number else ""))
        own = ["--realm", of.realm]
        for endpoint in of.listen:
            own += ["--listen", endpoint]
        for endpoint in of.connect:
            own += ["--connect", endpoint]
        if seed is not None:
            own += ["--seed", str(seed + number)]
        for name, value in (apart or {}).items():
            own += [flag(name), str(value(number))]
        commands.append([sys.executable, "-P", "-m", "naoserver_sim", *shared, *own])
    return commands


def run_team(commands: Iterable[Sequence[str]], stop: threading.Event) -> None:
    """Run commands until `stop` is set or one of them exits, which raises RobotError; then end all."""
    processes: list[subprocess.Popen[bytes]] = []
    try:
        for command in commands:
            tethered = [*tether_command(), *command]
            processes.append(subprocess.Popen(tethered, stdin=subprocess.DEVNULL, start_new_session=True))
        while not stop.wait(_POLL_PERIOD):
            for number, process in enumerate(processes):
                if process.poll() is not None:
                    raise RobotError(f"robot {number + 1} ended with exit code {process.returncode}")
    finally:
        _end(processes)


def _end(processes: Sequence[subprocess.Popen[bytes]]) -> None:
    for process in processes:
        process.terminate()
    deadline = time.monotonic() + _END_LIMIT
    for process in processes:
        try:
            process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait(_END_LIMIT)


def _without(options: Sequence[str], names: Sequence[str]) -> list[str]:
    """Return options without `--apart` and some that have a value, as `--name value` or `--name=value`."""
    left, rest = [], iter(options)
    for option in rest:
        if option == "--apart":
            continue
        if option in names:
            next(rest, None)  # its value
        elif option.partition("=")[0] not in names:
            left.append(option)
    return left
