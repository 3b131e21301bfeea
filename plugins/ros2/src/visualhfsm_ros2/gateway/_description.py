"""The robot server whose robot the gateway shows: its servants, and the body that it describes."""

from __future__ import annotations

from typing import Final, TypeVar

from interfaces.nao import DescriptionPrx, JointsPrx
from naoserver.bodies.body import Body, read_body
from naoserver.errors import RobotError
from zenoh_ice import Communicator, ObjectNotExistException, ObjectPrx

P = TypeVar("P", bound=ObjectPrx)


class GatewayError(Exception):
    """The robot cannot be shown to ROS."""


class DescribedRobot:
    """The servants of a realm's robot, and its body.

    Raises GatewayError for a description with a fault, SystemException when there is no robot server.
    """

    def __init__(self, communicator: Communicator) -> None:
        self._communicator: Final = communicator
        self._known = False  # whether all servants must be known by now
        # At most as large as the answer to a call may be, 1 MiB.
        described = self.require(DescriptionPrx, "Description").getBody()
        try:
            self.body: Final[Body] = read_body(described, "the robot's description")
            """Its body, as its server describes it."""
        except RobotError as error:
            raise GatewayError(str(error)) from error
        served = self.require(JointsPrx, "Body").getJointNames()
        if tuple(served) != self.body.joint_names:
            known = ", ".join(self.body.joint_names)
            raise GatewayError(
                f"the robot's description has the joints {known}; its server moves {', '.join(served)}"
            )

    def require(self, interface: type[P], identity: str) -> P:
        """Return a checked proxy of a servant of every robot server; raises SystemException without it."""
        return interface.checkedCast(self._communicator.stringToProxy(identity))

    def find(self, interface: type[P], identity: str) -> P | None:
        """Return a checked proxy; None if the robot has no such servant.

        Only the first absence takes its time: by then every servant of the robot is known.
        """
        if self._known and identity not in self._communicator.identities():
            return None
        try:
            return self.require(interface, identity)
        except ObjectNotExistException:
            self._known = True
            return None
