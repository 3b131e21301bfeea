"""ALMotion's whole body control: over which feet the robot balances, and effectors that follow targets."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from naoserver.bodies.capabilities import Support
from naoserver.bodies.kinematics import Matrix
from naoserver.moves.effector_paths import EVERY_AXIS, FIXED, LEGS, PLANE, POSITION, reach_places
from visualhfsm_naoqi.programs._access import ROBOT, Access, Service
from visualhfsm_naoqi.programs._arguments import chosen, constant, number, one_of, switch, vector
from visualhfsm_naoqi.programs._clients import SERVER, Activity, Call, Client, begins
from visualhfsm_naoqi.programs._effectors import EffectorMotion
from visualhfsm_naoqi.programs._motion import ALMotion

_SUPPORTS: Final = ("Legs", *LEGS)
_STATES: Final[dict[str, Sequence[float]]] = {"Fixed": FIXED, "Plane": PLANE, "Free": ()}
_EFFECTORS: Final = ("Head", "LArm", "RArm")
_PACE: Final = 0.3
"""Fraction of full speed at which an effector follows its target."""
_AHEAD: Final = 0.02
"""Distance in m of a sole's middle in front of its ankle."""
_ROUNDS: Final = 4
"""Computations of the torso's shift, each of which removes three quarters of the error."""


class WholeBody(Service):
    """Choose over which feet the robot balances while its legs are commanded.

    A robot without a balancer only moves its center of mass.
    """

    def __init__(self, access: Access) -> None:
        super().__init__(access)
        self._motion = access.service(ALMotion)
        self._effectors = access.service(EffectorMotion)
        self._client = SERVER  # that enabled it, or ended it
        self._enabled = False
        self._feet: dict[str, str] = {}  # the states that a program gave them
        self._constraint = Support.LEGS
        self._controlled: set[str] = set()  # effectors

    def wbEnable(self, isEnabled: object) -> None:
        """Balance from now on, over the feet that carry the robot; or end every choice of other feet."""
        with self._lock:
            self._client = self._access.calls.current.client
            self._enabled = bool(isEnabled)
            self._feet.clear()
            self._controlled.clear()
            self._constraint = Support.LEGS
            self._choose()

    def wbFootState(self, stateName: object, supportLeg: object) -> None:
        """Say how a foot stays on the floor: `Fixed`, in the `Plane`, or `Free`: the other one carries."""
        state = chosen(stateName, "state of a foot", _STATES)
        leg = chosen(supportLeg, "leg", _SUPPORTS)
        with self._lock:
            self._feet |= dict.fromkeys(LEGS if leg == "Legs" else (leg,), state)
            self._choose()

    def wbEnableBalanceConstraint(self, isEnable: object, supportLeg: object) -> None:
        """Keep the center of mass over a foot, or over `Legs`; or no longer over a certain foot."""
        support = Support(chosen(supportLeg, "leg", _SUPPORTS))
        with self._lock:
            self._constraint = support if isEnable else Support.LEGS
            self._choose()

    @begins(Activity.JOINTS)
    def wbGoToBalance(self, call: Call, supportLeg: object, duration: object) -> bool:
        """Move the center of mass over a foot, or between both, in s; returns whether it is there.

        Both feet carry the robot on the way and stay where they are, and the torso comes upright. Does
        nothing unless whole body control is enabled.
        """
        support = Support(chosen(supportLeg, "leg", _SUPPORTS))
        seconds = number(duration, "duration")
        with self._lock:
            if not self._enabled:
                return False
            self._feet = {leg: state for leg, state in self._feet.items() if state != "Free"}
            self._constraint = Support.LEGS
            self._choose()
        place = self._torso_over(support)
        self._effectors.positionInterpolation(
            call, "Torso", ROBOT, [*place, 0.0, 0.0, 0.0], EVERY_AXIS, seconds, True
        )
        with self._lock:
            arrived = self._enabled and not call.stopped.is_set()
            if arrived:
                self._constraint = support
                self._choose()
        return arrived

    def wbEnableEffectorControl(self, effectorName: object, isEnabled: object) -> None:
        """Let an effector, `Head`, `LArm` or `RArm`, follow the targets of wbSetEffectorControl, or not."""
        name = chosen(effectorName, "effector", _EFFECTORS)
        with self._lock:
            (self._controlled.add if isEnabled else self._controlled.discard)(name)

    @begins(Activity.JOINTS)
    def wbSetEffectorControl(self, effectorName: object, targetCoordinate: object) -> None:
        """Send an effector to x, y and z in m in the robot's frame, the head to angles in rad about them.

        Does nothing unless it is controlled.
        """
        name = chosen(effectorName, "effector", _EFFECTORS)
        target = vector(targetCoordinate, "targetCoordinate", 3)
        with self._lock:
            if not (self._enabled and name in self._controlled):
                return
        if name == "Head":
            _, pitch, yaw = target
            self._motion.setAngles("Head", [yaw, pitch], _PACE)
        else:
            self._effectors.setPosition(name, ROBOT, [*target, 0.0, 0.0, 0.0], _PACE, POSITION)

    wbEnableEffectorOptimization = constant(
        "Do nothing but check the values: effectors are never given up for balance.",
        effectorName=one_of("effector", (*_EFFECTORS, *LEGS)),
        isActive=switch,
    )

    def _forget(self, client: Client) -> None:
        """End the choices of a lost client; the robot still balances."""
        super()._forget(client)
        if client is self._client:
            self.wbEnable(False)

    def _choose(self) -> None:
        """Balance over the feet that the present choices leave; during a motion of the server, after it."""
        support, free = self._constraint, [leg for leg, state in self._feet.items() if state == "Free"]
        if support is Support.LEGS and len(free) == 1:
            support = Support.RIGHT if "LLeg" in free else Support.LEFT
        access, balancer = self._access, self._robot.balancer
        planted = {leg: _STATES[state] for leg, state in self._feet.items() if leg not in free}
        access.planted = planted if self._enabled else {}
        access.support = support if self._enabled else Support.LEGS
        if balancer is None or access.player.busy:
            return
        if self._enabled or balancer.support() is not None:
            balancer.command(access.support)

    def _torso_over(self, support: Support) -> list[float]:
        """Return x, y and z in m of the upright torso, on both feet, whose center of mass is over some.

        Upright, since the legs cannot bring a torso that leans forward to a side without turning the feet.
        """
        kinematics, start = self._access.kinematics, self._access.angles(measured=False)
        base = self._access.place("Torso", ROBOT, measured=False)
        feet = LEGS if support is Support.LEGS else (support.value,)
        ahead = np.array([_AHEAD, 0.0, 0.0, 1.0])
        goal = sum((base @ kinematics.place_of(foot, start) @ ahead)[:2] for foot in feet) / len(feet)
        torso: Matrix = np.eye(4)
        torso[:3, 3] = base[:3, 3]
        for _ in range(_ROUNDS):
            found = reach_places(kinematics, {"Torso": (torso, EVERY_AXIS)}, base, start, near=start)
            _, center = kinematics.center_of_mass("Body", found)
            torso[:2, 3] += goal - (torso @ [*center, 1.0])[:2]
        return [float(part) for part in torso[:3, 3]]
