"""What happens to the robot during a trial, at its times."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from codegen.messages import Message
from hfsm_runtime.component import proxies_of
from hfsm_runtime.virtual.errors import UnknownName
from naoserver.errors import InvalidCommand
from zenoh_ice import Clock, Current

from ._errors import TrialsError
from ._plan import CARRIED, Disturbance
from ._quantities import Values

if TYPE_CHECKING:
    from naoserver.bodies.capabilities import Stage
    from visualhfsm.simulation import Ball, Behavior

_SHORTEST_LEG: Final = 0.01
"""Least time in s that a ball is carried to a place: a tick, even if it is there already."""
_SHOWN: Final = "getImageData", "getSight"
"""Operations that return a picture, or what eyes see in it."""


class Disturbances:
    """Let disturbances happen to a behavior as its time passes. Raises TrialsError for one that cannot."""

    def __init__(self, behavior: Behavior, disturbances: Mapping[str, Disturbance], values: Values) -> None:
        self._behavior = behavior
        self.delay = 0.0
        """Age in s of the pictures that arrive now."""
        if any(each.late is not None for each in disturbances.values()):
            self._delay_pictures()
        for name, each in disturbances.items():
            numbers = {key: float(values[f"{name}.{key}"]) for key in each.quantities}
            self.later(numbers["at"], self._action(each, numbers))

    def _action(self, what: Disturbance, numbers: Mapping[str, float]) -> Callable[[], None]:
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
            return partial(self._let_be_late, numbers["late"], numbers["seconds"])
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
    ) -> Callable[[], None]:
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

    def _let_be_late(self, delay: float, seconds: float) -> None:
        self.delay = delay
        self.later(seconds, partial(setattr, self, "delay", 0.0))

    def later(self, seconds: float, action: Callable[[], None]) -> None:
        """Do something in some seconds of robot time."""
        clock = self._behavior.world.clock
        clock.call_at(clock.now() + seconds, action)

    def _delay_pictures(self) -> None:
        """Let what cameras show pass through a queue, from which the old comes while it is late."""
        behavior = self._behavior
        for name, proxy in proxies_of(behavior.component).items():
            servant = behavior.world.network.servant(proxy.identity)
            for shown in _SHOWN:
                if servant is not None and shown in servant.ice_interface.all_operations:
                    current = Current(proxy.identity, shown, "", 0.0, behavior.world.communicator)
                    show = partial(getattr(servant, shown), current=current)
                    behavior.stub(name, **{shown: _Late(self, show, behavior.world.clock)})


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


class _Late:
    """What a camera shows, late: the newest that it showed long enough ago."""

    def __init__(self, disturbances: Disturbances, show: Callable[..., Any], clock: Clock) -> None:
        self._disturbances = disturbances
        self._show = show
        self._clock = clock
        self._shown: deque[tuple[float, Any]] = deque()

    def __call__(self, *arguments: object) -> Any:  # noqa: ANN401 - a picture, or what is in it
        now, delay = self._clock.now(), self._disturbances.delay
        self._shown.append((now, self._show(*arguments)))
        while len(self._shown) > 1 and self._shown[1][0] <= now - delay:
            self._shown.popleft()
        return self._shown[0][1]
