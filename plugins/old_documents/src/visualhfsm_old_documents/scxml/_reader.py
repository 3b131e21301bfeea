"""Read SCXML into the model of a document.

A file that was exported here, and whose chart has not been changed since, gives the original document. Of any
other file, everything with an equivalent here is imported, and the rest is reported.

In SCXML a transition can lead from any state to any other, and into inner states. Here it connects two states
of one automaton, and an automaton that is entered starts in its initial state, or continues.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final, NamedTuple

from codegen.diagnostics import Diagnostics, Location, Note, did_you_mean
from codegen.hfsm.analysis import analyze
from codegen.hfsm.codes import Code
from codegen.hfsm.document import NO_CHILD, REFUSED, Automaton, Document, Event, State, Text, Transition
from codegen.hfsm.formats.reader import parse_document
from codegen.hfsm.formats.xml_tree import XmlElement, parse_xml
from codegen.hfsm.positions import on_circle
from codegen.messages import Message
from visualhfsm_old_documents.scxml._script import (
    ScriptReader,
    decode_event,
    descendants,
    first_words,
    inside_all,
    is_at_once,
    is_name,
    take_timers,
)
from visualhfsm_old_documents.scxml._writer import OWN_NAMESPACE, SCXML_NAMESPACE, write

_NATIVE: Final = f"{{{OWN_NAMESPACE}}}document"
_STATES: Final = ("state", "parallel", "final")
_STATE_PARTS: Final = (*_STATES, "onentry", "onexit", "transition", "initial", "history", "datamodel")
_PARTS: Final[Mapping[str, Sequence[str]]] = {
    "scxml": (*_STATES, "datamodel", "script", "initial"),
    "state": _STATE_PARTS,
    "parallel": _STATE_PARTS,
    "final": ("onentry", "onexit", "transition"),
    "datamodel": ("data",),
    **dict.fromkeys(("initial", "history"), ("transition",)),
    **dict.fromkeys(("raise", "log", "cancel", "param", "script", "elseif", "else"), ()),
}
_ATTRIBUTES: Final = re.compile(
    "array|autoforward|binding|cond|datamodel|delay|event|expr|id|idlocation|index|initial|item|label|location|"
    "name|namelist|sendid|src|target|type|version|xmlns|(?:delay|event|sendid|src|target|type)expr|.*:.*"
)
"""The attributes of SCXML, and those of other namespaces."""
_RETURN: Final = "200"
"""Time in ms in a state that waits before it returns: two cycles, in which the state above is left."""


def recognizes(root: XmlElement) -> bool:
    """Return whether the root of a file is that of SCXML."""
    return root.tag.rpartition(":")[2] == "scxml"


def read(
    root: XmlElement, path: Path, diagnostics: Diagnostics, _remarks: Diagnostics | None
) -> Document | None:
    """Return the document in SCXML, or None after reporting errors; `path` is for the messages."""
    reader = _Reader(root, path)
    chart = reader.document()
    element = root.first(_NATIVE)
    if element is not None:
        # With empty lines before it, its elements have the same lines as in the file.
        native = parse_document("\n" * (element.text_line - 1) + element.text, path, diagnostics)
        if native is None or (chart is not None and chart == _written_chart(native)):
            return native
        message = Message(
            "the chart was changed since it was exported: only the chart is read, without what "
            "SCXML cannot express, such as positions and code that runs in every cycle"
        )
        reader.report(Code.SCXML_NOT_IMPORTED, element, message)
    diagnostics.add_all(reader.diagnostics)
    return chart


def _written_chart(native: Document) -> Document | None:
    """Return the document that is read from the exported chart of a document."""
    written = parse_xml(write(native, Path(), Diagnostics()).encode(), Path(), Diagnostics())
    assert written is not None, "what was written can be read"
    return _Reader(written, Path()).document()


def _resolve_namespaces(element: XmlElement, around: Mapping[str, str]) -> None:
    """Remove the prefixes of SCXML elements; elements of other programs and ours become `{namespace}name`.

    An element without a namespace is SCXML's.
    """
    namespaces = {**around}
    for name, value in element.attributes.items():
        kind, _, prefix = name.partition(":")
        if kind == "xmlns":
            namespaces[prefix] = value
    prefix, _, local = element.tag.rpartition(":")
    namespace = namespaces.get(prefix) or (prefix or SCXML_NAMESPACE)
    element.tag = local if namespace == SCXML_NAMESPACE else f"{{{namespace}}}{local}"
    for child in element.elements():
        _resolve_namespaces(child, namespaces)


@dataclass(slots=True, eq=False)
class _State:
    """A state; `name` is its id in SCXML."""

    element: XmlElement
    automaton: _Automaton
    number: int
    name: str
    automata: list[_Automaton] = field(default_factory=list)
    history: XmlElement | None = None
    starts_with_history: bool = False

    @property
    def path(self) -> list[_State]:
        """The state and the states around it, the innermost first."""
        owner = self.automaton.owner
        return [self, *(owner.path if owner is not None else ())]

    def path_to(self, automaton: _Automaton) -> list[_State]:
        """Return the path up to the state of an automaton, or nothing if this state is not inside it."""
        levels = [each.automaton for each in self.path]
        return self.path[: levels.index(automaton) + 1] if automaton in levels else []


@dataclass(slots=True, eq=False)
class _Automaton:
    """Sibling states, and the element that contains them or is the only state."""

    element: XmlElement
    number: int
    owner: _State | None
    states: list[_State] = field(default_factory=list)
    transitions: list[Transition] = field(default_factory=list)
    variables: list[str] = field(default_factory=list)
    """The lines that set its variables."""
    first: _State | None = None


class _Goal(NamedTuple):
    """The target of a transition: a state, or its history."""

    state: _State
    history: XmlElement | None = None


class _Reader:
    """Builds a document from the chart in a file, and collects diagnostics."""

    def __init__(self, root: XmlElement, path: Path) -> None:
        self.diagnostics = Diagnostics()
        self._root = root
        self._path = path
        self._script = ScriptReader(root, self.report)
        self._others: set[str] = set()
        """Names of elements of other programs that have been reported."""
        self._automata: list[_Automaton] = []
        self._goals: dict[str, _Goal] = {}
        """The possible targets of transitions by id; a region means the state that contains it."""
        self._data: dict[str, tuple[XmlElement, int]] = {}
        """The elements of the variables, with the number of their automaton."""
        self._timers: dict[tuple[XmlElement, str], str] = {}
        self._events: dict[str, None] = {}
        """The events that transitions wait for."""

    def report(self, code: str, element: XmlElement, message: Message, notes: Sequence[Note] = ()) -> None:
        """Report an error, a warning or a note about an element, depending on its code."""
        place = Location(self._path, element.line, element.column, len(element.tag) + 1)
        add = {"E": self.diagnostics.error, "W": self.diagnostics.warning}.get(code[0], self.diagnostics.note)
        add(code, message, place, notes)

    def _report_lost(self, element: XmlElement, message: Message) -> None:
        """Report content that is not imported."""
        self.report(Code.SCXML_NOT_IMPORTED, element, message)

    def _report_difference(self, element: XmlElement, message: Message) -> None:
        """Report content that is imported, but has another meaning in some cases."""
        self.report(Code.SCXML_DIFFERENT_MEANING, element, message)

    def document(self) -> Document | None:
        """Return the document, or None after reporting errors."""
        root = self._root
        _resolve_namespaces(root, {})
        if root.tag != "scxml":
            message = Message(
                "`{tag}` is not the root of SCXML: it must be `scxml`, in {namespace}",
                tag=root.tag[:60],
                namespace=SCXML_NAMESPACE,
            )
            self.report(Code.INVALID_SCXML, root, message)
            return None
        for element in (root, *descendants(root)):
            self._check_element(element)
        self._read_automaton(root, None)
        self._timers = take_timers(root, self.report)
        for automaton in self._automata:
            self._find_initial(automaton)
        for automaton in self._automata:
            for state in list(automaton.states):
                self._check_heard(state, state.element.elements("onentry"))
                for element in state.element.elements("transition"):
                    self._read_transition(state, element)
        automata = tuple(map(self._automaton, self._automata))
        sent = {decode_event(each.attributes.get("event", "")) for each in descendants(root, "raise", "send")}
        document = Document(
            description=Text(root.attributes.get("name", "")),
            language=Text(self._script.language),
            events=tuple(Event(name=name) for name in self._events if name not in {*sent, REFUSED}),
            automata=automata,
        )
        self._check_scopes(document)
        return None if self.diagnostics.has_errors else document

    # The states as a tree.

    def _read_automaton(self, element: XmlElement, owner: _State | None, *, is_state: bool = False) -> None:
        """Read the states inside an element, or the element itself as the only state."""
        automaton = _Automaton(element, len(self._automata) + 1, owner)
        self._automata.append(automaton)
        if owner is not None:
            owner.automata.append(automaton)
        if not is_state:
            self._read_data(element, automaton)
        for number, each in enumerate([element] if is_state else element.elements(*_STATES), 1):
            state = _State(each, automaton, number, each.attributes.get("id", ""))
            automaton.states.append(state)
            self._add_goal(each, _Goal(state))
            for history in each.elements("history"):
                self._add_goal(history, _Goal(state, history))
                if state.history is not None:
                    message = Message("the state has a second history: only the first is imported")
                    self._report_difference(history, message)
                state.history = state.history or history
        for state in automaton.states:
            self._read_inside(state)

    def _read_inside(self, state: _State) -> None:
        """Read the automata inside a state."""
        element = state.element
        if element.tag == "state" and any(True for _ in element.elements(*_STATES)):
            self._read_automaton(element, state)
        else:
            self._read_data(element, state.automaton)
        for region in element.elements(*_STATES) if element.tag == "parallel" else ():
            tags = {child.tag for child in region.elements() if "{" not in child.tag}
            if region.tag == "state" and tags & {*_STATES} and tags <= {*_STATES, "initial", "datamodel"}:
                self._add_goal(region, _Goal(state))
                self._read_automaton(region, state)
            else:
                self._read_automaton(region, state, is_state=True)
        is_shallow = state.history is not None and state.history.attributes.get("type") != "deep"
        if is_shallow and any(each.automata for inner in state.automata for each in inner.states):
            message = Message("the history is shallow: here inner automata also resume")
            self._report_difference(state.history or element, message)

    def _check_parts(self, element: XmlElement, known: Sequence[str]) -> None:
        """Report the content of an element that is not imported."""
        for child in element.elements():
            if child.tag.startswith("{"):
                name = child.tag.partition("}")[2]
                if child.tag != _NATIVE and name not in self._others:
                    message = Message(
                        "`{name}` belongs to another program and is not imported", name=name[:60]
                    )
                    self.report(Code.SCXML_FOREIGN, child, message)
                self._others.add(name)
            elif child.tag not in known:
                message = Message("`{tag}` is not imported: there is no equivalent here", tag=child.tag[:60])
                self._report_lost(child, message)

    def _check_element(self, element: XmlElement) -> None:
        """Report attributes and content that are not imported, wherever the element is."""
        self._check_parts(element, _PARTS.get(element.tag, [each.tag for each in element.elements()]))
        for transition in element.elements("transition") if element.tag in ("initial", "history") else ():
            self._check_parts(transition, ())
        for name in element.attributes if "{" not in element.tag else ():
            if _ATTRIBUTES.fullmatch(name) is None:
                message = Message("the attribute `{name}` is not imported: SCXML has none", name=name[:60])
                self._report_lost(element, message)
        if element.attributes.get("binding") == "late":
            message = Message("data of states is set when they are entered: here when the component starts")
            self._report_difference(element, message)

    def _add_goal(self, element: XmlElement, goal: _Goal) -> None:
        name = element.attributes.get("id", "")
        if name and self._goals.setdefault(name, goal) is not goal:
            message = Message("a second element has the id `{name}`", name=name[:60])
            self.report(Code.INVALID_SCXML, element, message)

    def _read_data(self, element: XmlElement, automaton: _Automaton) -> None:
        """Read the data of an element, and the script of the root, as variables of an automaton."""
        for data in inside_all(element, "datamodel", "data"):
            name = data.attributes.get("id", "")
            if not is_name(name) or "src" in data.attributes:
                message = Message("the data `{name}` cannot be a Python variable", name=name[:60])
                if "src" in data.attributes:
                    message = Message("the data `{name}` is in another file", name=name[:60])
                self._report_lost(data, message)
            else:
                automaton.variables.append(f"{name} = {self._script.value(data) or 'None'}")
                self._data[name] = data, automaton.number
        for script in element.elements("script") if element is self._root else ():
            automaton.variables += self._script.lines([script])

    def _find_initial(self, automaton: _Automaton) -> None:
        """Find the initial state: by the automaton itself, by one around it, or else the first state."""
        element, wanted = automaton.element, automaton.first
        automaton.first = wanted or next(iter(automaton.states), None)
        if automaton.first is None or automaton.first.element is element:
            return
        names = element.attributes.get("initial", "").split()
        for transition in inside_all(element, "initial", "transition"):
            names += transition.attributes.get("target", "").split()
        goals = self._find_goals(names, element)
        if automaton.owner is not None:
            automaton.owner.starts_with_history = any(each.history is not None for each in goals)
        for start in (each for goal in goals for each in self._starts(goal)):
            for each in start.path_to(automaton):
                each.automaton.first = each
            if not start.path_to(automaton):
                message = Message(
                    "`{start}` is not inside the element that starts there", start=start.name[:60]
                )
                self.report(Code.INVALID_SCXML, element, message)
        if wanted is not None:
            self._check_initial(wanted, element)

    def _check_initial(self, state: _State, element: XmlElement) -> None:
        first = state.automaton.first
        if first is not None and first is not state:
            message = Message(
                "it enters `{state}`: here the state around it starts in `{first}`",
                state=state.name[:60],
                first=first.name[:60],
            )
            self._report_difference(element, message)

    # Transitions.

    def _read_transition(self, state: _State, element: XmlElement) -> None:
        names = element.attributes.get("target", "").split()
        if state.element.tag == "final" or not names:
            message = Message("a transition without a target, or out of a final state, is not imported")
            self._report_lost(element, message)
            return
        goals = self._find_goals(names, element)
        transitions = list(self._transitions(state, element))
        if not goals or not transitions:
            return
        (origin, destination), *others = {_side_by_side(state, goal.state) for goal in goals}
        if others:
            message = Message("a transition to several targets that are not in one state is not imported")
            self._report_lost(element, message)
            return
        if element.attributes.get("type") == "internal" and goals[0].state is not origin is destination:
            message = Message(
                "it stays in `{state}`: here it leaves and enters it again", state=state.name[:60]
            )
            self._report_difference(element, message)
        self._check_entered(goals, destination, element)
        self._check_heard(destination, [element, *descendants(origin.element, "onexit")])
        code = self._script.code([element])
        if origin is not state:
            destination, event = self._leave(state, origin, destination, names[0], element)
            code = replace(code, text="\n".join(filter(None, (code.text, f"self.send({event!r})"))))
        for transition in transitions:
            _join(state, destination, replace(transition, code=code))

    def _transitions(self, state: _State, element: XmlElement) -> Iterator[Transition]:
        """Yield a transition for each event, not yet connected to states."""
        condition = self._script.condition(element)
        events = element.attributes.get("event", "").split()
        if not events:
            yield _transition("condition", condition or "True", "", element)
        for event in events:
            name = first_words(event)
            if (timer := self._timers.get((state.element, name))) is not None:
                yield _transition("time", timer, condition, element)
            elif event == f"done.state.{state.name}":
                yield _transition("finished", "", condition, element)
            elif not name or event == "error" or event.startswith(("error.", "done.")):
                message = Message(
                    "`{event}` is not imported: here a transition waits for one event that is sent, or for "
                    "its state to finish",
                    event=event[:60],
                )
                self._report_lost(element, message)
            else:
                if name != event:
                    message = Message(
                        "`{event}` is read as `{name}` only: here an event has one name",
                        event=event[:60],
                        name=name[:60],
                    )
                    self._report_difference(element, message)
                self._events[decode_event(name)] = None
                yield _transition("event", decode_event(name), condition, element)

    def _leave(
        self, state: _State, origin: _State, destination: _State, name: str, element: XmlElement
    ) -> tuple[_State, str]:
        """Connect `origin`, a state around `state`, to the destination with an event.

        Returns the state in which the inner automaton waits until then, and the event. If the outer state
        resumes later, the automaton returns to the state that it left.
        """
        inner, around = state.automaton, state.path_to(origin.automaton)[1:]
        event = f"leave {around[0].name} for {name}"
        leaving = (each for each in origin.automaton.transitions if each.origin == origin.number)
        if all(each.trigger.text != event for each in leaving):
            # First, since in SCXML inner transitions have priority.
            _join(origin, destination, _transition("event", event, "", element), place=0)
            message = Message(
                "it leaves `{origin}` from inside: here with the state `{event}` and an event, which "
                "takes a cycle: earlier events still reach the state that is left",
                origin=origin.name[:60],
                event=event[:60],
            )
            self.report(Code.SCXML_OTHER_FORM, element, message)
        resumes = any(each.history is not None for each in around)
        name = f"{event} from {state.name}" if resumes else event
        waiting = next((each for each in inner.states if each.name == name), None)
        if waiting is None:
            waiting = _State(element, inner, len(inner.states) + 1, name)
            inner.states.append(waiting)
            if resumes:
                _join(waiting, state, _transition("time", _RETURN, "", element))
        return waiting, event

    def _find_goals(self, names: Sequence[str], element: XmlElement) -> list[_Goal]:
        """Return the targets with some ids, after reporting unknown ids."""
        for name in names:
            if name not in self._goals:
                message = Message("no state has the id `{name}`", name=name[:60])
                self.report(Code.INVALID_SCXML, element, message, did_you_mean(name, self._goals))
        return [self._goals[name] for name in names if name in self._goals]

    def _starts(self, goal: _Goal) -> list[_State]:
        """Return the states that a target enters; for a history the default ones."""
        state, history = goal
        if history is None:
            return [state]
        targets = (each.attributes.get("target", "").split() for each in history.elements("transition"))
        defaults = self._find_goals([name for names in targets for name in names], history)
        return [each.state for each in defaults if state in each.state.path] or [state]

    def _check_entered(self, goals: Sequence[_Goal], destination: _State, element: XmlElement) -> None:
        """Report automata that do not start as a transition requires."""
        for goal in goals:
            path = (each for start in self._starts(goal) for each in start.path_to(destination.automaton))
            for each in path:
                resumes = goal.history is not None or (each is goal.state and each.starts_with_history)
                if each.history is not None and not resumes:
                    message = Message(
                        "it restarts `{name}`: here the automata inside resume", name=each.name[:60]
                    )
                    self._report_difference(element, message)
                if each is not destination:
                    self._check_initial(each, element)

    def _check_heard(self, state: _State, senders: Iterable[XmlElement]) -> None:
        """Report what is sent before the automata inside a state, which wait for it, start."""
        inside = [
            each for child in state.element.elements(*_STATES) for each in descendants(child, "transition")
        ]
        words = {first_words(name) for each in inside for name in each.attributes.get("event", "").split()}
        for element in (each for sender in senders for each in descendants(sender, "raise", "send")):
            event = f"{element.attributes.get('event', '')}."
            if is_at_once(element) and any(event.startswith(f"{each}.") for each in words):
                message = Message(
                    "`{event}` is sent before the automata in `{state}` start: they do not get it",
                    event=event[:-1][:60],
                    state=state.name[:60],
                )
                self._report_difference(element, message)

    # The document.

    def _automaton(self, automaton: _Automaton) -> Automaton:
        transitions = sorted(automaton.transitions, key=lambda each: each.origin)
        return Automaton(
            id=automaton.number,
            father=automaton.owner.automaton.number if automaton.owner is not None else NO_CHILD,
            states=tuple(self._state(each) for each in automaton.states),
            transitions=tuple(replace(each, id=number) for number, each in enumerate(transitions, 1)),
            variables=Text("\n".join(automaton.variables), automaton.element.line, automaton.element.column),
        )

    def _state(self, state: _State) -> State:
        element = state.element
        restarts = state.history is None and any(each.states for each in state.automata)
        x, y = on_circle(state.number, len(state.automaton.states))
        return State(
            id=state.number,
            name=state.name,
            initial=state is state.automaton.first,
            final=element.tag == "final",
            x=x,
            y=y,
            children=tuple(each.number for each in state.automata),
            history=Text("restart" if restarts else ""),
            entry=self._script.code(element.elements("onentry")),
            exit=self._script.code(element.elements("onexit")),
        )

    def _check_scopes(self, document: Document) -> None:
        """Report data that other automata use: here a variable belongs to one automaton."""
        for code in analyze(document, self._path).automata:
            used = frozenset[str]().union(*(piece.used for piece in code.sharing()))
            for name in used & self._data.keys():
                data, owner = self._data[name]
                if owner != code.automaton.id:
                    message = Message(
                        "`{name}` is here a variable of automaton {owner}, but others use it: replace it by "
                        "`self.{name}`",
                        name=name[:60],
                        owner=owner,
                    )
                    self._report_difference(data, message)


def _transition(type: str, trigger: str, guard: str, element: XmlElement) -> Transition:
    line, column = element.line, element.column
    texts = Text(trigger, line, column), Text(guard, line, column)
    return Transition(id=0, origin=0, destination=0, type=type, trigger=texts[0], guard=texts[1])


def _join(origin: _State, destination: _State, transition: Transition, place: int | None = None) -> None:
    """Add a transition between two states to their automaton, at the end or at an index."""
    joined = replace(transition, origin=origin.number, destination=destination.number)
    transitions = origin.automaton.transitions
    transitions.insert(len(transitions) if place is None else place, joined)


def _side_by_side(source: _State, goal: _State) -> tuple[_State, _State]:
    """Return the innermost two states of one automaton that are, or contain, two states."""
    around = {state.automaton: state for state in source.path}
    return next((around[state.automaton], state) for state in goal.path if state.automaton in around)
