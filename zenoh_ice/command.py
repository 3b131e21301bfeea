"""What every command of the house shares: options, logging, and an orderly way out.

A command looks like this:

    app = typer.Typer()

    @app.command()
    def serve(realm: Realm = None, connect: Connect = None, listen: Listen = None, clock: ClockChoice = None,
              timeout: Timeout = None, config: Config = None, show_config: ShowConfig = False,
              log_level: LogLevel = None) -> None:
        settings = configure(realm=realm, connect=connect, listen=listen, clock=clock, timeout=timeout,
                             config=config, show_config=show_config, log_level=log_level)
        with initialize(settings) as communicator:
            ...

    def main() -> None:
        run(app)
"""

from __future__ import annotations

import logging
import math
import signal
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from types import FrameType
from typing import Annotated, Final, NoReturn

import typer

from .exceptions import ZenohIceError
from .settings import CONFIG_VARIABLE, DEFAULT_ENDPOINT, ENVIRONMENT_PREFIX, Settings, load_settings

__all__ = [
    "ClockChoice",
    "Config",
    "Connect",
    "Listen",
    "LogLevel",
    "Realm",
    "ShowConfig",
    "Timeout",
    "configure",
    "finite",
    "run",
    "set_up_logging",
]

_PANEL: Final = "Shared by all commands"
_CLEANUP_GRACE: Final = (
    10.0  # s after a signal in which further ones are ignored, so that cleaning up can end
)

_logger = logging.getLogger(__name__)

Realm = Annotated[
    str | None,
    typer.Option("--realm", metavar="NAME", help="Robot or stack to belong to.", rich_help_panel=_PANEL),
]
Connect = Annotated[
    list[str] | None,
    typer.Option(
        "--connect",
        metavar="ENDPOINT",
        help=f"Endpoint to connect to, such as {DEFAULT_ENDPOINT}; may be repeated.",
        rich_help_panel=_PANEL,
    ),
]
Listen = Annotated[
    list[str] | None,
    typer.Option(
        "--listen",
        metavar="ENDPOINT",
        help="Endpoint to listen on; port 0 lets the system pick; may be repeated.",
        rich_help_panel=_PANEL,
    ),
]
ClockChoice = Annotated[
    str | None,
    typer.Option(
        "--clock",
        metavar="auto|wall|sim",
        help="Time to go by: that of the wall, or the robot's; auto takes the robot's when it is simulated.",
        rich_help_panel=_PANEL,
    ),
]
Timeout = Annotated[
    float | None,
    typer.Option("--timeout", metavar="SECONDS", help="Longest duration of a call.", rich_help_panel=_PANEL),
]
Config = Annotated[
    Path | None,
    typer.Option(
        "--config",
        metavar="TOML",
        help=f"File of settings. {ENVIRONMENT_PREFIX}REALM and the like, then flags, win over it.",
        envvar=CONFIG_VARIABLE,
        rich_help_panel=_PANEL,
    ),
]
ShowConfig = Annotated[
    bool,
    typer.Option(
        "--show-config", help="Print the settings and where each comes from.", rich_help_panel=_PANEL
    ),
]
LogLevel = Annotated[
    str | None,
    typer.Option(
        "--log-level",
        metavar="LEVEL",
        help="Least severe messages to log: debug, info, warning, error or critical.",
        rich_help_panel=_PANEL,
    ),
]


def configure(
    *,
    realm: str | None = None,
    connect: list[str] | None = None,
    listen: list[str] | None = None,
    clock: str | None = None,
    timeout: float | None = None,
    config: Path | None = None,
    show_config: bool = False,
    log_level: str | None = None,
    defaults: Mapping[str, object] | None = None,
) -> Settings:
    """Turn the shared options into settings and set up logging.

    `defaults` are those of the command where they differ from those of `Settings`. With `show_config` the
    settings are printed and the command ends with exit code 0. Raises ConfigurationException.
    """
    flags = {
        "realm": realm,
        "connect": connect or None,
        "listen": listen or None,
        "clock": clock,
        "timeout": timeout,
        "log_level": log_level,
    }
    settings = load_settings(config, flags, defaults=defaults)
    if show_config:
        typer.echo(settings.describe())
        raise typer.Exit
    set_up_logging(settings.log_level)
    return settings


def finite(value: float | None) -> float | None:
    """Return a number of the command line; as the `callback` of an option it refuses `nan` and `inf`.

    Raises typer.BadParameter.
    """
    if value is not None and not math.isfinite(value):
        raise typer.BadParameter(f"{value} is not a finite number")
    return value


def set_up_logging(level: str) -> None:
    """Log to stderr, with time, level and logger, what is at least as severe as `level`."""
    logging.basicConfig(
        stream=sys.stderr,
        level=level.upper(),
        format="%(asctime)s.%(msecs)03d %(levelname)-8s %(name)s: %(message)s",
        datefmt="%H:%M:%S",
        force=True,
    )


def run(app: typer.Typer, *, expected: tuple[type[Exception], ...] = ()) -> NoReturn:
    """Run a command to its end and exit.

    The exit code is 0, 1 after an error of ours or one of the `expected` types (one line on stderr tells it),
    2 after wrong usage, and 129, 130 or 143 after SIGHUP, Ctrl-C or SIGTERM. Those signals raise SystemExit
    in the main thread, so `with` and `finally` clean up wherever they strike. While that goes on further ones
    are ignored, but not for ever.
    """
    errors: tuple[type[Exception], ...] = (ZenohIceError, *expected)
    _StopOnSignal().install()
    try:
        app()
    except errors as error:
        _logger.debug("the command failed", exc_info=True)
        typer.echo(f"{_program_name()}: error: {' '.join(str(error).split())}", err=True)
        sys.exit(1)
    sys.exit(0)


def _program_name() -> str:
    program = Path(sys.argv[0])
    return program.parent.name if program.name == "__main__.py" else program.name


class _StopOnSignal:
    """Turn signals into SystemExit in the main thread."""

    def __init__(self) -> None:
        self._stopped_at: float | None = None

    def install(self) -> None:
        signal.signal(signal.SIGINT, self._stop)
        signal.signal(signal.SIGTERM, self._stop)
        if signal.getsignal(signal.SIGHUP) is not signal.SIG_IGN:  # nohup
            signal.signal(signal.SIGHUP, self._stop)

    def _stop(self, number: int, _frame: FrameType | None) -> None:
        now = time.monotonic()
        if self._stopped_at is not None and now - self._stopped_at < _CLEANUP_GRACE:
            return
        self._stopped_at = now
        raise SystemExit(128 + number)
