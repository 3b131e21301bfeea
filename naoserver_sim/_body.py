"""A body in the model: links, joints, motors, contact shapes, cameras and sensors, made from its description.

Units and frames are those of `naoserver.body`; collision classes are in scene.xml. The visible shapes of the
body are in `appearance.py`.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from itertools import combinations
from typing import Any, Final

import mujoco

from naoserver.bodies import parts
from naoserver.bodies.footsteps import Footsteps
from naoserver.bodies.kinematics import neighbors_of
from naoserver.body import Body
from naoserver.errors import RobotError

Links = Mapping[str, mujoco.MjsBody]

SIDES: Final = ("left", "right")
BASE: Final = "base"
"""The free joint of the root link."""
MOUNT: Final = "mount"
"""The weld of a mounted body's root to the place where the robot starts."""
SHAPES: Final[Mapping[parts.ShapeKind, mujoco.mjtGeom]] = {
    "box": mujoco.mjtGeom.mjGEOM_BOX,
    "sphere": mujoco.mjtGeom.mjGEOM_SPHERE,
    "capsule": mujoco.mjtGeom.mjGEOM_CAPSULE,
    "cylinder": mujoco.mjtGeom.mjGEOM_CYLINDER,
    "ellipsoid": mujoco.mjtGeom.mjGEOM_ELLIPSOID,
    "hull": mujoco.mjtGeom.mjGEOM_MESH,
}
_FIRM: Final = (0.005, 1.0)
"""Time constant in s and damping with which couplings and loops hold."""
_UNIT: Final = "inertial unit"

# Data of a contact sensor, and its reduction of all contacts of a foot to one wrench: MuJoCo's `netforce`.
_FORCE_TORQUE_PLACE: Final = sum(
    1 << int(getattr(mujoco.mjtConDataField, f"mjCONDATA_{field}")) for field in ("FORCE", "TORQUE", "POS")
)
_NET_FORCE: Final = 3
# Lever arms in m of the friction of a shape that says its own: small, so that a wheel turns on the spot.
_TWISTING: Final = 0.003
_ROLLING: Final = 0.0001


def add_body(spec: mujoco.MjSpec, body: Body, cameras: tuple[parts.CameraFacts, ...]) -> Links:
    """Add the body on a free base with its motors and sensors; returns its links by name.

    `cameras` are those of the body with the image sizes that are simulated.
    """
    links: dict[str, mujoco.MjsBody] = {}
    for link in body.links:
        joint = body.moved_by.get(link.name)
        links[link.name] = _add_link(spec, links, link, joint, body)
    for number, shape in enumerate(body.shapes):
        _add_shape(spec, links, shape, f"contact shape {number}")
    for side, foot in zip(SIDES, body.soles, strict=False):
        if sole(side) not in [shape.name for shape in body.shapes]:
            raise RobotError(f"body {body.name}: below {foot.link} there is no shape called {sole(side)}")
    for first, second in passing_pairs(body):
        spec.add_exclude(bodyname1=first, bodyname2=second)
    for joint in body.joints:
        if joint.name in body.motors:
            gear = _gear(body, joint)
            lasting = joint.motor.continuous_torque if joint.motor else joint.max_torque
            add_motor(spec, joint, lasting).set_to_position(kp=gear.stiffness, kv=gear.damping)
    for coupling in body.couplings:
        spec.add_equality(
            type=mujoco.mjtEq.mjEQ_JOINT,
            objtype=mujoco.mjtObj.mjOBJ_JOINT,
            name1=coupling.follower,
            name2=coupling.leader,
            data=[coupling.offset, coupling.ratio, *[0] * (mujoco.mjNEQDATA - 2)],  # a polynomial
            solref=_FIRM,
        )
    for number, loop in enumerate(body.loops):
        _close(spec, links, loop, f"loop {number}")
    for facts, camera in zip(body.cameras, cameras, strict=True):
        add_camera(links[facts.link], camera)
    add_sensors(spec, body, links)
    return links


@contextmanager
def possible(body: Body) -> Iterator[None]:
    """Raise RobotError when MuJoCo finds a body impossible, such as one with a mass of no size."""
    try:
        with warnings.catch_warnings(action="ignore"):  # a body that flies apart is refused later
            yield
    except ValueError as problem:
        text = " ".join(str(problem).split())
        raise RobotError(f"body {body.name} cannot be simulated: {text}") from problem


