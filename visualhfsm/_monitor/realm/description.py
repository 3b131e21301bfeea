"""A robot's body and its looks, as its server describes them and as the page draws them.

Any process may serve any description, so all of it is checked; looks that cannot be drawn are replaced by
those that the body has without them. Lengths are in m; the server's quaternions are (w, x, y, z), those of
the page (x, y, z, w).
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from hashlib import sha256
from typing import Any, Final

import msgspec

from codegen.messages import NO_MESSAGE
from interfaces.nao import DescriptionPrx
from naoserver.bodies import DEFAULT_BODY, find_body
from naoserver.bodies.description import (
    describe_looks,
    looks_of,
    read_described_looks,
    start_of,
    write_looks,
)
from naoserver.bodies.faults import FEET, ROBOT
from naoserver.bodies.parts import NO_TURN, Axis, HingeAxis, Link
from naoserver.body import Body, read_description, write_body
from naoserver.errors import RobotError
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._monitor.realm.realm import PolledValue
from zenoh_ice import Communicator
from zenoh_ice.data.keys import Target
from zenoh_ice.data.text import printable

DESCRIPTION: Final = "Description"
"""The identity of the servant that describes the robot."""

_logger = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class DescribedRobot:
    """A robot as the page draws it; `body` and `looks` are the texts of its server."""

    name: str
    title: str
    """Its name for people."""
    neck: tuple[HingeAxis | None, HingeAxis | None]
    """The axes that pan and tilt its first camera."""
    joints: frozenset[str]
    sliding: tuple[str, ...]
    """The joints that slide instead of turning."""
    postures: tuple[str, ...]
    page: bytes
    """JSON for `static/robot3d/robot-drawing.js`."""
    hash: str
    """Names the content of `page`."""
    body: str
    looks: str

    def head(self, joints: Mapping[str, float]) -> tuple[float | None, float | None]:
        """Return pan and tilt of the head in rad at these angles of the joints; None when unknown."""
        pan, tilt = (
            axis.of(joints[axis.joint]) if axis is not None and axis.joint in joints else None
            for axis in self.neck
        )
        return pan, tilt


def describe(body: str, looks: str) -> DescribedRobot:
    """Return a robot of the texts that its `Description` serves. Raises VisualHfsmError for an unsound body.

    Looks that cannot be drawn are replaced, and logged.
    """
    with VisualHfsmError.in_place_of(RobotError, "the robot's body cannot be read: {reason}"):
        found = read_description(body)
    drawn = None
    try:
        drawn = read_described_looks(looks, found) if looks else None
    except RobotError as error:
        _logger.warning("%s is drawn by its contact shapes: %s", printable(found.name), printable(str(error)))
    if drawn is None or not drawn.shapes:
        drawn = describe_looks(looks_of(found), start_of(found))
    content: dict[str, Any] = {
        "name": found.name,
        "title": found.title or found.name,
        "links": [_link(link, found) for link in found.links],
        "soles": {sole.link: [[*point, -sole.height] for point in sole.outline] for sole in found.soles},
        "places": {
            ROBOT: [link.name for link in found.links],
            FEET: [sole.link for sole in found.soles],
            **{camera.name: [camera.link] for camera in found.cameras},
            **{name: [sensor.link] for name, sensor in found.touch.items()},
        },
        **msgspec.to_builtins(drawn),
    }
    if found.cameras:
        eye = found.cameras[0]
        content["eye"] = {"link": eye.link, "position": eye.position, "tilt": eye.tilt}
    page = msgspec.json.encode(content)
    neck = found.hinges.get("Neck", {})
    return DescribedRobot(
        name=found.name,
        title=printable(found.title or found.name),
        neck=(neck.get(Axis.PAN), neck.get(Axis.TILT)),
        joints=frozenset(found.joint_names),
        sliding=tuple(joint.name for joint in found.joints if joint.sliding),
        postures=tuple(map(printable, found.postures)),
        page=page,
        hash=sha256(page).hexdigest()[:32],
        body=body,
        looks=looks,
    )


def _link(link: Link, body: Body) -> dict[str, Any]:
    """Return a link as the page has it."""
    joint = body.moved_by.get(link.name)
    if joint is None:
        return {"name": link.name}
    content: dict[str, Any] = {"name": link.name, "parent": joint.parent, "origin": joint.origin}
    if joint.turn != NO_TURN:
        w, x, y, z = joint.turn
        content["turn"] = (x, y, z, w)
    if joint.name in body.joint:
        content |= {"joint": joint.name, "axis": joint.axis} | ({"sliding": True} if joint.sliding else {})
    return content


@cache
def nao() -> DescribedRobot:
    """Return a Nao: the robot of servers and recordings that describe none."""
    nao = find_body(DEFAULT_BODY)
    return describe(write_body(nao), write_looks(nao))


class DescriptionMonitor:
    """Fetch the description that a proxy of this text serves; `update` it a few times a second."""

    def __init__(self, communicator: Communicator, identity: str = DESCRIPTION) -> None:
        self._communicator = communicator
        proxy = DescriptionPrx.uncheckedCast(communicator.stringToProxy(identity))
        self._target = Target(proxy.ice_getRealm(), proxy.ice_getIdentity())
        self._body = PolledValue(proxy.getBody.begin)
        self._looks = PolledValue(proxy.getLooks.begin)
        self._served: tuple[str, float] | None = None
        self._read: tuple[str, str] | None = None
        self.robot: DescribedRobot | None = None
        """The robot that is described, also when it has left; None until one was."""
        self._refusal = NO_MESSAGE

    @property
    def is_present(self) -> bool:
        """Whether a robot is described."""
        return bool(self._communicator.presence.servers(self._target))

    @property
    def trouble(self) -> str:
        """Why the present description cannot be drawn."""
        return self._refusal or printable(self._body.trouble or self._looks.trouble)

    def update(self) -> None:
        """Request what is missing of a robot that has appeared."""
        served = next(
            ((each.server, each.since) for each in self._communicator.presence.servers(self._target)), None
        )
        if served is None:
            return
        if served != self._served:  # perhaps another robot
            self._served = served
            self._body.forget()
            self._looks.forget()
            self.robot, self._read, self._refusal = None, None, NO_MESSAGE
        body, looks = self._body.poll(), self._looks.poll()
        if body is None or looks is None or self._read is not None:
            return
        self._read = body, looks
        try:
            self.robot = describe(body, looks)
        except VisualHfsmError as error:
            self._refusal = error.message
            _logger.warning("%s", error)
