"""The footsteps: when which foot goes where, and where the zero moment point has to be meanwhile.

A step ends with the foot where the capture point, as the pendulum foretells it, is then at the right
distance: that of the periodic walk with the commanded velocity. So a robot that is pushed steps there where
it catches itself. Small errors are left to the zero moment point, which can move within the sole. Places on
the floor are complex numbers, x + iy, in m, in the frame of the odometer.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum, auto
from typing import Final

from naoserver.bodies.capabilities import STILL, WalkVelocity
from naoserver.bodies.footsteps import Footsteps
from naoserver_sim._footsteps.limbs import LEFT, RIGHT
from naoserver_sim._locomotion import nearer


@dataclass(frozen=True, slots=True)
class Pendulum:
    """The linear inverted pendulum of a body in a step of `step_time` s: its capture point, in closed form.

    The body is a point mass at constant height over the zero moment point (Kajita et al., IROS 2001). Its
    capture point moves away from there exponentially (Englsberger et al., IEEE Trans. Robotics 31, 2015). In
    the double support at the beginning of a step the zero moment point passes evenly from the old foot to the
    new one.
    """

    frequency: float
    """Natural frequency in 1/s."""
    double_support: float
    """In s."""
    step_time: float

    def growth(self, time: float) -> float:
        """Return the growth of a distance from the new foot from a time in s to the step's end."""
        return math.exp(self.frequency * (self.step_time - time))

    def pulled(self, time: float) -> float:
        """Return by how much the rest of load on the old foot moves the end, in ways from old to new foot.

        It is the integral of the zero moment point's way from a time in s to the end of the step.
        """
        if time >= self.double_support:
            return 0.0
        return self._antiderivative(self.double_support) - self._antiderivative(time)

    def end(self, point: complex, time: float, old: complex, new: complex) -> complex:
        """Return where a capture point that is at `point` at a time will be at the step's end."""
        return new + self.growth(time) * (point - new) + self.pulled(time) * (new - old)

    def start(self, end: complex, time: float, old: complex, new: complex) -> complex:
        """Return where the capture point must be at a time to be at `end` at the step's end."""
        return new + (end - new - self.pulled(time) * (new - old)) / self.growth(time)

    def offset(self, width: float, stride: complex) -> complex:
        """Return capture point less new foot at the beginning of each step of a periodic walk.

        `stride` is the way of the body in a step, in the frame of its heading. `width` in m is the distance
        of the old foot from the new one to the left: it is negative when the new one is the left one.
        """
        growth, pulled = self.growth(0.0), self.pulled(0.0)
        return stride * (1.0 - pulled) / (growth - 1.0) + 1j * width * (1.0 + pulled) / (1.0 + growth)

    def _antiderivative(self, time: float) -> float:
        share = time / self.double_support
        return self.growth(time) * (share - 1.0 + 1.0 / (self.frequency * self.double_support))


