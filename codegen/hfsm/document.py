"""The model of an automaton document: what the reader makes, the writer writes and the editor changes.

Everything is immutable, so that an editor's undo is the former document. Lines and columns count from 1 and
say where a thing stands in the file that was read, 0 when it was not read from a file; they do not count in
comparisons. What a person types (numbers of time, conditions, code) is kept as text: a document may be saved
unfinished, and `codegen.hfsm.checks` says what is missing before a component is generated.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

NO_CHILD: Final = 0
"""The child id of a state that owns no automaton, and the father's id of the root."""

DEFAULT_PERIOD: Final = "100"
"""Milliseconds between the cycles of an automaton that does not say."""


@dataclass(frozen=True, slots=True)
class Text:
    """A text with the place of its first character in the file."""

    text: str = ""
    line: int = field(default=0, compare=False)
    column: int = field(default=0, compare=False)

    @property
    def is_blank(self) -> bool:
        """Whether there is nothing but white space."""
        return not self.text.strip()


@dataclass(frozen=True, slots=True)
class Comment:
    """An XML comment."""

    text: str


@dataclass(frozen=True, slots=True)
class Element:
    """An XML element that the model does not know; it is kept and written back.

    It holds a text or children, not both.
    """

    tag: str
    attributes: tuple[tuple[str, str], ...] = ()
    text: str = ""
    children: tuple[Extra, ...] = ()


