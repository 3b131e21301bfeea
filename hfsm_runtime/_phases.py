"""How far an automaton has come in its state, and with its cycle."""

from __future__ import annotations

from enum import Enum, IntEnum, auto

from ._automaton import State


class Phase(IntEnum):
    """The stages of an automaton in its current state; four functions of `Tree` move it on.

    A ghost keeps its phase, and goes on from there when it is active again.
    """

    UNUSED = 0
    """It has never been active, and entered no state yet."""
    OWES_ENTRY = 1
    """The entry code of the state is to run."""
    ENTERING = 2
    """The entry code has begun; if it does not run to its end, it is to run again, from its beginning."""
    OWES_ARGUMENTS = 3
    """The entry code has run to its end; the inputs of the automata below are to be set."""
    ENTERED = 4
    """The entry is complete. No cycle of an active automaton ends so: the state begins."""
    BEGUN = 5
    """The timers count, and the automata below are awake; no observer has been asked whether to pause."""
    SETTLED = 6
    PAUSED = 7
    """The next cycle continues the last one at the transitions, with the same events."""
    PAUSED_AT_CODE = 8
    """The next cycle continues the last one at the code of the state."""
    FINISHED = 9
    """The state is final, and no more cycles run."""


class CycleStatus(Enum):
    """The cycle of an automaton at a moment, if it is in one."""

    IDLE = auto()
    RUNNING = auto()
    STEPPING = auto()
    """It runs although the tree is held."""
    OUTLIVED = auto()
    """It runs no more code and changes nothing: the automaton was a ghost meanwhile, and is active again."""


# To find a member in its enumeration takes longer than all else that a cycle does with it.
UNUSED, OWES_ENTRY, ENTERING, OWES_ARGUMENTS, ENTERED, BEGUN, SETTLED, PAUSED, PAUSED_AT_CODE, FINISHED = (
    Phase
)
IDLE, RUNNING, STEPPING, OUTLIVED = CycleStatus


def after_entry_code(state: State) -> Phase:
    """Return the phase of an automaton whose entry code has run to its end, or that has none."""
    return ENTERED if state.arguments is None or state.final else OWES_ARGUMENTS