def add_camera(parent: mujoco.MjsBody, camera: parts.CameraFacts, yaw: float = 0.0) -> None:
    """Mount a camera that looks along its parent's x axis, pitched by its tilt and turned left by `yaw`."""
    width, height = camera.sizes[0]
    half = math.tan(camera.horizontal_fov / 2)
    right = (math.sin(yaw), -math.cos(yaw), 0.0)
    ahead = math.sin(camera.tilt)
    parent.add_camera(
        name=camera.name,
        pos=camera.position,
        xyaxes=[*right, ahead * math.cos(yaw), ahead * math.sin(yaw), math.cos(camera.tilt)],
        fovy=math.degrees(2 * math.atan(half * height / width)),
    )


def add_motor(
    spec: mujoco.MjSpec, joint: parts.JointFacts, lasting: float, kind: mujoco.MjsDefault | None = None
) -> mujoco.MjsActuator:
    """Add the motor of a joint, named as the joint; `lasting` is the continuous torque in N m."""
    limited = math.isfinite(joint.upper - joint.lower)
    return spec.add_actuator(
        kind,
        name=joint.name,
        target=joint.name,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        ctrlrange=[joint.lower, joint.upper] if limited else [0.0, 0.0],
        ctrllimited=limited,
        forcerange=[-joint.max_torque, joint.max_torque],
        userdata=[lasting],
    )


def _close(spec: mujoco.MjSpec, links: Links, loop: parts.Loop, name: str) -> None:
    """Hold two links together at a place."""
    ends = f"{name} first", f"{name} second"
    links[loop.first].add_site(name=ends[0], pos=loop.place, quat=loop.turn or parts.NO_TURN)
    links[loop.second].add_site(name=ends[1], pos=loop.other)
    spec.add_equality(
        type=mujoco.mjtEq.mjEQ_CONNECT if loop.turn is None else mujoco.mjtEq.mjEQ_WELD,
        objtype=mujoco.mjtObj.mjOBJ_SITE,
        name1=ends[0],
        name2=ends[1],
        data=[*[0.0] * 10, 1.0, 0.0],  # the rotation of a weld counts as much as its place
        solref=_FIRM,
    )


def _gear(body: Body, joint: parts.Joint) -> parts.Gear:
    if not joint.gear and joint.name not in body.motors:
        return parts.Gear(stiffness=0.0)
    try:
        return body.gears[joint.gear]
    except KeyError:
        message = f"joint {joint.name}: without a gear, its stiffness and damping, it cannot be simulated"
        raise RobotError(message) from None


def _add_link(
    spec: mujoco.MjSpec, links: Links, link: parts.Link, joint: parts.Joint | None, body: Body
) -> mujoco.MjsBody:
    # The facts may count the mass of a small part in its neighbor, MuJoCo needs some.
    inertial: dict[str, Any] = {"mass": 1e-5, "inertia": [1e-8] * 3}
    if link.mass > 0:
        of = link.inertia
        inertial = {"mass": link.mass, "ipos": link.com}
        inertial["fullinertia"] = [of.ixx, of.iyy, of.izz, of.ixy, of.ixz, of.iyz]
    if joint is None and body.mounted and link.mass < body.mass / 2:
        # It cannot move, but what is light beside all that it carries would give way at its mount.
        inertial = {"mass": body.mass, "inertia": [body.mass] * 3}
    if joint is None:
        added = spec.worldbody.add_body(name=link.name, explicitinertial=True, **inertial)
        added.add_freejoint(name=BASE)
        return added
    parent = links[joint.parent]
    added = parent.add_body(
        name=link.name, pos=joint.origin, quat=joint.turn, explicitinertial=True, **inertial
    )
    if joint not in body.fixed_joints:
        gear = _gear(body, joint)
        limited = math.isfinite(joint.upper - joint.lower)
        spring = {"stiffness": [gear.stiffness, 0.0, 0.0], "springref": gear.rest} if joint.passive else {}
        added.add_joint(
            name=joint.name,
            type=mujoco.mjtJoint.mjJNT_SLIDE if joint.sliding else mujoco.mjtJoint.mjJNT_HINGE,
            axis=joint.axis,
            range=[joint.lower, joint.upper] if limited else [0.0, 0.0],
            limited=limited,
            damping=[gear.friction_damping, 0.0, 0.0],
            frictionloss=gear.friction,
            armature=gear.inertia,
            **spring,
        )
    return added