Extra = Element | Comment
"""What the model carries along without a meaning of its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """What every element of the model has.

    `comments` stand before the element, `extras` are written at its end, `attributes` are those that the
    model does not know. `path` is the file that it was read from when that is not the document's own.
    """

    comments: tuple[Comment, ...] = ()
    extras: tuple[Extra, ...] = ()
    attributes: tuple[tuple[str, str], ...] = ()
    line: int = field(default=0, compare=False)
    column: int = field(default=0, compare=False)
    path: Path | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Argument(Node):
    """What a state hands to the input `name` of one of its automata: an expression.

    `child` is the automaton's id; 0 stands for the only one of the state's automata that has such an input.
    """

    name: str
    child: int = NO_CHILD
    value: Text = Text()


@dataclass(frozen=True, slots=True, kw_only=True)
class State(Node):
    """A state: its place on the canvas in pixels, its code, and the automata that it owns.

    `code` runs in every cycle, `entry` when the state is entered and `exit` when it is left. An automaton
    that enters a `final` state has finished. `history` says what becomes of the state's automata when it is
    entered again: `resume` (also when blank) where they were, or `restart`.
    """

    id: int
    name: str
    initial: bool = False
    final: bool = False
    x: float = 0.0
    y: float = 0.0
    children: tuple[int, ...] = ()
    history: Text = Text()
    entry: Text = Text()
    code: Text = Text()
    exit: Text = Text()
    arguments: tuple[Argument, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Transition(Node):
    """A transition between two states of one automaton.

    `type` is `time`, with milliseconds in `trigger`; `condition`, with Python in `trigger`; `event`, with
    the name of the event in `trigger`; or `finished`: all automata of the origin have finished. All but a
    `condition` may have a `guard` that must hold, too. `code` runs when it fires. Transitions out of a state
    are tried by `priority`, 1 first, and those without one after them in the order of the document.
    """

    id: int
    name: str = ""
    x: float = 0.0
    y: float = 0.0
    origin: int
    destination: int
    type: str = "condition"
    trigger: Text = Text()
    guard: Text = Text()
    priority: Text = Text()
    code: Text = Text()


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter(Node):
    """A typed value: a parameter of a component (`self.name`, `--name`), or an input of an automaton.

    `type` is `int`, `float`, `bool`, `str` or, for an input only, `object`; `default` is a Python literal.
    An input without a default must be handed over by the state that owns the automaton.
    """

    name: str
    type: Text = Text()
    default: Text = Text()
    description: Text = Text()


@dataclass(frozen=True, slots=True, kw_only=True)
class Import(Node):
    """Where the content of an automaton comes from: another document, by its path relative to this one.

    `automaton` is an id in that document, 0 for its root. All below it comes along.
    """

    file: Text
    automaton: int = NO_CHILD


@dataclass(frozen=True, slots=True, kw_only=True)
class Automaton(Node):
    """An automaton; `father` is the id of the automaton above it, 0 for the root.

    `inputs` are variables that the owning state sets each time it is entered. One with an `imported` has
    nothing else of its own.
    """

    id: int
    father: int = NO_CHILD
    states: tuple[State, ...] = ()
    transitions: tuple[Transition, ...] = ()
    inputs: tuple[Parameter, ...] = ()
    imported: Import | None = None
    iteration_time: Text = Text(DEFAULT_PERIOD)
    variables: Text = Text()
    functions: Text = Text()

    def state(self, id: int) -> State | None:
        """Return the state with this id, or None."""
        return next((state for state in self.states if state.id == id), None)

    def outgoing(self, state: int) -> tuple[Transition, ...]:
        """Return the transitions out of a state, by its id, in the order in which they are tried."""
        return self.all_outgoing().get(state, ())

    def all_outgoing(self) -> dict[int, tuple[Transition, ...]]:
        """Return what `outgoing` returns for each state that transitions leave, by its id."""
        found: dict[int, list[Transition]] = {}
        for transition in self.transitions:
            found.setdefault(transition.origin, []).append(transition)
        return {state: tuple(sorted(leaving, key=_rank)) for state, leaving in found.items()}


def _rank(transition: Transition) -> float:
    digits = transition.priority.text.strip()
    return int(digits) if digits.isascii() and digits.isdigit() and len(digits) < 10 else math.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class Library(Node):
    """What the code imports: `cv2`, `numpy as np`, or `from math import pi`.

    One of another `kind` than `module` is kept and not imported: a `driver` is what documents of 2013 call
    so, such as `laser`.
    """

    name: Text
    kind: str = "module"


@dataclass(frozen=True, slots=True, kw_only=True)
class Interface(Node):
    """A servant that the component uses.

    `name` is the attribute of `self` that holds the proxy, `proxy` the identity of the servant (the oldest
    documents have none and mean that of the attribute), `type` the IDL interface, plain or scoped. `ip` and
    `port` are those of the Ice servers of old: they are kept, and not used.
    """

    name: str
    proxy: str | None = None
    ip: str | None = None
    port: str | None = None
    type: str = ""

    @property
    def identity(self) -> str:
        """The identity of the servant."""
        return (self.proxy or "").strip() or self.name


@dataclass(frozen=True, slots=True, kw_only=True)
class Event(Node):
    """An event that may come from outside; those that only automata send need not be declared."""

    name: str
    description: Text = Text()


@dataclass(frozen=True, slots=True, kw_only=True)
class Functions(Node):
    """Functions of an imported file that stand in none of the automata that come from it."""

    text: Text


@dataclass(frozen=True, slots=True, kw_only=True)
class Property(Node):
    """What the model checker is to prove of the automata.

    `kind` is `always`, `eventually` or `never`, `within` a number of milliseconds or blank, `expression`
    what holds, as in `docs/explanation/model-checker.md`.
    """

    name: str = ""
    kind: str = "always"
    within: Text = Text()
    expression: Text = Text()


@dataclass(frozen=True, slots=True, kw_only=True)
class Document(Node):
    """A component as a tree of automata, with the libraries and interfaces that its code uses.

    `description`, `on_error`, `on_refused`, `dialect`, `language`, parameters, events and properties are
    additions of ours; the origin's editor ignores them. `dialect` is blank for the format of today, and names
    the editor of old (`VisualHFSM`, `VisualStates`) whose generator the code was written for. `language` is
    blank for Python, and names any other, in which the code is kept but does not run. `lists` has what is
    unknown in the elements around parameters, libraries, interfaces and so on, such as what ROS needs to know
    in `config`. `functions` come from imported files, and `format` names the
    one that the document was read from: neither is written.
    """

    root_tag: str = "VisualHFSM"
    description: Text = Text()
    on_error: Text = Text()
    on_refused: Text = Text()
    dialect: Text = Text()
    language: Text = Text()
    parameters: tuple[Parameter, ...] = ()
    events: tuple[Event, ...] = ()
    properties: tuple[Property, ...] = ()
    automata: tuple[Automaton, ...] = ()
    libraries: tuple[Library, ...] = ()
    interfaces: tuple[Interface, ...] = ()
    lists: tuple[Element, ...] = ()
    functions: tuple[Functions, ...] = ()
    format: str = field(default="native", compare=False)

    @property
    def is_old(self) -> bool:
        """Whether the code expects what the origin's generators gave to it."""
        return not self.dialect.is_blank

    @property
    def proxy_aliases(self) -> dict[str, str]:
        """The second names that the origin's generators gave to proxies, each with the interface's name."""
        return {f"{each.name}Prx": each.name for each in self.interfaces} if self.is_old else {}

    def automaton(self, id: int) -> Automaton | None:
        """Return the automaton with this id, or None."""
        return next((automaton for automaton in self.automata if automaton.id == id), None)

    @property
    def root(self) -> Automaton | None:
        """The automaton that no state owns, or None when there is none or more than one."""
        roots = [automaton for automaton in self.automata if automaton.father == NO_CHILD]
        return roots[0] if len(roots) == 1 else None

    def owner(self, automaton: Automaton) -> State | None:
        """Return the state that owns an automaton, or None for the root and for a lost one."""
        father = self.automaton(automaton.father)
        if father is None:
            return None
        return next((state for state in father.states if automaton.id in state.children), None)

    def states(self) -> Iterator[tuple[Automaton, State]]:
        """Yield every state with its automaton, in the order of the file."""
        for automaton in self.automata:
            for state in automaton.states:
                yield automaton, state