_LOST_FORWARD: Final = 0.85
"""Part of half a sole's length beyond which a standing robot makes a step."""
_LOST_ASIDE: Final = 0.5
"""The same to a side, as a part of the width between the feet."""
_TIPPING: Final = 0.3
"""Part of the width between the feet beyond which the weight is already on one foot."""
_READY: Final = 0.01
"""Distance in m from its place for a first step at which the capture point is there."""
_LONGEST_SHIFT: Final = 0.5
"""Seconds after which the first step begins in any case."""
_WITHIN_SOLE: Final = 0.7
"""Part of half a sole within which the zero moment point moves in a step."""
_STEADY: Final = 0.15
"""Part of that within which it moves in a steady walk."""
_DECIDED: Final = 0.06
"""Seconds before the end of a step from which the foot's place is fixed."""
_TARGET_LIFE: Final = 0.0194
"""Seconds in which the target of a foot makes half of its way to a new place."""
_LANDING: Final = 0.03
"""Seconds before the end of a step at which the foot reaches the floor."""
_FAR: Final = 0.8
"""Part of the reach beyond which a step is made earlier."""
_WIDE: Final = 0.85
"""The same for the largest width."""
_SOONER: Final = 1.5
"""Seconds by which a step becomes shorter in a second."""
_LEAST_REST: Final = 0.08
"""Seconds that it still takes then."""
_NARROW: Final = 0.06
"""Range of widths in m below the narrowest one in which a step is made later."""
_LATER: Final = 1.0
"""Seconds by which a step becomes longer in a second."""
_LONGEST_STEP: Final = 1.25
"""Longest step as a multiple of the usual one."""
_BLOCKED: Final = 0.045
"""Distance in m before its target at which a foot lands that has met something."""
_THROWN: Final = 0.13
"""Distance in m before its usual place at which a foot catches a body that is held back."""
_CALM: Final = 0.06
"""Distance in m from its usual place at which a step counts as calm."""
_CALM_STEPS: Final = 3
"""Calm steps on the spot after which the walk ends, once the feet are side by side."""
_BESIDE: Final = 0.03
"""Distance in m from beside the other foot at which a last step ends there: motions from wide feet fall."""
_MOST_STEPS: Final = 20
"""Steps since the velocity is 0 after which the walk ends, calm or not."""
_REST: Final = 0.5
"""Seconds for which a robot that ended a walk without calm only stands: others see that it has ended."""
_LARGEST_ERROR: Final = 0.15
"""Largest distance in m from the commanded way that a step makes up for."""
_LARGEST_TURN: Final = 0.5
"""Largest turn of a step in rad."""
_SLOWING: Final = 2.0
"""Factor by which a velocity may change more from one step to the next if it becomes smaller."""


class Phase(Enum):
    """What the feet do."""

    STANDING = auto()
    SHIFTING = auto()
    """Both feet are on the floor, and the weight moves to the first foot of support."""
    STEPPING = auto()


@dataclass(slots=True)
class Foot:
    """Where a foot is planned to be: the middle of its sole, its heading in rad, its height in m."""

    place: complex
    heading: float
    height: float = 0.0


@dataclass(slots=True)
class _Step:
    """A step that is being made."""

    pendulum: Pendulum
    stride: complex
    """Way of the body in m, in the frame of the foot of support."""
    heading: float
    """Heading of the foot at the end."""
    begin: Foot
    """The swinging foot at the beginning."""
    ahead: complex
    """Direction of the foot of support."""
    usual: complex
    """Where the foot would end in an undisturbed walk."""
    offset: complex
    """Capture point less foot at the end of such a walk's step."""
    time: float = 0.0
    target: complex | None = None
    deviation: float = 0.0
    """Distance in m of the target from its usual place."""


