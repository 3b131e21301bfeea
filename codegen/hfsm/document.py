"""The model of an automaton document: what the reader makes, the writer writes and the editor changes.

Everything is immutable, so that undo in an editor restores the previous document. Lines and columns are the
position in the file, counted from 1, or 0 if the element was not read from a file. Comparisons ignore them.
What people type (times, conditions, code) is kept as text, since a document may be saved unfinished;
`codegen.hfsm._checks` reports what is missing before a component is generated.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final, NamedTuple

import msgspec

REFUSED: Final = "refused"
"""The event that the runtime sends to a state whose code asks for what a servant refuses."""

NATIVE: Final = "native"
"""Our own format of documents."""

NO_CHILD: Final = 0
"""The child id of a state without an automaton, and the father's id of the root."""

DEFAULT_PERIOD: Final = "100"
"""The default period of an automaton in ms."""


ANNOTATION_KINDS: Final = ("note", "frame")
"""The kinds of annotations; one of another kind is drawn as the first."""

ANNOTATION_COLORS: Final = ("yellow", "blue", "green", "pink", "gray")
"""The colors of annotations; one of another color is drawn in the first."""

SMALLEST_ANNOTATION: Final = 24.0
"""The least width and height of an annotation in pixels: a finger can touch it."""


@dataclass(frozen=True, slots=True)
class Text:
    """A text with the position of its first character in the file."""

    text: str = ""
    line: int = field(default=0, compare=False)
    column: int = field(default=0, compare=False)

    @property
    def is_blank(self) -> bool:
        """Whether it has only white space."""
        return not self.text.strip()


class Comment(msgspec.Struct, frozen=True, tag=True):
    """An XML comment."""

    text: str


class Element(msgspec.Struct, frozen=True, tag=True):
    """An XML element that the model does not know; it is kept and written back.

    It has a text or children, not both.
    """

    tag: str
    attributes: tuple[tuple[str, str], ...] = ()
    text: str = ""
    children: tuple[Extra, ...] = ()


