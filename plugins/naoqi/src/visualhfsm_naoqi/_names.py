"""NAOqi's names and numbers, for its client and its emulator: keys of ALMemory, lights, image sizes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from naoserver.bodies.capabilities import WalkVelocity

AXES: Final = "XYZ"
DEVICES: Final = "Device/SubDeviceList/"
GRAVITY: Final = 9.81
"""In m/s2: NAOqi gives the pressure on the feet in kg."""
JOINT_KEYS: Final[Mapping[str, str]] = {
    "positions": f"{DEVICES}{{}}/Position/Sensor/Value",
    "commands": f"{DEVICES}{{}}/Position/Actuator/Value",
    "stiffnesses": f"{DEVICES}{{}}/Hardness/Actuator/Value",
    "temperatures": f"{DEVICES}{{}}/Temperature/Sensor/Value",
    "velocities": "Motion/Velocity/Sensor/{}",
    "torques": "Motion/Torque/Sensor/{}",
}
"""The key of a joint for each field of a `JointReading`."""
IMAGE_SIZES: Final[Mapping[int, tuple[int, int]]] = {
    0: (160, 120),
    1: (320, 240),
    2: (640, 480),
    3: (1280, 960),
    4: (2560, 1920),
    5: (1280, 720),
    6: (1920, 1080),
    7: (80, 60),
    8: (40, 30),
}
"""Width and height by NAOqi's number of a resolution (alvisiondefinitions.h)."""
LIGHT_GROUPS: Final[Mapping[str, str]] = {
    "LeftEye": "LeftFaceLeds",
    "RightEye": "RightFaceLeds",
    "LeftEar": "LeftEarLeds",
    "RightEar": "RightEarLeds",
    "Head": "BrainLeds",
    "Chest": "ChestLeds",
    "LeftFoot": "LeftFootLeds",
    "RightFoot": "RightFootLeds",
}
"""ALLeds' group of each light of `Lights`."""


def touch_key(name: str) -> str:
    """Return the key of a touch sensor, as `H25.touch_sensors` calls it."""
    if name == "ChestButton":
        return f"{DEVICES}ChestBoard/Button/Sensor/Value"
    if name.startswith("Head"):
        return f"{DEVICES}Head/Touch/{name.removeprefix('Head')}/Sensor/Value"
    kind = "Touch" if name[1:].startswith("Hand") else "Bumper"
    return f"{DEVICES}{name[:5]}/{kind}/{name[5:].removeprefix('Bumper')}/Sensor/Value"


_FREQUENCIES: Final = (1 / 0.6, 1 / 0.42)
"""Steps a second at the lowest and the highest frequency (control-walk in the documentation of NAOqi 2.1)."""
_FEET: Final = 0.1
"""Distance of the feet in m, from which MaxStepY is measured."""


def gait_limits(config: Mapping[str, float]) -> WalkVelocity:
    """Return the highest velocities of a configuration of NAOqi's gait.

    Forwards, each step is MaxStepX long. To the side, only every other step moves the robot, because the feet
    cannot be nearer to each other than when it stands.
    """
    lowest, highest = _FREQUENCIES
    frequency = lowest + config["MaxStepFrequency"] * (highest - lowest)
    return WalkVelocity(
        forward=config["MaxStepX"] * frequency,
        left=(config["MaxStepY"] - _FEET) * frequency / 2.0,
        turn=config["MaxStepTheta"] * frequency,
    )
