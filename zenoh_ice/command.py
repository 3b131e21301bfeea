"""What every command of the house shares: options, logging, and an orderly way out.

A command looks like this:

    app = typer.Typer()

    @app.command()
    @with_settings()
    def serve(*, settings: Settings, speed: float = 1.0) -> None:
        with initialize(settings) as communicator:
            ...

    def main() -> None:
        run(app)
"""

from __future__ import annotations

import errno
import functools
import inspect
import logging
import math
import os
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Final, NoReturn

import typer

from .exceptions import ZenohIceError
from .network.process_status import program_name
from .network.security import exposure
from .settings import CONFIG_VARIABLE, DEFAULT_ENDPOINT, ENVIRONMENT_PREFIX, Settings, load_settings
from .stop_signals import StopOnSignal

__all__ = ["finite", "run", "set_up_logging", "with_settings"]

_PANEL: Final = "Shared by all commands"

_NO_ROOM: Final = (errno.ENOSPC, errno.EDQUOT)

_logger = logging.getLogger(__name__)


def _option(kind: object, name: str, metavar: str | None, explanation: str, **options: Any) -> object:  # noqa: ANN401 - typer's
    return Annotated[
        kind, typer.Option(f"--{name}", metavar=metavar, help=explanation, rich_help_panel=_PANEL, **options)
    ]


_Text: Final = str | None
_Texts: Final = list[str] | None

_SHARED: Final[Mapping[str, object]] = {
    "realm": _option(_Text, "realm", "NAME", "Robot or stack to belong to."),
    "connect": _option(
        _Texts, "connect", "ENDPOINT", f"Endpoint to connect to, such as {DEFAULT_ENDPOINT}; may be repeated."
    ),
    "listen": _option(
        _Texts, "listen", "ENDPOINT", "Endpoint to listen on; port 0 lets the system pick; may be repeated."
    ),
    "mode": _option(
        _Text,
        "mode",
        "peer|client",
        "Talk to every other peer directly, or through the router or server at --connect alone.",
    ),
    "clock": _option(
        _Text,
        "clock",
        "auto|wall|sim",
        "Time to go by: that of the wall, or the robot's; auto takes the robot's when it is simulated.",
    ),
    "timeout": _option(float | None, "timeout", "SECONDS", "Longest duration of a call."),
    "authority": _option(_Text, "authority", "PEM", "Who vouches for others, for TLS."),
    "certificate": _option(_Text, "certificate", "PEM", "What others know us by."),
    "key": _option(_Text, "key", "PEM", "Key of the certificate."),
    "config": _option(
        Path | None,
        "config",
        "TOML",
        f"File of settings. {ENVIRONMENT_PREFIX}REALM and the like, then flags, win over it.",
        envvar=CONFIG_VARIABLE,
    ),
    "show_config": _option(bool, "show-config", None, "Print the settings and where each comes from."),
    "log_level": _option(
        _Text,
        "log-level",
        "LEVEL",
        "Least severe messages to log: debug, info, warning, error or critical.",
    ),
}
"""The types of the shared options by their names in Python."""
_DEFAULTS: Final = {"show_config": False}  # None for the others


def with_settings(
    defaults: Mapping[str, object] | None = None,
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command the options that all commands share; it takes what they say as `settings`.

    `defaults` are those of the command where they differ from those of `Settings`. Logging is set up before
    the command runs. With `--show-config` the settings are printed instead, on stderr what is dangerous about
    them, and the exit code is 0.
    """

    def decorate(command: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(command)
        def with_options(**options: Any) -> None:  # noqa: ANN401 - typer has checked them
            shared = {name: options.pop(name) for name in _SHARED}
            command(settings=_settings(shared, defaults), **options)

        own = [
            parameter
            for parameter in inspect.signature(command, eval_str=True).parameters.values()
            if parameter.name != "settings"
        ]
        added = [
            inspect.Parameter(
                name, inspect.Parameter.KEYWORD_ONLY, annotation=kind, default=_DEFAULTS.get(name)
            )
            for name, kind in _SHARED.items()
        ]
        # What typer reads: the command's own options, then the shared ones.
        with_options.__signature__ = inspect.Signature([*own, *added])  # type: ignore[attr-defined]
        with_options.__annotations__ = {option.name: option.annotation for option in (*own, *added)}
        return with_options

    return decorate


def _settings(options: dict[str, Any], defaults: Mapping[str, object] | None) -> Settings:
    config, show_config = options.pop("config"), options.pop("show_config")
    # Of an option that may be repeated typer makes an empty list when it is not given.
    flags = {name: None if value == [] else value for name, value in options.items()}
    settings = load_settings(config, flags, defaults=defaults)
    if show_config:
        typer.echo(settings.describe())
        for danger in exposure(settings):
            typer.echo(f"warning: {danger}", err=True)
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
    _replace_closed_streams()
    stop = StopOnSignal()
    stop.install()
    try:
        app()
    except SystemError:
        # A signal that strikes in the middle of Zenoh's own code comes out of it as this, without a cause.
        if stop.exit_code is None:
            raise
        sys.exit(stop.exit_code)
    except errors as error:
        _fail(str(error))
    except OSError as error:
        if error.errno not in _NO_ROOM:
            raise
        _fail(f"cannot write{f' {error.filename}' if error.filename else ''}: {error.strerror}")
    sys.exit(0)


def _fail(why: str) -> NoReturn:
    _logger.debug("the command failed", exc_info=True)
    typer.echo(f"{program_name()}: error: {' '.join(why.split())}", err=True)
    sys.exit(1)


def _replace_closed_streams() -> None:
    """Let what is written go nowhere where whoever started the command closed its output, as in `>&-`."""
    for name in ("stdout", "stderr"):
        if getattr(sys, name) is None:
            setattr(sys, name, Path(os.devnull).open("w", encoding="utf-8"))  # noqa: SIM115 - to the end
