"""What is drawn of a robot, of any realm: its body, and how its joints stand."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from typing import Final

from codegen.messages import NO_MESSAGE, Message
from interfaces.nao import JointsPrx
from visualhfsm._monitor.realm.description import DESCRIPTION, DescribedRobot, DescriptionMonitor, nao
from visualhfsm._monitor.realm.realm import Newest, PolledValue
from zenoh_ice import Communicator
from zenoh_ice.data.values import NAME

BODY: Final = "Body"
STALE: Final = 0.8
"""Wall seconds after which a value that is sent at least ten times a second is too old."""
_MOST_TOGETHER: Final = 15
"""Other robots that are drawn at a time."""
_MOST_EVER: Final = 64
"""Those that are looked for at all: any process may report robots, and new ones all the time."""


class BodyMonitor:
    """Listen to the joints of a realm's robot, and to its description; `update` it a few times a second."""

    def __init__(self, communicator: Communicator, realm: str) -> None:
        self._communicator = communicator
        self._realm = realm
        body = JointsPrx.uncheckedCast(communicator.stringToProxy(f"{BODY}@{realm}"))
        self.state: Final = Newest(body.getJointState.latest)
        self.names: Final = PolledValue(body.getJointNames.begin)
        self._description = DescriptionMonitor(communicator, f"{DESCRIPTION}@{realm}")

    @property
    def is_present(self) -> bool:
        """Whether it has joints that are served."""
        return BODY in self._communicator.identities(self._realm)

    def update(self) -> None:
        """Request missing data; of a robot that has left, forget them."""
        self._description.update()
        if self.is_present:
            self.names.poll()
        elif self.names.value is not None:
            self.names.forget()

    @property
    def described(self) -> DescribedRobot | None:
        """The robot as it is drawn; None for one whose body is not known, or not yet.

        Without a robot it is the last one, or the Nao, as for a server of a Nao that describes none.
        """
        description, names = self._description, self.names.value
        if description.is_present:
            return description.robot
        if not self.is_present:
            return description.robot or nao()
        return None if names is None or not nao().joints.issuperset(names) else nao()

    @property
    def undescribed(self) -> Message:
        """Why a present robot cannot be drawn; empty for one that can, or that is not known yet."""
        if self._description.is_present:
            return Message.verbatim(self._description.trouble)
        if self.described is None and self.names.value is not None:
            return Message("This robot's server does not describe its body, so that it cannot be drawn.")
        return NO_MESSAGE

    def joints(self, oldest: float = STALE) -> dict[str, float]:
        """Return the angles of the joints in rad by name; none when unknown or older than `oldest` s."""
        body, names = self.state(), self.names.value
        if body is None or names is None or body.age > oldest:
            return {}
        pairs = zip(names, body.value.positions, strict=False)
        return {name: angle for name, angle in pairs if math.isfinite(angle)}


class Others:
    """The other robots of the world of a robot, each by its realm, by which the ground truth places it."""

    def __init__(self, communicator: Communicator) -> None:
        self._communicator = communicator
        self._known: dict[str, BodyMonitor] = {}
        self._present: Mapping[str, BodyMonitor] = {}

    def update(self, names: Iterable[str]) -> None:
        """Request missing data of those that the world has now."""
        wanted = [name for name in names if re.fullmatch(NAME, name)][:_MOST_TOGETHER]
        for name in wanted:
            if name not in self._known and len(self._known) < _MOST_EVER:
                self._known[name] = BodyMonitor(self._communicator, name)
        found = {name: self._known[name] for name in wanted if name in self._known}
        for body in found.values():
            body.update()
        self._present = {name: body for name, body in found.items() if body.is_present}

    def bodies(self) -> Mapping[str, tuple[BodyMonitor, DescribedRobot]]:
        """Return those that can be drawn, each with its description."""
        known = ((name, body, body.described) for name, body in self._present.items())
        return {name: (body, described) for name, body, described in known if described is not None}
