"""The command `nao`: its subcommands and their options.

Each subcommand imports its implementation when it runs, so that help and completion are fast.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from nao_tools import NaoError
from nao_tools._completion import complete_call, complete_camera, complete_servant, complete_stream
from nao_tools._security.command import app as security
from zenoh_ice.application import missing_package
from zenoh_ice.application.cli import SERVER_WAIT, ServerWait, finite, report_ready, with_settings
from zenoh_ice.settings import ROUTER_DEFAULTS, Settings

app = typer.Typer(
    name="nao",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["--help", "-h"]},
)

_DEFAULTS = {"clock": "wall"}

_SECONDS: Any = typer.Option(min=0.0, callback=finite, help="Stop after this many seconds; 0 means never.")
_Json = Annotated[bool, typer.Option("--json", help="Print JSON on one line, for programs.")]


def _command(
    *examples: str,
    defaults: Mapping[str, object] = _DEFAULTS,
    **options: Any,  # noqa: ANN401 - those of typer
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Return a decorator that makes a function a subcommand, with common options and examples in its help."""
    epilog = "Examples:\n\n" + "\n\n".join(examples)
    return lambda function: app.command(epilog=epilog, **options)(with_settings(defaults=defaults)(function))


def _argument(metavar: str, text: str, complete: Callable[..., list[str]] | None = None) -> Any:  # noqa: ANN401
    return typer.Argument(metavar=metavar, help=text, autocompletion=complete, show_default=False)


@app.callback(epilog="Examples:\n\nnao list\n\nnao call Head.getPose\n\nnao watch Body\n\nnao doctor")
def nao() -> None:
    """Inspect a running robot and its programs, and call its servants."""


_PATTERN = "Part of the name of a servant or of its interface, or a pattern with * and ?."


@_command(
    "nao list", "nao list motors", "nao list 'Left*'", "nao list --json | jq '.[].servant'", name="list"
)
def list_(
    *,
    settings: Settings,
    pattern: Annotated[str, _argument("PATTERN", _PATTERN, complete_servant)] = "",
    json: _Json = False,
) -> None:
    """List what is online: servants, their interfaces and uptimes."""
    from nao_tools._listing import list_servants

    list_servants(settings, pattern, as_json=json)


@_command("nao describe Head", "nao describe Head.setPose")
def describe(
    *,
    settings: Settings,
    servant: Annotated[str, _argument("SERVANT[.OPERATION]", "What to describe.", complete_call)],
    json: _Json = False,
) -> None:
    """Describe what a servant can do: operations, parameters, types."""
    from nao_tools._listing import describe

    describe(settings, servant, as_json=json)


_VALUES = (
    "Its arguments as JSON, in their order or by name; @FILE reads one from a file, @- from"
    " standard input. Members of a struct that are left out are zero."
)


@_command(
    "nao call Head.getPose",
    "nao call Head.setPose 0.3 -0.1 0.5",
    "nao call Head.setPose pan=0.3 tilt=-0.1 fraction=0.5",
    """nao call LeftShoulderMotors.setPose3DMotorsData '{"tilt": 1.2}'""",
    "nao call Camera.getImageData RGB8 --json",
    # Negative numbers are not options.
    context_settings={"ignore_unknown_options": True},
)
def call(
    *,
    settings: Settings,
    operation: Annotated[str, _argument("SERVANT.OPERATION", "What to call.", complete_call)],
    arguments: Annotated[list[str] | None, _argument("VALUE|NAME=VALUE", _VALUES)] = None,
    json: _Json = False,
) -> None:
    """Call an operation of a servant and print what it returns."""
    words = arguments or []
    unknown = next((word for word in words if word.startswith("--")), None)
    if unknown is not None:
        raise typer.BadParameter(f"there is no option {unknown}")
    from nao_tools._call import call

    call(settings, operation, words, as_json=json)


_STREAM = "What to watch; the servant alone will do if it has one stream."


@_command(
    "nao watch Body",
    "nao watch Camera.getImageData --no-values",
    "nao watch Head.getPose --seconds 5 | tee rate.txt",
    "nao watch Head.getPose --count 1 --json",
)
def watch(
    *,
    settings: Settings,
    stream: Annotated[str, _argument("SERVANT[.OPERATION]", _STREAM, complete_stream)],
    count: Annotated[int, typer.Option(min=0, help="Stop after this many samples; 0 means never.")] = 0,
    seconds: Annotated[float, _SECONDS] = 0.0,
    rate: Annotated[
        float | None,
        typer.Option(min=0.001, callback=finite, help="Receive at most this many samples per second."),
    ] = None,
    values: Annotated[bool, typer.Option("--values/--no-values", help="Show the values, too.")] = True,
    json: _Json = False,
) -> None:
    """Watch a stream: rate, age, size, losses, and its newest value.

    On a terminal these are shown in place, otherwise as a line a second. With --json every sample is a line.
    """
    from nao_tools._watch import watch

    watch(settings, stream, count=count, seconds=seconds, rate=rate, with_values=values, as_json=json)


