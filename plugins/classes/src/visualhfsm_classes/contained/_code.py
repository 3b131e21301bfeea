"""The code of a component at the far end: loaded as elsewhere, and run piece by piece."""

from __future__ import annotations

import builtins
import logging
import os
import sys
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from functools import partial
from types import ModuleType
from typing import Any, Final

import msgspec

from hfsm_runtime import Automaton, Event, State
from hfsm_runtime.component import Component, endpoints_of, equip, make_automata, proxies_of
from hfsm_runtime.debugger.reload import components_in
from hfsm_runtime.errors import ComponentError, VariablesError
from hfsm_runtime.loading import naming_libraries
from hfsm_runtime.places import keep_in_memory, locate
from hfsm_runtime.plugins import (
    Mark,
    TimeModule,
    explain,
    functions_of,
    hand_over,
    make_event,
    outputs_of,
    restore_random,
    short_repr,
    values_of,
)
from interfaces.jderobot import JderobotException
from visualhfsm_classes.contained import _protocol as protocol
from visualhfsm_classes.contained._link import FarTransport, Link
from visualhfsm_classes.contained._protocol import (
    LARGEST_TEXT,
    LARGEST_VALUES,
    Begin,
    Done,
    Raised,
    RunCode,
)
from zenoh_ice.data import typed

_MODULE: Final = "contained_component"
_LONGEST_NAME: Final = 200
_DEEPEST_NESTING: Final = 4
"""Levels of lists and dictionaries in a variable that is shown as it is."""
_MOST_ELEMENTS: Final = 1000
"""Elements of a list that is shown as it is."""

Code = Callable[..., object]


class FarComponent:
    """A component whose automata are at the near end."""

    def __init__(self, link: Link) -> None:
        self._link: Final = link
        self._transport: Final = FarTransport(link)
        self._file = ""
        self._time: Final = ExitStack()  # which stays open until the process ends
        self._code: dict[tuple[int, str, int], Code] = {}
        self._automata: dict[int, Automaton] = {}
        self._above: dict[int, int] = {}
        """The automaton above each, but the root."""
        self._component: Component | None = None
        self._shows = False
        self._shown: dict[int, dict[str, object]] = {}
        """The variables of each automaton as they were sent last."""

    def serve(self, message: object) -> object:
        """Answer a request of the near end."""
        try:
            match message:
                case RunCode():
                    value = self._run(message)
                    changed = self._changed(message.automaton)
                    return Done(value, _encoded(changed)) if changed else Done(value)
                case Begin():
                    self._begin(message)
                case protocol.AskHolds():
                    return Done(self._transport.inlets[message.stream].holds())
                case protocol.Deliver():
                    self._transport.inlets[message.stream].push(message.sample)
                case protocol.ListVariables():
                    return Done(variables=_encoded(self._variables(message.automaton)))
        except protocol.PipeError:
            raise
        except BaseException as error:  # noqa: BLE001 - code of others may raise anything, also SystemExit
            return self._raised(error, message.automaton if isinstance(message, RunCode) else 0)
        return Done()

    def _run(self, message: RunCode) -> bool:
        code = self._code.get((message.automaton, message.part, message.id))
        if code is None:
            return False
        if not message.event:
            return bool(code())
        data = typed.from_json(message.data) if message.data else None
        return bool(code(Event(message.event, data)))

    def _begin(self, message: Begin) -> None:
        link = self._link
        component = self._component = _load(message)()
        self._file = type(component).automaton.__code__.co_filename
        for name, value in message.parameters.items():
            setattr(component, name, value)
        communicator = self._transport.communicator
        for name, declared in proxies_of(component).items():
            proxy = communicator.stringToProxy(declared.identity)
            vars(component)[name] = declared.type.uncheckedCast(proxy)
        if endpoints_of(component):
            raise ComponentError("a contained component cannot use ROS")
        equip(component, link.clock, link.clock.sleep_in_cycle, self._send, self._mark)
        handler = _Handler(link)
        component._hfsm_log.addHandler(handler)
        component._hfsm_log.propagate = False
        self._time.enter_context(TimeModule(link.clock).shown_to(component))
        restore_random(message.random)
        root = make_automata(component)
        self._automata = {each.id: each for each in root.tree()}
        self._above = {
            child.id: each.id for each in root.tree() for state in each.states for child in state.children
        }
        self._code = dict(_pieces(root, {}))
        self._shows = message.shows

    def _send(self, name: str, data: object) -> None:
        event = make_event(name, data)
        self._link.ask(protocol.Send(event.name, msgspec.json.encode(event.data)))

    def _mark(self, mark: Mark) -> None:
        self._link.ask(protocol.SetMark(mark.camera, float(mark.u), float(mark.v), mark.label))

    def _variables(self, automaton: int) -> dict[str, object]:
        found = values_of(self._automata[automaton])
        return {name: _shown(value, _DEEPEST_NESTING) for name, value in list(found.items())[:_MOST_ELEMENTS]}

    def _changed(self, automaton: int) -> dict[str, object]:
        """Return the variables that have changed since the last time."""
        if not self._shows:
            return {}
        known, present = self._shown.get(automaton, {}), self._variables(automaton)
        self._shown[automaton] = present
        return {name: value for name, value in present.items() if name not in known or known[name] != value}

    def _chain(self, automaton: int) -> list[Automaton]:
        """Return an automaton and those above it."""
        found = []
        number: int | None = automaton
        while number in self._automata:
            found.append(self._automata[number])
            number = self._above.get(number)
        return found

    def _raised(self, error: BaseException, automaton: int) -> Raised:
        if isinstance(error, VariablesError) and error.__cause__ is not None:
            error = error.__cause__  # where it happened is said apart
        name = type(error).__name__[:_LONGEST_NAME]
        said = explain(error, self._component, self._chain(automaton))
        text, detail = said.removeprefix(f"{type(error).__name__}: "), ""
        if isinstance(error, JderobotException):
            text, detail, *_ = (*map(str, error.args), "")
        place = locate(error, self._file) if self._file else ""
        return Raised(name, _sendable(text), _sendable(place), _sendable(detail)[:_LONGEST_NAME])


