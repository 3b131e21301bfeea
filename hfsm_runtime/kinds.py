"""Kinds of endpoints that a component may declare beside its proxies; ROS is the first.

What they do, plug-ins know: the entry points of `visualhfsm.kinds`, each a package. Its module `components`
is a `Kind`, and its module `names` has what generated components import of `hfsm_runtime`. The function
`options` in the module of this name makes the options of the kind in the command of a component: the first
has the name of the kind, and opens its ends also for components that declare none.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, Any, Final, Protocol

from zenoh_ice import plugins

from .component import Component, endpoints_of
from .errors import ComponentError, MissingLibraryError

if TYPE_CHECKING:
    from zenoh_ice import Settings

NAMES: Final = frozenset({"Ros", "ros_message", "ros_tf"})
"""What generated components may import by the names of a plug-in."""

Ask = Callable[[str, Callable[[], Any], Callable[[], float] | None], Any]
"""Return a reading of a kind: one function makes it, the other returns for how many s it waits, if it does.

A recording calls the function and writes the reading down; a replay returns the recorded reading.
"""
Differs = Callable[[str, object, object], object]
"""Called in a replay for what user code sends otherwise: the recorded value and the present one."""
Called = Callable[[str, dict[str, Any], object, Exception | None], object]
"""Called for what user code does: its name, its arguments, the result, and the error if there is one."""


class Ends(Protocol):
    """The ends of the endpoints of a component and of its later versions."""

    def connect(self, component: Component) -> None:
        """Connect what a component declares and has not connected yet. Raises ComponentError."""


class OpenEnds(Ends, Protocol):
    """The ends of a component that runs on its robot."""

    def shown(self, monitor: Any) -> AbstractContextManager[object]:  # noqa: ANN401
        """Show a component where its ends are in a `with` block, and let it be steered from there.

        `monitor` is its `hfsm_runtime.debugger.monitor.Monitor`.
        """


class Kind(Protocol):
    """A kind of endpoints; declarations are of a subclass of `Endpoint`."""

    def opened(
        self, component: type[Component], settings: Settings, options: Mapping[str, Any]
    ) -> AbstractContextManager[OpenEnds]:
        """Open the ends of a component in a `with` block. Raises ComponentError."""

    def imitated(
        self,
        now: Callable[[], float],
        wait: Callable[[Callable[[], bool], float], bool],
        called: Called,
        *,
        stand_ins: bool,
    ) -> Ends:
        """Return ends within the process, for virtual time.

        `now` returns the time in s, and `wait` lets time pass until a condition holds or a limit in s is
        over. With `stand_ins` everything answers, with blank values.
        """

    def recorded(self, component: Component, ask: Ask) -> AbstractContextManager[None]:
        """Record what a connected component gets from its ends, in a `with` block."""

    def replayed(self, component: Component, ask: Ask, differs: Differs) -> None:
        """Give a component what was recorded in place of ends. Raises ComponentError."""

    def stop(self, component: Component) -> None:
        """Stop what a component drives by its endpoints, within 0.5 s; failures are logged."""


def kind_of(name: str) -> Kind:
    """Return a kind of endpoints by its name. Raises ComponentError for one that is not installed."""
    try:
        kind: Kind | None = plugins.find(plugins.KINDS, name, "components")
    except plugins.PluginError as error:
        raise ComponentError(str(error)) from error
    if kind is None:
        raise ComponentError(f"the plug-in for endpoints of the kind {name!r} is not installed")
    return kind


def kinds_of(component: Component | type[Component]) -> dict[str, Kind]:
    """Return the kinds of the endpoints that a component declares, by name. Raises ComponentError."""
    return {each.of: kind_of(each.of) for each in endpoints_of(component).values()}


def options_of_kinds() -> dict[str, Sequence[inspect.Parameter]]:
    """Return the options of each kind that is installed, by its name."""
    return {name: kind.options() for name, kind in plugins.each(plugins.KINDS, "options")}


def imported(name: str) -> Any:  # noqa: ANN401
    """Return what a generated component imports by one of the NAMES. Raises MissingLibraryError."""
    names = plugins.find(plugins.KINDS, "ros", "names")
    if names is None:
        text = "the document uses ROS, which is not installed: `pip install 'visualhfsm[ros2]'`"
        raise MissingLibraryError(text, name=name)
    return getattr(names, name)
