"""Endpoints of components: a kind that a plug-in adds, and one that is not installed."""

from __future__ import annotations

import inspect
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from typer.testing import CliRunner

import hfsm_runtime
from hfsm_runtime import Automaton, Component, State
from hfsm_runtime._stop import may_move, stop_robot
from hfsm_runtime.command import make_app
from hfsm_runtime.component import Endpoint, endpoints_of
from hfsm_runtime.errors import ComponentError, MissingLibraryError, NotConnectedError
from hfsm_runtime.kinds import NAMES, Ask, Called, Differs, Ends, Kind, kind_of, kinds_of, options_of_kinds
from hfsm_runtime.virtual import VirtualWorld
from tests.support.automata import automaton
from tests.support.plugins import installed, without
from zenoh_ice import Settings
from zenoh_ice.plugins import KINDS

FLAGS = """
import inspect
from typing import Annotated

import typer


def options():
    kind = Annotated[bool, typer.Option("--flags", help="Hoist flags.")]
    return [inspect.Parameter("flags", inspect.Parameter.KEYWORD_ONLY, annotation=kind, default=False)]
"""


class Signal(Endpoint):
    of = "signals"
    title = "signals"


class Horn(Component, document="horn.xml"):
    horn = Signal("harbor/horn")

    def automaton(self) -> Automaton:
        return automaton(1, "horn", [State(id=1, name="quiet")])


class Imitated:
    """Counts what is connected."""

    def __init__(self, now: Callable[[], float]) -> None:
        self.now = now

    def connect(self, component: Component) -> None:
        for name in endpoints_of(component):
            vars(component).setdefault(name, SimpleNamespace(heard_at=self.now))


class Signals:
    """A kind as a plug-in writes it."""

    def __init__(self) -> None:
        self.stopped: list[str] = []

    def opened(
        self, component: type[Component], settings: Settings, options: Mapping[str, Any]
    ) -> AbstractContextManager[Any]:
        raise NotImplementedError

    def imitated(
        self,
        now: Callable[[], float],
        wait: Callable[[Callable[[], bool], float], bool],
        called: Called,
        *,
        stand_ins: bool,
    ) -> Ends:
        return Imitated(now)

    def recorded(self, component: Component, ask: Ask) -> AbstractContextManager[None]:
        return nullcontext()

    def replayed(self, component: Component, ask: Ask, differs: Differs) -> None: ...

    def stop(self, component: Component) -> None:
        self.stopped += endpoints_of(component)


SIGNALS = Signals()
COMPONENTS = f"""
from {__name__} import SIGNALS

opened, imitated, stop = SIGNALS.opened, SIGNALS.imitated, SIGNALS.stop
recorded, replayed = SIGNALS.recorded, SIGNALS.replayed
"""


@pytest.fixture
def kind(tmp_path: Path) -> Iterator[Kind]:
    """The kind, installed."""
    modules = {"signals.components": COMPONENTS, "signals.options": FLAGS}
    with installed(tmp_path, {KINDS: {"signals": "signals"}}, **modules):
        SIGNALS.stopped.clear()
        yield kind_of("signals")


def test_an_endpoint_is_connected_by_its_kind_and_stopped_by_it(kind: Kind) -> None:
    component, world = Horn(), VirtualWorld()
    with pytest.raises(NotConnectedError, match=r"self\.horn \(harbor/horn of signals\) is not connected"):
        _ = component.horn
    assert kinds_of(component) == {"signals": kind}
    world.connect(component)
    world.connect(component)  # as a reload does
    assert component.horn.heard_at() == world.clock.now()
    assert may_move(component)
    stop_robot(component)
    assert SIGNALS.stopped == ["horn"]
    world.close()


@pytest.mark.usefixtures("kind")
def test_its_options_are_those_of_every_component() -> None:
    assert [each.name for each in options_of_kinds()["signals"]] == ["flags"]

    class Plain(Component): ...

    (command,) = make_app(Plain).registered_commands
    assert command.callback is not None
    assert "flags" in inspect.signature(command.callback).parameters


def test_a_kind_that_is_not_installed_is_named() -> None:
    with pytest.raises(
        ComponentError, match="the plug-in for endpoints of the kind 'signals' is not installed"
    ):
        VirtualWorld().connect(Horn())


@pytest.mark.parametrize("name", sorted(NAMES))
def test_a_generated_component_says_so_when_it_is_imported(name: str) -> None:
    with without("visualhfsm_ros2"), pytest.raises(MissingLibraryError, match=r"visualhfsm\[ros2\]"):
        getattr(hfsm_runtime, name)


def test_a_command_then_has_no_options_of_ros() -> None:
    with without("visualhfsm_ros2"):
        assert "ros" not in options_of_kinds()


def test_a_plug_in_that_is_broken_keeps_no_component_from_its_command(tmp_path: Path) -> None:
    modules = {"breaks.options": "raise ValueError('no wheels')"}
    with installed(tmp_path, {KINDS: {"broken": "breaks"}}, **modules):
        assert "broken" not in options_of_kinds()


def test_a_command_asks_plug_ins_for_options_only_where_its_line_needs_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Plain(Component, document="plain.xml"): ...

    with installed(tmp_path, {KINDS: {"flags": "flags"}}, **{"flags.options": FLAGS}):
        lean = make_app(Plain, lean=True)
        assert CliRunner().invoke(lean, ["--show-config", "--realm=lab"]).exit_code == 0
        assert "flags" not in sys.modules
        assert "--flags" in CliRunner().invoke(lean, ["--help"], env={"COLUMNS": "160"}).output
        refused = CliRunner().invoke(make_app(Plain, lean=True), ["--flagz"])
        assert (refused.exit_code, "No such option: --flagz" in refused.output) == (2, True)
