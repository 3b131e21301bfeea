"""A component and its robot as the lines and the report see them, for tests."""

from __future__ import annotations

import base64
import gzip
import json
import math
import re
from copy import deepcopy
from functools import cache
from typing import Any

from interfaces.nao import HealthEvent, HealthReport, Severity
from tests.support.component import dance_and_follow, snapshot
from visualhfsm._commands.watch import WatchState
from visualhfsm._monitor.realm.automata import Automata
from visualhfsm._monitor.realm.robot import RobotState
from visualhfsm._monitor.realm.run_log import LiveSnapshot, RunLog

__all__ = ["content", "recorded", "watched"]


def recorded(until: float) -> RunLog:
    """Return a log from 0 on, with ten entries per second."""
    log = RunLog()
    for tenth in range(round(until * 10)):
        log.add(LiveSnapshot(tenth / 10, snapshot(tenth / 10), _robot(tenth / 10)))
    return log


def content(page: str) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return what run-page.js reads: the content, and the moments."""
    found = re.search(r'id="data">([A-Za-z0-9+/=]*)</script>', page)
    assert found
    first, *moments = gzip.decompress(base64.b64decode(found[1])).split(b"\n")
    return json.loads(first), [json.loads(each) for each in moments]


def _robot(time: float) -> RobotState:
    joints = {"LShoulderPitch": math.sin(time), "HeadYaw": 0.31, "HeadPitch": -0.07}
    event = HealthEvent(1.2, Severity.Warning, "Head", "stopped: its velocity was not renewed within 0.5 s")
    health = HealthReport(time, time, 0.99, 0.0031, 0.03, False, {"Camera": 10.0}, 0, 0, [event])
    return RobotState(joints, 0.31, -0.07, health)


_recorded = cache(recorded)


def watched(time: float = 9.5) -> WatchState:
    """Return everything known at a time, all of it recent."""
    log = _recorded(time)
    newest = deepcopy(log.newest)
    assert newest is not None
    return WatchState(
        component="dance_and_follow",
        endpoint="tcp/127.0.0.1:7447",
        automata=Automata(dance_and_follow()),
        snapshot=newest.component,
        snapshot_age=0.05,
        robot=newest.robot,
        robot_age=0.01,
    )
