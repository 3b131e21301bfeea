"""Walk and balance of a body that holds angles: commanded from any thread, computed at each tick."""

from __future__ import annotations

import cmath
import math
from enum import Enum, auto
from typing import Final

import numpy as np
from numpy.typing import NDArray

from naoserver.bodies.capabilities import STILL, Odometry
from naoserver.bodies.footsteps import Footsteps
from naoserver_sim._footsteps.estimator import BodySensors, Estimator, Loads
from naoserver_sim._footsteps.limbs import LEFT, RIGHT, Array, Limbs
from naoserver_sim._footsteps.motion import PlannedMotion, SupportTorques
from naoserver_sim._footsteps.posture import HeldPosture
from naoserver_sim._footsteps.steps import Phase, Steps
from naoserver_sim._locomotion import LYING, MOVED, OFF_ITS_FEET, STUCK, TILT, ArmSwing, Locomotion, limp
from naoserver_sim._simulator import Simulator
from zenoh_ice.data.text import sentence

_HANGING: Final = math.radians(45)
"""Angle to the vertical below which an arm hangs."""
_FASTEST_SWING: Final = 3.0
"""Highest speed of a shoulder in rad/s."""


_STEPS_LATE: Final = 2.0
"""Steps until it walks at a commanded velocity."""
_LEANING: Final = math.radians(20)
"""Tilt of the trunk beyond which stiff legs would not help a limp robot: it falls."""
_BORNE: Final = 0.3
"""Least part of its weight that the feet of a standing robot bear."""
_CARRIES: Final = 0.1
"""Least share of the load with which a foot carries a robot whose legs are held."""
_CALM: Final = 0.02
"""Distance in m of the capture point from the middle between the feet within which a robot stands calmly."""
_CALM_PERIOD: Final = 0.03
"""Seconds between two corrections of a robot that stands calmly."""
_CALM_RATE: Final = 0.05
"""Turning rate in rad/s about each axis up to which it stands calmly: a push is answered at once."""
_ROUNDING: Final = 1e-6  # s
_STEADY_PERIOD: Final = 0.02
"""Seconds between two plans of the legs of a robot that walks steadily: between them they go on as before."""
_FOLLOWING: Final = "its legs follow commands with gains"
_HEADWAY_PERIOD: Final = 0.05 - _ROUNDING
"""Seconds between two looks at whether it gets on, which takes more than a second."""
_LOADS_PERIOD: Final = 0.1
"""Seconds between two estimates of the loads of the feet while it balances: they are smoothed more slowly."""
_RESTING: Final = 0.5
"""Seconds of rest after which legs that are held near the stance balance again."""


class _Stage(Enum):
    LOST = auto()
    """It lies, is limp or carried: the legs are left alone."""
    HELD = auto()
    """The legs hold the angles that somebody commands."""
    BALANCED = auto()
    """The legs are moved here, to stand or to walk."""


