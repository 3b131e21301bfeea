"""The motors of the model: position servos with the limits of their joints."""

from __future__ import annotations

import mujoco

from naoserver.body import Joint
from naoserver.robot import JointFacts


def add_motor(spec: mujoco.MjSpec, joint: Joint | JointFacts, *, kp: float, kv: float) -> None:
    """Add the motor of a joint, named as the joint: it pulls towards its setpoint.

    `kp` is in N m/rad and `kv` in N m s/rad; of a slide in N/m and N s/m.
    """
    motor = spec.add_actuator(
        name=joint.name,
        target=joint.name,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        ctrllimited=mujoco.mjtLimited.mjLIMITED_TRUE,
        ctrlrange=[joint.lower, joint.upper],
        forcelimited=mujoco.mjtLimited.mjLIMITED_TRUE,
        forcerange=[-joint.max_torque, joint.max_torque],
    )
    motor.set_to_position(kp=kp, kv=kv)
