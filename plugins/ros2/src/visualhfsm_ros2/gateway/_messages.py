"""Readings of the robot as ROS messages: their fields, in SI units and the axes of REP 103.

`Stamps` turns the robot's time into that of ROS. `BodyFrames` makes the tree of transforms (REP 105, 120):
`odom`, `base_link` (the torso), the links, and `base_footprint` on the floor below.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection, Iterator, Mapping, Sequence
from io import BytesIO
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from interfaces import nao
from interfaces.jderobot import CameraDescription, EncodersData, ImageData
from naoserver.bodies.body import Body
from naoserver.bodies.capabilities import Vector
from naoserver.bodies.kinematics import Matrix, angles_of, kinematics_of, matrix_of, turned
from naoserver.bodies.parts import NO_TURN, Joint, Quaternion
from visualhfsm_ros2.gateway._frames import FOOTPRINT, ODOM, ROOT, FixedFrame, fixed_frames, link_frames
from zenoh_ros2 import Types

Fields = dict[str, object]

_NS: Final = 1_000_000_000
_LEVEL_OF_TILT: Final = 1e-4  # rad2: roll and pitch to 0.01 rad
_SPEED_OVER: Final = 0.2
"""Robot seconds over which the odometry's velocity is measured."""
_SLIP: Final = 0.1
"""Standard deviation of the odometry as a share of the way, and of the angle turned: feet slip."""
_VEER: Final = 0.05
"""Standard deviation of its heading in rad for each m walked."""
_PLACED: Final = 0.01
"""Its standard deviation at the start, in m and rad."""
_HEIGHT: Final = 1e-4  # m2: the legs' angles give the height to 0.01 m
_LINEAR_VARIANCE: Final = 1e-3
"""Of each linear velocity in m2/s2: the torso sways by 0.03 m/s about that of the walk."""
_TURN_VARIANCE: Final = 1e-2
"""Of the turning velocity in rad2/s2."""
_SWAY_VARIANCE: Final = 0.25
"""Of the rates of roll and pitch in rad2/s2, which are given as 0: a walk sways by 0.5 rad/s."""
_MOST_BETWEEN: Final = 50
_HOT, _TOO_HOT = 68.0, 74.0
"""Degrees Celsius from which naoqi_driver2 calls a joint hot, and too hot."""
_LOW, _EMPTY = 0.6, 0.3
"""Charges below which naoqi_driver2 warns, and reports an error."""
_CHARGING: Final = 1
_DISCHARGING: Final = 2
_CHARGED: Final = 4
"""States of a power supply in sensor_msgs/msg/BatteryState."""
_OK: Final = 0
_WARN: Final = 1
_ERROR: Final = 2
"""Levels of diagnostic_msgs/msg/DiagnosticStatus."""
_LEVELS: Final = {nao.Severity.Info: _OK, nao.Severity.Warning: _WARN, nao.Severity.Error: _ERROR}
_FULL: Final = 0.99
_QUALITY: Final = 80
"""Of JPEG images, as image_transport's."""


class Stamps:
    """The headers of messages: the time of ROS, in a simulation the robot's, else the date; and frames."""

    def __init__(self, *, simulated: bool, frame_prefix: str = "") -> None:
        """Begin the names of all frames with `frame_prefix`, which keeps robots apart, such as `bob/`."""
        self.simulated: Final = simulated
        self.frame_prefix: Final = frame_prefix
        self._offset = 0  # ns

    def adjust(self, time: float, wall_time: float) -> None:
        """Take the date, in s since 1970, at a robot time in s."""
        if not self.simulated:
            self._offset = round((wall_time - time) * _NS)

    def ns(self, time: float) -> int:
        """Return the time of ROS in ns at a robot time in s."""
        return max(0, round(time * _NS) + self._offset)

    def stamp(self, time: float) -> Fields:
        """Return the fields of a builtin_interfaces/msg/Time."""
        sec, nanosec = divmod(self.ns(time), _NS)
        return {"sec": sec, "nanosec": nanosec}

    def robot_time(self, seconds: float) -> float:
        """Return the robot time in s at a time of ROS in s."""
        return seconds - self._offset / _NS

    def header(self, time: float, frame: str = "") -> Fields:
        """Return the fields of a std_msgs/msg/Header."""
        return {"stamp": self.stamp(time), "frame_id": frame and self.frame_prefix + frame}


