"""The judge's half of a submission: the automata of its document, whose code runs elsewhere.

Nothing of the document's Python is executed, or compiled, here.
"""

from __future__ import annotations

import ast
import importlib
import math
import types
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from types import CellType
from typing import Any, Final, NoReturn

from codegen.diagnostics import Diagnostics
from codegen.hfsm import document as model
from codegen.hfsm import read_document, resolve
from codegen.hfsm.code.names import component_name
from codegen.hfsm.known_interfaces import find_interfaces
from codegen.hfsm.model_checker.model import nanoseconds
from codegen.logic import PROOFS
from hfsm_runtime import Automaton, Component, Event, Output, Parameter, Proxy, State, Transition
from visualhfsm.simulation import DocumentInvalid, importable
from zenoh_ice import ObjectPrx

LARGEST_DOCUMENT: Final = 2 << 20
"""Bytes of the largest submission."""
_DEEPEST_NESTING: Final = 50
"""Levels of automata below one another."""
_SHORTEST_DELAY: Final = 1e-9  # s, for a time of 0: it fires in the next cycle
_HIGHEST_RATE: Final = 5000.0
"""Cycles in a second of all automata together: each costs the judge time."""
_LONGEST_NAME: Final = 200
_LONGEST_CONDITION: Final = 300  # characters that are shown

Ask = Callable[[str, int, int, str, Event | None], bool]
"""Runs a piece of code: its part, the ids of the automaton and of the state or transition, where it is in
words, and the event."""
Shown = dict[int, dict[str, CellType]]
"""The variables that are shown, by automaton and name."""


def read_submission(path: Path) -> model.Document:
    """Return the document of a submission, which is alone with what it may import. Raises DocumentInvalid."""
    diagnostics = Diagnostics()
    try:
        document = read_document(path, diagnostics)
        if document is not None:
            document = resolve(document, path, diagnostics)
    except (ValueError, RecursionError, MemoryError) as error:
        raise DocumentInvalid(f"{path.name} cannot be read: {error}") from error
    if document is None or diagnostics.has_errors:
        said = diagnostics.render(outcome="").replace(f"{path.parent}/", "")
        raise DocumentInvalid(f"{path.name} cannot be read:\n{said}")
    if document.ros:
        raise DocumentInvalid(f"{path.name} uses ROS, which no trial of a submission has")
    return document


def make_component(
    document: model.Document,
    path: Path,
    include: Sequence[Path],
    *,
    begin: Callable[[Component], None],
    ask: Ask,
    shown: Shown,
    proofs: tuple[Any, ...] = (),
) -> type[Component]:
    """Return a component with the automata of a document whose code runs elsewhere.

    `begin` is called before its automata are made. What is in `shown` appears as their variables; `proofs`
    is what its own component keeps. Raises DocumentInvalid for one that the compiler would not have taken.
    """
    try:
        root = _Automata(document, path, ask, shown).root()
        body: dict[str, object] = {**_proxies(document, include), **_parameters(document)}
    except (ValueError, LookupError, TypeError, SyntaxError, MemoryError, RecursionError) as error:
        raise DocumentInvalid(f"{path.name} is no document that could run: {error}") from error

    def automaton(self: Component) -> Automaton:
        begin(self)
        return root

    body |= {"automaton": automaton, PROOFS: proofs, "__module__": f"{__name__}.{path.stem}"}
    options: dict[str, Any] = {
        "document": path.name,
        "on_error": document.on_error.text.strip() or "stop",
        "on_refused": document.on_refused.text.strip() or "pause",
        "events": [event.name.strip() for event in document.events],
    }
    return types.new_class("Submission", (Component,), options, lambda namespace: namespace.update(body))


