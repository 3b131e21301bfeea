"""The base of generated components: what user code sees as `self`."""

from __future__ import annotations

import inspect
import logging
import threading
from collections.abc import Callable, Collection, Mapping
from pathlib import PurePath
from types import FunctionType
from typing import Any, ClassVar, Generic, Self, TypeVar, overload

from zenoh_ice.data.exceptions import ZenohIceError
from zenoh_ice.threads.clock import Clock, WallClock

from ._actor import make_event
from ._automaton import Automaton
from ._marks import Mark, make_mark
from .errors import (
    ComponentError,
    EventError,
    NotConnectedError,
    OnError,
    OnRefused,
    VariablesError,
    describe,
)
from .places import keep_source, locate

P = TypeVar("P")
_D = TypeVar("_D", bound="_Declared[Any]")


class _Declared(Generic[P]):
    """An attribute that a component declares in its class; the class itself returns the declaration."""

    name = ""

    def __set_name__(self, owner: type, name: str) -> None:
        self.name = name

    @overload
    def __get__(self, instance: None, owner: type) -> Self: ...
    @overload
    def __get__(self, instance: object, owner: type) -> P: ...

    def __get__(self, instance: object | None, owner: type) -> Self | P:
        return self if instance is None else self._value()

    def _value(self) -> P:
        """Return the value of the attribute while nothing is assigned to it."""
        raise NotImplementedError


class Proxy(_Declared[P]):
    """Declare a proxy of a component: the identity of its servant and its class.

    The attribute is the proxy itself once the component is connected. A test may assign anything else.
    """

    def __init__(self, identity: str, type: type[P]) -> None:
        self.identity = identity
        self.type = type

    def _value(self) -> P:
        raise NotConnectedError(f"self.{self.name} (servant {self.identity}) is not connected")


class Endpoint(_Declared[Any]):
    """Declare an endpoint that is no servant's, such as a topic of ROS, by its name there.

    Each kind has a subclass, which says `of` which kind it is, and as errors call it.
    """

    of: ClassVar[str]
    title: ClassVar[str]

    def __init__(self, target: str) -> None:
        self.target = target

    def _value(self) -> Any:  # noqa: ANN401
        raise NotConnectedError(f"self.{self.name} ({self.target} of {self.title}) is not connected")


class Parameter(_Declared[P]):
    """Declare a parameter of a component: its default, of type int, float, bool or str, and what it is for.

    The attribute is the default until the command line, or a test, sets it.
    """

    def __init__(self, default: P, description: str = "") -> None:
        self.default = default
        self.description = description

    def _value(self) -> P:
        return self.default


class _Itself:
    """The component under another name, unless a document gives that name to something else."""

    def __get__(self, instance: Component | None, owner: type) -> Any:  # noqa: ANN401 - user code is not typed
        return owner if instance is None else instance


class _ItsClock:
    """The clock of a component, unless a document defines something else with the name `clock`."""

    def __get__(self, instance: Component | None, owner: type[Component]) -> Clock:
        return (owner if instance is None else instance)._hfsm_clock


class Component:
    """The `self` of user code: proxies and functions of the document, the clock and the log.

    A subclass gives the document it was generated from, the reactions to an error (`stop` or `continue`) and
    to a refused command (`pause` or `error`), the texts of the project's own types of ROS, and the events
    that may come from outside. It defines `automaton`. Other code must not rely on `__init__`, `clock`,
    `log`, `sleep`, `send` and `mark`, because a document may define functions with these names.
    """

    clock = _ItsClock()
    """The clock of the component: the wall's, or the robot's."""
    log: logging.Logger = logging.getLogger("component")
    """The log of user code."""

    # VisualStates has names for several parts, which are all the component here.
    interfaces = rosNode = globalNamespace = namespace = _Itself()

    _hfsm_document: ClassVar[str] = ""
    _hfsm_on_error: ClassVar[OnError] = OnError.STOP
    _hfsm_on_refused: ClassVar[OnRefused] = OnRefused.PAUSE
    _hfsm_ros_types: ClassVar[Mapping[str, str]] = {}
    _hfsm_events: ClassVar[frozenset[str]] = frozenset()
    _hfsm_proofs: ClassVar[tuple[tuple[Any, ...], ...]] = ()
    _hfsm_log: ClassVar[logging.Logger] = log
    _hfsm_clock: Clock = WallClock()
    _hfsm_sleep: Callable[[float], None] | None = None
    _hfsm_send: Callable[[str, object], None] | None = None
    _hfsm_mark: Callable[[Mark], None] | None = None

    def __init_subclass__(
        cls,
        *,
        document: str = "",
        on_error: str = "stop",
        on_refused: str = "pause",
        ros_types: Mapping[str, str] | None = None,
        events: Collection[str] = (),
        **others: Any,  # noqa: ANN401
    ) -> None:
        super().__init_subclass__(**others)
        cls._hfsm_document = document
        if document and isinstance(made := vars(cls).get("automaton"), FunctionType):
            keep_source(made)
        cls._hfsm_on_error = OnError(on_error)
        cls._hfsm_on_refused = OnRefused(on_refused)
        cls._hfsm_ros_types = ros_types or {}
        cls._hfsm_events = frozenset(events)
        cls._hfsm_log = logging.getLogger(PurePath(document).stem or cls.__name__)
        if isinstance(inspect.getattr_static(cls, "log"), logging.Logger):
            cls.log = cls._hfsm_log

    def automaton(self) -> Automaton:
        """Return the root automaton with all below it; called once, before the first cycle."""
        raise NotImplementedError

    def sleep(self, seconds: float) -> None:
        """Wait by the component's clock; when the component ends, the wait and the whole cycle end early.

        Raises ValueError for a time without an end, such as nan.
        """
        if not seconds <= threading.TIMEOUT_MAX:
            raise ValueError(f"self.sleep({seconds}) would never end")
        if self._hfsm_sleep is None:
            self.clock.sleep(seconds)
        else:
            self._hfsm_sleep(seconds)

    def send(self, name: str, data: object = None) -> None:
        """Send an event to every active automaton; none is active before the component has started.

        `data` is a JSON value. Raises EventError.
        """
        if self._hfsm_send is None:
            make_event(name, data)
        else:
            self._hfsm_send(name, data)

    def mark(self, camera: str, u: float, v: float, label: str = "") -> None:
        """Mark a pixel of a camera's picture, such as where a ball is, for all viewers of the picture.

        The pixel is `u` pixels right of the top left corner and `v` below it. The mark is shown for 0.5 s, or
        until another with the same label replaces it. Raises MarkError.
        """
        mark = make_mark(camera, u, v, label)
        if self._hfsm_mark is not None:
            self._hfsm_mark(mark)


