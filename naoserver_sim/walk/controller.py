"""From velocities to the motors of the legs: the gait, kept upright by the inertial unit."""

from __future__ import annotations

from typing import Final

from naoserver.capabilities import WalkVelocity
from naoserver_sim.walk.gait import AT_REST, LEFT, RIGHT, FootOffset, Gait
from naoserver_sim.walk.kinematics import FootPose, Legs

__all__ = ["WalkController"]


# How the body is held while it walks, and how it is kept upright.
_HIP_HEIGHT: Final = 0.230
"""Height in m of the hips above the soles."""
_HIP_DEPTH: Final = 0.085
"""Height in m of the torso's frame above the hips."""
_HIP_WIDTH: Final = 0.05
"""Distance in m of a hip from the middle."""
_FORWARD_OF_HIP: Final = 0.012
"""Distance of the feet in front of the torso's frame in m."""
_LEAN: Final = 0.05
"""Pitch of the torso in rad; so small that its sine is the angle, and its cosine 1 but for 0.1 percent."""
_PITCH_GAIN: Final = 0.03
"""Radians of the carrying ankle's pitch for a rad/s of the torso's."""
_ROLL_GAIN: Final = 0.05
"""Radians of the carrying ankle's roll for a rad/s of the torso's."""
_HIP_GAIN: Final = 0.01
"""Radians of the carrying hip's pitch for a rad/s of the torso's."""
_SMOOTHING: Final = 0.6
"""Part of the last turning rate that is kept at each tick."""


class WalkController:
    """Say at each tick of control where the legs are to be; no physics, no threads."""

    def __init__(self) -> None:
        self.gait: Final = Gait()
        self._legs = Legs()
        self._rate = (0.0, 0.0)
        self._part = [0.0, 0.0]  # of the feedback that each foot gets: the one that carries, without a jump

    def reset(self) -> None:
        """Stand on both feet at once, as before the first step."""
        self.gait.stop()
        self._rate = (0.0, 0.0)
        self._part = [0.0, 0.0]

    def stance(self, shift: tuple[float, float] = (0.0, 0.0)) -> list[float]:
        """Return the angles of `LEG_MOTORS` with which a step begins and ends; `shift` is that of `tick`."""
        return Legs().solve(self._foot(LEFT, AT_REST, shift), self._foot(RIGHT, AT_REST, shift))

    def tick(
        self,
        seconds: float,
        velocity: WalkVelocity,
        turning: tuple[float, float, float],
        loads: tuple[float, float],
        shift: tuple[float, float] = (0.0, 0.0),
    ) -> list[float]:
        """Return the angles of `LEG_MOTORS`.

        `turning` is the torso's turning rate in rad/s, `loads` are those of the soles in N, left and right;
        `shift` is by how much in m the center of mass is further forwards and to the left than usual.
        """
        gait, keep = self.gait, _SMOOTHING
        roll = keep * self._rate[0] + (1.0 - keep) * turning[0]
        pitch = keep * self._rate[1] + (1.0 - keep) * turning[1]
        self._rate = (roll, pitch)
        gait.tick(seconds, velocity, loads)
        angles = self._legs.solve(
            self._foot(LEFT, gait.feet[LEFT], shift), self._foot(RIGHT, gait.feet[RIGHT], shift)
        )
        for foot in (LEFT, RIGHT):
            carries = gait.walking and foot == gait.support
            part = self._part[foot] = 0.5 * (self._part[foot] + carries)
            first = 1 + 5 * foot
            angles[first + 1] += part * _HIP_GAIN * pitch
            angles[first + 3] += part * _PITCH_GAIN * pitch
            angles[first + 4] += part * _ROLL_GAIN * roll
        return angles

    def _foot(self, foot: int, offset: FootOffset, shift: tuple[float, float]) -> FootPose:
        """Return where a foot is to be in the frame of a torso that leans forwards."""
        x = offset.x + _FORWARD_OF_HIP + shift[0]
        y = offset.y + (_HIP_WIDTH if foot == LEFT else -_HIP_WIDTH) + shift[1]
        z = offset.lift - _HIP_HEIGHT - _HIP_DEPTH
        return FootPose(x - _LEAN * z, y, z + _LEAN * x, offset.yaw, pitch=-_LEAN)
