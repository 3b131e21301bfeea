"""A component and its robot as the view and the report see them, for tests."""

from __future__ import annotations

import math
from dataclasses import replace

from interfaces.nao import HeadPose, HealthEvent, HealthReport, Severity
from tests.support.component import ball_variables, dance_and_follow, snapshot
from visualhfsm.watch.automata import Automata
from visualhfsm.watch.recording import ARM_JOINTS, Recording, RobotReading
from visualhfsm.watch.scene import STALE_HEALTH, Aged, Scene

__all__ = ["aged", "recorded", "scene"]


def recorded(until: float) -> Recording:
    """Return a recording from 0 on, ten rows a second."""
    recording = Recording(Automata(dance_and_follow()))
    for tenth in range(round(until * 10)):
        recording.add(snapshot(tenth / 10, ball_variables(12.5, -3.25)), _robot(tenth / 10))
    return recording


def _robot(time: float) -> RobotReading:
    joints = {side + name: math.sin(time) for side in "LR" for name in ARM_JOINTS}
    return RobotReading(0.31, -0.07, joints, 1.0, 0.003, 0.05, 10.0)


def scene(time: float = 9.5) -> Scene:
    """Return what is seen at a time, all of it fresh."""
    recording = recorded(time)
    newest = recording.newest
    assert newest is not None
    event = HealthEvent(1.2, Severity.Warning, "Head", "velocity not renewed")
    health = HealthReport(time, time, 0.99, 0.0031, 0.03, False, {"Camera": 10.0}, 0, 0, [event])
    return Scene(
        component="dance_and_follow",
        endpoint="tcp/127.0.0.1:7447",
        elapsed=time,
        seconds=60.0,
        automata=recording.automata,
        snapshot=Aged(newest, 0.05),
        ball=recording.rows[-1].ball,
        changes=list(recording.changes),
        head=Aged(HeadPose(time, 0.31, -0.07, 0.0, 0.0), 0.01),
        joints=Aged(recording.rows[-1].robot.joints, 0.01),
        limits={"HeadYaw": (-2.0, 2.0), "LShoulderPitch": (-2.0, 2.0)},
        health=Aged(health, 0.3, STALE_HEALTH),
    )


def aged(scene: Scene, seconds: float, *names: str) -> Scene:
    """Return a scene in which some parts were last heard of so long ago."""
    return replace(scene, **{name: replace(getattr(scene, name), age=seconds) for name in names})
