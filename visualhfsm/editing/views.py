"""What the page draws: a document and its automata as plain values.

All fields are named in camelCase in JSON. `x` and `y` are pixels: of a state its middle, of a transition its
handle.
"""

from __future__ import annotations

import msgspec

from codegen.hfsm.document import Automaton, Document, Parameter, State, Transition

__all__ = [
    "AutomatonView",
    "DocumentView",
    "StateView",
    "TransitionView",
    "automaton_view",
    "document_view",
    "state_view",
    "transition_view",
]


class _View(msgspec.Struct, frozen=True, kw_only=True, rename="camel"):
    pass


class ArgumentView(_View, frozen=True, kw_only=True):
    """What a state hands to an input."""

    name: str
    child: int
    value: str


class StateView(_View, frozen=True, kw_only=True):
    """A state."""

    id: int
    name: str
    x: float
    y: float
    initial: bool
    final: bool
    children: tuple[int, ...]
    history: str
    entry: str
    code: str
    exit: str
    arguments: tuple[ArgumentView, ...]


class TransitionView(_View, frozen=True, kw_only=True):
    """A transition."""

    id: int
    name: str
    x: float
    y: float
    origin: int
    destination: int
    type: str
    trigger: str
    guard: str
    priority: str
    code: str


class ParameterView(_View, frozen=True, kw_only=True):
    """A parameter of the component, or an input of an automaton."""

    name: str
    type: str
    default: str
    description: str


class ImportView(_View, frozen=True, kw_only=True):
    """Where the content of an automaton comes from; automaton 0 is the root of the file."""

    file: str
    automaton: int


class AutomatonView(_View, frozen=True, kw_only=True):
    """An automaton; which state of `father` owns it stands in the `children` of that one."""

    id: int
    father: int
    period: str
    variables: str
    functions: str
    inputs: tuple[ParameterView, ...]
    imported: ImportView | None
    states: tuple[StateView, ...]
    transitions: tuple[TransitionView, ...]


class EventView(_View, frozen=True, kw_only=True):
    """A declared event."""

    name: str
    description: str


class PropertyView(_View, frozen=True, kw_only=True):
    """What is to be proved."""

    name: str
    kind: str
    within: str
    expression: str


class LibraryView(_View, frozen=True, kw_only=True):
    """What the code imports."""

    name: str
    kind: str


class InterfaceView(_View, frozen=True, kw_only=True):
    """A servant that the component uses; `proxy` is its identity as it was typed, `identity` as it counts."""

    name: str
    proxy: str
    identity: str
    type: str


class DocumentView(_View, frozen=True, kw_only=True):
    """All of a document but its automata."""

    description: str
    on_error: str
    on_refused: str
    language: str
    parameters: tuple[ParameterView, ...]
    events: tuple[EventView, ...]
    properties: tuple[PropertyView, ...]
    libraries: tuple[LibraryView, ...]
    interfaces: tuple[InterfaceView, ...]


def document_view(document: Document) -> DocumentView:
    """Return all of a document but its automata, for the page."""
    return DocumentView(
        description=document.description.text,
        on_error=document.on_error.text,
        on_refused=document.on_refused.text,
        language=document.language.text,
        parameters=tuple(_parameter(each) for each in document.parameters),
        events=tuple(
            EventView(name=each.name, description=each.description.text) for each in document.events
        ),
        properties=tuple(
            PropertyView(
                name=each.name, kind=each.kind, within=each.within.text, expression=each.expression.text
            )
            for each in document.properties
        ),
        libraries=tuple(LibraryView(name=each.name.text, kind=each.kind) for each in document.libraries),
        interfaces=tuple(
            InterfaceView(name=each.name, proxy=each.proxy or "", identity=each.identity, type=each.type)
            for each in document.interfaces
        ),
    )


def automaton_view(automaton: Automaton) -> AutomatonView:
    """Return an automaton for the page; it depends on nothing else, so that it can be kept."""
    imported = automaton.imported
    return AutomatonView(
        id=automaton.id,
        father=automaton.father,
        period=automaton.iteration_time.text,
        variables=automaton.variables.text,
        functions=automaton.functions.text,
        inputs=tuple(_parameter(each) for each in automaton.inputs),
        imported=None
        if imported is None
        else ImportView(file=imported.file.text, automaton=imported.automaton),
        states=tuple(state_view(each) for each in automaton.states),
        transitions=tuple(transition_view(each) for each in automaton.transitions),
    )


def state_view(state: State) -> StateView:
    """Return a state for the page."""
    return StateView(
        id=state.id,
        name=state.name,
        x=state.x,
        y=state.y,
        initial=state.initial,
        final=state.final,
        children=state.children,
        history=state.history.text,
        entry=state.entry.text,
        code=state.code.text,
        exit=state.exit.text,
        arguments=tuple(
            ArgumentView(name=each.name, child=each.child, value=each.value.text) for each in state.arguments
        ),
    )


def transition_view(transition: Transition) -> TransitionView:
    """Return a transition for the page."""
    return TransitionView(
        id=transition.id,
        name=transition.name,
        x=transition.x,
        y=transition.y,
        origin=transition.origin,
        destination=transition.destination,
        type=transition.type,
        trigger=transition.trigger.text,
        guard=transition.guard.text,
        priority=transition.priority.text,
        code=transition.code.text,
    )


def _parameter(parameter: Parameter) -> ParameterView:
    return ParameterView(
        name=parameter.name,
        type=parameter.type.text,
        default=parameter.default.text,
        description=parameter.description.text,
    )
