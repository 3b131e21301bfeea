"""The paper's experiments, with a separate process for each component."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from contextlib import ExitStack

import numpy as np
import pytest

from interfaces.hfsm import HfsmMonitorPrx
from interfaces.jderobot import CameraPrx, ImageData
from interfaces.nao import HealthPrx
from tests.support.limits import EVENT_LIMIT, START_LIMIT
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.soak import repeated
from zenoh_ice import Communicator, Sample, initialize

pytestmark = [pytest.mark.slow, pytest.mark.gl]

IMAGES = repeated(30, 50)


@pytest.fixture
def stack() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def start_robot(stack: ExitStack, *options: str) -> tuple[str, Communicator]:
    """Start the simulated robot; return its endpoint and a communicator connected to it."""
    endpoint = free_endpoint()
    server = stack.enter_context(ComponentProcess(module("naoserver_sim", "--listen", endpoint, *options)))
    server.wait_for("ready")
    return endpoint, stack.enter_context(initialize(connect=[endpoint]))


def is_centered(image: ImageData) -> bool:
    """Return whether the center of the clearly green pixels is in the middle third of both axes."""
    height, width = image.description.height, image.description.width
    pixels = np.frombuffer(image.pixelData, np.uint8).reshape(height, width, 3).astype(np.int16)
    green = pixels[..., 1] - np.maximum(pixels[..., 0], pixels[..., 2]) > 50
    rows, columns = np.nonzero(green)
    return (
        len(rows) > 0
        and width / 3 < columns.mean() < 2 * width / 3
        and height / 3 < rows.mean() < 2 * height / 3
    )


def test_follow_ball_keeps_the_green_ball_in_the_middle_of_the_image(stack: ExitStack) -> None:
    endpoint, communicator = start_robot(stack, "--speed", "2")
    for command in (
        module("ballmover", "green", "--loop", "--connect", endpoint),
        module("behaviors.follow_ball", "--connect", endpoint),
    ):
        stack.enter_context(ComponentProcess(command))
    monitor = HfsmMonitorPrx.uncheckedCast(communicator.stringToProxy("Hfsm.follow_ball"))
    started = monitor.getSnapshot.wait(timeout=START_LIMIT)
    camera = CameraPrx.checkedCast(communicator.stringToProxy("Camera"))

    # Of images in a row nine of ten; on a busy machine it may take a while until it keeps up for so long.
    centered: deque[bool] = deque(maxlen=IMAGES)
    sample: Sample[ImageData] | None = None
    while len(centered) < IMAGES or sum(centered) < 0.9 * IMAGES:
        sample = camera.getImageData.wait(after=sample, timeout=START_LIMIT)
        assert sample.time < started.time + 200, "it loses the ball"
        if sample.time > started.time + 3:
            centered.append(is_centered(sample.value))


def test_dance_and_follow_changes_by_the_timeline_of_the_paper_and_keeps_its_balance(
    stack: ExitStack,
) -> None:
    endpoint, communicator = start_robot(stack, "--speed", "2")  # a busy machine may be late by half a second
    for command in (
        module("ballmover", "red", "--loop", "--connect", endpoint),
        module("ballmover", "green", "--loop", "--connect", endpoint),
        module("behaviors.dance_and_follow", "--connect", endpoint),
    ):
        stack.enter_context(ComponentProcess(command))
    monitor = HfsmMonitorPrx.uncheckedCast(communicator.stringToProxy("Hfsm.dance_and_follow"))
    health = HealthPrx.uncheckedCast(communicator.stringToProxy("Health"))

    snapshot = monitor.getSnapshot.wait(timeout=START_LIMIT)
    structure = monitor.getStructure()
    names = {(a.id, s.id): s.name for a in structure.automata for s in a.states}
    root, follow, dance = (
        a.id for a in structure.automata if a.name in ("dance_and_follow", "followBall", "dance")
    )
    entered: dict[int, list[tuple[str, float]]] = {root: [], follow: [], dance: []}
    tilt = 0.0
    while len(entered[root]) < 4:
        for automaton in snapshot.value.automata:
            entry = (names[automaton.id, automaton.state], automaton.enteredAt)
            changes = entered.get(automaton.id)
            if changes is not None and not automaton.ghost and entry not in changes[-1:]:
                changes.append(entry)
        report = health.getHealth.latest()
        tilt = max(tilt, report.value.torsoTilt if report else 0.0)
        snapshot = monitor.getSnapshot.wait(after=snapshot, timeout=EVENT_LIMIT)

    assert [name for name, _ in entered[root]] == ["followBall", "dance", "followBall", "dance"]
    assert [at for _, at in entered[root]] == pytest.approx([0, 10, 20, 30], abs=2.0)
    assert [name for name, _ in entered[follow]][:3] == ["red", "green", "red"]
    assert [at for _, at in entered[follow]][:3] == pytest.approx([0, 8, 26], abs=2.0)
    assert [name for name, _ in entered[dance]][:2] == ["right", "left"]
    assert tilt < math.radians(10)
