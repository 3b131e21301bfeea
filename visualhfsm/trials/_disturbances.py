"""What happens to the robot during a trial, at its times."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from hfsm_runtime.component import proxies_of
from naoserver.errors import InvalidCommand
from zenoh_ice import Current

from ._errors import TrialsError
from ._plan import Disturbance
from ._quantities import Values

if TYPE_CHECKING:
    from visualhfsm.simulation import Behavior

_CARRIED: Final = ("pan", "distance", "height")
_PICTURES: Final = "getImageData"


class Disturbances:
    """Let disturbances happen to a behavior as its time passes."""

    def __init__(self, behavior: Behavior, disturbances: Mapping[str, Disturbance], values: Values) -> None:
        self._behavior = behavior
        self.delay = 0.0
        """Age in s of the pictures that arrive now."""
        if any(each.late is not None for each in disturbances.values()):
            self._delay_pictures()
        for name, each in disturbances.items():
            numbers = {key: float(values[f"{name}.{key}"]) for key in each.quantities}
            self._later(numbers["at"], partial(self._happen, each, numbers))

    def _happen(self, what: Disturbance, numbers: Mapping[str, float]) -> None:
        if what.push is not None:
            self._push(numbers["push"], numbers["direction"], numbers["seconds"])
        elif what.move is not None:
            self._move(what.move, {name: numbers[name] for name in what.to})
        elif what.offline is not None:
            cut = ExitStack()
            cut.enter_context(self._behavior.server_offline(*what.offline))
            self._later(numbers["seconds"], cut.close)
        elif what.late is not None:
            self._arrive_after(numbers["late"])
            self._later(numbers["seconds"], partial(self._arrive_after, 0.0))

    def _later(self, seconds: float, action: Callable[[], None]) -> None:
        clock = self._behavior.world.clock
        clock.call_at(clock.now() + seconds, action)

    def _arrive_after(self, delay: float) -> None:
        self.delay = delay

    def _push(self, newtons: float, direction: float, seconds: float) -> None:
        stage = self._behavior.robot.device.stage
        if stage is None:
            raise TrialsError('only the simulated robot can be pushed: write robot = "sim"')
        angle = stage.truth().torso.heading + direction
        stage.push((newtons * math.cos(angle), newtons * math.sin(angle), 0.0), seconds)

    def _move(self, name: str, to: dict[str, float]) -> None:
        robot = self._behavior.robot
        stage = robot.device.stage
        if to.keys() <= {*_CARRIED}:
            robot.ball(name).place(**to)
            return
        if stage is None or not to.keys() <= {"x", "y", "z"}:
            raise TrialsError(
                f"{name} cannot be moved to {', '.join(to)}: write x, y and z, or {', '.join(_CARRIED)}"
            )
        at = stage.truth().objects.get(name)
        here = dict(zip("xyz", at.position, strict=True)) if at is not None else {}
        place = (here | to).get
        try:
            stage.place_object(name, (place("x", 0.0), place("y", 0.0), place("z", 0.0)))
        except InvalidCommand as error:
            raise TrialsError(f"{name} cannot be moved there: {error}") from error

    def _delay_pictures(self) -> None:
        """Let pictures pass through a queue, from which old ones come while they are late."""
        behavior = self._behavior
        for name, proxy in proxies_of(behavior.component).items():
            camera = behavior.world.network.servant(proxy.identity)
            if camera is not None and _PICTURES in camera.ice_interface.all_operations:
                current = Current(proxy.identity, _PICTURES, "", 0.0, behavior.world.communicator)
                behavior.stub(name, getImageData=_LatePictures(self, camera, current))

    def now(self) -> float:
        """Return the time of the world in s."""
        return self._behavior.world.clock.now()


class _LatePictures:
    """A camera whose pictures arrive late: it returns the newest that was taken long enough ago."""

    def __init__(self, disturbances: Disturbances, camera: Any, current: Current) -> None:  # noqa: ANN401
        self._disturbances = disturbances
        self._camera = camera
        self._current = current
        self._taken: deque[tuple[float, Any]] = deque()

    def __call__(self, *arguments: object) -> Any:  # noqa: ANN401 - a picture
        now, delay = self._disturbances.now(), self._disturbances.delay
        self._taken.append((now, self._camera.getImageData(*arguments, self._current)))
        while len(self._taken) > 1 and self._taken[1][0] <= now - delay:
            self._taken.popleft()
        return self._taken[0][1]
