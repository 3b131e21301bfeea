"""Options for settings, logging, and an orderly way out, for commands; `ballmover/_cli.py` is an example."""

from __future__ import annotations

import atexit
import errno
import functools
import gc
import inspect
import logging
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, Final, NoReturn

import typer
from msgspec import structs
from typer.core import TyperCommand
from typer.main import get_command_name
from typer.models import CommandInfo, TyperInfo

from zenoh_ice.application.logs import set_up_logging
from zenoh_ice.application.watchdog import Watchdog
from zenoh_ice.data.exceptions import ZenohIceError
from zenoh_ice.data.status import program_name
from zenoh_ice.data.text import printable
from zenoh_ice.data.toml_file import shown
from zenoh_ice.settings import CONFIG_VARIABLE, DEFAULT_ENDPOINT, Settings, load_settings
from zenoh_ice.settings.security import exposure

_logger = logging.getLogger(__name__)


def _option(name: str, metavar: str | None, text: str, kind: Any = str | None) -> inspect.Parameter:  # noqa: ANN401
    flag, panel = f"--{name.replace('_', '-')}", "Shared by all commands"
    kind = Annotated[kind, typer.Option(flag, metavar=metavar, help=text, rich_help_panel=panel)]
    default = None if metavar else False
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)


_CONNECT: Final = f"Endpoint to connect to, such as {DEFAULT_ENDPOINT}; may be repeated."
_LISTEN: Final = "Endpoint to listen on; port 0 picks a free port; may be repeated."
_CONFIG: Final = f"Settings file, instead of {CONFIG_VARIABLE}; variables and flags override it."
_LONGEST_ERROR: Final = 1 << 16
_END_LIMIT: Final = 10.0
"""Seconds in which a process ends that a signal is to end."""
_SHARED: Final = [
    _option("realm", "NAME", "Robot or stack to join."),
    _option("connect", "ENDPOINT", _CONNECT, list[str] | None),
    _option("listen", "ENDPOINT", _LISTEN, list[str] | None),
    _option("mode", "peer|client", "Talk to peers directly, or through the router or server at --connect."),
    _option("clock", "auto|wall|sim", "Wall time or robot time; auto: robot time if it is simulated."),
    _option("timeout", "SECONDS", "Time limit of a call.", float | None),
    _option("log_level", "LEVEL", "Lowest level to log: debug, info, warning, error or critical."),
    _option("log_file", "FILE", "File to log to, instead of stderr; {program} and {pid} stand for ours."),
    _option("log_format", "text|json", "Log lines of text, or a JSON object on each line."),
    _option("authority", "PEM", "Certificate of the authority, for TLS."),
    _option("certificate", "PEM", "Our own certificate."),
    _option("key", "PEM", "Private key of our certificate."),
    _option("config", "TOML", _CONFIG),
    _option("show_config", None, "Print the settings and where each comes from.", bool),
]


def describe(settings: Settings) -> str:
    """Return a table of the settings and the source of each; of `[security]`, only those that are set."""
    rows = {name: shown(value) for name, value in structs.asdict(settings).items() if name != "security"}
    for name, value in structs.asdict(settings.security).items():
        if f"security.{name}" in settings.origins:
            text = shown([*value] if name == "roles" else value)
            rows[f"security.{name}"] = "(hidden)" if name == "password" else text
    width = max(map(len, rows.values()))
    return "\n".join(
        f"{name:<22}  {text:<{width}}  {settings.origins.get(name, 'default')}" for name, text in rows.items()
    )