Extra = Element | Comment
"""Content that is kept and written back, but has no meaning here."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """The base of all elements of the model.

    `comments` are written before the element, `extras` at its end. `attributes` are those that the model does
    not know. `path` is the file of an imported element, and None in the document itself.
    """

    comments: tuple[Comment, ...] = ()
    extras: tuple[Extra, ...] = ()
    attributes: tuple[tuple[str, str], ...] = ()
    line: int = field(default=0, compare=False)
    column: int = field(default=0, compare=False)
    path: Path | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Argument(Node):
    """The expression that a state passes to the input `name` of one of its automata.

    `child` is the automaton's id; 0 means the only automaton of the state that has such an input.
    """

    name: str
    child: int = NO_CHILD
    value: Text = Text()


@dataclass(frozen=True, slots=True, kw_only=True)
class Result(Node):
    """The `variable` of a state's automaton that takes the output `name` of one of the automata below.

    It may also be an output of the state's automaton, which hands it on. `child` is as in an argument.
    """

    name: str
    child: int = NO_CHILD
    variable: Text = Text()


@dataclass(frozen=True, slots=True, kw_only=True)
class State(Node):
    """A state: its position on the canvas in pixels, its code, and the automata that it owns.

    `code` runs in every cycle, `entry` when the state is entered and `exit` when it is left. An automaton
    that enters a `final` state has finished. When the state is entered again, its automata continue with the
    `history` `resume`, which is also the meaning of a blank one, and start again with `restart`.
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
    results: tuple[Result, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Transition(Node):
    """A transition between two states of one automaton.

    `type` is `time`, with milliseconds in `trigger`; `condition`, with Python in `trigger`; `event`, with
    the name of the event in `trigger`; or `finished`: all automata of the origin have finished. All types
    except `condition` may have a `guard` that must also hold. `code` runs when it fires. The transitions out
    of a state are tried by `priority`, 1 first, then those without one in the order of the document.
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

    @property
    def rank(self) -> int | None:
        """The priority as a number from 1, None without one that is valid."""
        digits = self.priority.text.strip()
        is_number = digits.isascii() and digits.isdigit() and len(digits) < 10
        return int(digits) or None if is_number else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Annotation(Node):
    """A text that people wrote on the canvas for each other; nothing that runs depends on it.

    `kind` is `note`, a text of any number of lines, or `frame`, a titled rectangle around states, which move
    with it. `x` and `y` are its upper left corner in pixels. A blank `color` is yellow for a note and gray
    for a frame.
    """

    id: int
    kind: str = "note"
    x: float = 0.0
    y: float = 0.0
    width: float = 0.0
    height: float = 0.0
    color: Text = Text()
    text: Text = Text()


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter(Node):
    """A typed value: a parameter of a component (`self.name`, `--name`), an input or output of an automaton.

    `type` is `int`, `float`, `bool`, `str` or, not for a parameter, `object`; `default` is a Python literal.
    The state that owns the automaton must pass a value to an input without a default. An output begins with
    its default.
    """

    name: str
    type: Text = Text()
    default: Text = Text()
    description: Text = Text()


@dataclass(frozen=True, slots=True, kw_only=True)
class Import(Node):
    """The source of an imported automaton: another document, by its path relative to this one.

    `automaton` is an id in that document, 0 for its root. It is imported with all automata below it.
    """

    file: Text
    automaton: int = NO_CHILD


@dataclass(frozen=True, slots=True, kw_only=True)
class Automaton(Node):
    """An automaton; `father` is the id of the automaton above it, 0 for the root.

    `inputs` are variables that the owning state sets each time it is entered, `outputs` are variables that
    it may take. An automaton with `imported` has no content in this document.
    """

    id: int
    father: int = NO_CHILD
    states: tuple[State, ...] = ()
    transitions: tuple[Transition, ...] = ()
    annotations: tuple[Annotation, ...] = ()
    inputs: tuple[Parameter, ...] = ()
    outputs: tuple[Parameter, ...] = ()
    imported: Import | None = None
    iteration_time: Text = Text(DEFAULT_PERIOD)
    variables: Text = Text()
    functions: Text = Text()

    @property
    def declared(self) -> frozenset[str]:
        """The names of its inputs and outputs, which are variables of its code."""
        return frozenset(item.name for item in (*self.inputs, *self.outputs))

    def state(self, id: int) -> State | None:
        """Return the state with this id, or None."""
        return next((state for state in self.states if state.id == id), None)

    def outgoing(self, state: int) -> tuple[Transition, ...]:
        """Return the transitions out of a state, by its id, in the order in which they are tried."""
        return self.all_outgoing().get(state, ())

    def all_outgoing(self) -> dict[int, tuple[Transition, ...]]:
        """Return the result of `outgoing` for each state that has outgoing transitions, by its id."""
        found: dict[int, list[Transition]] = {}
        for transition in self.transitions:
            found.setdefault(transition.origin, []).append(transition)
        return {
            state: tuple(sorted(leaving, key=lambda each: each.rank or math.inf))
            for state, leaving in found.items()
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Library(Node):
    """A library that the code imports: `cv2`, `numpy as np`, or `from math import pi`.

    Libraries of another `kind` than `module` are kept, but not imported, such as the `driver` `laser` in
    documents of 2013.
    """

    name: Text
    kind: str = "module"


@dataclass(frozen=True, slots=True, kw_only=True)
class Interface(Node):
    """A servant that the component uses.

    `name` is the attribute of `self` with the proxy, `proxy` the identity of the servant (the oldest
    documents have none and mean `name`), `type` the IDL interface, plain or scoped. `ip` and `port` are
    addresses of former Ice servers: they are kept, but not used.
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
class RosInterface(Node):
    """A topic, service or action of ROS 2 that the component uses.

    `name` is the attribute of `self`, `kind` is `publish`, `subscribe`, `service` or `action`, `target` the
    ROS name (`/cmd_vel`) and `type` the ROS type (`geometry_msgs/msg/Twist`). `qos` has the words that
    plugins/ros2/docs/ros2-behaviors.md explains. With `stop` `true` a default message is published when the
    component stops; blank means `true` for velocities.
    """

    name: str
    kind: str = "subscribe"
    target: str = ""
    type: str = ""
    qos: Text = Text()
    stop: Text = Text()

    @property
    def identity(self) -> str:
        """The ROS name, which other interfaces may share."""
        return self.target.strip()


TF: Final = "tf"
"""The module of ROS 1 of which old documents with topics get the parts that they use."""


class RosAlias(NamedTuple):
    """An operation of a ROS interface that has another name in the component."""

    interface: str
    operation: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Event(Node):
    """An event that may come from outside; events that only automata send need no declaration."""

    name: str
    description: Text = Text()


@dataclass(frozen=True, slots=True, kw_only=True)
class Functions(Node):
    """Functions of an imported file that belong to none of its imported automata."""

    text: Text


@dataclass(frozen=True, slots=True, kw_only=True)
class Property(Node):
    """A property of the automata that the model checker tries to prove.

    `kind` is `always`, `eventually` or `never`, `within` a number of milliseconds or blank. For `expression`
    see `docs/explanation/model-checker.md`.
    """

    name: str = ""
    kind: str = "always"
    within: Text = Text()
    expression: Text = Text()


FAILS_AFTER: Final = 2.0
"""When parts of the robot fail of which nobody says when, in s."""
SUCCEED: Final = "succeed"
"""What a behavior whose robot fails must do if it may not stop."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Survives(Node):
    """A failure of a `part` of the robot that the behavior must survive, as `nao faults` names both.

    `amount` is in the unit of the `kind`, and blank for as much as is usual; `after` is when it fails, in s,
    and blank for FAILS_AFTER. The behavior survives if it stops or succeeds; with `must` `succeed` it may
    not stop.
    """

    part: str = ""
    kind: str = ""
    amount: str = ""
    after: str = ""
    must: str = ""

    @property
    def failure(self) -> str:
        """The failure in words, such as `Camera black`."""
        return f"{self.part} {self.kind} {self.amount}".strip()

    @property
    def fails_at(self) -> float:
        """When the part fails, in s. Raises ValueError if `after` is no number."""
        return float(self.after or FAILS_AFTER)


@dataclass(frozen=True, slots=True, kw_only=True)
class Shelf(Node):
    """The place of a document on the editor's shelf, from which it is drawn into other documents as a state.

    `title` is what people call it, `category` the heading below which it stands, `icon` the name of a picture
    of the page, and `words` are further words by which it is found. Each may be blank.
    """

    title: Text = Text()
    category: Text = Text()
    icon: Text = Text()
    words: Text = Text()


@dataclass(frozen=True, slots=True, kw_only=True)
class Document(Node):
    """A component as a tree of automata, with the libraries and interfaces that its code uses.

    `description`, `on_error`, `on_refused`, `world`, `dialect`, `language`, `shelf`, annotations, parameters,
    events, properties, `survives` and `ros` are our additions; the original editor ignores them. `dialect` is
    blank for the current format, and otherwise names the former editor (`VisualHFSM`, `VisualStates`) whose
    generator the code was written for. `language` is blank for Python, and otherwise names the language of
    the code, which is kept but does not run. `lists` has the unknown content of the elements around
    parameters, libraries, interfaces and so on, such as settings of ROS in `config`. `functions` come from
    imported files, and `format` is the format that the document was read from: neither is written.
    """

    root_tag: str = "VisualHFSM"
    description: Text = Text()
    on_error: Text = Text()
    on_refused: Text = Text()
    world: Text = Text()
    """The world in which the editor starts a simulation for it; any does when it is blank."""
    dialect: Text = Text()
    language: Text = Text()
    shelf: Shelf | None = None
    parameters: tuple[Parameter, ...] = ()
    events: tuple[Event, ...] = ()
    properties: tuple[Property, ...] = ()
    survives: tuple[Survives, ...] = ()
    automata: tuple[Automaton, ...] = ()
    libraries: tuple[Library, ...] = ()
    interfaces: tuple[Interface, ...] = ()
    ros: tuple[RosInterface, ...] = ()
    lists: tuple[Element, ...] = ()
    functions: tuple[Functions, ...] = ()
    format: str = field(default=NATIVE, compare=False)

    @property
    def is_old(self) -> bool:
        """Whether the code relies on names that the original generators defined."""
        return not self.dialect.is_blank

    @property
    def proxy_aliases(self) -> dict[str, str]:
        """The second names that the original generators gave to proxies, each with the interface's name."""
        own = {each.name for each in self.all_interfaces}
        aliases = {f"{each.name}Prx": each.name for each in self.interfaces}
        return {alias: name for alias, name in aliases.items() if alias not in own}

    @property
    def all_interfaces(self) -> tuple[Interface | RosInterface, ...]:
        """The interfaces of servants and of ROS, which are all attributes of `self`."""
        return (*self.interfaces, *self.ros)

    @property
    def ros_messages(self) -> dict[str, str]:
        """The types whose short names the generator of VisualStates imported."""
        topics = [each.type.strip() for each in self.ros if self.is_old and "/msg/" in each.type]
        return {name.rpartition("/")[2]: name for name in topics}

    @property
    def ros_aliases(self) -> dict[str, RosAlias]:
        """The names that VisualStates gave to newest messages and to functions that publish."""
        found: dict[str, RosAlias] = {}
        for each in self.ros if self.is_old else ():
            if each.kind == "subscribe" and each.name.endswith("Sub"):
                found[each.name.removesuffix("Sub")] = RosAlias(each.name, "value")
            elif each.kind == "publish" and each.name.endswith("Pub"):
                name = each.name.removesuffix("Pub")
                for alias in (f"publish{name}", name):  # of 2018, and where the document names the function
                    found.setdefault(alias, RosAlias(each.name, "publish"))
        return found

    def automaton(self, id: int) -> Automaton | None:
        """Return the automaton with this id, or None."""
        return next((automaton for automaton in self.automata if automaton.id == id), None)

    @property
    def root(self) -> Automaton | None:
        """The automaton that no state owns, or None if there is not exactly one."""
        roots = [automaton for automaton in self.automata if automaton.father == NO_CHILD]
        return roots[0] if len(roots) == 1 else None

    def owner(self, automaton: Automaton) -> State | None:
        """Return the state that owns an automaton, or None for the root and for one without an owner."""
        father = self.automaton(automaton.father)
        if father is None:
            return None
        return next((state for state in father.states if automaton.id in state.children), None)

    def above(self, automaton: Automaton) -> Iterator[Automaton]:
        """Yield the automata above one, the nearest first."""
        seen = {automaton.id}
        father = self.automaton(automaton.father)
        while father is not None and father.id not in seen:
            seen.add(father.id)
            yield father
            father = self.automaton(father.father)

    def states(self) -> Iterator[tuple[Automaton, State]]:
        """Yield every state with its automaton, in the order of the file."""
        for automaton in self.automata:
            for state in automaton.states:
                yield automaton, state