def equip(
    component: Component,
    clock: Clock,
    sleep: Callable[[float], None],
    send: Callable[[str, object], None],
    mark: Callable[[Mark], None] | None = None,
) -> None:
    """Give a component its clock, and the functions behind its `sleep`, `send` and `mark`."""
    component._hfsm_clock = clock
    component._hfsm_sleep = sleep
    component._hfsm_send = send
    component._hfsm_mark = mark


def require_declared(component: Component, name: str) -> None:
    """Raise EventError for an event that the document does not declare: only its own code may send that."""
    if name in component._hfsm_events:
        return
    import html  # rarely needed, and read at each start

    document = component._hfsm_document or "its document"
    element = f"<event><name>{html.escape(name, quote=False)}</name></event>"
    raise EventError(
        f"the event {name!r} is not declared, so that it may not come from outside: add {element} to the "
        f"<events> of {document} (in the editor: Data, Component), and generate the component again"
    )


def proxies_of(component: Component | type[Component]) -> dict[str, Proxy[Any]]:
    """Return the proxies that a component declares, by attribute."""
    return _declared(component, Proxy)


def endpoints_of(component: Component | type[Component]) -> dict[str, Endpoint]:
    """Return the endpoints that a component declares, by attribute."""
    return _declared(component, Endpoint)


def type_texts_of(component: Component) -> Mapping[str, str]:
    """Return the texts of the project's own types that the endpoints of a component use, by type."""
    return component._hfsm_ros_types


def name_of(component: Component | type[Component]) -> str:
    """Return the name of a component, which is that of its log."""
    return component._hfsm_log.name


def parameters_of(component: Component | type[Component]) -> dict[str, Parameter[Any]]:
    """Return the parameters that a component declares, by attribute."""
    return _declared(component, Parameter)


def _declared(component: Component | type[Component], kind: type[_D]) -> dict[str, _D]:
    owner = component if isinstance(component, type) else type(component)
    bases = [base for base in reversed(owner.__mro__) if base not in Component.__mro__]  # which has none
    return {
        name: value for base in bases for name, value in vars(base).items() if issubclass(type(value), kind)
    }


def parameter_values(component: Component) -> dict[str, object]:
    """Return the values that a component's parameters have now, by attribute."""
    return {name: getattr(component, name) for name in parameters_of(component)}


def source_of(component: Component) -> str:
    """Return the file of a generated component."""
    return type(component).automaton.__code__.co_filename


def make_automata(component: Component) -> Automaton:
    """Return the automata of a component; this runs the variables of its document.

    Raises DefinitionError, ZenohIceError when the variables need a server that is offline, and VariablesError
    for any other exception in them but Ctrl-C, `sys.exit` included.
    """
    sleep = component._hfsm_sleep
    send = component._hfsm_send
    mark = component._hfsm_mark
    component._hfsm_sleep = component._hfsm_send = _too_early
    component._hfsm_mark = None  # there are no viewers yet
    try:
        return component.automaton()
    except (ComponentError, ZenohIceError, KeyboardInterrupt):
        raise
    except BaseException as error:
        place = locate(error, source_of(component))
        message = f"the variables of the component failed: {describe(error)}"
        raise VariablesError(f"{message} at {place}" if place else message) from error
    finally:
        component._hfsm_sleep = sleep
        component._hfsm_send = send
        component._hfsm_mark = mark


def _too_early(*_: object) -> None:
    raise RuntimeError(
        "`self.send` and `self.sleep` are for entry code: no automaton runs when variables are set"
    )