_FILE = "Output file; its extension, .png, .jpg or .ppm, sets the format. Default: CAMERA.png."


@_command(
    "nao save-image Camera", "nao save-image CameraBottom floor.jpg", "nao save-image CameraOutside robot.png"
)
def save_image(
    *,
    settings: Settings,
    camera: Annotated[str, _argument("CAMERA", "Servant that provides images.", complete_camera)],
    file: Annotated[Path | None, _argument("FILE", _FILE)] = None,
    json: _Json = False,
) -> None:
    """Take an image with a camera and write it to a file."""
    from nao_tools._images import save_image

    save_image(settings, camera, file, as_json=json)


@_command("nao eyes", "nao eyes --realm red1 --rate 5", "nao eyes --looks my-eyes.toml")
def eyes(
    *,
    settings: Settings,
    looks: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="What to look for (TOML), as naoserver/eyes/eyes.toml has it."),
    ] = None,
    rate: Annotated[
        float, typer.Option(min=0.1, max=100.0, callback=finite, help="At most so many looks a second.")
    ] = 20.0,
    server_wait: ServerWait = SERVER_WAIT,
) -> None:
    """See balls, robots, tags and a soccer field in the robot's pictures, and serve that as Sight.

    Prints a line that begins with 'ready' once it can be called. Ctrl-C ends it.
    """
    try:
        from naoserver.eyes.looks import read_looks
        from naoserver.eyes.serving import serve_eyes
    except ModuleNotFoundError as error:
        raise NaoError(missing_package(error, "vision")) from error
    serve_eyes(settings, read_looks(looks), rate=rate, wait=server_wait)


@_command(
    "nao faults",
    "nao faults Camera",
    "nao faults Camera frozen",
    "nao faults Camera late 0.5 --seconds 10",
    "nao faults --heal",
    # Negative numbers are not options.
    context_settings={"ignore_unknown_options": True},
)
def faults(
    *,
    settings: Settings,
    part: Annotated[str, _argument("PART", "A joint, a sensor, a camera, a link, or Robot.")] = "",
    kind: Annotated[str, _argument("KIND", "How it is to fail, such as stuck.")] = "",
    amount: Annotated[
        float | None,
        typer.Argument(metavar="AMOUNT", help="How much; as much as is usual if left out.", callback=finite),
    ] = None,
    seconds: Annotated[
        float | None,
        typer.Option(min=0.001, callback=finite, help="Robot seconds after which it works again."),
    ] = None,
    heal: Annotated[bool, typer.Option("--heal", help="Let PART work again, or all without it.")] = False,
    json: _Json = False,
) -> None:
    """Let a part of a simulated or a fake robot fail, and list what fails and what can.

    A real robot fails by itself, and does not serve this.
    """
    from nao_tools import _faults as commands

    if part.startswith("--"):
        raise typer.BadParameter(f"there is no option {part}")
    if heal:
        if kind or seconds is not None or json:
            raise typer.BadParameter("--heal takes nothing but a PART")
        commands.heal(settings, part)
    elif kind:
        commands.inject(settings, part, kind, amount, seconds, as_json=json)
    elif seconds is not None:
        raise typer.BadParameter("--seconds needs a PART and a KIND")
    else:
        commands.faults(settings, part, as_json=json)


@_command("nao status", "nao status --all", "nao status --json | jq .robot.Battery.charge")
def status(
    *,
    settings: Settings,
    every_servant: Annotated[
        bool, typer.Option("--all", help="Show all servants, not only those called most.")
    ] = False,
    json: _Json = False,
) -> None:
    """Show the state of the robot and of the processes that serve it."""
    from nao_tools._status import status

    status(settings, every_servant=every_servant, as_json=json)


@_command("nao doctor", "nao doctor --connect tcp/192.168.1.20:7447", "nao doctor --json")
def doctor(*, settings: Settings, json: _Json = False) -> None:
    """Find problems of this installation, and report how to fix them.

    It checks what is installed, the machine and the network. The exit code is 1 if something failed.
    """
    from nao_tools._doctor import examine

    if not examine(settings, as_json=json):
        raise typer.Exit(1)


