"""The run that a judge sees: the states of a trial with their times, its calls, and where the robot was."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from hfsm_runtime.observer import Observer
from hfsm_runtime.tree import Actor, ChangeKind
from visualhfsm.trials import place_of

if TYPE_CHECKING:
    from hfsm_runtime.virtual import Call
    from visualhfsm.simulation import Behavior
    from visualhfsm.trials import Plan, Value

_MOST_CHANGES: Final = 50_000


@dataclass(frozen=True, slots=True)
class Moment:
    """How the robot is at a time of a run."""

    time: float
    """In s."""
    head: tuple[float, float] | None
    """Pan, positive to the left, and tilt, positive downwards, in rad; None without a neck."""
    place: tuple[float, float] | None
    """Where it is on the floor in m: in the simulated world, or by its odometry."""
    heading: float
    """Which way it faces in rad, positive to the left."""
    fallen: bool
    things: Mapping[str, tuple[float, float, float]]
    """Where balls and boxes of the simulated world are, x, y and z in m."""


class JudgedRun:
    """A trial as judges see it, while it runs and afterwards. Implements `Witness`."""

    def __init__(self, plan: Plan) -> None:
        self._disturbances = tuple(plan.disturbances)
        self.behavior: Behavior
        """The running behavior: everything that a test can read."""
        self.values: Mapping[str, Value] = {}
        """The values of the plan's quantities."""
        self.moments: list[Moment] = []
        """The state of the robot ten times a second."""
        self.changes: list[tuple[float, tuple[str, ...]]] = []
        """The paths of the current states from a time in s on."""
        self.events: dict[str, float] = {}
        """When each disturbance happens, in s."""

    # -- what judges ask -----------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """How long it took in s."""
        return self.behavior.time

    @property
    def fell(self) -> float | None:
        """When the robot fell, in s; None if it did not."""
        return next((each.time for each in self.moments if each.fallen), None)

    def calls(self, target: str = "") -> list[Call]:
        """Return the calls of an operation (`Head.setPose`), of a servant, or all."""
        return self.behavior.calls(target)

    def spans(self, state: str) -> list[tuple[float, float]]:
        """Return when a state, by its name or its path, was current: from and to in s."""
        found: list[tuple[float, float]] = []
        begin: float | None = None
        for time, paths in self.changes:
            current = any(f"/{state}/" in f"/{path}/" for path in paths)
            if current and begin is None:
                begin = time
            elif not current and begin is not None:
                found.append((begin, time))
                begin = None
        return [*found, (begin, self.time)] if begin is not None else found

    def current(self, *, failed: bool = False) -> list[tuple[float, float, str]]:
        """Return which states were current for some time, or last as it `failed`: from, to in s, paths."""
        ends = [*(time for time, _ in self.changes[1:]), self.time]
        found = [
            (begin, end, ", ".join(paths)) for (begin, paths), end in zip(self.changes, ends, strict=True)
        ]
        return [each for each in found if each[1] > each[0] or (failed and each is found[-1])]

    def entered(self, state: str, after: float = 0.0) -> float | None:
        """Return when a state is current for the first time after a time in s; None if it never is."""
        return next(
            (max(begin, after) for begin, end in self.spans(state) if end > after or begin >= after), None
        )

    # -- what the trial reports ----------------------------------------------------------------------------

    def begin(self, behavior: Behavior, values: Mapping[str, Value]) -> None:
        """See it before its first cycle."""
        self.behavior, self.values = behavior, values
        self.events = {name: float(values[f"{name}.at"]) for name in self._disturbances}
        self._note(0.0)
        behavior.tree.observers.append(_Changes(self._note))

    def observe(self, behavior: Behavior) -> None:
        """See where the robot is."""
        if not behavior.has_robot:
            return
        robot = behavior.robot
        place, heading = place_of(behavior)
        stage = robot.device.stage
        things = {} if stage is None else stage.truth().objects
        self.moments.append(
            Moment(
                behavior.time,
                robot.head if robot.device.body.neck is not None else None,
                place,
                heading,
                robot.state.fallen,
                {name: pose.position for name, pose in things.items()},
            )
        )

    def _note(self, time: float) -> None:
        paths = tuple(self.behavior.active_paths)
        if len(self.changes) < _MOST_CHANGES and (not self.changes or self.changes[-1][1] != paths):
            self.changes.append((time, paths))


class _Changes(Observer):
    """Report when the current states change."""

    def __init__(self, note: Callable[[float], None]) -> None:
        self._note = note

    def changed(self, now: int, run: Actor, kind: ChangeKind) -> None:  # noqa: ARG002
        """Report it."""
        self._note(now / 1e9)
