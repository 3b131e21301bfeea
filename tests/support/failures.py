"""What follows when the code of a document fails: the table of the reference, and a component for each cell.

The table says which code runs after a piece that fails once: in the same cycle, and in those that follow.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from enum import StrEnum
from itertools import groupby
from typing import Any, Final

from hfsm_runtime import Automaton, Component, Input, State, Transition
from hfsm_runtime._automaton import REFUSED
from hfsm_runtime._component_run import ComponentRun
from hfsm_runtime.errors import CycleCutError
from interfaces.jderobot import CommandRefusedException, InvalidValueException
from zenoh_ice.data.exceptions import ConnectionLostException

PERIOD: Final = 0.02


class Raised(StrEnum):
    """What a piece of code raises, or what ends its cycle."""

    ERROR = "an exception"
    DECLARED = "an exception that the IDL declares"
    HEARD = "one for which the state waits"
    LOST = "a lost server"
    REFUSED = "a refused command"
    CUT = "a pause"
    STOPPED = "the end of the component"
    EXIT = "sys.exit"
    EXIT_IN_ORDER = "sys.exit without an error"
    OTHER = "another BaseException"


class Ends(StrEnum):
    """What ends."""

    PIECE = "the piece"
    CYCLE = "the cycle"
    COMPONENT = "the component"


ENDS: Final[Mapping[Raised, tuple[Ends, Ends]]] = {
    Raised.ERROR: (Ends.COMPONENT, Ends.PIECE),
    Raised.DECLARED: (Ends.COMPONENT, Ends.PIECE),
    Raised.HEARD: (Ends.PIECE, Ends.PIECE),
    Raised.LOST: (Ends.CYCLE, Ends.CYCLE),
    Raised.REFUSED: (Ends.CYCLE, Ends.CYCLE),
    Raised.CUT: (Ends.CYCLE, Ends.CYCLE),
    Raised.STOPPED: (Ends.COMPONENT, Ends.COMPONENT),
    Raised.EXIT: (Ends.COMPONENT, Ends.COMPONENT),
    Raised.EXIT_IN_ORDER: (Ends.COMPONENT, Ends.COMPONENT),
    Raised.OTHER: (Ends.COMPONENT, Ends.COMPONENT),
}
"""What ends by it where `onerror` is `stop`, and where it is `continue`."""

ALL: Final = "guard, exit x, exit a, fired, entry b, arguments b, code b"
"""All pieces of a firing, in their order."""
AFTER_CHANGE: Final = "; entry b, arguments b, code b"


@dataclass(frozen=True)
class Fate:
    """What the reference says, and the code that runs after the piece: in its cycle; then in later ones."""

    text: str
    runs: str = ""


FOLLOWS: Final[Mapping[str, Mapping[Ends, Fate]]] = {
    "guard": {
        Ends.PIECE: Fate("it does not hold, and the next transition is tried", f"; {ALL}"),
        Ends.CYCLE: Fate("nothing more runs; the next cycle tries all transitions again", f"; {ALL}"),
        Ends.COMPONENT: Fate("nothing more runs"),
    },
    "exit x": {
        Ends.PIECE: Fate("all else runs", "exit a, fired, entry b, arguments b, code b"),
        Ends.CYCLE: Fate(
            "the exit code above it runs, and the state changes; then as for the state's own",
            f"exit a{AFTER_CHANGE}",
        ),
        Ends.COMPONENT: Fate("the exit code above it runs, and the state changes", "exit a"),
    },
    "exit a": {
        Ends.PIECE: Fate("all else runs", "fired, entry b, arguments b, code b"),
        Ends.CYCLE: Fate(
            "the state changes; the transition's code does not run, which is logged; entry code and what "
            "follows it run in the next cycle",
            AFTER_CHANGE,
        ),
        Ends.COMPONENT: Fate("the state changes"),
    },
    "fired": {
        Ends.PIECE: Fate("all else runs", "entry b, arguments b, code b"),
        Ends.CYCLE: Fate("entry code and what follows it run in the next cycle", AFTER_CHANGE),
        Ends.COMPONENT: Fate("nothing more runs"),
    },
    "entry b": {
        Ends.PIECE: Fate("all else runs, and the state begins", "arguments b, code b"),
        Ends.CYCLE: Fate("the next cycle runs it again from its beginning", AFTER_CHANGE),
        Ends.COMPONENT: Fate("nothing more runs"),
    },
    "arguments b": {
        Ends.PIECE: Fate("inputs keep their values, and the state begins", "code b"),
        Ends.CYCLE: Fate(
            "the next cycle evaluates them again, without the entry code", "; arguments b, code b"
        ),
        Ends.COMPONENT: Fate("nothing more runs"),
    },
    "code b": {
        Ends.PIECE: Fate("outputs are handed up; it runs again in the next cycle", "; code b"),
        Ends.CYCLE: Fate("nothing is handed up; it runs again in the next cycle", "; code b"),
        Ends.COMPONENT: Fate("nothing more runs"),
    },
}
NAMES: Final[Mapping[str, str]] = {
    "guard": "a guard",
    "exit x": "exit code of an automaton below",
    "exit a": "exit code of the state",
    "fired": "the transition's code",
    "entry b": "entry code",
    "arguments b": "arguments",
    "code b": "code of the state",
}
"""The pieces as the reference calls them."""
HEARD: Final[Mapping[str, str]] = {"guard": "; exit x, exit a", "code b": ""}
"""The same where the state hears it next, as the event `refused`, and is left."""

ERRORS: Final[Mapping[Raised, int]] = {
    each: 0 if each in (Raised.HEARD, Raised.CUT, Raised.STOPPED, Raised.EXIT_IN_ORDER) else 1
    for each in Raised
}
"""How many errors are told."""
EXIT_CODES: Final[Mapping[Raised, int]] = {
    Raised.ERROR: 1,
    Raised.DECLARED: 1,
    Raised.STOPPED: 0,
    Raised.EXIT: 3,
    Raised.EXIT_IN_ORDER: 0,
    Raised.OTHER: 1,
}
"""The exit code of a component that ends by it."""


class OtherError(BaseException):
    """It is no Exception, so that few people catch it."""


@dataclass(frozen=True)
class Next:
    """The state that follows, and how: by an event or a time, while an ancestor leaves the state above or not."""

    name: str
    is_by_event: bool = False
    has_entry: bool = False
    has_children: bool = False
    is_final: bool = False
    is_ghost: bool = False

    def keeps(self, piece: str) -> bool:
        """Return whether a piece of the table runs with this state."""
        if piece == "entry b":
            return self.has_entry
        if piece == "arguments b":
            return self.has_children and not self.is_final
        return piece != "code b" or not self.is_final


NEXT: Final = (
    Next("bare"),
    Next("with entry code, by an event", is_by_event=True, has_entry=True),
    Next("with children", has_children=True),
    Next("with both", has_entry=True, has_children=True),
    Next("final", is_final=True),
    Next("final with both", has_entry=True, has_children=True, is_final=True),
    Next("bare, of a ghost", is_ghost=True),
    Next(
        "with both, by an event, of a ghost",
        is_by_event=True,
        has_entry=True,
        has_children=True,
        is_ghost=True,
    ),
)


@dataclass(frozen=True)
class Cell:
    """A cell of the table: which piece raises what, before which state, with which policy."""

    raised: Raised
    piece: str
    next: Next
    policy: str

    def __str__(self) -> str:
        return f"{self.raised} in {self.piece}, next {self.next.name}, {self.policy}"

    @property
    def ends(self) -> Ends:
        return ENDS[self.raised][self.policy == "continue"]

    @property
    def expected(self) -> list[str]:
        """The code that runs."""
        before = ALL.split(", ")[: ALL.split(", ").index(self.piece)]
        follows = FOLLOWS[self.piece][self.ends].runs
        if self.raised is Raised.HEARD:
            follows = HEARD.get(self.piece, follows)
        after = [each.strip() for each in follows.replace(";", ",").split(",")]
        lines = [*before, f"{self.piece}!", *filter(None, after)]
        return [line for line in lines if self.next.keeps(line.rstrip("!"))]

    @property
    def last_state(self) -> str:
        """The state in which the automaton ends, by a timer if the state before has begun."""
        if self.ends is Ends.COMPONENT:
            return "a" if self.piece == "guard" else "b"
        is_heard = self.raised is Raised.HEARD and self.piece == "guard"
        return "b" if self.next.is_final and not is_heard else "c"


def cells() -> Iterator[Cell]:
    """Yield all cells."""
    for raised in Raised:
        for piece in FOLLOWS:
            for after in NEXT:
                if after.keeps(piece) and not (raised is Raised.HEARD and after.is_ghost):  # it hears nothing
                    yield from (Cell(raised, piece, after, policy) for policy in ("stop", "continue"))


class Failing:
    """Makes a component whose code fails once, and keeps what ran.

    `run` is what runs it; it is None in a replay, where a pause and the end come from the recording.
    """

    def __init__(self, cell: Cell) -> None:
        self.cell = cell
        self.lines: list[str] = []
        self.inner_ran = False
        self.run: ComponentRun | None = None
        self._is_armed = True
        self._is_asleep = False

    @property
    def ran(self) -> list[str]:
        """The code that ran, the repetitions of cyclic code left out."""
        return [line for line, _ in groupby(self.lines)]

    def component(self) -> Component:
        """Return the component."""
        failing = self

        class Written(Component, document="failing.xml", on_error=self.cell.policy):
            def automaton(self) -> Automaton:
                return failing._automata(self)

        made = Written()
        made._hfsm_log.disabled = False
        return made

    def _piece(self, component: Component, name: str, result: object = None) -> Callable[[], object]:
        def code() -> object:
            if name != self.cell.piece or not self._is_armed:
                self.lines.append(name)
                return result
            self._is_armed = False
            self.lines.append(f"{name}!")
            self._fail(component)
            return result

        return code

    def _fail(self, component: Component) -> None:
        if self.cell.next.is_ghost:
            self._is_asleep = True
            with suppress(CycleCutError):
                component.sleep(60)  # until the state above is left
            self._is_asleep = False
        match self.cell.raised:
            case Raised.ERROR:
                raise ValueError("a mistake")
            case Raised.DECLARED | Raised.HEARD:
                raise InvalidValueException("not that")
            case Raised.LOST:
                raise ConnectionLostException("offline")
            case Raised.REFUSED:
                raise CommandRefusedException("a hand in the way", "")
            case Raised.CUT:
                if self.run is not None:
                    self.run.pause()
            case Raised.STOPPED:
                if self.run is not None:
                    self.run.request_stop()
            case Raised.EXIT:
                raise SystemExit(3)
            case Raised.EXIT_IN_ORDER:
                raise SystemExit
            case Raised.OTHER:
                raise OtherError("nobody expects this")
        component.sleep(60)

    def _automata(self, component: Component) -> Automaton:
        after, given = self.cell.next, 0

        def piece(name: str, result: object = None) -> Callable[[], object]:
            return self._piece(component, name, result)

        def note_inner() -> None:
            self.inner_ran = True

        def has_run() -> bool:
            """Return whether all code of the state and below it has run, however late a thread is."""
            return self.lines[-1] == "code b" and (self.inner_ran or not after.has_children)

        def take(values: Mapping[str, object]) -> None:
            nonlocal given
            given = int(str(values["n"]))

        def arguments() -> Mapping[str, object]:
            piece("arguments b")()
            return {"n": given + 1}

        x = State("x", initial=True, code=lambda: component.send("go"), exit=piece("exit x"))
        below = Automaton("below", id=2, period=PERIOD, states=(x,))
        inner = Automaton(
            "inner",
            id=3,
            period=PERIOD,
            states=(State("y", initial=True, code=note_inner),),
            inputs=(Input(name="n", type=int, default=0),),
            set_inputs=take,
        )
        guard, fired = piece("guard", True), piece("fired")
        go: dict[str, Any] = {"event": "go"} if after.is_by_event else {"seconds": 2 * PERIOD}
        states = (
            State("a", initial=True, restart=True, children=(below,), exit=piece("exit a")),
            State(
                "b",
                final=after.is_final,
                entry=piece("entry b") if after.has_entry else None,
                arguments=arguments if after.has_children else None,
                children=(inner,) if after.has_children else (),
                code=piece("code b"),
            ),
            State("c"),
        )
        transitions: tuple[Transition, ...] = (
            Transition("go", 1, 2, guard=lambda *_: guard(), code=lambda *_: fired(), **go),
            Transition("", 2, 3, seconds=3 * PERIOD, guard=has_run),
        )
        if self.cell.raised is Raised.HEARD:
            transitions += tuple(Transition("", each, 3, event=REFUSED, priority=1) for each in (1, 2))
        walk = Automaton("walk", id=1, period=PERIOD, states=states, transitions=transitions)
        if not after.is_ghost:
            return walk
        return Automaton(
            "above",
            id=4,
            period=PERIOD,
            states=(State("here", initial=True, children=(walk,)), State("away")),
            transitions=(
                Transition("", 1, 2, guard=lambda: self._is_asleep),
                Transition("", 2, 1, seconds=2 * PERIOD),
            ),
        )
