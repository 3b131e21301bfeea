"""The command line of a generated component."""

from __future__ import annotations

import inspect
import re
import shlex
import threading
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager, ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path, PurePath
from typing import Annotated, Any, Final, NoReturn

import msgspec
import typer

from interfaces.hfsm import Breakpoint
from interfaces.nao import SafetyPrx
from zenoh_ice import Communicator, Settings, initialize
from zenoh_ice.application import cli
from zenoh_ice.application.last_cycle import CycleFile
from zenoh_ice.application.patience import Patience

from ._component_run import ComponentRun
from ._robot import Permission, servers_present
from ._robot import connect as connect_proxies
from ._runtime import Runtime
from ._stop import end_callbacks, may_move, send_only_stops, stop_robot
from .component import Component, Parameter, endpoints_of, parameters_of
from .debugger.monitor import Monitor
from .debugger.snapshot import structure_of
from .ending import CycleNotes
from .errors import ComponentError, OnError, OnRefused
from .kinds import OpenEnds, kind_of, kinds_of, options_of_kinds

_CHECK_PERIOD: Final = 0.1  # s between two checks of the main thread for signals

_OnError = Annotated[
    OnError | None,
    typer.Option(
        help="Reaction to an exception in the code of a state or transition. Default: the document's.",
        show_default=False,
    ),
]
_OnRefused = Annotated[
    OnRefused | None,
    typer.Option(
        help="Reaction when the robot refuses a command, as after an emergency stop. Default: the "
        "document's.",
        show_default=False,
    ),
]
_Seconds = Annotated[
    float | None,
    typer.Option(
        min=0.0,
        callback=cli.finite,
        metavar="SECONDS",
        help="Stop after this time, by the component's clock.",
    ),
]
_BeginAt = Annotated[
    str | None,
    typer.Option(
        metavar="AUTOMATON.STATE",
        help="Start in this state, and in the states above that lead to it; ids of the document, as 4.2.",
    ),
]
_Breakpoints = Annotated[
    list[str] | None,
    typer.Option(
        metavar="AUTOMATON.STATE[:CONDITION]",
        help="Pause when this state has been entered, such as 4.2, or when a transition has fired, such as "
        "4.t3; with a condition, 4.2:count > 3, only if that is true. May be given several times.",
    ),
]
_StayHalted = Annotated[
    bool,
    typer.Option(
        "--stay-halted", help="After an error stop the robot but keep serving the monitor, until Ctrl-C."
    ),
]
_Record = Annotated[
    Path | None,
    typer.Option(
        metavar="MCAP",
        dir_okay=False,
        help="Record the run to a new file, for `visualhfsm replay` and for Foxglove.",
    ),
]
_RecordImages = Annotated[
    bool,
    typer.Option(
        "--record-images",
        help="Record images, too: some MB per second. Code that reads images needs them for a replay.",
    ),
]


def option_of(name: str) -> str:
    """Return the option of a parameter: `--top-speed` of `top_speed`."""
    return f"--{name.replace('_', '-')}"


def main(component: type[Component]) -> NoReturn:
    """Run a component from the command line, and exit.

    The exit code is 0 when it finishes or its monitor stops it, 1 after an error, that of `sys.exit` when its
    code calls that, 130 after Ctrl-C and 143 after SIGTERM; in each case the robot is stopped first.
    """
    cli.run(make_app(component, lean=True), expected=(ComponentError,))


@dataclass(frozen=True)
class ComponentWorld:
    """A component's world: the communicator of its proxies, a function that connects them, its runtime."""

    communicator: Communicator
    connect: Callable[[Component], None]
    runtime: Callable[..., ComponentRun] = Runtime


