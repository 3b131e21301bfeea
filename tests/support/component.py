"""A component as its monitor describes it, for tests: root, a child for each of two states, a timer each."""

from __future__ import annotations

from interfaces.hfsm import (
    AutomatonSnapshot,
    AutomatonStructure,
    Breakpoint,
    ComponentSnapshot,
    ComponentStatus,
    ComponentStructure,
    Explanation,
    HfsmMonitor,
    Mark,
    ReloadReport,
    StateStructure,
    TimerSnapshot,
    TransitionKind,
    TransitionStructure,
)
from zenoh_ice import Current

__all__ = [
    "MonitorStub",
    "ball_mark",
    "dance_and_follow",
    "snapshot",
    "state_structure",
    "transition_structure",
]

PERIODS = {1: 10.0, 2: 8.0}
"""Seconds after which the timed automata of `dance_and_follow` change their state."""


def dance_and_follow() -> ComponentStructure:
    """Return the automata: 1 root, 2 followBall with 3 red and 4 green below it, 5 dance."""
    return ComponentStructure(
        name="dance_and_follow",
        document="dance_and_follow.xml",
        generation=0,
        parameters=[],
        automata=[
            _automaton(1, "dance_and_follow", 0, 0, states={"followBall": 2, "dance": 5}, seconds=10.0),
            _automaton(2, "followBall", 1, 1, states={"red": 3, "green": 4}, seconds=8.0),
            _automaton(3, "red", 2, 1, states={"follow": 0, "search": 0}),
            _automaton(4, "green", 2, 2, states={"follow": 0, "search": 0}),
            _automaton(5, "dance", 1, 2, states={"right": 0, "left": 0}),
        ],
    )


def _automaton(
    id: int, name: str, parent: int, owner: int, *, states: dict[str, int], seconds: float = 0.0
) -> AutomatonStructure:
    first, second = states
    return AutomatonStructure(
        id=id,
        name=name,
        parent=parent,
        owner=owner,
        period=0.1,
        source="",
        states=[
            state_structure(number, state, initial=number == 1, children=[child] if child else [])
            for number, (state, child) in enumerate(states.items(), 1)
        ],
        transitions=[
            transition_structure(
                1, f"to {second}", 1, 2, seconds=seconds, condition="" if seconds else "ready"
            ),
            transition_structure(
                2, f"to {first}", 2, 1, seconds=seconds, condition="" if seconds else "ready"
            ),
        ],
    )


def state_structure(
    id: int, name: str, *, initial: bool = False, final: bool = False, children: list[int] | None = None
) -> StateStructure:
    """Return a state, by default one without anything special."""
    return StateStructure(
        id=id, name=name, initial=initial, final=final, children=children or [], restart=False
    )  # fmt: skip


def transition_structure(
    id: int,
    name: str,
    origin: int,
    destination: int,
    *,
    seconds: float = 0.0,
    event: str = "",
    condition: str = "",
) -> TransitionStructure:
    """Return a transition: by time if `seconds` is more than 0, at an event if one is named."""
    kind = TransitionKind.OnCondition
    if seconds:
        kind = TransitionKind.OnTime
    elif event:
        kind = TransitionKind.OnEvent
    return TransitionStructure(
        id=id, name=name, origin=origin, destination=destination, kind=kind, seconds=seconds, event=event,
        condition=condition, order=1,
    )  # fmt: skip


def ball_mark(u: float, v: float, label: str = "green ball") -> Mark:
    """Return the mark of a ball at an offset from the center of a picture of 320 x 240 pixels."""
    return Mark("Camera", 159.5 + u, 119.5 + v, label)


def snapshot(time: float, ball: tuple[float, float] | None = (12.5, -3.25)) -> ComponentSnapshot:
    """Return the states of the component at a time, by its document: 10 s following, 10 s dancing, ...

    While it follows, it marks its ball, at an offset from the picture's center; without one it marks nothing.
    """
    turns, in_root = divmod(time, PERIODS[1])
    root = 1 + int(turns) % 2
    following = (int(turns) + 1) // 2 * PERIODS[1] + (in_root if root == 1 else 0.0)
    phases, in_child = divmod(following, PERIODS[2])
    child = 1 + int(phases) % 2
    entered = phases * PERIODS[2]
    entered += (entered - 1e-9) // PERIODS[1] * PERIODS[1] if entered else 0.0
    automata = [_snapshot(number, time) for number in range(1, 6)]
    automata[0].state, automata[0].enteredAt = root, turns * PERIODS[1]
    automata[0].lastTransition = 3 - root if turns else 0
    automata[0].timers = [TimerSnapshot(root, PERIODS[1] - in_root)]
    automata[1].state, automata[1].enteredAt = child, entered
    automata[1].lastTransition = 3 - child if phases else 0
    automata[1].timers = [TimerSnapshot(child, PERIODS[2] - in_child)]
    ghosts = (False, root != 1, root != 1 or child != 1, root != 1 or child != 2, root != 2)
    for automaton, ghost in zip(automata, ghosts, strict=True):
        automaton.ghost = ghost
    for automaton in automata[2:4]:
        automaton.variables = {"error": "12.5", "seen": "True", "corner": "0"}
    marks = [ball_mark(*ball, ("red ball", "green ball")[child - 1])] if ball and root == 1 else []
    return ComponentSnapshot(
        startedAt=0.0, time=time, status=ComponentStatus.Running, generation=0, automata=automata, parameters={}, stoppedAt=[],
        errors=[], marks=marks,
    )  # fmt: skip


def short_snapshot(time: float) -> ComponentSnapshot:
    """Return a component whose one automaton has been in its first state since 0."""
    return ComponentSnapshot(time=time, status=ComponentStatus.Running, automata=[_snapshot(1, time)])


def _snapshot(id: int, time: float) -> AutomatonSnapshot:
    """Return an automaton that has been in its first state since 0."""
    return AutomatonSnapshot(
        id=id, state=1, ghost=False, finished=False, lastTransition=0, enteredAt=0.0, timers=[], guards=[], variables={},
        cycles=int(time * 10), overruns=0, lastCycle=0.001, longestCycle=0.004,
    )  # fmt: skip


class MonitorStub(HfsmMonitor):
    """A monitor of `dance_and_follow` that does not change and ignores commands."""

    def getStructure(self, current: Current) -> ComponentStructure:
        return dance_and_follow()

    def getSnapshot(self, current: Current) -> ComponentSnapshot:
        return snapshot(0.0)

    def pause(self, current: Current) -> None: ...
    def resume(self, current: Current) -> None: ...
    def step(self, automaton: int, current: Current) -> None: ...
    def forceTransition(self, automaton: int, transition: int, current: Current) -> None: ...
    def setBreakpoints(self, breakpoints: list[Breakpoint], current: Current) -> None: ...

    def getBreakpoints(self, current: Current) -> list[Breakpoint]:
        return []

    def setVariable(self, automaton: int, name: str, value: str, current: Current) -> None: ...
    def sendEvent(self, name: str, data: str, current: Current) -> None: ...
    def setSpeed(self, speed: float, current: Current) -> None: ...

    def explain(self, automaton: int, current: Current) -> Explanation:
        return Explanation(
            automaton=automaton, state=1, ghost=False, enteredBy=0, transitions=[], summary=""
        )  # fmt: skip

    def reload(self, current: Current) -> ReloadReport:
        return ReloadReport(generation=1, held=0.0, notKept=[])

    def stop(self, current: Current) -> None: ...