class Steps:
    """Plan the steps; `tick` is due at each control tick.

    `locate` returns the place and the heading at which a foot is measured to be.
    """

    def __init__(self, footsteps: Footsteps, locate: Callable[[int], tuple[complex, float]]) -> None:
        self._footsteps = footsteps
        self._locate = locate
        self._within = tuple(_WITHIN_SOLE * half for half in footsteps.sole_half)
        self._usual = Pendulum(footsteps.frequency, footsteps.double_support, footsteps.step_time)
        self.phase = Phase.STANDING
        self.support = LEFT
        """The foot that bears the robot in a step."""
        self.zmp = 0j
        """Where the zero moment point has to be."""
        self.count = 0
        """Number of steps that have ended."""
        self.held_back = False
        """True if something kept the last step from its way."""
        self.feet = [Foot(0.5j * footsteps.width, 0.0), Foot(-0.5j * footsteps.width, 0.0)]
        """Left and right foot."""
        self.steady = False
        """Whether the capture point in the present step is about where it is planned to be."""
        self._step: _Step | None = None
        self._shifted = 0.0  # seconds
        self._tipping = False
        self._stopping = 0  # steps since the velocity is 0
        self._calm = 0  # calm ones of these, the last ones
        self._rest = 0.0  # seconds for which it takes no step
        self._velocity = STILL  # of the present step
        self._path = Foot(0j, 0.0)  # of the body, as commanded

    @property
    def shares(self) -> tuple[float, float]:
        """Parts of the weight that the left and the right foot bear."""
        step = self._step
        if step is None:
            return 0.5, 0.5
        share = min(step.time / self._footsteps.double_support, 1.0)
        return (share, 1.0 - share) if self.support == LEFT else (1.0 - share, share)

    @property
    def on_one_foot(self) -> bool:
        """Whether the foot of support bears everything."""
        return self._step is not None and self._step.time >= self._footsteps.double_support

    @property
    def left(self) -> float:
        """Seconds until the present step ends; 0 between steps."""
        return 0.0 if self._step is None else self._step.pendulum.step_time - self._step.time

    @property
    def heading(self) -> float:
        """The mean of both headings."""
        return 0.5 * (self.feet[LEFT].heading + self.feet[RIGHT].heading)

    @property
    def middle(self) -> complex:
        """The place between the feet."""
        return 0.5 * (self.feet[LEFT].place + self.feet[RIGHT].place)

    def stand(self) -> None:
        """Stand at once on both feet, where they are."""
        self.feet = [Foot(*self._locate(LEFT)), Foot(*self._locate(RIGHT))]
        self.phase = Phase.STANDING
        self.zmp = self.middle
        self._step = None
        self._velocity = STILL
        self._rest = 0.0

    def tick(self, seconds: float, point: complex, velocity: WalkVelocity, *, firm: bool = True) -> None:
        """Advance by some seconds, with the capture point at `point`, towards a velocity.

        Only a robot that stands `firm` begins to step.
        """
        if self.phase is Phase.STANDING:
            self._balance(point)
            self._rest -= seconds
            if firm and self._rest <= 0.0:
                self._leave(point, velocity)
        if self.phase is Phase.SHIFTING:
            self._shift(seconds, point, velocity)
        step = self._step
        if step is not None:
            step.time += seconds
            if step.time >= step.pendulum.step_time:
                self._land(step, velocity)
                step = self._step
        if step is not None:
            self._swing(seconds, step, point)
        elif self.phase is Phase.STANDING:
            self._balance(point)

    # -- standing ----------------------------------------------------------------------------------------

    def _balance(self, point: complex) -> None:
        self.zmp = self.middle + (1.0 + self._footsteps.standing_gain) * (point - self.middle)

    def _leave(self, point: complex, velocity: WalkVelocity) -> None:
        """Begin to shift the weight when it is to walk, or when only a step can catch it."""
        error = (point - self.middle) * cmath.rect(1.0, -self.heading)
        width, half = self._footsteps.width, self._footsteps.sole_half[0]
        lost = abs(error.real) > _LOST_FORWARD * half or abs(error.imag) > _LOST_ASIDE * width
        if not lost and velocity == STILL:
            return
        self.phase = Phase.SHIFTING
        self.support = RIGHT if lost and error.imag < 0.0 else LEFT
        self._shifted = 0.0
        self._stopping = self._calm = 0
        self._tipping = abs(error.imag) > _TIPPING * width
        self._path = Foot(self.middle, self.heading)

    def _shift(self, seconds: float, point: complex, velocity: WalkVelocity) -> None:
        """Press with the foot that is to lift until the capture point has come to the other one's side."""
        foot, lifting = self.feet[self.support], self.feet[1 - self.support]
        ahead = cmath.rect(1.0, self.heading)
        falling = (1.0 + self._footsteps.standing_gain) * ((point - self.middle) / ahead).real
        self.zmp = lifting.place + _limited(falling, _WITHIN_SOLE * self._footsteps.sole_half[0]) * ahead
        self._shifted += seconds
        distance = ((point - foot.place) * cmath.rect(1.0, -foot.heading)).imag
        wanted = self._offset(self.support, 0j).imag
        if abs(distance) <= abs(wanted) + _READY or self._shifted > _LONGEST_SHIFT or self._tipping:
            self._begin(self.support, velocity)

    # -- stepping ----------------------------------------------------------------------------------------

    def _approach(self, wanted: WalkVelocity) -> WalkVelocity:
        """Return the velocity of the next step, a bit nearer to the wanted one."""
        most, wanted = self._footsteps.changes, self._footsteps.possible(wanted)
        self._velocity = WalkVelocity(
            nearer(self._velocity.forward, wanted.forward, most.forward, _SLOWING),
            nearer(self._velocity.left, wanted.left, most.left, _SLOWING),
            nearer(self._velocity.turn, wanted.turn, most.turn, _SLOWING),
        )
        return self._velocity

    def _outwards(self, foot: int) -> float:
        return 1.0 if foot == LEFT else -1.0

    def _offset(self, foot: int, stride: complex) -> complex:
        """Return capture point less foot when its support begins, in the frame of the heading."""
        return self._usual.offset(-self._outwards(foot) * self._footsteps.width, stride)

    def _begin(self, support: int, velocity: WalkVelocity) -> None:
        """Begin a step on a foot, which leads back to the commanded way."""
        footsteps, foot, path = self._footsteps, self.feet[support], self._path
        velocity = self._approach(velocity)
        ahead = cmath.rect(1.0, foot.heading)
        middle = foot.place - 0.5j * self._outwards(support) * footsteps.width * ahead
        turn = path.heading + velocity.turn * footsteps.step_time - foot.heading
        heading = foot.heading + max(-_LARGEST_TURN, min(_LARGEST_TURN, turn))
        missed = (path.place - middle) / ahead
        missed = complex(_limited(missed.real, _LARGEST_ERROR), _limited(missed.imag, _LARGEST_ERROR))
        stride = complex(velocity.forward, velocity.left) * footsteps.step_time
        self._path = Foot(middle + missed * ahead + stride * cmath.rect(1.0, heading), heading)
        stride += missed * footsteps.place_gain * footsteps.step_time
        swing, then = 1 - support, cmath.rect(1.0, heading)
        half_width = 0.5j * self._outwards(swing) * footsteps.width
        usual = foot.place + (half_width + stride) * ahead + half_width * then
        offset = self._offset(swing, stride) * then
        begin = replace(self.feet[swing])
        self._step = _Step(self._usual, stride, heading, begin, ahead, usual, offset)
        self.support = support
        self.phase = Phase.STEPPING

    def _land(self, step: _Step, velocity: WalkVelocity) -> None:
        """Let the swinging foot bear the robot, and begin the next step or end the walk."""
        landed = 1 - self.support
        place, heading = self._locate(landed)
        before, planned = self.feet[landed].heading, self.feet[landed].place
        self.feet[landed] = Foot(place, before + math.remainder(heading - before, math.tau))
        self.count += 1
        way = step.stride * cmath.rect(1.0, self.feet[self.support].heading)
        short, missed = (_along(way, wanted - place) for wanted in (step.usual, planned))
        self.held_back = short > _THROWN or missed > _BLOCKED
        if self.held_back:
            self._path = Foot(self.middle, self.heading)  # it makes up for nothing
        self._stopping = self._stopping + 1 if velocity == STILL else 0
        calm = self._velocity == velocity == STILL and step.deviation < _CALM
        self._calm = self._calm + 1 if calm else 0
        apart = (self.feet[LEFT].place - self.feet[RIGHT].place) * cmath.rect(1.0, -self.heading)
        even = abs(apart - 1j * self._footsteps.width) < 0.5 * _BESIDE
        settled = even and self._calm >= _CALM_STEPS
        if settled or self._stopping == _MOST_STEPS:
            self._step = None
            self._velocity = STILL
            self._rest = 0.0 if settled else _REST
            self.phase = Phase.STANDING
        else:
            self._begin(landed, velocity)

    def _swing(self, seconds: float, step: _Step, point: complex) -> None:
        """Choose zero moment point and target, and move the swinging foot."""
        support, ahead, old = self.feet[self.support], step.ahead, step.begin.place
        planned = step.pendulum.start(step.usual + step.offset, step.time, old, support.place)
        error = self._footsteps.walking_gain * (point - planned) / ahead
        length, width = self._within
        moved = complex(_limited(error.real, length), _limited(error.imag, width))
        self.steady = abs(error.real) < _STEADY * length and abs(error.imag) < _STEADY * width
        loaded = min(step.time / self._footsteps.double_support, 1.0)
        self.zmp = old + loaded * (support.place - old) + moved * ahead
        if step.time < step.pendulum.step_time - _DECIDED:
            # The zero moment point can stay where it is once the support foot bears everything.
            center = self.zmp if loaded == 1.0 else support.place
            end = step.pendulum.end(point, step.time, old, center)
            wanted = (end - step.offset - support.place) / ahead
            middle = (step.usual - support.place) / ahead
            self._aim(seconds, step, wanted, middle, ahead)
        self._move(step)

    def _aim(self, seconds: float, step: _Step, wanted: complex, usual: complex, ahead: complex) -> None:
        """Take a target for the swinging foot, in the support foot's frame, as far as it can reach it."""
        footsteps = self._footsteps
        outwards = self._outwards(1 - self.support)
        aside = outwards * wanted.imag
        if step.time > footsteps.double_support:
            self._hurry(seconds, step, abs(wanted.real), aside)
        aside = min(max(aside, footsteps.narrowest), footsteps.widest)
        target = complex(_limited(wanted.real, footsteps.reach), outwards * aside)
        step.deviation = abs(target - usual)
        beside = 1j * outwards * footsteps.width
        if self._calm >= _CALM_STEPS - 1 and abs(target - beside) < _BESIDE:
            target = beside
        place = self.feet[self.support].place + target * ahead
        left = 0.5 ** (seconds / _TARGET_LIFE)
        step.target = place if step.target is None else place + left * (step.target - place)

    def _hurry(self, seconds: float, step: _Step, forward: float, aside: float) -> None:
        """Make a step that would become too long sooner, one that would become too narrow later."""
        footsteps, pendulum = self._footsteps, step.pendulum
        time = pendulum.step_time
        if forward > _FAR * footsteps.reach or aside > _WIDE * footsteps.widest:
            time = min(time, max(time - seconds * _SOONER, footsteps.shortest_step, step.time + _LEAST_REST))
        elif footsteps.narrowest - _NARROW < aside < footsteps.narrowest:
            time = min(time + seconds * _LATER, _LONGEST_STEP * footsteps.step_time)
        if time != pendulum.step_time:
            step.pendulum = replace(pendulum, step_time=time)

    def _move(self, step: _Step) -> None:
        """Move the swinging foot along a path of least jerk, up and down as well."""
        double_support = self._footsteps.double_support
        duration = step.pendulum.step_time - double_support - _LANDING
        passed = min(max((step.time - double_support) / duration, 0.0), 1.0)
        eased = passed**3 * (10.0 - 15.0 * passed + 6.0 * passed**2)
        begin, foot = step.begin, self.feet[1 - self.support]
        assert step.target is not None
        foot.place = begin.place + eased * (step.target - begin.place)
        foot.heading = begin.heading + eased * (step.heading - begin.heading)
        foot.height = self._footsteps.lift * 16.0 * passed**2 * (1.0 - passed) ** 2


def _along(way: complex, distance: complex) -> float:
    """Return the part of a distance that leads along a way."""
    return (distance * way.conjugate()).real / max(abs(way), 1e-9)


def _limited(value: float, most: float) -> float:
    return max(-most, min(most, value))