def make_app(
    component: type[Component],
    dry_run: Callable[[Communicator], AbstractContextManager[ComponentWorld]] | None = None,
    *,
    lean: bool = False,
) -> typer.Typer:
    """Return the command of a component; a `dry_run`, given the realm's communicator, makes another world.

    A `lean` one asks plug-ins for options only where its line, or its component, needs them.
    """
    options = {} if lean and not endpoints_of(component) else options_of_kinds()
    cls = cli.lean(partial(make_app, component, dry_run)) if lean else None
    app = typer.Typer(add_completion=False, rich_markup_mode=None, pretty_exceptions_enable=False)
    module = getattr(inspect.getmodule(component), "__spec__", None)
    name = f"python -m {module.name}" if module else f"python {PurePath(inspect.getfile(component)).name}"
    examples = f"""Examples:

\b
  {name}
  {name} --seconds 60 --connect tcp/192.168.1.20:7447
  {name} --on-error continue --log-level info
  {name} --record run.mcap --record-images{_example(component, name)}

Exit codes: 0 done, 1 an error, 2 wrong usage, 130 Ctrl-C, 143 SIGTERM, or that of sys.exit in its code."""

    @app.command(cls=cls, help=inspect.getdoc(component), epilog=examples)
    @cli.with_settings()
    @with_parameters(component)
    @cli.with_options("of_kinds", [each for of_one in options.values() for each in of_one], dict)
    def run(
        *,
        settings: Settings,
        parameters: dict[str, object],
        of_kinds: dict[str, Any],
        on_error: _OnError = None,
        on_refused: _OnRefused = None,
        seconds: _Seconds = None,
        server_wait: cli.ServerWait = cli.SERVER_WAIT,
        begin_at: _BeginAt = None,
        breakpoint: _Breakpoints = None,
        stay_halted: _StayHalted = False,
        record: _Record = None,
        record_images: _RecordImages = False,
    ) -> None:
        first = None if begin_at is None else _ids(begin_at)
        breakpoints = [_breakpoint(each) for each in breakpoint or []]
        if record_images and record is None:
            raise typer.BadParameter("--record-images needs --record")
        if record is not None and dry_run is not None:
            raise typer.BadParameter("a dry run is not recorded")
        asked = [name for name in options if of_kinds[name]]
        if asked and dry_run is not None:
            raise typer.BadParameter(f"a dry run takes no {option_of(asked[0])}")
        patience = Patience(server_wait)
        with patience.until_served(partial(initialize, settings)) as communicator, ExitStack() as stack:
            made, ends = make_component(component, parameters), list[OpenEnds]()
            if dry_run is None:
                kinds = kinds_of(component) | {name: kind_of(name) for name in asked}
                opened = (each.opened(component, settings, of_kinds) for each in kinds.values())
                ends += map(stack.enter_context, opened)
                world = ComponentWorld(communicator, partial(_connect, communicator, ends))
                connect_proxies(made, communicator, patience)
            else:
                world = stack.enter_context(dry_run(communicator))
            world.connect(made)
            # From here on there is a recording to close and a robot to stop.
            stop = stack.enter_context(cli.stop_on_signals())

            def present() -> bool:
                return servers_present(runtime.component, world.communicator)

            stop.interrupts = True  # the variables of the document may wait for anything
            clock = world.communicator.clock
            reactions = {"on_error": on_error, "on_refused": on_refused, "servers_present": present}
            if record is None:
                runtime = world.runtime(made, clock, **reactions)
            else:
                # Loaded only for a recording.
                from ._recording.run import RecordedRuntime, recording
                from ._recording.surroundings import recorded_failures, recorded_surroundings

                recorder = stack.enter_context(recording(made, record, with_images=record_images))
                runtime = RecordedRuntime(made, clock, recorder, **reactions)
                recorder.action("structure", **msgspec.to_builtins(structure_of(runtime)))
                stack.enter_context(recorded_surroundings(communicator, recorder))
                stack.enter_context(recorded_failures(communicator, recorder, component))
            stop.interrupts = False
            if (kept := CycleFile.of_parent()) is not None:
                stack.callback(kept.close)
                runtime.tree.observers.append(CycleNotes(kept))
            if first is not None:
                runtime.begin_at(*first)
            with Monitor(runtime, communicator, breakpoints, world.connect) as monitor, ExitStack() as shown:
                for each in ends:
                    shown.enter_context(each.shown(monitor))
                safety = SafetyPrx.uncheckedCast(world.communicator.stringToProxy("Safety"))
                _run(runtime, seconds, stop, safety, stay_halted=stay_halted)
            if runtime.failed and not stop.is_set():
                raise typer.Exit(runtime.exit_code)

    return app


def _example(component: type[Component], name: str) -> str:
    """Return a line that sets the first parameter, or nothing without parameters."""
    for parameter, declared in parameters_of(component).items():
        value = "" if isinstance(declared.default, bool) else f" {shlex.quote(str(declared.default))}"
        return f"\n  {name} {option_of(parameter)}{value}"
    return ""


_PLACE: Final = re.compile(r"(\d{1,11})\.(t?)(\d{1,11})", re.ASCII)


