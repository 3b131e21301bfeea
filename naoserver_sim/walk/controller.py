"""From velocities to the motors of the legs: the gait, kept upright by the inertial unit."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from naoserver.capabilities import WalkVelocity
from naoserver_sim.walk.gait import AT_REST, LEFT, RIGHT, FootOffset, Gait
from naoserver_sim.walk.kinematics import FootPose, Legs

__all__ = ["WalkController", "WalkOptions"]


@dataclass(frozen=True, slots=True)
class WalkOptions:
    """How the body is held while it walks, and how it is kept upright."""

    hip_height: float = 0.230
    """Height in m of the hips above the soles."""
    hip_depth: float = 0.085
    """Height in m of the torso's frame above the hips."""
    hip_width: float = 0.05
    """Distance in m of a hip from the middle."""
    forward_of_hip: float = 0.012
    """How far the feet stand before the torso's frame in m."""
    lean: float = 0.05
    """Pitch of the torso in rad."""
    pitch_gain: float = 0.03
    """Radians of the carrying ankle's pitch for a rad/s of the torso's."""
    roll_gain: float = 0.05
    """Radians of the carrying ankle's roll for a rad/s of the torso's."""
    hip_gain: float = 0.01
    """Radians of the carrying hip's pitch for a rad/s of the torso's."""
    smoothing: float = 0.6
    """Part of the last turning rate that is kept at each tick."""


class WalkController:
    """Say at each tick of control where the legs are to be; no physics, no threads."""

    def __init__(self, options: WalkOptions | None = None, gait: Gait | None = None) -> None:
        self.options: Final = options or WalkOptions()
        self.gait: Final = gait or Gait()
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
        options, gait = self.options, self.gait
        keep = options.smoothing
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
            angles[first + 1] += part * options.hip_gain * pitch
            angles[first + 3] += part * options.pitch_gain * pitch
            angles[first + 4] += part * options.roll_gain * roll
        return angles

    def _foot(self, foot: int, offset: FootOffset, shift: tuple[float, float]) -> FootPose:
        """Return where a foot is to be in the frame of a torso that leans forwards."""
        options = self.options
        side = 1.0 if foot == LEFT else -1.0
        x = offset.x + options.forward_of_hip + shift[0]
        z = offset.lift - options.hip_height - options.hip_depth
        lean = options.lean  # small: the sine is the angle, the cosine 1 but for 0.1 percent
        return FootPose(
            x - lean * z,
            offset.y + side * options.hip_width + shift[1],
            z + lean * x,
            offset.yaw,
            pitch=-lean,
        )
