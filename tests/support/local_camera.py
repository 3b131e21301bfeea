"""The camera of a robot in this process, without a server."""

from __future__ import annotations

from typing import Any

from naoserver.options import CameraOptions
from naoserver.protocol.robot import Robot
from naoserver.safety._event_log import EventLog
from naoserver.serving.camera import BodyHistory, CameraI

__all__ = ["LocalCamera", "local_cameras"]


class LocalCamera:
    """A camera with the operations of a CameraPrx."""

    def __init__(self, robot: Robot, name: str) -> None:
        facts = next(camera for camera in robot.body.cameras if camera.name == name)
        now = robot.clock.now
        history = BodyHistory(robot, lambda: None)
        self._servant: Any = CameraI(robot, facts, CameraOptions(), EventLog(now, now), history)

    def __getattr__(self, operation: str) -> Any:
        return lambda *arguments: getattr(self._servant, operation)(*arguments, None)


def local_cameras(robot: Robot) -> dict[str, LocalCamera]:
    """Return the cameras on a robot, by their names."""
    return {camera.name: LocalCamera(robot, camera.name) for camera in robot.body.cameras}