class _Handler(logging.Handler):
    """Pass on what code logs."""

    def __init__(self, link: Link) -> None:
        super().__init__()
        self._link: Final = link

    def emit(self, record: logging.LogRecord) -> None:
        try:
            text = record.getMessage()
        except Exception:  # noqa: BLE001 - arguments of others
            self.handleError(record)
            return
        self._link.ask(protocol.Log(record.levelno, _sendable(text)))


def _load(message: Begin) -> type[Component]:
    """Run the module of a component in memory, and return its class."""
    file = f"<compiled>/{os.path.basename(message.file)}"  # noqa: PTH119 - it is no path
    text = message.text
    keep_in_memory(file, text, message.documents)
    module = ModuleType(_MODULE)
    module.__file__ = file
    vars(module)["__builtins__"] = dict(vars(builtins))  # with these, its imports can get a virtual `time`
    sys.modules[_MODULE] = module
    sys.path[:0] = message.include
    with naming_libraries(file):
        exec(compile(text, file, "exec"), vars(module))  # noqa: S102 - it is to run
    (found,) = components_in(module)
    return found


def _pieces(
    root: Automaton, outputs: dict[int, dict[str, object]]
) -> list[tuple[tuple[int, str, int], Code]]:
    """Return the code by automaton, part and id; `outputs` are those that automata have published."""
    found: list[tuple[tuple[int, str, int], Code | None]] = []
    for automaton in root.tree():
        for state in automaton.states:
            found += [
                ((automaton.id, part, state.id), getattr(state, part)) for part in ("entry", "code", "exit")
            ]
            if (arguments := state.arguments) is not None:
                found.append(
                    ((automaton.id, "arguments", state.id), lambda s=state, a=arguments: hand_over(s, a()))
                )
            if state.results is not None:
                found.append(((automaton.id, "results", state.id), partial(_take, state, outputs)))
        if automaton.set_outputs is not None:
            found.append(((automaton.id, "set_outputs", 0), partial(_reset, automaton)))
            found.append(((automaton.id, "get_outputs", 0), partial(_publish, automaton, outputs)))
        for transition in automaton.transitions:
            found.append(((automaton.id, "guard", transition.id), transition.guard))
            found.append(((automaton.id, "fired", transition.id), transition.code))
    return [(key, code) for key, code in found if code is not None]


def _reset(automaton: Automaton) -> None:
    assert automaton.set_outputs is not None
    automaton.set_outputs(automaton.first_outputs())


def _publish(automaton: Automaton, outputs: dict[int, dict[str, object]]) -> None:
    outputs[automaton.id] = outputs_of(automaton, functions_of(automaton))


def _take(state: State, outputs: Mapping[int, Mapping[str, object]], event: Event) -> None:
    """Let a state take the outputs of its automata; the event has those that have only started."""
    assert state.results is not None
    taken = {
        child.id: child.first_outputs() if child.id in event.data else outputs[child.id]
        for child in state.children
    }
    state.results(taken if len(taken) > 1 else taken[state.children[0].id])


def _encoded(values: dict[str, object]) -> msgspec.Raw:
    """Return variables as they are sent: as short texts if they are large."""
    encoded = msgspec.msgpack.encode(values)
    if len(encoded) > LARGEST_VALUES:
        encoded = msgspec.msgpack.encode({name: short_repr(value) for name, value in values.items()})
    return msgspec.Raw(encoded)


def _sendable(text: str) -> str:
    return str(text).encode("utf-8", "backslashreplace").decode()[:LARGEST_TEXT]


def _shown(value: object, depth: int) -> Any:  # noqa: ANN401 - what is plain stays as it is
    if value is None or type(value) in (bool, float):
        return value
    if type(value) is int and value.bit_length() < 64:
        return value
    if type(value) is str and len(value) <= LARGEST_TEXT:
        return _sendable(value)
    if depth and type(value) in (list, tuple) and len(value) <= _MOST_ELEMENTS:  # type: ignore[arg-type]
        return [_shown(each, depth - 1) for each in value]  # type: ignore[attr-defined]
    if depth and type(value) is dict and len(value) <= _MOST_ELEMENTS:
        return {_sendable(str(key)): _shown(each, depth - 1) for key, each in value.items()}
    return short_repr(value)
