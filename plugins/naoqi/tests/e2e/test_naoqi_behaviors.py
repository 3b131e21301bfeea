"""The paper's behaviors, unchanged, on a robot over NAOqi, with a separate process for each component."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest

pytest.importorskip("qi", reason="a real robot needs libqi: pip install 'visualhfsm[naoqi]'")
pytest.importorskip("cv2", reason="nao eyes needs OpenCV: pip install 'visualhfsm[vision]'")

from interfaces.jderobot import CameraPrx, ImageData
from interfaces.nao import JointsPrx
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.robot_server import wait_for
from zenoh_ice import Communicator, initialize


@pytest.fixture(scope="module")
def endpoint() -> Iterator[str]:
    """The endpoint of the server of a robot over NAOqi."""
    endpoint = free_endpoint()
    with ComponentProcess(module("visualhfsm_naoqi.programs", "--qi", "tcp://127.0.0.1:0")) as robot:
        url = robot.wait_for(r"^ready: (\S+)")[1]
        with ComponentProcess(
            module("visualhfsm_naoqi.robot", "--robot", url, "--listen", endpoint)
        ) as server:
            server.wait_for("^ready")
            yield endpoint


@pytest.fixture
def communicator(endpoint: str) -> Iterator[Communicator]:
    """A client."""
    with initialize(connect=[endpoint], clock="wall") as communicator:
        yield communicator


def test_follow_ball_turns_the_head_to_the_ball(endpoint: str, communicator: Communicator) -> None:
    camera = CameraPrx.checkedCast(communicator.stringToProxy("Camera"))
    assert not is_centered(camera.getImageData("RGB8"))
    with (
        ComponentProcess(module("nao_tools", "eyes", "--connect", endpoint)),
        ComponentProcess(module("behaviors.follow_ball", "--connect", endpoint)),
    ):
        wait_for(camera.getImageData, is_centered)


def test_dance_moves_the_arms(endpoint: str, communicator: Communicator) -> None:
    body = JointsPrx.checkedCast(communicator.stringToProxy("Body"))
    shoulder = body.getJointNames().index("LShoulderPitch")
    before = body.getJointState().positions[shoulder]
    with ComponentProcess(module("behaviors.dance", "--connect", endpoint)):
        wait_for(body.getJointState, lambda state: abs(state.positions[shoulder] - before) > 0.2)


def is_centered(image: ImageData) -> bool:
    """Return whether the center of the clearly green pixels is in the middle tenth of both axes."""
    height, width = image.description.height, image.description.width
    pixels = np.frombuffer(image.pixelData, np.uint8).reshape(height, width, 3).astype(np.int16)
    rows, columns = np.nonzero(pixels[..., 1] - np.maximum(pixels[..., 0], pixels[..., 2]) > 50)
    return (
        len(rows) > 0
        and width * 0.45 < columns.mean() < width * 0.55
        and height * 0.45 < rows.mean() < height * 0.55
    )
