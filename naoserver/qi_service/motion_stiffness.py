"""The operations of ALMotion that let motors hold or go limp."""

from __future__ import annotations

from naoserver.qi_service.access import Access
from naoserver.qi_service.calls import Call, long_call
from naoserver.qi_service.chains import joints_of
from naoserver.qi_service.postures import Postures
from naoserver.qi_service.trajectory import check_times
from naoserver.qi_service.values import number_lists, numbers

__all__ = ["StiffnessOperations"]

_WAKING = 0.5
"""Robot seconds in which the motors of a limp robot become stiff."""
_RESTING = 1.0
"""Robot seconds in which the motors of a crouching robot go limp."""
_PACE = 0.8


class StiffnessOperations:
    """Let motors hold or go limp."""

    def __init__(self, access: Access, postures: Postures) -> None:
        self._body = access.body
        self._postures = postures

    def setStiffnesses(self, names: object, stiffnesses: object) -> None:
        """Let joints hold from 0, limp, to 1; returns at once."""
        joints = joints_of(names)
        values = numbers(stiffnesses, "stiffnesses", len(joints))
        self._body.stiffen(dict(zip(joints, values, strict=True)), 0.0)

    def getStiffnesses(self, names: object) -> list[float]:
        """Return how strongly joints hold, from 0 to 1."""
        values = self._body.read().stiffnesses
        return [values[self._body.index(joint)] for joint in joints_of(names)]

    @long_call
    def stiffnessInterpolation(
        self, call: Call, names: object, stiffnessLists: object, timeLists: object
    ) -> None:
        """Change how strongly joints hold, evenly from key to key at times in s; returns at the last."""
        joints = joints_of(names)
        values = number_lists(stiffnessLists, "stiffnessLists", len(joints))
        times = number_lists(timeLists, "timeLists", len(joints))
        begun: dict[float, dict[str, tuple[float, float]]] = {}  # when: by joint, stiffness and seconds
        for joint, own, moments in zip(joints, values, times, strict=True):
            check_times(joint, moments, len(own))
            for begin, end, value in zip([0.0, *moments[:-1]], moments, own, strict=True):
                begun.setdefault(begin, {})[joint] = (value, end - begin)
            begun.setdefault(moments[-1], {})
        now = 0.0
        for begin in sorted(begun):
            if call.wait(begin - now):
                return
            now = begin
            for joint, (value, seconds) in begun[begin].items():
                self._body.stiffen({joint: value}, seconds)

    @long_call
    def wakeUp(self, call: Call) -> None:
        """Let every motor hold, and stand up; returns when the robot stands."""
        limp = {
            joint.name: 1.0
            for joint, stiffness in zip(self._body.joints, self._body.read().stiffnesses, strict=True)
            if stiffness < 1.0
        }
        if limp:
            self._body.stiffen(limp, _WAKING)
            call.wait(_WAKING)
        self._postures.go(call, "Stand", _PACE)

    @long_call
    def rest(self, call: Call) -> None:
        """Crouch, and then let every motor go limp; returns when they are."""
        if max(self._body.read().stiffnesses) > 0.0:
            self._postures.go(call, "Crouch", _PACE)
        if not call.stopped.is_set():
            self._body.stiffen({joint.name: 0.0 for joint in self._body.joints}, _RESTING)
            call.wait(_RESTING)

    def robotIsWakeUp(self) -> bool:
        """Return whether the motors hold."""
        return min(self._body.read().stiffnesses) > 0.0