@_command(
    "nao stop",
    'nao stop "it walks towards the stairs" --realm robot2',
    "nao stop --all --connect tls/robotlab.local:7448",
    "nao stop --all --json | jq '.robots[] | select(.still | not)'",
    "nao stop --ready",
    "nao stop --reset",
    "nao stop --reset --resume",
)
def stop(
    *,
    context: typer.Context,
    settings: Settings,
    reason: Annotated[
        str, typer.Argument(metavar="REASON", help="Reason that refused callers get.")
    ] = "nao stop",
    ready: Annotated[
        bool, typer.Option("--ready", help="Keep a connection open; stop at Enter, space or Ctrl-C.")
    ] = False,
    everywhere: Annotated[
        bool, typer.Option("--all", help="Stop the robots of all realms that can be reached.")
    ] = False,
    reset: Annotated[bool, typer.Option("--reset", help="Let the robot accept commands again.")] = False,
    resume: Annotated[
        bool, typer.Option("--resume", help="With --reset: let what the stop paused or refused go on, too.")
    ] = False,
    seconds: Annotated[
        float, typer.Option(min=0.1, callback=finite, help="Give up after this many seconds.")
    ] = 20.0,
    json: _Json = False,
) -> None:
    """Stop the robot; it then refuses every command.

    The robot holds its joints, ends its walk and motions, and refuses commands from everyone until --reset.
    The stop is repeated until the robot has confirmed it; the exit code is 1 if it has not. It works with
    robots of every release. With --ready the command connects first and waits for a key, so that nothing
    delays the stop. Components keep running; `visualhfsm stop` ends one.
    """
    from nao_tools import _stop as commands
    from nao_tools._stopping import STOP_LIMITS, StopLimits

    if ready + reset + everywhere > 1:
        raise typer.BadParameter("--all, --ready and --reset exclude each other")
    if resume and not reset:
        raise typer.BadParameter("--resume needs --reset")
    if ready and json:
        raise typer.BadParameter("--ready waits for a person, and prints no JSON")
    if reset:
        commands.reset(settings, resume=resume, as_json=json)
    elif ready:
        commands.hold(settings, reason)
    else:
        limits = context.find_object(StopLimits) or STOP_LIMITS
        stop_robots = commands.stop_all if everywhere else commands.stop
        stop_robots(settings, reason, seconds, as_json=json, limits=limits)


@_command("nao router", "nao router --config keys/router.toml", defaults=ROUTER_DEFAULTS)
def router(*, settings: Settings) -> None:
    """Route messages between machines, as far as their roles permit.

    Their processes connect to it with --mode client. `nao security init` creates the files that secure it on
    a network.
    """
    from nao_tools._deployment.router import serve

    serve(settings, report_ready)


_STACK_EXAMPLES = """Examples:

nao stack sim

nao stack nao --set robot=tcp://nao.local

nao stack lab --machine operator

nao stack ./my.toml --set speed=5 --seconds 60

nao stack lab --machine robot --systemd units"""


@app.command(epilog=_STACK_EXAMPLES)
def stack(
    name: Annotated[
        str, typer.Argument(metavar="NAME|FILE", help="demo, lab, nao, ros, sim, or a stack file (TOML).")
    ],
    *,
    machine: Annotated[
        str, typer.Option(metavar="NAME", help="Which part to start, of a stack for several machines.")
    ] = "",
    seconds: Annotated[float | None, _SECONDS] = None,
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="Change a variable of the stack; repeatable."),
    ] = None,
    realm: Annotated[
        str, typer.Option(metavar="NAME", help="Robot or stack that the processes join, instead of nao.")
    ] = "",
    systemd: Annotated[
        Path | None, typer.Option(metavar="DIR", help="Start nothing: write systemd units into a folder.")
    ] = None,
) -> None:
    """Start the processes of a stack file and stop them all together.

    Each writes its own log file; the foreground process, if the stack has one, gets the terminal. Ctrl-C
    stops everything in reverse order; a second Ctrl-C, at once.
    """
    from nao_tools._deployment.launcher import start
    from nao_tools._deployment.stack import load_stack, stack_path
    from nao_tools._deployment.units import write

    part, changes = load_stack(stack_path(name)).on_machine(machine), _changes(settings or [])
    part = part.in_realm(realm) if realm else part
    if systemd:
        write(part, changes, systemd)
    else:
        raise typer.Exit(start(part, changes, seconds))


def _changes(settings: Iterable[str]) -> dict[str, str]:
    """Return the variables that `--set NAME=VALUE` gives."""
    changes = {}
    for setting in settings:
        name, equals, value = setting.partition("=")
        if not equals or not name:
            raise typer.BadParameter(f"{setting!r} is not NAME=VALUE", param_hint="--set")
        changes[name] = value
    return changes


app.add_typer(security, name="security")
