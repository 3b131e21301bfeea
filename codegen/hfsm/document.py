"""The model of an automaton document: what the reader makes, the writer writes and the editor changes.

Everything is immutable, so that an editor's undo is the former document. Lines and columns count from 1 and
say where a thing stands in the file that was read, 0 when it was not read from a file; they do not count in
comparisons. What a person types (numbers of time, conditions, code) is kept as text: a document may be saved
unfinished, and `codegen.hfsm.checks` says what is missing before a component is generated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Final

__all__ = [
    "Automaton",
    "Comment",
    "Document",
    "Element",
    "Extra",
    "Interface",
    "Library",
    "State",
    "Text",
    "Transition",
]

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
    """An XML element that the model does not know; it is kept and written back."""

    tag: str
    attributes: tuple[tuple[str, str], ...] = ()
    text: str = ""
    children: tuple[Extra, ...] = ()


Extra = Element | Comment
"""What the model carries along without a meaning of its own."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Node:
    """What every element of the model has.

    `comments` stand before the element, `extras` are written at its end, `attributes` are those that the
    model does not know.
    """

    comments: tuple[Comment, ...] = ()
    extras: tuple[Extra, ...] = ()
    attributes: tuple[tuple[str, str], ...] = ()
    line: int = field(default=0, compare=False)
    column: int = field(default=0, compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class State(_Node):
    """A state: its place on the canvas in pixels, its code, and the automaton that it owns."""

    id: int
    name: str
    initial: bool = False
    x: float = 0.0
    y: float = 0.0
    child: int = NO_CHILD
    code: Text = Text()


@dataclass(frozen=True, slots=True, kw_only=True)
class Transition(_Node):
    """A transition between two states of one automaton.

    `type` is `time`, with milliseconds in `trigger`, or `condition`, with an expression in `trigger`. `code`
    runs when it fires.
    """

    id: int
    name: str = ""
    x: float = 0.0
    y: float = 0.0
    origin: int
    destination: int
    type: str = "condition"
    trigger: Text = Text()
    code: Text = Text()


@dataclass(frozen=True, slots=True, kw_only=True)
class Automaton(_Node):
    """An automaton; `father` is the id of the automaton above it, 0 for the root."""

    id: int
    father: int = NO_CHILD
    states: tuple[State, ...] = ()
    transitions: tuple[Transition, ...] = ()
    iteration_time: Text = Text(DEFAULT_PERIOD)
    variables: Text = Text()
    functions: Text = Text()

    def state(self, id: int) -> State | None:
        """Return the state with this id, or None."""
        return next((state for state in self.states if state.id == id), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Library(_Node):
    """What the code imports: `cv2`, `numpy as np`, or `from math import pi`."""

    name: Text


@dataclass(frozen=True, slots=True, kw_only=True)
class Interface(_Node):
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
class Document(_Node):
    """A component as a tree of automata, with the libraries and interfaces that its code uses.

    `description` and `on_error` are additions of ours; the origin's editor ignores them. What is unknown
    among the libraries and among the interfaces is in `libraries_extras` and `config_extras`.
    """

    root_tag: str = "VisualHFSM"
    description: Text = Text()
    on_error: Text = Text()
    automata: tuple[Automaton, ...] = ()
    libraries: tuple[Library, ...] = ()
    interfaces: tuple[Interface, ...] = ()
    libraries_extras: tuple[Extra, ...] = ()
    config_extras: tuple[Extra, ...] = ()

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
        return next((state for state in father.states if state.child == automaton.id), None)

    def states(self) -> Iterator[tuple[Automaton, State]]:
        """Yield every state with its automaton, in the order of the file."""
        for automaton in self.automata:
            for state in automaton.states:
                yield automaton, state