def joint_state(header: Fields, names: Sequence[str], state: nao.JointState) -> Fields:
    """Return a sensor_msgs/msg/JointState; for hands, 0 is closed and 1 open."""
    return {
        "header": header,
        "name": list(names),
        "position": state.positions,
        "velocity": state.velocities,
        "effort": state.torques,
    }


def imu(header: Fields, reading: nao.InertialReading) -> Fields:
    """Return a sensor_msgs/msg/Imu; the heading is not measured: it is 0, with a variance that shows this."""
    orientation = [_LEVEL_OF_TILT, 0.0, 0.0, 0.0, _LEVEL_OF_TILT, 0.0, 0.0, 0.0, math.pi**2]
    return {
        "header": header,
        "orientation": _quaternion((reading.roll, reading.pitch, 0.0)),
        "orientation_covariance": orientation,
        "angular_velocity": _xyz(reading.angularVelocity),
        "linear_acceleration": _xyz(reading.acceleration),
    }


def sonar(header: Fields, distance: float, limits: nao.SonarLimits) -> Fields:
    """Return a sensor_msgs/msg/Range; infinite if nothing is in range (REP 117)."""
    return {
        "header": header,
        "radiation_type": 0,  # ultrasound
        "field_of_view": limits.cone,
        "min_range": limits.nearest,
        "max_range": limits.farthest,
        "range": distance,
    }


def battery(header: Fields, reading: nao.BatteryReading) -> Fields:
    """Return a sensor_msgs/msg/BatteryState; values that the robot does not measure are nan."""
    unknown = dict.fromkeys(("voltage", "charge", "capacity", "design_capacity"), math.nan)
    charging = _CHARGED if reading.charge >= _FULL else _CHARGING
    return {
        "header": header,
        **unknown,
        "temperature": reading.temperature,
        "current": reading.current,
        "percentage": reading.charge,
        "power_supply_status": charging if reading.plugged else _DISCHARGING,
        "power_supply_technology": 2,  # lithium ions
        "present": True,
    }


def foot(header: Fields, reading: nao.FootReading) -> Fields:
    """Return a naoqi_bridge_msgs/msg/FloatArrayStamped: N at front left and right, rear left and right."""
    return {
        "header": header,
        "data": [reading.frontLeft, reading.frontRight, reading.rearLeft, reading.rearRight],
    }


_BUMPER: Final = "bumper"
_HAND: Final = "hand_touch"
_HEAD: Final = "head_touch"
_BUMPERS: Final = {
    1: ("LFootBumperLeft", "LFootBumperRight"),
    0: ("RFootBumperLeft", "RFootBumperRight"),
}
_BUTTONS: Final = {"HeadFront": 1, "HeadMiddle": 2, "HeadRear": 3}
_HANDS: Final = {
    "RHandBack": 0,
    "RHandLeft": 1,
    "RHandRight": 2,
    "LHandBack": 3,
    "LHandLeft": 4,
    "LHandRight": 5,
}


def touch_kinds(sensors: Sequence[str]) -> dict[str, str]:
    """Return naoqi_driver2's topics, with their types, of some touch sensors: it has no others."""
    bumpers = [name for pair in _BUMPERS.values() for name in pair]
    kinds = {_BUMPER: ("Bumper", bumpers), _HAND: ("HandTouch", _HANDS), _HEAD: ("HeadTouch", _BUTTONS)}
    return {topic: kind for topic, (kind, names) in kinds.items() if not set(sensors).isdisjoint(names)}


def touch_events(before: Collection[str], after: Collection[str]) -> Iterator[tuple[str, Fields]]:
    """Yield naoqi_driver2's topic and fields of each sensor that was pressed or released."""
    for number, bumpers in _BUMPERS.items():
        was, is_ = (any(bumper in touched for bumper in bumpers) for touched in (before, after))
        if was != is_:
            yield _BUMPER, {"bumper": number, "state": int(is_)}
    for topic, field, numbers in ((_HAND, "hand", _HANDS), (_HEAD, "button", _BUTTONS)):
        for name, number in numbers.items():
            if (name in before) != (name in after):
                yield topic, {field: number, "state": int(name in after)}


