"""A component as its monitor tells of it, for tests: root, a child for each of two states, a timer each."""

from __future__ import annotations

from interfaces.hfsm import (
    AutomatonSnapshot,
    AutomatonStructure,
    ComponentSnapshot,
    ComponentStatus,
    ComponentStructure,
    StateStructure,
    TimerSnapshot,
    TransitionStructure,
)

__all__ = ["ball_variables", "dance_and_follow", "snapshot"]

PERIODS = {1: 10.0, 2: 8.0}
"""Seconds after which the timed automata of `dance_and_follow` change their state."""


def dance_and_follow() -> ComponentStructure:
    """Return the automata: 1 root, 2 followBall with 3 red and 4 green below it, 5 dance."""
    return ComponentStructure(
        "dance_and_follow",
        [
            _automaton(1, "dance_and_follow", 0, 0, {"followBall": 2, "dance": 5}, seconds=10.0),
            _automaton(2, "followBall", 1, 1, {"red": 3, "green": 4}, seconds=8.0),
            _automaton(3, "red", 2, 1, {"follow": 0, "search": 0}),
            _automaton(4, "green", 2, 2, {"follow": 0, "search": 0}),
            _automaton(5, "dance", 1, 2, {"right": 0, "left": 0}),
        ],
    )


def _automaton(
    id: int, name: str, parent: int, owner: int, states: dict[str, int], seconds: float = 0.0
) -> AutomatonStructure:
    first, second = states
    timed = seconds > 0
    return AutomatonStructure(
        id, name, parent, owner, 0.1,
        [StateStructure(number, state, number == 1, states[state]) for number, state in enumerate(states, 1)],
        [
            TransitionStructure(1, f"to {second}", 1, 2, timed, seconds, "" if timed else "ready"),
            TransitionStructure(2, f"to {first}", 2, 1, timed, seconds, "" if timed else "ready"),
        ],
    )  # fmt: skip


def ball_variables(u: float, v: float, *, seen: bool = True) -> dict[str, str]:
    """Return the variables of an automaton that follows a ball."""
    return {"error_u": repr(u), "error_v": repr(v), "ball_seen": repr(seen), "corner": "0"}


def snapshot(time: float, ball: dict[str, str] | None = None) -> ComponentSnapshot:
    """Return what the component does at a time, as its document says: 10 s following, 10 s dancing, ..."""
    turns, in_root = divmod(time, PERIODS[1])
    root = 1 + int(turns) % 2
    following = (int(turns) + 1) // 2 * PERIODS[1] + (in_root if root == 1 else 0.0)
    phases, in_child = divmod(following, PERIODS[2])
    child = 1 + int(phases) % 2
    entered = phases * PERIODS[2]
    entered += (entered - 1e-9) // PERIODS[1] * PERIODS[1] if entered else 0.0
    ghosts = {1: False, 2: root != 1, 3: root != 1 or child != 1, 4: root != 1 or child != 2, 5: root != 2}
    variables = ball or ball_variables(12.5, -3.25)
    return ComponentSnapshot(
        time,
        ComponentStatus.Running,
        [
            _snapshot(1, root, ghosts, turns * PERIODS[1], time, [TimerSnapshot(root, PERIODS[1] - in_root)]),
            _snapshot(2, child, ghosts, entered, time, [TimerSnapshot(child, PERIODS[2] - in_child)]),
            _snapshot(3, 1, ghosts, 0.0, time, [], variables),
            _snapshot(4, 1, ghosts, 0.0, time, [], variables),
            _snapshot(5, 1, ghosts, 0.0, time, [], {"reached": "3"}),
        ],
        [],
    )


def _snapshot(
    id: int, state: int, ghosts: dict[int, bool], entered: float, time: float,
    timers: list[TimerSnapshot], variables: dict[str, str] | None = None,
) -> AutomatonSnapshot:  # fmt: skip
    return AutomatonSnapshot(
        id, state, ghosts[id], 0 if entered == 0 else 3 - state, entered, timers, [], variables or {},
        int(time * 10), 0, 0.001, 0.004,
    )  # fmt: skip
