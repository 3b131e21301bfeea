"""The thread that plays motions."""

from __future__ import annotations

from naoserver.motions.player import PERIOD, MotionPlayer
from naoserver.pumps import Pump, Schedule
from zenoh_ice import Clock


class MotionPump(Pump):
    """Let a player go on at its period in the robot's time, while something is played."""

    def __init__(self, clock: Clock, player: MotionPlayer) -> None:
        super().__init__("motions")
        self._schedule = Schedule(clock)
        self._player = player

    def _round(self) -> None:
        if not self._player.busy:
            self._schedule.idle(self._stopping)
            return
        self._player.tick()
        self._schedule.wait_for_next(self._stopping, lambda: PERIOD)
