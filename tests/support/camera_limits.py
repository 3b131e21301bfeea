"""Limits of the cameras of simulated robots that live in real time: no busy machine comes near them."""

from __future__ import annotations

from typing import Final

from naoserver_sim.cameras import CameraLimits
from tests.support.limits import EVENT_LIMIT, START_LIMIT

__all__ = ["PATIENT_CAMERAS"]

PATIENT_CAMERAS: Final = CameraLimits(frame=EVENT_LIMIT, setup=START_LIMIT)