class FootstepWalker(Locomotion):
    """Move the setpoints of the legs, and of arms that hang, at each control tick.

    It balances from the start, whenever it is on its feet
    and its legs are stiff, and steps when only a step can catch it. Legs that somebody else commands hold
    their angles, until they rest near the stance or the robot is to walk. To the motors it adds the torques
    that this needs, as offsets of their angles beside the setpoints.

    It uses what the `sensors` of a body measure: angles, speeds and torques of its joints, and the inertial
    unit of its base. `latency` is that of its commands to the motors in s, beside that of the sensors.
    """

    def __init__(
        self,
        footsteps: Footsteps,
        limbs: Limbs,
        simulator: Simulator,
        sensors: BodySensors,
        *,
        joints: tuple[str, ...] = (),
        latency: float = 0.0,
    ) -> None:
        super().__init__(simulator, joints, footsteps.limits)
        mj = simulator.mj
        self.lag = _STEPS_LATE * footsteps.step_time
        self._footsteps = footsteps
        self._limbs = limbs
        self._setpoints = simulator.setpoints
        self._sensors = sensors
        self._late = latency + sensors.delay * simulator.tick_period  # from a movement to the answer in s
        self._estimator = Estimator(mj, limbs, footsteps)
        self._loads = Loads(mj, limbs, self._estimator)
        self._steps = Steps(footsteps, self._locate)
        self._motion = PlannedMotion(mj, limbs, footsteps, self._estimator)
        self._torques = SupportTorques(mj, limbs, footsteps, self._estimator)
        self._held = HeldPosture(mj, limbs, footsteps)
        self._arms = ArmSwing(self._setpoints, [limbs.motors[list(arm.joints)] for arm in limbs.arms])
        self._damping = mj.dof_damping[limbs.leg_dofs]
        self._gains, self._biases = simulator.motors.gains[:, 0], simulator.motors.biases[:, 2]
        self._stiff: tuple[Array, str] | None = None  # stiffnesses, and why the legs do not move with them
        self._seen = self._setpoints.setpoints  # of the last tick
        self._legs = self._seen[limbs.leg_motors]
        self._still = np.zeros(mj.nv)
        self._stage = _Stage.LOST
        self._rested = 0.0  # seconds for which commanded legs have not moved
        self._unloaded = 0.0  # seconds since the loads of the feet were estimated
        self._since = 0.0  # seconds since it was balanced
        self._zmp = 0j  # from then on
        self._pause = 0.0  # seconds until it is balanced again
        self._given = self._legs  # commands to the motors of the legs then
        self._drift = self._no_drift = np.zeros_like(self._legs)  # how they change from then on, in rad/s
        self._unchecked = 0.0  # seconds since its headway was looked at
        self._restart()

    # -- from any thread ---------------------------------------------------------------------------------

    @property
    def walking(self) -> bool:
        return self._commanded != STILL or self._steps.phase is not Phase.STANDING

    def odometry(self) -> Odometry:
        heading = math.pi - (math.pi - self._estimator.heading) % math.tau
        x, y, _ = self._estimator.origin.tolist()
        return Odometry(self._simulator.newest().time, x, y, heading)

    # -- in the thread of the physics --------------------------------------------------------------------

    def tick(self, seconds: float) -> None:
        """Move the legs, and arms that hang, and update the odometry."""
        resting = self._steps.phase is Phase.STANDING and self._stage is not _Stage.LOST
        self._estimator.turn(seconds, self._sensors.inertial(), resting=resting)
        self._since += seconds
        pausing = not resting or (self._estimator.turning < _CALM_RATE and self._velocity == STILL)
        if pausing and self._since < self._pause - _ROUNDING:
            self._simulator.commands[self._limbs.leg_motors] = self._given + self._since * self._drift
            return
        since, self._since, self._pause = self._since, 0.0, 0.0
        self._move(since)

    def _move(self, seconds: float) -> None:
        self._measure(seconds)
        hindrance = self._hindrance(self._simulator.motors.stiffnesses)
        if hindrance:
            self._lose(hindrance)
            return
        self._unchecked += seconds
        if self._unchecked >= _HEADWAY_PERIOD:
            stepping = self._steps.phase is Phase.STEPPING
            velocity = self._footsteps.possible(self._commanded) if stepping else STILL
            tilt = self._sensors.inertial().tilt
            self._check_headway(self._unchecked, velocity, self.odometry(), tilt)
            self._unchecked = 0.0
        if self._stage is _Stage.LOST:
            self._stage = _Stage.HELD
            self.balances = True
            self._zmp = self._estimator.capture_point
        setpoints = self._setpoints.setpoints
        legs = setpoints[self._limbs.leg_motors]
        moved = setpoints is not self._seen and legs.tolist() != self._legs.tolist()
        if self._stage is _Stage.BALANCED and moved and not self.walking:
            self._stage = _Stage.HELD
        if self._stage is _Stage.HELD:
            self._hold(seconds, legs, moved=moved)
        if self._stage is _Stage.BALANCED:
            self._balance(seconds)
        self._seen = self._setpoints.setpoints
        self._legs = self._seen[self._limbs.leg_motors]

    def abandon(self, why: str = MOVED) -> None:
        """End the walk at once, the legs where they are: the robot fell, or was placed elsewhere."""
        self._lose(why)
        self._restart()

    def _restart(self) -> None:
        """Let the robot have stood here for a while."""
        self._stage = _Stage.LOST
        self._pause = 0.0
        self._rested = _RESTING
        self._loads.reset()
        self._estimator.lose_footing()

    def _locate(self, foot: int) -> tuple[complex, float]:
        return self._estimator.place_of(foot), self._estimator.heading_of(foot)

    def _measure(self, seconds: float) -> None:
        """Estimate the state of the body from its sensors."""
        sensors, estimator = self._sensors, self._estimator
        sensors.tick()
        balanced = self._stage is _Stage.BALANCED
        estimator.tick(
            seconds,
            sensors.inertial(),
            sensors.angles,
            sensors.speeds,
            self._steps.shares if balanced else self._loads.shares,
            sliding=not balanced,
        )
        if self._stage is not _Stage.LOST:
            held = 0.5 * (seconds - self._simulator.tick_period)  # what is decided now holds as long again
            estimator.look_ahead(self._late + held, self._zmp)
        self._unloaded += seconds
        rises = not balanced or self._motion.returning
        if self._steps.phase is Phase.STANDING and (rises or self._unloaded >= _LOADS_PERIOD):
            self._loads.tick(self._unloaded, sensors.torques)
            self._unloaded = 0.0

    def _hindrance(self, stiffnesses: Array) -> str:
        """Return why it can neither walk nor balance; empty when it can."""
        motors = self._simulator.motors
        if motors.following.size and motors.follows[self._limbs.leg_motors].any():
            return _FOLLOWING
        inertial = self._sensors.inertial()
        if self._stiff is None or self._stiff[0] is not stiffnesses:
            legs = stiffnesses[self._limbs.leg_motors]
            self._stiff = stiffnesses, limp(legs, sentence("its legs are limp"))
        _, weak = self._stiff
        if max(abs(inertial.roll), abs(inertial.pitch)) > (_LEANING if weak else TILT):
            return LYING
        if weak:
            return weak
        standing = self._steps.phase is Phase.STANDING
        if standing and sum(self._loads.feet.tolist()) < _BORNE * self._loads.weight:
            return OFF_ITS_FEET
        return ""

    def _lose(self, why: str) -> None:
        """Leave the legs alone."""
        walks = self._commanded != STILL or self._velocity != STILL
        if walks or (self._stage is not _Stage.LOST and self.ended == STUCK):
            self._end(why)
        self._stage = _Stage.LOST
        self.balances = False
        self._rested = 0.0
        self._steps.stand()
        motors = self._limbs.leg_motors
        self._seen = self._setpoints.setpoints
        self._legs = self._seen[motors]
        self._simulator.commands[motors] = self._legs

    def _hold(self, seconds: float, legs: Array, *, moved: bool) -> None:
        """Hold the commanded angles, unless the legs are free to balance."""
        limbs, estimator, held = self._limbs, self._estimator, self._held
        angles = limbs.commanded(self._setpoints.setpoints)
        self._rested = 0.0 if moved else self._rested + seconds
        held.set_angles(angles)
        if self._velocity != STILL or (self._rested >= _RESTING and held.is_stance()):
            self._steps.stand()
            for foot in (LEFT, RIGHT):
                estimator.plant(foot, self._steps.feet[foot].place)
            self._motion.begin(angles)
            self._arms.begin(self._hanging())
            self._stage = _Stage.BALANCED
            return
        left, right = self._loads.shares
        support = LEFT if left >= right else RIGHT
        bearing = support if min(left, right) < _CARRIES and held.is_over(support) else None
        place = held.center(support, estimator)
        zmp = place + (1.0 + self._footsteps.standing_gain) * (estimator.capture_point - place)
        self._zmp = zmp
        heading = estimator.heading_of(support)
        torques = self._torques.at(self._still, zmp, heading, bearing)
        self._simulator.commands[limbs.leg_motors] = legs + self._offsets(
            torques, (legs - self._legs) / seconds
        )

    def _balance(self, seconds: float) -> None:
        """Stand or walk."""
        limbs, steps, motion = self._limbs, self._steps, self._motion
        resting, count = steps.phase is Phase.STANDING, steps.count
        point = self._estimator.capture_point
        steps.tick(seconds, point, self._velocity, firm=not motion.returning)
        self._zmp = steps.zmp
        landed = steps.count > count
        if landed:
            foot = steps.support if steps.phase is Phase.STEPPING else 1 - steps.support
            self._estimator.plant(foot, steps.feet[foot].place)
            if self._velocity != STILL and steps.held_back:
                self._end(STUCK)
        if resting and steps.phase is not Phase.STANDING:
            self._arms.begin(self._hanging())
        commands = self._simulator.commands
        if steps.phase is not Phase.STANDING:
            left, right = steps.feet
            ahead = ((left.place - right.place) * cmath.rect(1.0, -steps.heading)).real
            swing = 0.5 * self._footsteps.arm_swing * ahead
            self._arms.tick((swing, -swing), commands, _FASTEST_SWING * seconds)
        motion.tick(seconds, steps, limbs.commanded(self._setpoints.setpoints), landed=landed)
        heading = steps.feet[steps.support].heading
        bearing = steps.support if steps.on_one_foot else None
        torques = self._torques.at(motion.accelerations, steps.zmp, heading, bearing)
        self._setpoints.place(limbs.leg_motors, motion.legs, commands)
        given = commands[limbs.leg_motors] + self._offsets(torques, motion.speeds[limbs.leg_dofs])
        commands[limbs.leg_motors] = given
        self._drift = self._no_drift
        if steps.phase is Phase.STANDING and not motion.returning:
            if abs(point - steps.middle) < _CALM:
                self._pause = _CALM_PERIOD
        elif steps.steady and not landed:
            self._pause = min(_STEADY_PERIOD, steps.left)
            self._drift = (given - self._given) / seconds
        self._given = given

    def _hanging(self) -> NDArray[np.bool_]:
        """Return which arms hang."""
        data, arms = self._estimator.data, self._limbs.arms
        upwards = [data.subtree_com[arm.shoulder] - data.xpos[arm.shoulder] for arm in arms]
        return np.array([arm[2] < -math.cos(_HANGING) * np.linalg.norm(arm) for arm in upwards], dtype=bool)

    def _offsets(self, torques: Array, speeds: Array) -> Array:
        """Return by how much motors of the legs are to be ahead to give torques in N m at speeds in rad/s."""
        motors = self._limbs.leg_motors
        damping = self._damping - self._biases.take(motors)
        offsets: Array = (torques + damping * speeds) / self._gains.take(motors)
        return offsets
