"""Proxies of JdeRobot's interfaces with the further methods that its library for clients had.

Documents of 2016 to 2018 call them. A component imports a proxy from here if its code does: the interfaces
themselves have no such operations. `visualhfsm_old_documents._old_names` lists the methods.
"""

from __future__ import annotations

from typing import Any

from interfaces import jderobot
from interfaces.jderobot import CMDVelData, Pose3DData


class MotorsPrx(jderobot.MotorsPrx):
    """Command the velocity of a mobile robot."""

    def sendV(self, v: float) -> None:
        """Command the forward velocity in m/s."""
        self.setV(v)

    def sendW(self, w: float) -> None:
        """Command the turning velocity in rad/s, positive to the left."""
        self.setW(w)

    def sendL(self, l: float) -> None:  # noqa: E741
        """Command the sideways velocity in m/s, positive to the left."""
        self.setL(l)


class Pose3DPrx(jderobot.Pose3DPrx):
    """Read where a robot is."""

    def getPose3d(self) -> Pose3DData:
        """Return the newest pose."""
        return self.getPose3DData()


class CMDVelPrx(jderobot.CMDVelPrx):
    """Command the velocity of a robot that flies: set each velocity, then send all of them."""

    def __init__(self, *arguments: Any, **options: Any) -> None:  # noqa: ANN401 - of ObjectPrx
        super().__init__(*arguments, **options)
        self._velocities = CMDVelData()

    def setVX(self, vx: float) -> None:
        """Set the velocity forward in m/s."""
        self._velocities.linearX = vx

    def setVY(self, vy: float) -> None:
        """Set the velocity to the left in m/s."""
        self._velocities.linearY = vy

    def setVZ(self, vz: float) -> None:
        """Set the velocity upwards in m/s."""
        self._velocities.linearZ = vz

    def setYaw(self, yaw: float) -> None:
        """Set the turning velocity in rad/s, positive to the left."""
        self._velocities.angularZ = yaw

    def sendVelocities(self) -> None:
        """Command the velocities that were set."""
        self.setCMDVelData(self._velocities)

    def sendCMDVel(  # noqa: PLR0917 - as they have it
        self, vx: float, vy: float, vz: float, ax: float, ay: float, az: float
    ) -> None:
        """Command velocities in m/s, and turning velocities in rad/s."""
        self.setCMDVelData(CMDVelData(vx, vy, vz, ax, ay, az))