def raw_image(header: Fields, data: ImageData) -> Fields:
    """Return a sensor_msgs/msg/Image of RGB pixels."""
    shape = data.description
    return {
        "header": header,
        "height": shape.height,
        "width": shape.width,
        "encoding": "rgb8",
        "step": 3 * shape.width,
        "data": np.frombuffer(data.pixelData, np.uint8),
    }


def compressed_image(header: Fields, data: ImageData) -> Fields:
    """Return a sensor_msgs/msg/CompressedImage: a JPEG of RGB pixels, named as image_transport does."""
    from PIL import Image  # here: it takes time to load

    size, file = (data.description.width, data.description.height), BytesIO()
    Image.frombuffer("RGB", size, data.pixelData).save(file, "JPEG", quality=_QUALITY)
    pixels = np.frombuffer(file.getvalue(), np.uint8)
    return {"header": header, "format": "rgb8; jpeg compressed bgr8", "data": pixels}


def camera_info(header: Fields, camera: CameraDescription) -> Fields:
    """Return a sensor_msgs/msg/CameraInfo without distortion: our cameras have none, real ones a little."""
    fx, fy, u, v = camera.fdistx, camera.fdisty, camera.u0, camera.v0
    return {
        "header": header,
        "height": camera.height,
        "width": camera.width,
        "distortion_model": "plumb_bob",
        "d": [0.0] * 5,
        "k": [fx, camera.skew, u, 0.0, fy, v, 0.0, 0.0, 1.0],
        "r": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        "p": [fx, camera.skew, u, 0.0, 0.0, fy, v, 0.0, 0.0, 0.0, 1.0, 0.0],
    }


def diagnostics(
    header: Fields,
    health: nao.HealthReport,
    safety: nao.SafetyState,
    joints: tuple[Sequence[str], nao.JointState],
    power: nao.BatteryReading | None,
) -> Fields:
    """Return a diagnostic_msgs/msg/DiagnosticArray: the robot, its emergency stop, joints and battery."""
    level, newest = _OK, "OK"
    if safety.lost:
        level, newest = _ERROR, f"lost: {safety.lost}"
    elif health.fallen:
        level, newest = _ERROR, "fallen"
    elif health.events:
        level, newest = _LEVELS[health.events[-1].level], health.events[-1].message
    facts = {
        "fallen": health.fallen,
        "tilt of the torso in rad": health.torsoTilt,
        "real time factor": health.realTimeFactor,
        "lag in s": health.lag,
        "commands limited": health.limitedCommands,
        "velocities timed out": health.velocityTimeouts,
    }
    stopped = safety.reason or "emergency stop" if safety.stopped else "OK"
    status = [
        _status("naoserver: robot", level, newest, facts),
        _status(
            "naoserver: emergency stop",
            _ERROR if safety.stopped else _OK,
            stopped,
            {"held by": safety.holder},
        ),
    ]
    names, state = joints
    for name, temperature, stiffness in zip(names, state.temperatures, state.stiffnesses, strict=True):
        hot, words = _OK, "OK"
        if temperature >= _TOO_HOT:
            hot, words = _ERROR, "Too hot"
        elif temperature >= _HOT:
            hot, words = _WARN, "Hot"
        values = {"Temperature": temperature, "Stiffness": stiffness}
        status.append(_status(f"naoqi_driver_joints:{name}", hot, words, values))
    if power is not None:
        level, words = _OK, "OK"
        if power.plugged:
            words = "Charging"
        elif power.charge < _LOW:
            level = _ERROR if power.charge < _EMPTY else _WARN
            words = "Discharging"
        values = {"Percentage": 100.0 * power.charge, "Charging": power.plugged, "Current": power.current}
        status.append(_status("naoqi_driver_battery:Status", level, words, values))
    return {"header": header, "status": status}