def with_options(
    parameter: str,
    options: Sequence[inspect.Parameter],
    gather: Callable[[dict[str, Any]], object],
    *,
    first: bool = False,
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command options in place of one of its parameters, after its own or `first`.

    The command is called with what `gather` returns for the values of the options by their names.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(command)
        def called_by_typer(**values: Any) -> None:  # noqa: ANN401 - typer has checked them
            given = {option.name: values.pop(option.name) for option in options}
            command(**{parameter: gather(given)}, **values)

        parameters = inspect.signature(command, eval_str=True).parameters.values()
        own = [each for each in parameters if each.name != parameter]
        signature = inspect.Signature([*options, *own] if first else [*own, *options])
        called_by_typer.__signature__ = signature  # type: ignore[attr-defined]
        called_by_typer.__annotations__ = {
            name: each.annotation for name, each in signature.parameters.items()
        }
        return called_by_typer

    return decorate


def with_settings(
    defaults: Mapping[str, object] | None = None,
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command the options that all commands share; they are passed to it as `settings`.

    `defaults` are the command's defaults that differ from those of `Settings`. Logging is set up before the
    command runs. With `--show-config` the command prints the settings instead, and their dangers on stderr,
    and exits with code 0.
    """

    def gather(shared: dict[str, Any]) -> Settings:
        config = shared.pop("config")
        show_config = shared.pop("show_config")
        flags = {name: value for name, value in shared.items() if value != []}  # typer's "not given"
        settings = load_settings(config, flags, defaults=defaults)
        if show_config:
            typer.echo(describe(settings))
            for danger in exposure(settings):
                typer.echo(f"warning: {danger}", err=True)
            raise typer.Exit
        set_up_logging(settings)
        return settings

    return with_options("settings", _SHARED, gather)


def lean(complete: Callable[[], typer.Typer]) -> type[TyperCommand]:
    """Return the class of a command without the options of plug-ins, which are loaded when they are needed.

    That is where its line has an option that it does not know, as for help: it then is what `complete` makes.
    """

    class Lean(TyperCommand):
        def parse_args(self, ctx: Any, args: list[str]) -> list[str]:  # noqa: ANN401 - typer hides its types
            known = {name for each in self.params for name in (*each.opts, *each.secondary_opts)}
            if any(each.startswith("--") and each.partition("=")[0] not in known for each in args):
                whole = typer.main.get_command(complete())
                self.params, self.callback, self.epilog = whole.params, whole.callback, whole.epilog
            return super().parse_args(ctx, args)

    return Lean


def finite(value: float | None) -> float | None:
    """Return a number from the command line, but refuse `nan` and `inf`: the `callback` of an option.

    Raises typer.BadParameter.
    """
    if value is not None and not math.isfinite(value):
        raise typer.BadParameter(f"{value} is not a finite number")
    return value


ServerWait = Annotated[
    float,
    typer.Option(
        "--server-wait",
        metavar="SECONDS",
        min=0.0,
        callback=finite,
        help="How long to wait at the start for the servers that are needed.",
    ),
]
"""An option of a command that may start before its servers: see `patience.Patience`."""
SERVER_WAIT: Final = 30.0


def load_transport() -> None:
    """Import what the first communicator would import, in a process that will need it soon."""
    import zenoh_ice.routes._transport  # noqa: F401 - it takes long


def report_ready(text: str = "") -> Watchdog:
    """Print `text`, if any, and notify systemd, if it started the command, that the command is ready.

    Returns systemd's watchdog, to which the command reports that it works.
    """
    if text:
        typer.echo(text)
    watchdog = Watchdog()
    watchdog.report_ready()
    return watchdog


class Stop(threading.Event):
    """The event that the first signal sets."""

    signal: int = 0  # its number
    interrupts = False
    """Whether it interrupts the main thread, too: code that does not look at the event."""
    again = False

    def begin_again(self) -> None:
        """End the command, and start it again in this process: with its arguments and its environment."""
        self.again = True
        self.set()


@contextmanager
def stop_on_signals(*, cleanup_limit: float = 10.0) -> Iterator[Stop]:
    """Let SIGINT, SIGTERM and SIGHUP only set an event, for the duration of a `with` block.

    The block runs on the main thread. It waits for the event or polls it, cleans up, and ends; then
    SystemExit is raised with 128 and the number of the signal, unless the block raised something itself.
    After `Stop.begin_again` the command starts again instead. Further signals are ignored for `cleanup_limit`
    s; the first one after that ends the process at once.
    """
    stop = Stop()
    signals = _stop_signals()
    reader, writer = os.pipe()

    def listen() -> None:
        deadline = 0.0
        while number := int.from_bytes(os.read(reader, 1)):  # 0 when the writer is closed
            if number in signals and not stop.signal:
                stop.signal = number
                deadline = time.monotonic() + cleanup_limit
                stop.set()
            elif number in signals and time.monotonic() > deadline:
                os._exit(128 + number)

    # Python writes signal numbers to the pipe, whichever thread receives them and whatever the main thread
    # waits for; an ordinary thread, which may take locks, sets the event.
    thread = threading.Thread(target=listen, name="signals", daemon=True)
    os.set_blocking(writer, False)
    thread.start()
    former_writer = signal.set_wakeup_fd(writer, warn_on_full_buffer=False)

    interrupted = False

    def interrupt(_number: int, _frame: object) -> None:
        nonlocal interrupted
        if stop.interrupts and not interrupted:
            interrupted = True
            raise KeyboardInterrupt

    former = {number: signal.signal(number, interrupt) for number in signals}
    try:
        yield stop
    except KeyboardInterrupt:
        if not interrupted:
            raise
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)
        signal.set_wakeup_fd(former_writer)
        os.close(writer)
        thread.join(2.0)
        os.close(reader)
    if stop.signal:
        raise SystemExit(128 + stop.signal)
    if stop.again:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        # As it was given: variables of systemd were taken out of ours.
        given = Path("/proc/self/environ").read_bytes().split(b"\0")
        environment = dict(each.split(b"=", 1) for each in given if b"=" in each)
        os.execve(sys.executable, [sys.executable, *sys.orig_argv[1:]], environment)  # noqa: S606 - ourselves


@contextmanager
def unwind_on_signals(*, cleanup_limit: float = 10.0) -> Iterator[None]:
    """Let SIGINT, SIGTERM or SIGHUP raise SystemExit in a `with` block, which cleans up what it has opened.

    The block runs on the main thread, and need not look out for anything. The exit code is that of
    `stop_on_signals`. Further signals are ignored; `cleanup_limit` s after the first the process ends at
    once, whatever keeps it.
    """
    signals = _stop_signals()

    def end(number: int, _frame: object) -> None:
        for each in signals:
            signal.signal(each, signal.SIG_IGN)
        limit = threading.Timer(cleanup_limit, os._exit, (128 + number,))
        limit.daemon = True
        limit.start()
        raise SystemExit(128 + number)

    former = {number: signal.signal(number, end) for number in signals}
    try:
        yield
    finally:
        for number, handler in former.items():
            if signal.getsignal(number) is end:  # otherwise one has come, and no other may cut the end short
                signal.signal(number, handler)


def _stop_signals() -> tuple[signal.Signals, ...]:
    """Return the signals that end a command: without SIGHUP where it is ignored, as under nohup."""
    hangup = () if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN else (signal.SIGHUP,)
    return signal.SIGINT, signal.SIGTERM, *hangup


def _drop_other_commands(app: typer.Typer) -> None:
    """Drop all subcommands but the requested one: building all takes an eighth of the start-up time."""
    if app.registered_callback and len(sys.argv) > 1:
        asked = [each for each in app.registered_commands if _name_of(each) == sys.argv[1]]
        if asked:
            app.registered_commands, app.registered_groups = asked, []


def join_lines(app: typer.Typer) -> None:
    """Join the lines of the paragraphs in docstrings of commands: Rich would keep them, on any terminal."""
    described: list[CommandInfo | TyperInfo] = [*app.registered_commands]
    if app.registered_callback is not None:
        described.append(app.registered_callback)
    for each in described:
        if each.callback is not None and each.callback.__doc__ is not None:
            paragraphs = inspect.cleandoc(each.callback.__doc__).split("\n\n")
            each.help = "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs)
    for group in app.registered_groups:
        if group.typer_instance is not None:
            join_lines(group.typer_instance)


def _name_of(command: CommandInfo) -> str:
    return command.name or get_command_name(getattr(command.callback, "__name__", ""))


def run(app: typer.Typer, *, expected: tuple[type[Exception], ...] = ()) -> NoReturn:
    """Run a command to its end and exit.

    The exit code is 0, 1 after an error of ours or one of the `expected` types (one line on stderr reports
    it), 2 after wrong usage, and 129, 130 or 143 after SIGHUP, Ctrl-C or SIGTERM. Those signals end the
    process at once, unless the command has something to clean up and is in a block of `stop_on_signals`, or
    of `unwind_on_signals`.
    """
    errors: tuple[type[Exception], ...] = (ZenohIceError, *expected)
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:  # closed by the caller, as in `>&-`
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115 - to the end
    for number in _stop_signals():
        signal.signal(number, lambda number, _frame: os._exit(128 + number))
    gc.freeze()  # imported modules stay loaded: later collections need not search them
    gc.enable()
    _drop_other_commands(app)
    join_lines(app)
    atexit.register(gc.freeze)  # exiting frees all memory: skip the final garbage collection
    why: str | None
    try:
        try:
            app()
        except SystemExit as end:
            sys.stdout.flush()
            if isinstance(end.code, int) and end.code - 128 in _stop_signals():
                _end_undisturbed(end.code)
            raise
    except errors as error:
        _logger.debug("the command failed", exc_info=True)
        why = str(error)
    except BrokenPipeError:
        why = None  # nobody reads on, as after `| head`
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        why = f"cannot write{f' {error.filename}' if error.filename else ''}: {error.strerror}"
    else:
        sys.exit(0)
    _end_output()
    if why is not None:
        typer.echo(f"{program_name()}: error: {printable(' '.join(why.split()), _LONGEST_ERROR)}", err=True)
    sys.exit(1)


def _end_undisturbed(code: int) -> None:
    """Let no further signal change the exit code: Python gives up its handlers before it has ended."""
    for number in _stop_signals():
        signal.signal(number, signal.SIG_IGN)
    limit = threading.Timer(_END_LIMIT, os._exit, (code,))
    limit.daemon = True
    limit.start()


def _end_output() -> None:
    """Write what is left of the output, or drop it: Python would try again at its end, and complain."""
    try:
        sys.stdout.flush()
    except OSError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