class _Automata:
    """The automata of a document, as `codegen` would write them."""

    def __init__(self, document: model.Document, path: Path, ask: Ask, shown: Shown) -> None:
        self._shown: Final = shown
        self._document: Final = document
        self._path: Final = path
        self._ask: Final = ask
        self._rate = 0.0
        """Cycles in a second of all automata so far."""

    def root(self) -> Automaton:
        root = self._document.root
        if root is None:
            _refuse("it has no root")
        return self._automaton(root, component_name(self._path.stem), 0)

    def _automaton(self, automaton: model.Automaton, name: str, depth: int) -> Automaton:
        if depth > _DEEPEST_NESTING:
            _refuse(f"it has more than {_DEEPEST_NESTING} levels of automata")
        period = nanoseconds(automaton.iteration_time)
        self._rate += 1e9 / (period or math.inf)
        if self._rate > _HIGHEST_RATE:
            _refuse(f"its automata have more than {_HIGHEST_RATE:g} cycles in a second")
        initial = next((state for state in automaton.states if state.initial), automaton.states[0])
        return Automaton(
            name,
            id=automaton.id,
            source="" if automaton.path is None else automaton.path.name,
            period=(period or 0) / 1e9,
            states=tuple(self._state(automaton, each, each is initial, depth) for each in automaton.states),
            transitions=tuple(self._transition(automaton, each) for each in automaton.transitions),
            **self._outputs(automaton),
        )

    def _outputs(self, automaton: model.Automaton) -> dict[str, Any]:
        """Return the arguments of an automaton for its outputs, whose values stay at the other end.

        Here an output is whether that end has published it since the automaton started.
        """
        if not automaton.outputs:
            return {}
        names = [each.name for each in automaton.outputs]
        where = f"the outputs of automaton {automaton.id}"
        reset = self._code("set_outputs", automaton, 0, where)
        publish = self._code("get_outputs", automaton, 0, where)

        return {
            "outputs": tuple(Output(name=name, default=False) for name in names),
            "set_outputs": lambda _: reset(),
            "get_outputs": partial(_published, publish, names),
        }

    def _state(self, automaton: model.Automaton, state: model.State, initial: bool, depth: int) -> State:
        if len(state.name) > _LONGEST_NAME:
            _refuse(f"the state {state.name[:20]!r}... has a name of more than {_LONGEST_NAME} characters")

        def code(part: str, text: model.Text) -> Callable[[], object] | None:
            return None if text.is_blank else self._code(part, automaton, state.id, f"state {state.name}")

        def arguments() -> dict[str, object]:
            run()
            return {}  # the other end has handed them over

        run = self._code("arguments", automaton, state.id, f"state {state.name}")
        take = self._code("results", automaton, state.id, f"state {state.name}", takes_event=True)
        owned = (self._document.automaton(child) for child in state.children)
        children = tuple(self._automaton(child, state.name, depth + 1) for child in owned if child)
        return State(
            state.name,
            id=state.id,
            initial=initial,
            final=state.final,
            entry=code("entry", state.entry),
            code=code("code", state.code),
            exit=code("exit", state.exit),
            children=children,
            restart=state.history.text.strip() == "restart",
            arguments=arguments if state.arguments else None,
            results=partial(_taken, take, children) if state.results else None,
        )

    def _transition(self, automaton: model.Automaton, transition: model.Transition) -> Transition:
        trigger, kind = transition.trigger, transition.type
        priority = transition.priority.text.strip()
        name = transition.name[:_LONGEST_NAME]
        where = f"transition {name or transition.id}"
        takes_event = kind == "event"

        def code(part: str, text: model.Text) -> Callable[..., object] | None:
            if text.is_blank:
                return None
            return self._code(part, automaton, transition.id, where, takes_event=takes_event)

        guard = code("guard", trigger if kind == "condition" else transition.guard)
        if kind == "condition" and guard is None:
            guard = _never
        seconds = None
        if kind == "time":
            seconds = (nanoseconds(trigger) or 0) / 1e9 or _SHORTEST_DELAY
        shown = (trigger if kind == "condition" else transition.guard).text
        return Transition(
            name,
            transition.origin,
            transition.destination,
            id=transition.id,
            seconds=seconds,
            event=trigger.text.strip() if takes_event else "",
            finished=kind == "finished",
            guard=guard,
            condition=" ".join(shown.split())[:_LONGEST_CONDITION],
            priority=int(priority) if priority else None,
            code=code("fired", transition.code),
        )

    def _code(
        self, part: str, automaton: model.Automaton, id: int, where: str, *, takes_event: bool = False
    ) -> Callable[..., bool]:
        run = partial(self._ask, part, automaton.id, id, where)
        shown = self._shown.setdefault(automaton.id, {})
        return _Piece(run if takes_event else partial(run, None), shown)


class _Piece:
    """A piece of code that runs elsewhere, through which the variables of its automaton are found."""

    co_firstlineno = 0
    co_filename = ""

    def __init__(self, run: Callable[..., bool], shown: Mapping[str, CellType]) -> None:
        self._run: Final = run
        self._shown: Final = shown

    def __call__(self, *event: Event) -> bool:
        return self._run(*event)

    # What a function has that encloses them.

    @property
    def __code__(self) -> _Piece:
        return self

    @property
    def co_freevars(self) -> tuple[str, ...]:
        return tuple(self._shown)

    @property
    def __closure__(self) -> tuple[CellType, ...]:
        return tuple(self._shown.values())


# These are no closures: what a closure encloses would be shown as variables.


def _published(publish: Callable[[], object], names: Sequence[str]) -> dict[str, object]:
    """Let the other end publish outputs, and note that it has."""
    publish()
    return dict.fromkeys(names, True)


def _taken(
    take: Callable[[Event], object], children: Sequence[Automaton], outputs: Mapping[Any, Any]
) -> None:
    """Let the other end take outputs, whose values it has."""
    by_child = outputs if len(children) > 1 else {children[0].id: outputs}
    take(Event("started", [child for child, values in by_child.items() if not all(values.values())]))


def _never() -> bool:
    return False


def _proxies(document: model.Document, include: Sequence[Path]) -> dict[str, Proxy[Any]]:
    known = find_interfaces(None, include)
    proxies: dict[str, Proxy[Any]] = {}
    with importable(*include):
        for each in document.interfaces:
            found = known.find(each.type)[0]
            kind = getattr(importlib.import_module(found.package), found.proxy)
            if not issubclass(kind, ObjectPrx):
                _refuse(f"{each.type} is no interface")
            proxies[each.name] = Proxy(each.identity.strip(), kind)
    return proxies


def _parameters(document: model.Document) -> dict[str, Parameter[Any]]:
    parameters: dict[str, Parameter[Any]] = {}
    for each in document.parameters:
        value = ast.literal_eval(each.default.text.strip())
        if each.type.text.strip() == "float" and type(value) is int:
            value = float(value)
        if not isinstance(value, bool | int | float | str):
            _refuse(f"the parameter {each.name} has no plain default")
        parameters[each.name] = Parameter(value, " ".join(each.description.text.split()))
    return parameters


def _refuse(why: str) -> NoReturn:
    raise ValueError(why)
