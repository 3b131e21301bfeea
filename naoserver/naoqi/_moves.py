"""Motions that NAOqi controls: ALMotion's walk, and ALRobotPosture's ways into postures."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from dataclasses import astuple, replace
from typing import Any, Final

from interfaces.nao import Severity
from naoserver._naoqi_names import gait_limits
from naoserver.capabilities import STILL, Odometry, PostureProgress, WalkVelocity
from naoserver.errors import CommandRefused, HardwareFailure, InvalidCommand
from naoserver.hardware.background import BackgroundCalls, CoalescingQueue, Poll
from naoserver.hardware.connection import CallConnection
from naoserver.hardware.link import CallFailed, CallLink, LinkLost, Reply, call
from naoserver.hardware.reporter import Reporter
from naoserver.naoqi._state import NaoqiState
from naoserver.robot import LIMP
from zenoh_ice import Clock

_RESTING_PERIOD: Final = 0.2
"""Seconds between two requests for the odometry while it stands."""
_POSTURE_PERIOD: Final = 0.5
"""Seconds between two requests for its posture."""
_ENDED: Final = 0.3
"""Seconds for which NAOqi has to report the end of a walk before it is believed."""
_STUBBORN: Final = 1.0
"""Seconds after a stop, more than a step takes, after which it is repeated."""
_LOST: Final = "the robot was lost"
_USUAL: Final = {"MaxStepX": 0.04, "MaxStepY": 0.14, "MaxStepTheta": 0.349, "MaxStepFrequency": 1.0}
_POSITION: Final = "ALMotion.getRobotPosition"


class NaoqiWalker:
    """The walk of a robot. Implements Walker.

    NAOqi walks on until it is stopped, even when this process is gone: after the loss of the connection,
    the walk ends only when the robot is found again.
    """

    lag = 0.0

    def __init__(
        self, connection: CallConnection, state: NaoqiState, clock: Clock, reporter: Reporter
    ) -> None:
        self._connection = connection
        self._state = state
        self._clock = clock
        self._lock = threading.Lock()
        self._reporter = reporter
        self._velocities: CoalescingQueue[WalkVelocity] = CoalescingQueue(
            "walk", connection, reporter, self._send, lambda velocity: velocity == STILL
        )
        self.joints: Final = state.facts.groups.legs
        self.limits = gait_limits(_USUAL)
        self._commanded = STILL
        self.walking = False  # according to NAOqi
        self.balances: Final = False
        self._sent = 0.0  # when the newest command was given
        self._still_since: float | None = None
        self._stopping = False  # the walk was stopped, and the robot has not come to a stand since
        self.ended = ""
        self._newest: Reply | None = None  # to the newest command that was sent
        self._odometry = Odometry(clock.now(), 0.0, 0.0, 0.0)
        self.questions: Final = (
            Poll(reporter, clock.now, self._period, self._take_position, _POSITION, True),
            Poll(reporter, clock.now, self._period, self._take_active, "ALMotion.moveIsActive"),
        )

    def open(self, link: CallLink) -> None:
        """End an earlier walk, and find out how fast the robot walks."""
        call(link, "ALMotion.stopMove")
        try:
            answer = call(link, "ALMotion.getMoveConfig", "Default")
            config = {str(name): float(value) for name, value in answer}
        except (CallFailed, TypeError, ValueError):
            config = {}
        self.limits = gait_limits({**_USUAL, **config})

    def close(self) -> None:
        """End the walk, and the thread."""
        if self.walking or self._commanded != STILL:
            self.command(STILL)
        self._velocities.close()

    @property
    def stopped(self) -> bool:
        """Whether the robot has answered every command, and none keeps it walking."""
        return self._commanded == STILL and self._velocities.idle

    def command(self, velocity: WalkVelocity) -> None:
        with self._lock:
            if velocity != STILL:
                self._check()
                if velocity == self._commanded:
                    return  # NAOqi itself continues the walk
            elif self._commanded == STILL and not self.walking:
                return
            self._commanded, self.ended = velocity, ""
            self._sent, self._still_since = self._clock.now(), None
            self._stopping = velocity == STILL
            self.walking = self.walking or velocity != STILL
            self._velocities.post({"velocity": velocity})

    def commanded(self) -> WalkVelocity:
        return self._commanded

    def odometry(self) -> Odometry:
        return self._odometry

    def forget(self) -> None:
        """Treat the walk as ended: the robot is lost, and stopped when it is found again."""
        with self._lock:
            self._velocities.forget()
            if self._commanded != STILL:
                self.ended = _LOST
            self._commanded = STILL
            self.walking = False
            self._stopping = False

    def _check(self) -> None:
        if self._connection.link is None:  # nothing would end a walk that began after `forget`
            raise InvalidCommand("velocity", f"the robot ended the walk: {_LOST}")
        if self._state.body().fallen:
            raise InvalidCommand("velocity", "the robot has fallen: make it stand up first")
        stiffnesses = zip(self._state.facts.joint_names, self._state.joints().stiffnesses, strict=True)
        limp = [joint for joint, value in stiffnesses if joint in self.joints and value < LIMP]
        if limp:
            message = f"{limp[0]} is limp: make the legs stiff, and let the robot stand, first"
            raise InvalidCommand("velocity", message)

    def _period(self) -> float:
        return self._connection.limits.period if self.walking else _RESTING_PERIOD

    def _take_position(self, answer: Any, asked: float) -> None:  # noqa: ANN401
        try:
            x, y, heading = (float(value) for value in answer)
        except (TypeError, ValueError):
            raise HardwareFailure(f"{_POSITION}: {str(answer)[:60]!r} is not a place") from None
        self._odometry = Odometry(asked, x, y, heading)

    def _take_active(self, answer: Any, asked: float) -> None:  # noqa: ANN401
        with self._lock:
            if answer:
                self.walking, self._still_since = True, None
                if self._stopping and asked - self._sent >= _STUBBORN and self._velocities.idle:
                    self._stop_again(asked)
            elif self.walking and asked > self._sent and self._velocities.idle:
                if self._still_since is None:
                    self._still_since = asked
                elif asked - self._still_since >= _ENDED:
                    if self._commanded != STILL:
                        self.ended = self._reason()
                    self._commanded = STILL
                    self.walking = False
                    self._stopping = False

    def _reason(self) -> str:
        """Return why the robot does not walk, though it was commanded to."""
        if self._newest is not None and self._newest.done:
            try:
                self._newest.result(0.0)
            except HardwareFailure as error:
                return f"it refused to walk: {error}"
        return "it has fallen" if self._state.body().fallen else "NAOqi stopped it, and does not say why"

    def _send(self, link: CallLink, commands: Mapping[str, WalkVelocity]) -> list[Reply]:
        velocity = commands["velocity"]
        if velocity == STILL:
            self._newest = link.begin("ALMotion.stopMove")
        else:
            self._newest = link.begin("ALMotion.move", *astuple(velocity))
        return [self._newest]

    def _stop_again(self, now: float) -> None:
        self._sent = now
        self._velocities.post({"velocity": STILL})
        message = "the robot walks on though it was stopped: the stop is repeated until it stands"
        self._reporter.report(Severity.Error, message, "walks on")


class NaoqiPostures:
    """The postures of a robot. Implements OwnPostures; `go` raises CommandRefused while the robot is lost."""

    def __init__(
        self,
        connection: CallConnection,
        calls: BackgroundCalls,
        reporter: Reporter,
        now: Callable[[], float],
    ) -> None:
        self._connection = connection
        self._calls = calls
        self._lock = threading.Lock()
        self.names: tuple[str, ...] = ()
        self._current = ""
        self._going: Reply | None = None
        self._stopped = False
        self._stop_at = 0.0  # when a stop is repeated
        self._now = now
        self._reporter = reporter
        self._progress = PostureProgress()
        self.question: Final = Poll(
            reporter, now, lambda: _POSTURE_PERIOD, self._take, "ALRobotPosture.getPosture"
        )

    def open(self, link: CallLink) -> None:
        """End an earlier way into a posture, and find out which postures the robot knows."""
        call(link, "ALRobotPosture.stopMove")
        self.names = tuple(str(name) for name in call(link, "ALRobotPosture.getPostureList"))

    def go(self, name: str, fraction: float) -> None:
        with self._lock:
            link = self._connection.link
            if link is None:
                raise CommandRefused("the robot is not connected")
            self._going = link.begin("ALRobotPosture.goToPosture", name, fraction)
            self._stopped = False
            self._progress = PostureProgress(name, moving=True)

    def stop(self) -> None:
        with self._lock:
            if self._going is None:
                return
            self._stopped, self._stop_at = True, self._now() + _STUBBORN
        try:
            self._calls.run("ALRobotPosture.stopMove", urgent=True)
        except LinkLost:
            self.forget()

    def current(self) -> str:
        return self._current

    def progress(self) -> PostureProgress:
        return self._progress

    def tick(self, _link: CallLink) -> None:
        """Check whether the way has ended, and repeat a stop that has not ended it."""
        with self._lock:
            going = self._going
            if going is None:
                return
            stubborn = self._stopped and not going.done and self._now() >= self._stop_at
        if stubborn:
            message = "the robot goes on into a posture though it was stopped: the stop is repeated"
            self._reporter.report(Severity.Error, message, "posture")
            self.stop()
        elif going.done:
            self._end(going)

    def _end(self, going: Reply) -> None:
        with self._lock:
            if self._going is not going:
                return
            self._going = None
            why = "it was stopped" if self._stopped else "the robot did not reach its goal"
            try:
                reached = bool(going.result(0.0))
            except LinkLost:  # its answer is the first that says so
                reached, why = False, _LOST
            except HardwareFailure as error:
                reached, why = False, str(error)
            message = "" if reached else why
            self._progress = replace(self._progress, moving=False, reached=reached, message=message)

    def forget(self) -> None:
        """Treat the way as ended: the robot is lost."""
        with self._lock:
            if self._going is not None:
                self._going = None
                self._progress = replace(self._progress, moving=False, message=_LOST)

    def _take(self, answer: Any, _asked: float) -> None:  # noqa: ANN401
        name = str(answer)
        self._current = name if name != "Unknown" and name in self.names else ""