def _status(name: str, level: int, message: str, values: Mapping[str, object]) -> Fields:
    pairs = [
        {"key": key, "value": f"{value:.6g}" if isinstance(value, float) else str(value)}
        for key, value in values.items()
    ]
    hardware = name.partition(":")[2].strip()
    return {"name": name, "level": level, "message": message, "hardware_id": hardware, "values": pairs}


class BodyFrames:
    """The transforms of a body as messages, made quickly for each reading of the joints."""

    def __init__(self, types: Types, body: Body, prefix: str = "") -> None:
        self._prefix: Final = prefix
        self._joints: Final = body.joints
        self._links: Final = link_frames(body)
        self._kinematics: Final = kinematics_of(body)
        self._fixed: Final = fixed_frames(body)
        self._time: Final = types["builtin_interfaces/msg/Time"]
        self._header: Final = types["std_msgs/msg/Header"]
        self._vector: Final = types["geometry_msgs/msg/Vector3"]
        self._quaternion: Final = types["geometry_msgs/msg/Quaternion"]
        self._transform: Final = types["geometry_msgs/msg/Transform"]
        self._stamped: Final = types["geometry_msgs/msg/TransformStamped"]
        self.message: Final = types["tf2_msgs/msg/TFMessage"]
        """Makes a message of transforms."""
        self._way: deque[tuple[float, EncodersData]] = deque(maxlen=_MOST_BETWEEN)
        self._walked = 0.0  # m, since the first odometry
        self._turned = 0.0  # rad

    def fixed(self, ns: int, others: Sequence[FixedFrame] = ()) -> Any:  # noqa: ANN401 - made at run time
        """Return the tf2_msgs/msg/TFMessage of the fixed frames, and of others that are not on the body."""
        return self.message([self._of_frame(frame, ns) for frame in (*self._fixed, *others)])

    def moving(self, ns: int, angles: Sequence[float]) -> list[Any]:
        """Return the transforms of the joints at their angles in rad."""
        return [
            self._placed(self._links[joint.parent], self._links[joint.child], *_moved(joint, angle), ns)
            for joint, angle in zip(self._joints, angles, strict=True)
        ]

    def floor(
        self, ns: int, angles: Sequence[float], tilt: tuple[float, float], odometry: EncodersData | None
    ) -> tuple[list[Any], Matrix]:
        """Return the transforms below odom and base_footprint, and the place of base_link in odom.

        `tilt` is roll and pitch of the torso in rad; without odometry there is no odom, only the floor below.
        """
        by_name = {joint.name: angle for joint, angle in zip(self._joints, angles, strict=True)}
        torso = self._kinematics.torso_place(by_name, *tilt)
        feet = [(torso @ sole)[:2, 3] for sole in self._kinematics.soles(by_name)] or [torso[:2, 3]]
        x, y = np.mean(feet, axis=0)
        footprint = np.linalg.inv(torso) @ matrix_of((float(x), float(y), 0.0, 0.0, 0.0, 0.0))
        found = [self._of_matrix(ROOT, FOOTPRINT, footprint, ns)]
        if odometry is None:
            return found, torso
        place = matrix_of((odometry.robotx, odometry.roboty, 0.0, 0.0, 0.0, odometry.robottheta)) @ torso
        return [self._of_matrix(ODOM, ROOT, place, ns), *found], place

    def odometry(self, header: Fields, time: float, place: Matrix, data: EncodersData) -> Fields:
        """Return a nav_msgs/msg/Odometry of base_link: its velocity is that over the last 0.2 s.

        Its variances grow with the way, as its error does; covariances between axes are given as 0.
        """
        way = self._way
        if way and not way[-1][0] < time:  # the simulation restarted
            way.clear()
            self._walked = self._turned = 0.0
        if way:
            newest = way[-1][1]
            self._walked += math.hypot(data.robotx - newest.robotx, data.roboty - newest.roboty)
            self._turned += abs(math.remainder(data.robottheta - newest.robottheta, math.tau))
        way.append((time, data))
        while len(way) > 2 and time - way[1][0] >= _SPEED_OVER:
            way.popleft()
        then, before = way[0]
        seconds = max(time - then, 1e-3)
        ahead, aside = data.robotx - before.robotx, data.roboty - before.roboty
        turn = math.remainder(data.robottheta - before.robottheta, math.tau)
        velocity = {
            "linear": {
                "x": (data.robotcos * ahead + data.robotsin * aside) / seconds,
                "y": (data.robotcos * aside - data.robotsin * ahead) / seconds,
            },
            "angular": {"z": turn / seconds},
        }
        x, y, z = place[:3, 3].tolist()
        pose = {"position": {"x": x, "y": y, "z": z}, "orientation": _quaternion(angles_of(place))}
        placed = _PLACED**2 + (_SLIP * self._walked) ** 2
        heading = _PLACED**2 + (_SLIP * self._turned) ** 2 + (_VEER * self._walked) ** 2
        at = (placed, placed, _HEIGHT, _LEVEL_OF_TILT, _LEVEL_OF_TILT, heading)
        moving = (*(_LINEAR_VARIANCE,) * 3, _SWAY_VARIANCE, _SWAY_VARIANCE, _TURN_VARIANCE)
        return {
            "header": header,
            "child_frame_id": self._prefix + ROOT,
            "pose": {"pose": pose, "covariance": _diagonal(at)},
            "twist": {"twist": velocity, "covariance": _diagonal(moving)},
        }

    def _of_frame(self, frame: FixedFrame, ns: int) -> Any:  # noqa: ANN401
        return self._placed(frame.parent, frame.name, frame.position, _from_angles(frame.angles), ns)

    def _of_matrix(self, parent: str, child: str, place: Matrix, ns: int) -> Any:  # noqa: ANN401
        x, y, z = place[:3, 3].tolist()
        return self._placed(parent, child, (x, y, z), _from_angles(angles_of(place)), ns)

    def _placed(
        self, parent: str, child: str, position: Vector, turn: tuple[float, float, float, float], ns: int
    ) -> Any:  # noqa: ANN401
        header = self._header(self._time(*divmod(ns, _NS)), self._prefix + parent)
        return self._stamped(
            header, self._prefix + child, self._transform(self._vector(*position), self._quaternion(*turn))
        )


