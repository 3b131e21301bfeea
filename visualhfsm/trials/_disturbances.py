"""What happens to the robot during a trial, at its times."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING, Final

from codegen.messages import Message
from hfsm_runtime.component import proxies_of
from hfsm_runtime.virtual.errors import UnknownName
from naoserver.errors import InvalidCommand

from ._errors import TrialsError
from ._plan import CARRIED, Disturbance
from ._quantities import Values

if TYPE_CHECKING:
    from naoserver.bodies.capabilities import Stage
    from visualhfsm.simulation import Ball, Behavior

_SHORTEST_LEG: Final = 0.01
"""Least time in s that a ball is carried to a place: a tick, even if it is there already."""


class Disturbances:
    """Let disturbances happen to a behavior as its time passes. Raises TrialsError for one that cannot."""

    def __init__(self, behavior: Behavior, disturbances: Mapping[str, Disturbance], values: Values) -> None:
        self._behavior = behavior
        for name, each in disturbances.items():
            drawn = {key: values[f"{name}.{key}"] for key in each.quantities}
            part, kind = str(drawn.pop("fail", "")), str(drawn.pop("kind", ""))
            numbers = {key: float(value) for key, value in drawn.items()}
            action = self._failure(part, kind, numbers) if part else self._action(each, numbers)
            self.later(numbers["at"], action)

    def fail(self, what: str, amount: float | None, at: float, begin: Callable[[], object]) -> None:
        """Let a part fail at a time, such as `Camera black`; `begin` is called then."""
        part, _, kind = what.rpartition(" ")
        failure = self._failure(part, kind, {"seconds": 0.0} | ({} if amount is None else {"amount": amount}))
        self.later(at, lambda: (begin(), failure()))

    def _failure(self, part: str, kind: str, numbers: Mapping[str, float]) -> Callable[[], object]:
        """Return what lets a part fail."""
        amount, seconds = numbers.get("amount"), numbers["seconds"] or None
        if (faults := self._behavior.robot.device.faults) is None:
            raise TrialsError.because("a real robot fails by itself only: write robot = {sim}", sim='"sim"')
        with TrialsError.in_place_of(InvalidCommand, "{part} cannot fail: {reason}", part=part):
            faults.check(part, kind, amount, seconds)
        return partial(faults.inject, part, kind, amount, seconds)

    def _action(self, what: Disturbance, numbers: Mapping[str, float]) -> Callable[[], object]:
        """Return what happens."""
        if what.push is not None:
            stage = self._stage(Message('only the simulated robot can be pushed: write robot = "sim"'))
            return partial(_push, stage, numbers["push"], numbers["direction"], numbers["seconds"])
        if what.move is not None:
            places = [
                {axis: numbers[prefix + axis] for axis in place} for prefix, place in what.places.items()
            ]
            return self._movement(what.move, places, numbers.get("speed"))
        if what.late is not None:
            numbers = {"amount": numbers["late"], "seconds": numbers["seconds"]}
            cameras = [camera.name for camera in self._behavior.robot.device.body.cameras]
            late = [self._failure(camera, "late", numbers) for camera in cameras]
            return lambda: [each() for each in late]
        called = (proxy.identity for proxy in proxies_of(self._behavior.component).values())
        servants = sorted({*self._behavior.world.communicator.identities(), *called})
        for identity in what.offline or ():
            if identity not in servants:
                raise TrialsError.because(
                    "{identity} cannot be offline: there is no such servant; there are {known}",
                    identity=identity,
                    known=", ".join(servants),
                )
        return partial(self._cut, what.offline or (), numbers["seconds"])

    def _movement(
        self, name: str, places: Sequence[Mapping[str, float]], speed: float | None
    ) -> Callable[[], object]:
        """Return what moves a thing: at once to a place, or at a speed from place to place."""
        axes = {axis for place in places for axis in place}
        if axes <= {*CARRIED}:
            with TrialsError.in_place_of(UnknownName, "{name} cannot be carried: {reason}", name=name):
                ball = self._behavior.robot.ball(name)
            return partial(ball.place, **places[0]) if speed is None else _Carrier(self, ball, places, speed)
        if not axes <= {"x", "y", "z"}:
            raise TrialsError.because(
                "{name} cannot be moved to {axes}: write x, y and z, or {carried}",
                name=name,
                axes=", ".join(axes),
                carried=", ".join(CARRIED),
            )
        stage = self._stage(
            Message(
                "the fake robot has no {name} with x, y and z: write {carried}",
                name=name,
                carried=", ".join(CARRIED),
            )
        )
        if name not in stage.objects:
            known = ", ".join(stage.objects) or "none"
            raise TrialsError.because(
                "{name} cannot be moved: there is no such thing in the world; there are {known}",
                name=name,
                known=known,
            )
        return partial(_put, stage, name, places[0])

    def _stage(self, otherwise: Message) -> Stage:
        stage = self._behavior.robot.device.stage
        if stage is None:
            raise TrialsError(otherwise)
        return stage

    def _cut(self, identities: Sequence[str], seconds: float) -> None:
        cut = ExitStack()
        cut.enter_context(self._behavior.server_offline(*identities))
        self.later(seconds, cut.close)

    def later(self, seconds: float, action: Callable[[], object]) -> None:
        """Do something in some seconds of robot time."""
        clock = self._behavior.world.clock

        def act() -> None:
            action()

        clock.call_at(clock.now() + seconds, act)


def _push(stage: Stage, newtons: float, direction: float, seconds: float) -> None:
    angle = stage.truth().torso.heading + direction
    stage.push((newtons * math.cos(angle), newtons * math.sin(angle), 0.0), seconds)


def _put(stage: Stage, name: str, to: Mapping[str, float]) -> None:
    place = {**dict(zip("xyz", stage.truth().objects[name].position, strict=True)), **to}
    with TrialsError.in_place_of(InvalidCommand, "{name} cannot be moved there: {reason}", name=name):
        stage.place_object(name, (place["x"], place["y"], place["z"]))


class _Carrier:
    """Carry a ball from place to place, again and again."""

    def __init__(
        self, disturbances: Disturbances, ball: Ball, places: Sequence[Mapping[str, float]], speed: float
    ) -> None:
        self._disturbances = disturbances
        self._ball = ball
        self._places = places
        self._speed = speed
        self._legs = 0

    def __call__(self) -> None:
        """Begin to carry it to the next place."""
        to = self._places[self._legs % len(self._places)]
        here = dict(zip(CARRIED, self._ball.position, strict=True))
        here |= (
            self._places[(self._legs - 1) % len(self._places)] if self._legs else {}
        )  # it lags behind by some hundredths of a second
        self._legs += 1
        self._ball.move(**to, speed=self._speed)
        if len(self._places) > 1:
            seconds = max(abs(value - here[axis]) for axis, value in to.items()) / self._speed
            self._disturbances.later(max(seconds, _SHORTEST_LEG), self)
