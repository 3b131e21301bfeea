"""A robot's share of a simulation: its part of the arrays of a model in which others may stand, too."""

from __future__ import annotations

from typing import Final, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

_ALL: Final = slice(None)


class Share(NamedTuple):
    """Where a robot is in the arrays of the whole model; by default, everything is its own.

    A robot computes with its own model, in which nobody else stands: what it costs does not grow with
    the others. Its indices there are places in its share, which is contiguous in each array.
    """

    prefix: str = ""
    """What its names begin with in the whole model."""
    qpos: slice = _ALL
    dofs: slice = _ALL
    motors: slice = _ALL
    sensors: slice = _ALL
    bodies: slice = _ALL
    """Those of its model: the first ones, which do not move, may be others here, and are not to be used."""


ALONE: Final = Share()
"""The share of a robot that is alone."""

STATE: Final = {"qpos": "qpos", "qvel": "dofs", "qacc_warmstart": "dofs", "ctrl": "motors"}
"""The arrays of its state that make a robot stand, and which part of its share is in each."""
PLACES: Final = {"cam_pos": mujoco.mjtObj.mjOBJ_CAMERA, "eq_data": mujoco.mjtObj.mjOBJ_EQUALITY}
"""The arrays of its model that are set once it is compiled, and what has rows there, by its name."""


def share_of(whole: mujoco.MjModel, own: mujoco.MjModel, root: str, prefix: str) -> Share:
    """Return where a robot is in the whole, by its own model; `root` is its first link there."""
    base, there = own.body(root).id, whole.body(prefix + root).id
    free, free_there = own.body_jntadr[base], whole.body_jntadr[there]

    def part(begin: int, begin_there: int, count: int) -> slice:
        return slice(begin_there - begin, begin_there - begin + count)

    motor = own.actuator(0).name if own.nu else ""
    sensor = own.sensor(0).name
    return Share(
        prefix,
        part(own.jnt_qposadr[free], whole.jnt_qposadr[free_there], own.nq),
        part(own.jnt_dofadr[free], whole.jnt_dofadr[free_there], own.nv),
        part(0, whole.actuator(prefix + motor).id if own.nu else 0, own.nu),
        part(0, whole.sensor(prefix + sensor).adr[0], own.nsensordata),
        part(base, there, own.nbody),
    )


def move_in(
    whole: mujoco.MjModel, data: mujoco.MjData, share: Share, own: mujoco.MjModel, state: mujoco.MjData
) -> None:
    """Let a robot be in its share as it is in its own model and state."""
    for array, part in STATE.items():
        getattr(data, array)[getattr(share, part)] = getattr(state, array)
    for array, kind in PLACES.items():
        for row, values in enumerate(getattr(own, array)):
            if name := mujoco.mj_id2name(own, kind, row):
                getattr(whole, array)[mujoco.mj_name2id(whole, kind, share.prefix + name)] = values


class RobotData:
    """The state of a robot: views of its share of MuJoCo's arrays, of the same names."""

    def __init__(self, data: mujoco.MjData, share: Share) -> None:
        qpos, dofs, motors, bodies = share.qpos, share.dofs, share.motors, share.bodies
        self.qpos: Final[NDArray[np.float64]] = data.qpos[qpos]
        self.qvel: Final[NDArray[np.float64]] = data.qvel[dofs]
        self.qacc_warmstart: Final[NDArray[np.float64]] = data.qacc_warmstart[dofs]
        self.qfrc_bias: Final[NDArray[np.float64]] = data.qfrc_bias[dofs]
        self.ctrl: Final[NDArray[np.float64]] = data.ctrl[motors]
        self.actuator_force: Final[NDArray[np.float64]] = data.actuator_force[motors]
        self.actuator_length: Final[NDArray[np.float64]] = data.actuator_length[motors]
        self.sensordata: Final[NDArray[np.float64]] = data.sensordata[share.sensors]
        self.xpos: Final[NDArray[np.float64]] = data.xpos[bodies]
        self.xmat: Final[NDArray[np.float64]] = data.xmat[bodies]
        self.xipos: Final[NDArray[np.float64]] = data.xipos[bodies]
        self.xfrc_applied: Final[NDArray[np.float64]] = data.xfrc_applied[bodies]