def _moved(joint: Joint, angle: float) -> tuple[Vector, tuple[float, float, float, float]]:
    """Return the place of a joint's frame in its parent's, and its quaternion (x, y, z, w)."""
    if joint.sliding:
        x, y, z = turned(joint.turn)[:3, :3] @ joint.axis * angle + joint.origin
        return (float(x), float(y), float(z)), _product(joint.turn, (0.0, 0.0, 0.0, 1.0))
    about = _about(joint.axis, angle)
    return joint.origin, about if joint.turn == NO_TURN else _product(joint.turn, about)


def _product(turn: Quaternion, then: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) of `turn` (w, x, y, z), then of `then` (x, y, z, w)."""
    length = math.hypot(*turn)  # figures are rounded
    w, x, y, z = (part / length for part in turn)
    a, b, c, d = then
    return (
        w * a + x * d + y * c - z * b,
        w * b - x * c + y * d + z * a,
        w * c + x * b - y * a + z * d,
        w * d - x * a - y * b - z * c,
    )


def _about(axis: Vector, angle: float) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) of a rotation by an angle in rad about a unit vector."""
    sine = math.sin(angle / 2)
    return axis[0] * sine, axis[1] * sine, axis[2] * sine, math.cos(angle / 2)


def _from_angles(angles: Vector) -> tuple[float, float, float, float]:
    """Return the quaternion (x, y, z, w) of rotations about x, then y, then z in rad."""
    (sr, cr), (sp, cp), (sy, cy) = ((math.sin(angle / 2), math.cos(angle / 2)) for angle in angles)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def _quaternion(angles: Vector) -> Fields:
    return dict(zip("xyzw", _from_angles(angles), strict=True))


def _diagonal(variances: Sequence[float]) -> NDArray[np.float64]:
    """Return a covariance of independent values, row by row."""
    return np.diag(np.asarray(variances)).reshape(-1)


def _xyz(vector: Any) -> Fields:  # noqa: ANN401 - of the interfaces
    return {axis: getattr(vector, axis) for axis in "xyz"}
