"""Whether the joints that move a robot follow: one that does not must not be walked on with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np

from naoserver_sim._motors import Array
from naoserver_sim._simulator import Simulator

_PERIOD: Final = 0.05
"""Seconds between two looks."""
_LOOKS: Final = 13
"""Looks on which a verdict stands: those of 0.6 s, more than a step of any robot here."""
_SURE: Final = 3
"""Looks in a row in which a joint does not follow until that is said."""
_COMMANDED: Final = 0.1
"""Least range in rad of a joint's setpoints in this time of which there is a verdict."""
_AWAY: Final = 0.08
"""Least distance in rad from them that a verdict needs: the floor holds ankles of feet that bear, by 0.06."""
_BEHIND: Final = 0.3
"""Distance in rad from its setpoints, all the time, at which it does not follow: 0.05 at most is usual."""
_FOLLOWED: Final = 0.2
"""Share of this range that it must go: with noise, joints that follow go a third of it at least."""


class Following:
    """Compare the ways of joints with those of their setpoints. For the thread of the physics only."""

    def __init__(self, simulator: Simulator, joints: Sequence[str]) -> None:
        mj = simulator.mj
        motors = {int(joint): motor for motor, joint in enumerate(mj.actuator_trnid[:, 0])}
        ids = {name: mj.joint(name).id for name in joints}
        self._simulator: Final = simulator
        self._names: Final = [name for name, joint in ids.items() if joint in motors]
        self._motors: Final = np.array([motors[ids[name]] for name in self._names], np.intp)
        self._qpos: Final = np.array([mj.jnt_qposadr[ids[name]] for name in self._names], np.intp)
        self._looks: Final[Array] = np.zeros((_LOOKS, 2, len(self._names)))
        self._count = 0  # of looks since the motion began
        self._since = 0.0
        self._astray = np.zeros(len(self._names), np.intp)  # looks in which each did not follow, to the last

    def begin(self) -> None:
        """Begin a motion."""
        self._count = 0
        self._since = _PERIOD
        self._astray[:] = 0

    def tick(self, seconds: float) -> str:
        """Advance by some seconds; return the name of a joint that does not follow, or an empty text."""
        self._since += seconds
        if self._since < _PERIOD - 1e-6 or not self._names:
            return ""
        self._since = 0.0
        look = self._looks[self._count % _LOOKS]
        look[0] = self._simulator.setpoints.setpoints[self._motors]
        look[1] = self._simulator.newest().measured[self._qpos]
        self._count += 1
        if self._count < _LOOKS:
            return ""
        commanded, done = self._looks.max(axis=0) - self._looks.min(axis=0)
        off = np.abs(self._looks[:, 0] - self._looks[:, 1])
        stays = (commanded >= _COMMANDED) & (done < _FOLLOWED * commanded) & (off.max(axis=0) > _AWAY)
        astray = stays | (off.min(axis=0) > _BEHIND)
        # A wall holds all wheels, and a robot that is thrown over leans soon.
        self._astray = np.where(astray & (not astray.all()), self._astray + 1, 0)
        return self._names[int(self._astray.argmax())] if self._astray.max() >= _SURE else ""
