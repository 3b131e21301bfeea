"""The operations of ALMotion that tell of what the body consists."""

from __future__ import annotations

from naoserver.qi_service.access import Access
from naoserver.qi_service.chains import joints_of
from naoserver.qi_service.joint_motion import PERIOD

__all__ = ["BodyOperations"]


class BodyOperations:
    """Tell of what the body consists."""

    def __init__(self, access: Access) -> None:
        self._body = access.body

    def getBodyNames(self, name: object) -> list[str]:
        """Return the joints of a chain, such as `Body` or `LArm`."""
        return list(joints_of(name))

    def getJointNames(self, name: object) -> list[str]:
        """Return the joints of a chain, as getBodyNames was called before."""
        return list(joints_of(name))

    def getLimits(self, name: object) -> list[list[float]]:
        """Return least and greatest angle in rad, full speed in rad/s and torque in N m of each joint."""
        facts = [self._body.facts(joint) for joint in joints_of(name)]
        return [[joint.lower, joint.upper, joint.max_velocity, joint.max_torque] for joint in facts]

    def getMotionCycleTime(self) -> int:
        """Return the period of the setpoints in ms."""
        return round(PERIOD * 1000)

    def getRobotConfig(self) -> list[list[object]]:
        """Return names and values of what the body consists of."""
        facts: dict[str, object] = {
            "Model Type": "naoH25",
            "Head Version": "VERSION_60",
            "Body Version": "VERSION_60",
            "Arm Version": "VERSION_60",
            "Laser": False,
            "Extended Arms": False,
            "Extended Hand": True,
            "Number of Legs": 2,
            "Number of Arms": 2,
            "Number of Hands": 2,
        }
        return [list(facts), list(facts.values())]

    def getSummary(self) -> str:
        """Return a table of joints with stiffness, command and position, for people."""
        reading = self._body.read()
        rows = zip(self._body.joints, reading.stiffnesses, reading.commands, reading.positions, strict=True)
        lines = [
            f"{joint.name:<16}{stiff:>10.2f}{command:>12.6f}{at:>12.6f}" for joint, stiff, command, at in rows
        ]
        return "\n".join([f"{'Joint':<16}{'Stiffness':>10}{'Command':>12}{'Sensor':>12}", *lines])