def _add_shape(spec: mujoco.MjSpec, links: Links, shape: parts.Shape, mesh: str) -> None:
    """Add a contact shape to its link; that of a hull is a mesh of the name `mesh`."""
    place: dict[str, Any] = {"pos": shape.position, "quat": shape.turn}
    if shape.kind == "hull":
        # The mass is the link's: a shell, so that a thin hull may have none.
        shell = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        spec.add_mesh(name=mesh, uservert=[part for point in shape.points for part in point], inertia=shell)
        place["meshname"] = mesh
    if shape.ends is not None:
        place = {"fromto": [*shape.ends[0], *shape.ends[1]]}
    if shape.friction is not None:
        place |= {"friction": [shape.friction, _TWISTING, _ROLLING], "priority": 1}
    links[shape.link].add_geom(
        spec.find_default("link"),
        name=shape.name,
        type=SHAPES[shape.kind],
        size=[*shape.size, 0.0, 0.0][:3],
        **place,
    )


def sole(side: str) -> str:
    """Return the name of the contact shape of the sole of a side, `left` or `right`."""
    return f"{side}_sole"


def middle_of(side: str) -> str:
    """Return the name of the site in the middle of the sole of a side, of a body that walks by footsteps."""
    return f"{side} middle"


def passing_pairs(body: Body) -> Iterator[tuple[str, str]]:
    """Yield the pairs of links that may pass through each other."""
    are_neighbors = neighbors_of(body)
    apart = {frozenset(pair) for pair in body.overlapping}
    apart |= {frozenset((loop.first, loop.second)) for loop in body.loops}
    intangible = set(body.intangible)
    for first, second in combinations((link.name for link in body.links), 2):
        if (
            not intangible.isdisjoint((first, second))
            or frozenset((first, second)) in apart
            or are_neighbors(first, second)
        ):
            yield first, second


def add_sensors(spec: mujoco.MjSpec, body: Body, links: Links) -> None:
    """Add the inertial unit, the soles' wrenches and the touch sensors that feel to the body's links."""
    sensor, kind = mujoco.mjtSensor, mujoco.mjtObj

    def measure(site: str, **sensors: mujoco.mjtSensor) -> None:
        for name, measurement in sensors.items():
            spec.add_sensor(name=name, type=measurement, objtype=kind.mjOBJ_SITE, objname=site)

    def feel(link: str) -> None:
        """Add the touch sensors of a link that feel contacts: rays from them into a box in front of them."""
        for name, touch in body.touch.items():
            if touch.link == link and touch.field is not None:
                middle, half = touch.field
                links[link].add_site(name=name, type=mujoco.mjtGeom.mjGEOM_BOX, pos=middle, size=half)
                measure(name, **{name: sensor.mjSENS_TOUCH})

    # Also in a body without such a unit: nobody reads it there.
    place = body.inertial_unit.accelerometer if body.inertial_unit else parts.NOWHERE
    links[body.root.name].add_site(name=_UNIT, pos=place)
    measure(_UNIT, acceleration=sensor.mjSENS_ACCELEROMETER, turning=sensor.mjSENS_GYRO)
    measure(_UNIT, attitude=sensor.mjSENS_FRAMEQUAT)
    for side, facts in zip(SIDES, body.soles, strict=False):
        foot, under = links[facts.link], f"{side} sole"
        foot.add_site(name=under, pos=[0, 0, -facts.height])
        if isinstance(body.walk, Footsteps):
            foot.add_site(name=middle_of(side), pos=body.walk.sole_middle)
        wrench = spec.add_sensor(
            name=f"{side} wrench", type=sensor.mjSENS_CONTACT, objtype=kind.mjOBJ_BODY, objname=foot.name
        )
        wrench.intprm[:3] = [_FORCE_TORQUE_PLACE, _NET_FORCE, 1]
        for axis in ("POS", "XAXIS", "YAXIS", "ZAXIS"):
            measure(under, **{f"{side} {axis}": getattr(sensor, f"mjSENS_FRAME{axis}")})
        feel(facts.link)
    for link in links:
        if link not in [facts.link for facts in body.soles]:
            feel(link)
