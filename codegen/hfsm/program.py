"""A document as a program: the code of every piece, analyzed, ready to be written down."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from .code.text import Code
from .document import Automaton, State, Transition
from .known_interfaces import KnownInterface

__all__ = [
    "ArgumentProgram",
    "AutomatonProgram",
    "ExtensionProgram",
    "FunctionsProgram",
    "InputProgram",
    "LibraryProgram",
    "ParameterProgram",
    "Program",
    "ProxyProgram",
    "StateProgram",
    "TransitionProgram",
]


@dataclass(frozen=True, slots=True)
class ArgumentProgram:
    """What a state hands to the input `name` of the automaton `child`."""

    child: int
    name: str
    value: Code


@dataclass(frozen=True, slots=True)
class StateProgram:
    """A state: its pieces of code, the automata below it that exist, and what it hands to them."""

    state: State
    initial: bool
    entry: Code | None
    code: Code | None
    exit: Code | None
    children: tuple[int, ...]
    restart: bool
    arguments: tuple[ArgumentProgram, ...]

    def pieces(self) -> Iterator[Code]:
        """Yield the pieces of code."""
        yield from (piece for piece in (self.entry, self.code, self.exit) if piece is not None)
        yield from (argument.value for argument in self.arguments)


@dataclass(frozen=True, slots=True)
class TransitionProgram:
    """A transition, which fires after `seconds`, by an event, at the end of the children, or by its guard.

    `code` runs when it fires.
    """

    transition: Transition
    seconds: float | None
    event: str
    finished: bool
    guard: Code | None
    priority: int | None
    code: Code | None

    def pieces(self) -> Iterator[Code]:
        """Yield the pieces of code."""
        yield from (piece for piece in (self.guard, self.code) if piece is not None)


@dataclass(frozen=True, slots=True)
class InputProgram:
    """An input: the name of its type, and its default as Python, or None when it has to be handed over."""

    name: str
    type: str
    default: str | None


@dataclass(frozen=True, slots=True)
class AutomatonProgram:
    """An automaton: its period in s, and the code of its parts; states by their place in the document.

    `owner` is the state that owns it, None for the root. `source` names the file that it was imported from.
    """

    automaton: Automaton
    owner: State | None
    source: str
    period: float
    inputs: tuple[InputProgram, ...]
    variables: Code | None
    states: tuple[StateProgram, ...]
    transitions: tuple[TransitionProgram, ...]

    def pieces(self) -> Iterator[Code]:
        """Yield the pieces of code that run in cycles."""
        for state in self.states:
            yield from state.pieces()
        for transition in self.transitions:
            yield from transition.pieces()


@dataclass(frozen=True, slots=True)
class FunctionsProgram:
    """Functions, which become methods of the component.

    They stand in the file `path`, None for the document itself, which is called `file`; `automaton` is the id
    of theirs, 0 for those that belong to none.
    """

    file: str
    code: Code
    path: Path | None = None
    automaton: int = 0


@dataclass(frozen=True, slots=True)
class LibraryProgram:
    """An import; `code` is that of the document, None for one of ours; `file` and `path` as of functions."""

    statement: str
    code: Code | None = None
    file: str = ""
    path: Path | None = None


@dataclass(frozen=True, slots=True)
class ParameterProgram:
    """A parameter of the component, with its default as Python."""

    name: str
    default: str
    description: str


@dataclass(frozen=True, slots=True)
class ProxyProgram:
    """A proxy of the component: its attribute, the identity of its servant, and its interface."""

    attribute: str
    identity: str
    interface: KnownInterface


@dataclass(frozen=True, slots=True)
class ExtensionProgram:
    """The hand-written base of a component: its module, which lies beside the component, and its class."""

    module: str
    class_name: str


@dataclass(frozen=True, slots=True)
class Program:
    """A component, ready to be written down.

    `document_name` is the file that it is made of, and `sources` are those that this one imports. `automata`
    are the root and all below it, each before its children. `is_old` tells that the code expects what the
    origin's generators gave to it.
    """

    document_name: str
    sources: tuple[str, ...]
    name: str
    class_name: str
    description: str
    on_error: str
    on_refused: str
    extension: ExtensionProgram | None
    libraries: tuple[LibraryProgram, ...]
    parameters: tuple[ParameterProgram, ...]
    proxies: tuple[ProxyProgram, ...]
    functions: tuple[FunctionsProgram, ...]
    automata: tuple[AutomatonProgram, ...]
    is_old: bool = False
