"""Servant of the ground truth: where everything is, as only a simulation knows it."""

from __future__ import annotations

from typing import Final

from interfaces.nao import GroundTruth, GroundTruthReading, Pose, Quaternion, Vector3
from naoserver import capabilities
from naoserver.capabilities import Stage, Truth
from zenoh_ice import Current


class _TruthSource:
    """The ground truth as what streams it reads it."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage

    def read(self) -> Truth:
        """Return where everything is."""
        return self._stage.truth()


class GroundTruthI(GroundTruth):
    """Tell where the robot and everything else is, in calls and as a stream."""

    def __init__(self, stage: Stage) -> None:
        self.device: Final = _TruthSource(stage)

    def getGroundTruth(self, current: Current) -> GroundTruthReading:  # noqa: ARG002
        """Return where everything is."""
        return _reading(self.device.read())

    @property
    def listening(self) -> bool:
        """Whether anybody listens to the stream."""
        return self.getGroundTruthPublisher.listening

    def publish(self, truth: Truth) -> None:
        """Send where everything is to whoever listens."""
        self.getGroundTruthPublisher.publish(_reading(truth), time=truth.time)


def _reading(truth: Truth) -> GroundTruthReading:
    return GroundTruthReading(
        time=truth.time,
        torso=_pose(truth.torso),
        velocity=Vector3(*truth.velocity),
        angularVelocity=Vector3(*truth.angular_velocity),
        objects={name: _pose(pose) for name, pose in truth.objects.items()},
    )


def _pose(pose: capabilities.Pose) -> Pose:
    return Pose(position=Vector3(*pose.position), orientation=Quaternion(*pose.orientation))
