"""The messages of Booster's robots, as DDS carries them: names, order and types are the wire.

Enumerations are uint32.
"""

from __future__ import annotations

from typing import Final

from cyclonedds.idl.types import array, float32, sequence, uint8, uint32

from visualhfsm_makers._dds import message

_CALLS, _PLACE = "booster_msgs.msg.dds_.", "booster_interface.msg.dds_."
_TEXTS: Final = dict.fromkeys(("uuid", "header", "body"), str)

RpcReqMsg = message(f"{_CALLS}RpcReqMsg_", **_TEXTS)
"""A call; `header` and `body` are JSON."""
RpcRespMsg = message(f"{_CALLS}RpcRespMsg_", **_TEXTS)
"""The answer to the call of the same `uuid`."""

ImuState = message(f"{_PLACE}ImuState_", **dict.fromkeys(("rpy", "gyro", "acc"), array[float32, 3]))
MotorState = message(
    f"{_PLACE}MotorState_",
    mode=uint8,
    **dict.fromkeys(("q", "dq", "ddq", "tau_est"), float32),
    temperature=uint8,
    lost=uint32,
    reserve=array[uint32, 2],
)
LowState = message(
    f"{_PLACE}LowState_",
    imu_state=ImuState,
    motor_state_parallel=sequence[MotorState],
    motor_state_serial=sequence[MotorState],
)
"""The inertial unit and the motors, in the order of the joints."""
MotorCmd = message(
    f"{_PLACE}MotorCmd_", mode=uint8, **dict.fromkeys(("q", "dq", "tau", "kp", "kd", "weight"), float32)
)
LowCmd = message(f"{_PLACE}LowCmd_", cmd_type=uint32, motor_cmd=sequence[MotorCmd])
"""A command with gains to motors, in the order of the joints."""
Odometer = message(f"{_PLACE}Odometer_", **dict.fromkeys(("x", "y", "theta"), float32))
FallDownState = message(f"{_PLACE}FallDownState_", fall_down_state=uint32, is_recovery_available=bool)
