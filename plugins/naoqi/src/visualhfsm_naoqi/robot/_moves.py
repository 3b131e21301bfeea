"""Commands of motion: joints and walk as calls of ALMotion, postures as calls of ALRobotPosture."""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import astuple, dataclass, replace
from typing import Any, Final

from interfaces.nao import Severity
from naoserver.bodies.capabilities import STILL, Odometry, PostureProgress, WalkVelocity
from naoserver.errors import CommandRefused, HardwareFailure, InvalidCommand
from naoserver.hardware.connection import CallFailed, LinkLost, Reporter
from naoserver.protocol.robot import LIMP
from visualhfsm_naoqi._names import gait_limits
from visualhfsm_naoqi.robot._state import NaoqiState
from visualhfsm_naoqi.robot.background import BackgroundCalls, CoalescingQueue, Poll
from visualhfsm_naoqi.robot.calls import CallConnection, CallLink, Reply, call
from zenoh_ice import Clock
from zenoh_ice.data.text import sentence

_SLOWEST_FRACTION: Final = 0.002
"""Smallest fraction of a joint's full speed in a call."""
_FEW: Final = 4
"""Number of different speeds sent unchanged; more are rounded, because each needs its own call."""
_STEP: Final = math.log(1.1)
_HOLD_FRACTION: Final = 0.1
_SLOWLY: Final = "ALMotion.stiffnessInterpolation"


@dataclass(frozen=True, slots=True)
class Order:
    """Command for a joint: go to a target at a fraction of its full speed; without a target, stay."""

    target: float | None = None
    fraction: float = 0.0


class NaoqiJoints:
    """Command the joints of a robot, as in `JointDevice`; a lost robot gets no commands."""

    def __init__(
        self, connection: CallConnection, state: NaoqiState, calls: BackgroundCalls, reporter: Reporter
    ) -> None:
        self._state = state
        self._joints = {joint.name: joint for joint in state.facts.joints}
        self._calls = calls
        self.orders: Final[CoalescingQueue[Order]] = CoalescingQueue(
            "joints",
            connection,
            reporter,
            lambda link, orders: [link.begin(method, *given) for method, *given in calls_of(orders)],
            lambda order: order.target is None,
        )
        self._stiffnesses: CoalescingQueue[tuple[float, float]] = CoalescingQueue(
            "stiffness", connection, reporter, self._send_stiffnesses, lambda _change: False
        )
        self._stiffening = threading.Lock()
        self._in_doubt: dict[
            str, float
        ] = {}  # stiffnesses that were commanded while others were on their way

    def close(self) -> None:
        """Send the waiting commands, and end the threads."""
        self.orders.close()
        self._stiffnesses.close()

    def forget(self) -> None:
        """Drop all commands not yet sent: the robot is lost."""
        self.orders.forget()
        with self._stiffening:
            self._stiffnesses.forget()
            self._in_doubt = {}

    def tick(self, _link: CallLink) -> None:
        """Set stiffnesses once more that were in doubt: NAOqi may have run their calls in any order."""
        with self._stiffening:
            if self._in_doubt and self._stiffnesses.idle and not self._calls.runs(_SLOWLY):
                self._stiffnesses.post({joint: (value, 0.0) for joint, value in self._in_doubt.items()})
                self._in_doubt = {}

    def command_positions(self, targets: Mapping[str, float], max_speeds: Mapping[str, float]) -> None:
        self._send({joint: (target, max_speeds[joint]) for joint, target in targets.items()})

    def command_velocities(self, velocities: Mapping[str, float]) -> None:
        held = [joint for joint, velocity in velocities.items() if velocity == 0.0]
        if held:
            self._state.hold(held)
            self.orders.post(dict.fromkeys(held, Order()))
        ways = {}
        for joint, velocity in velocities.items():
            if velocity != 0.0:
                facts = self._joints[joint]
                ways[joint] = (facts.upper if velocity > 0.0 else facts.lower, abs(velocity))
        self._send(ways)

    def command_stiffnesses(self, stiffnesses: Mapping[str, float], seconds: float) -> None:
        with self._stiffening:
            if self._in_doubt or self._calls.runs(_SLOWLY):
                self._in_doubt.update(stiffnesses)
            self._stiffnesses.post({joint: (value, seconds) for joint, value in stiffnesses.items()})

    def _send(self, ways: Mapping[str, tuple[float, float]]) -> None:
        orders = {}
        for joint in self._state.send(ways):
            target, speed = ways[joint]
            orders[joint] = Order(target, speed / self._joints[joint].max_velocity)
        if orders:
            self.orders.post(orders)

    def _send_stiffnesses(self, link: CallLink, wanted: Mapping[str, tuple[float, float]]) -> list[Reply]:
        at_once = {joint: value for joint, (value, seconds) in wanted.items() if seconds <= 0.0}
        slowly = {joint: change for joint, change in wanted.items() if change[1] > 0.0}
        if slowly:  # it answers when the last motor has arrived: the next change does not wait for that
            columns = ([[part] for part in column] for column in zip(*slowly.values(), strict=True))
            self._calls.run(_SLOWLY, list(slowly), *columns)
        if not at_once:
            return []
        return [link.begin("ALMotion.setStiffnesses", list(at_once), list(at_once.values()))]


