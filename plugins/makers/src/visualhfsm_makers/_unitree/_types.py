"""The messages of Unitree's robots, as DDS carries them: names, order and types are the wire."""

from __future__ import annotations

from typing import Final

from cyclonedds.idl.types import array, float32, int16, int32, int64, sequence, uint8, uint16, uint32

from visualhfsm_makers._dds import message

_API, _HG, _GO = "unitree_api.msg.dds_.", "unitree_hg.msg.dds_.", "unitree_go.msg.dds_."
_VECTOR: Final = array[float32, 3]
_SPARE: Final = array[uint32, 4]

Identity = message(f"{_API}RequestIdentity_", id=int64, api_id=int64)
"""Which call it is, and of which operation; its answer repeats both."""
Lease = message(f"{_API}RequestLease_", id=int64)
"""The maker's lease, for which these services do not ask."""
Policy = message(f"{_API}RequestPolicy_", priority=int32, noreply=bool)
RequestHeader = message(f"{_API}RequestHeader_", identity=Identity, lease=Lease, policy=Policy)
Request = message(f"{_API}Request_", header=RequestHeader, parameter=str, binary=sequence[uint8])
"""A call; `parameter` is JSON."""
Status = message(f"{_API}ResponseStatus_", code=int32)
"""How the call went: 0, or the maker's code of an error."""
ResponseHeader = message(f"{_API}ResponseHeader_", identity=Identity, status=Status)
Response = message(f"{_API}Response_", header=ResponseHeader, data=str, binary=sequence[uint8])
"""The answer to a call; `data` is JSON."""

_FOLLOWED: Final = dict.fromkeys(("q", "dq", "tau", "kp", "kd"), float32)
MotorCmd = message(f"{_HG}MotorCmd_", mode=uint8, **_FOLLOWED, reserve=uint32)
LowCmd = message(
    f"{_HG}LowCmd_",
    mode_pr=uint8,
    mode_machine=uint8,
    motor_cmd=array[MotorCmd, 35],
    reserve=_SPARE,
    crc=uint32,
)
"""A command with gains to all motors."""
_INERTIAL: Final = {
    "quaternion": array[float32, 4],
    **dict.fromkeys(("gyroscope", "accelerometer", "rpy"), _VECTOR),
}
Imu = message(f"{_HG}IMUState_", **_INERTIAL, temperature=int16)
MotorState = message(
    f"{_HG}MotorState_",
    mode=uint8,
    **dict.fromkeys(("q", "dq", "ddq", "tau_est"), float32),
    temperature=array[int16, 2],
    vol=float32,
    sensor=array[uint32, 2],
    motorstate=uint32,
    reserve=_SPARE,
)
LowState = message(
    f"{_HG}LowState_",
    version=array[uint32, 2],
    mode_pr=uint8,
    mode_machine=uint8,
    tick=uint32,
    imu_state=Imu,
    motor_state=array[MotorState, 35],
    wireless_remote=array[uint8, 40],
    reserve=_SPARE,
    crc=uint32,
)
"""The state of all motors, and of the inertial unit in the pelvis."""
BmsState = message(
    f"{_HG}BmsState_",
    **dict.fromkeys(("version_high", "version_low", "fn"), uint8),
    cell_vol=array[uint16, 40],
    bmsvoltage=array[uint32, 3],
    current=int32,
    soc=uint8,
    soh=uint8,
    temperature=array[int16, 12],
    cycle=uint16,
    manufacturer_date=uint16,
    bmsstate=array[uint32, 5],
    reserve=array[uint32, 3],
)
"""The state of the battery."""

TimeSpec = message(f"{_GO}TimeSpec_", sec=int32, nanosec=uint32)
GoImu = message(f"{_GO}IMUState_", **_INERTIAL, temperature=uint8)
PathPoint = message(
    f"{_GO}PathPoint_", **dict.fromkeys(("t_from_start", "x", "y", "yaw", "vx", "vy", "vyaw"), float32)
)
SportModeState = message(
    f"{_GO}SportModeState_",
    stamp=TimeSpec,
    error_code=uint32,
    imu_state=GoImu,
    mode=uint8,
    progress=float32,
    gait_type=uint8,
    foot_raise_height=float32,
    position=_VECTOR,
    body_height=float32,
    velocity=_VECTOR,
    yaw_speed=float32,
    range_obstacle=array[float32, 4],
    foot_force=array[int16, 4],
    foot_position_body=array[float32, 12],
    foot_speed_body=array[float32, 12],
    path_point=array[PathPoint, 10],
)
"""Where the robot believes it is, and how fast; the rest is of the maker's dogs."""
