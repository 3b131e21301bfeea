"""The stream of poses: which robot, the world, then moments."""

from __future__ import annotations

import asyncio
import json
from typing import Any

import pytest

from visualhfsm._monitor.poses import PoseStream
from visualhfsm._monitor.realm.description import nao
from visualhfsm._monitor.realm.robot import RobotMonitor
from zenoh_ice import initialize


@pytest.mark.slow
def test_without_a_robot_the_stream_begins_with_a_nao_the_balls_and_a_state_without_joints() -> None:
    async def first(count: int) -> list[dict[str, Any]]:
        with initialize(connect=[], listen=[], clock="wall") as communicator:
            frames = PoseStream(RobotMonitor(communicator)).frames()
            found = [json.loads(await anext(frames)) for _ in range(count)]
            await frames.aclose()
            return found

    robot, world, state = asyncio.run(first(3))
    assert robot == {"body": nao().hash, "why": ""}
    assert {shape["object"] for shape in world["world"]} == {"BallGreen", "BallRed"}
    assert state == {"joints": {}, "tilt": None, "torso": None, "objects": {}, "others": {}}