def calls_of(orders: Mapping[str, Order]) -> list[tuple[str, list[str], list[float], float]]:
    """Return the calls that carry out orders: method, joints, values and the fraction of full speed.

    setAngles takes one fraction for all its joints, so there is a call for each fraction. If there are many,
    they are rounded down, by less than a tenth.
    """
    held = [joint for joint, order in orders.items() if order.target is None]
    targets = {joint: order.target for joint, order in orders.items() if order.target is not None}
    fractions = {joint: min(1.0, max(_SLOWEST_FRACTION, orders[joint].fraction)) for joint in targets}
    if len(set(fractions.values())) > _FEW:
        for joint, fraction in fractions.items():
            rounded = math.exp(math.floor(math.log(fraction) / _STEP + 1e-9) * _STEP)
            fractions[joint] = max(_SLOWEST_FRACTION, rounded)
    groups: dict[float, list[str]] = {}
    for joint, fraction in fractions.items():
        groups.setdefault(fraction, []).append(joint)
    calls = [
        ("ALMotion.setAngles", joints, [targets[joint] for joint in joints], fraction)
        for fraction, joints in groups.items()
    ]
    if held:
        # Relative to their present setpoints, which only the robot knows at this moment.
        calls.append(("ALMotion.changeAngles", held, [0.0] * len(held), _HOLD_FRACTION))
    return calls


_RESTING_PERIOD: Final = 0.2
"""Seconds between two requests for the odometry while it stands."""
_POSTURE_PERIOD: Final = 0.5
"""Seconds between two requests for its posture."""
_ENDED: Final = 0.3
"""Seconds for which NAOqi has to report the end of a walk before it is believed."""
_STUBBORN: Final = 1.0
"""Seconds after a stop, more than a step takes, after which it is repeated."""
_LOST: Final = sentence("the robot was lost")
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
        self.failed: Final = False  # NAOqi does not say
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
            why = _LOST
            raise InvalidCommand("velocity", f"the robot ended the walk: {why}")
        if self._state.body().fallen:
            raise InvalidCommand("velocity", "the robot has fallen: make it stand up first")
        stiffnesses = zip(self._state.facts.joint_names, self._state.joints().stiffnesses, strict=True)
        limp = [joint for joint, value in stiffnesses if joint in self.joints and value < LIMP]
        if limp:
            message = sentence(f"{limp[0]} is limp: make the legs stiff, and let the robot stand, first")
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
                return sentence(f"it refused to walk: {error}")
        if self._state.body().fallen:
            return sentence("it has fallen")
        return sentence("NAOqi stopped it, and does not say why")

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
        self, connection: CallConnection, calls: BackgroundCalls, reporter: Reporter, now: Callable[[], float]
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
            reporter, now, lambda: _POSTURE_PERIOD, self._receive, "ALRobotPosture.getPosture"
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

    def _receive(self, answer: Any, _asked: float) -> None:  # noqa: ANN401
        name = str(answer)
        self._current = name if name != "Unknown" and name in self.names else ""