def _ids(text: str) -> tuple[int, int]:
    """Return the ids of an automaton and a state; raises BadParameter."""
    found = _PLACE.fullmatch(text)
    if not found or found[2]:
        raise typer.BadParameter(f"--begin-at takes AUTOMATON.STATE, such as 4.2, not {text!r}")
    return int(found[1]), int(found[3])


def _breakpoint(text: str) -> Breakpoint:
    """Return a breakpoint; raises BadParameter."""
    place, _, condition = text.partition(":")
    found = _PLACE.fullmatch(place)
    if not found:
        raise typer.BadParameter(
            f"--breakpoint takes AUTOMATON.STATE[:CONDITION], such as 4.2 or 4.t3, not {text!r}"
        )
    ids = (0, int(found[3])) if found[2] else (int(found[3]), 0)
    return Breakpoint(int(found[1]), *ids, condition.strip())


def _run(
    runtime: ComponentRun,
    seconds: float | None,
    stop: threading.Event,
    safety: SafetyPrx,
    *,
    stay_halted: bool,
) -> None:
    try:
        runtime.start()
        cli.report_ready()
        _wait(runtime, seconds, stop, safety)
        if runtime.failed and stay_halted:
            _end(runtime)
            typer.echo("halted; Ctrl-C ends the component", err=True)
            stop.wait()
    finally:
        _end(runtime)


def _end(runtime: ComponentRun) -> None:
    """End the automata and stop the robot: at once, and again when the last cycle has ended.

    What goes on of user code then, on its own threads, commands nothing any more.
    """
    runtime.request_stop()
    component = runtime.component
    with ExitStack() as last:  # each, whatever the others raise: to log may run user code
        last.callback(stop_robot, component)
        last.callback(send_only_stops, component)
        last.callback(end_callbacks, component)
        last.callback(runtime.stop)
        if runtime.in_cycle:
            stop_robot(component)


def _wait(runtime: ComponentRun, seconds: float | None, stop: threading.Event, safety: SafetyPrx) -> None:
    """Wait for the component's end, its time or a signal, and resume it after refused commands."""
    end = None if seconds is None else runtime.clock.now() + seconds
    permission = Permission(safety, runtime.component)
    runtime.on_resumed = permission.begin_again
    while not (runtime.ended.is_set() or stop.is_set()):
        # Also where no command is refused meanwhile: the next one would start the robot after the reset.
        if runtime.refusal is None and may_move(runtime.component) and (why := permission.why_stopped()):
            runtime.pause_for(why)
        runtime.retry(permission.is_given)
        runtime.look_at_cycles()
        # In wall time: a clock that stands still must not hide a signal.
        wait = _CHECK_PERIOD
        if end is not None:
            left = end - runtime.clock.now()
            if left <= 0:
                return
            wait = min(wait, left / max(runtime.clock.rate, 1.0))
        runtime.ended.wait(wait)


def _connect(communicator: Communicator, ends: Iterable[OpenEnds], component: Component) -> None:
    """Connect a component's proxies, and its endpoints of other kinds."""
    connect_proxies(component, communicator)
    for each in ends:
        each.connect(component)


_PREFIX: Final = "parameter_"
"""Prefix of the options' names in Python, to avoid collisions."""


def with_parameters(component: type[Component]) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """Give a command an option for each parameter of a component; the values are passed as `parameters`."""

    def gather(values: dict[str, Any]) -> dict[str, Any]:
        return {name.removeprefix(_PREFIX): value for name, value in values.items()}

    options = [_option(name, declared) for name, declared in parameters_of(component).items()]
    return cli.with_options("parameters", options, gather, first=True)


def make_component(component: type[Component], parameters: Mapping[str, object]) -> Any:  # noqa: ANN401
    """Return a component with the values of its parameters set before its `__init__` runs."""
    made = component.__new__(component)
    vars(made).update(parameters)
    made.__init__()  # type: ignore[misc]  # the document's, if it defines one
    return made


def _option(name: str, declared: Parameter[Any]) -> inspect.Parameter:
    kind = type(declared.default)
    option = option_of(name)
    names = f"{option}/--no-{option.removeprefix('--')}" if kind is bool else option
    callback = cli.finite if kind is float else None
    annotation = Annotated[kind, typer.Option(names, help=declared.description or None, callback=callback)]  # type: ignore[valid-type]
    return inspect.Parameter(
        _PREFIX + name, inspect.Parameter.KEYWORD_ONLY, annotation=annotation, default=declared.default
    )
