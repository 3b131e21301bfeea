"""The frames of the links and sensors of a body in ROS.

They have the names that the body's description gives them there, for the Nao those of naoqi_driver2. REP 120
(Coordinate Frames for Humanoid Robots) defines `base_link`, `torso`, `gaze`, `l_sole` and `r_sole`. Axes are
those of REP 103: x forward, y left, z up; of optical frames z forward, x right, y down.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from interfaces.jderobot import CameraDescription
from naoserver.body import Body
from naoserver.capabilities import Vector
from naoserver.kinematics import angles_of, turned
from naoserver.parts import NOWHERE, Camera, Joint, Sole

ODOM: Final = "odom"
"""The frame of the odometry: the place at which it began."""
ROOT: Final = "base_link"
"""The root of the tree: the frame of the body's root link."""
FOOTPRINT: Final = "base_footprint"
"""The place on the floor between the soles, or below the root, with the heading of the root."""
SOLES: Final = ("l_sole", "r_sole")
GAZE: Final = "gaze"
OUTSIDE: Final = "CameraOutside"
"""The camera beside the robot."""
OUTSIDE_YAW: Final = math.radians(113)
"""Its yaw in `odom`, which its description lacks; a simulation places it (surroundings.py)."""
_OPTICAL: Final = (-math.pi / 2, 0.0, -math.pi / 2)


@dataclass(frozen=True, slots=True)
class Frame:
    """A frame that is fixed to another."""

    name: str
    parent: str
    position: Vector
    """In the parent's frame in m."""
    angles: Vector = NOWHERE
    """Roll, pitch and yaw in rad: about the parent's fixed x, then y, then z axis."""


def link_frames(body: Body) -> Mapping[str, str]:
    """Return the frame of each link, by the link's name; no two are equal, nor one of the robot's own."""
    names: dict[str, str] = {}
    taken = {ODOM, FOOTPRINT}
    for link in body.links:
        name = link.ros_name or link.name
        while name in taken or (name == ROOT and link is not body.root):
            name += "_"
        taken.add(name)
        names[link.name] = name
    return names


def fixed_frames(body: Body) -> list[Frame]:
    """Return the frames that never move, each after its parent.

    One that has the name of a link is left out: that link is it.
    """
    links = link_frames(body)
    root = links[body.root.name]
    frames = [Frame(root, ROOT, NOWHERE)] if root != ROOT else []
    frames += [
        Frame(links[joint.child], links[joint.parent], joint.origin, angles_at_rest(joint))
        for joint in body.fixed_joints
    ]
    taken = {ODOM, ROOT, FOOTPRINT, *links.values()}
    for frame in _sensor_frames(body, links):
        if frame.name not in taken:
            taken.add(frame.name)
            frames.append(frame)
    return frames


def angles_at_rest(joint: Joint) -> Vector:
    """Return roll, pitch and yaw of a joint's frame in its parent's, at the angle 0."""
    return angles_of(turned(joint.turn))


def camera_frame(camera: Camera | None, name: str) -> str:
    """Return the beginning of the frames of a camera; `camera` is None for one that is not on the body."""
    return (camera.ros_name if camera else None) or name


def optical_frame(camera: str) -> str:
    """Return the frame of a camera's images, by the beginning of its frames."""
    return f"{camera}_optical_frame"


def outside_frames(camera: CameraDescription) -> list[Frame]:
    """Return the frames of a camera beside the robot: it stands still where the odometry began."""
    place = camera.posx, camera.posy, camera.posz
    return list(_camera_frames(camera.name, ODOM, place, (0.0, camera.tilt, OUTSIDE_YAW)))


def _camera_frames(name: str, parent: str, position: Vector, angles: Vector) -> Iterator[Frame]:
    yield Frame(f"{name}_frame", parent, position, angles)
    yield Frame(optical_frame(name), f"{name}_frame", NOWHERE, _OPTICAL)


def _sensor_frames(body: Body, links: Mapping[str, str]) -> Iterator[Frame]:
    """Yield the frames of soles and sensors, each after its parent."""
    for name, sole in zip(SOLES, body.soles, strict=False):
        yield Frame(name, links[sole.link], (0.0, 0.0, -sole.height))
    for camera in body.cameras:
        name = camera_frame(camera, camera.name)
        yield from _camera_frames(name, links[camera.link], camera.position, (0.0, camera.tilt, 0.0))
    if body.cameras and body.neck is not None:
        yield Frame(GAZE, links[body.cameras[0].link], body.cameras[0].position)
    if (unit := body.inertial_unit) is not None:
        root = links[body.root.name]
        yield Frame("ImuTorsoAccelerometer_frame", root, unit.accelerometer)
        yield Frame("ImuTorsoGyrometer_frame", root, unit.gyrometer)
    for side, place in (("L", body.sonar.left), ("R", body.sonar.right)) if body.sonar else ():
        yield Frame(f"{side}Sonar_frame", links[place.link], place.position, place.angles)
    for side, sole in zip("LR", body.soles, strict=False):
        yield from _pressure_frames(side, sole, links[sole.link])
    for sensor, place in body.touch.items():
        yield Frame(f"{place.ros_name or sensor}_frame", links[place.link], place.position, place.angles)


def _pressure_frames(side: str, sole: Sole, link: str) -> Iterator[Frame]:
    for sensor, position in sole.pressure.items():
        corner = "".join(filter(str.isupper, sensor))  # FrontLeft: FL
        yield Frame(f"{side}Fsr{corner}_frame", link, position)
