"""A stand-in for a camera: its pictures are black, and of the shape that it describes."""

from __future__ import annotations

import math

import pytest

from hfsm_runtime import Automaton, Component, Proxy, State
from hfsm_runtime.virtual import VirtualWorld
from interfaces.jderobot import CameraPrx, ConfigurationNotExistException
from tests.support.automata import automaton


class UsesCamera(Component, document="uses.xml"):
    Below = Proxy("CameraBottom", CameraPrx)

    def automaton(self) -> Automaton:
        return automaton(1, "uses", [State(id=1, name="idle")])


@pytest.mark.parametrize(
    ("pixel_format", "channels"), [("RGB8", 3), ("BGR8", 3), ("GRAY8", 1), ("YUV422", 2)]
)
def test_a_stand_in_for_a_camera_gives_black_pictures(
    caplog: pytest.LogCaptureFixture, pixel_format: str, channels: int
) -> None:
    world, component = VirtualWorld(stand_ins=True), UsesCamera()
    world.connect(component)
    camera = component.Below
    image, facts = camera.getImageData(pixel_format), camera.getCameraDescription()
    shape = image.description
    assert pixel_format in camera.getImageFormat()
    assert (shape.width, shape.height, shape.format) == (facts.width, facts.height, pixel_format)
    assert len(image.pixelData) == shape.size == facts.width * facts.height * channels > 0
    assert not any(image.pixelData) or pixel_format == "YUV422"
    assert caplog.messages == ["self.Below is a stand-in, whose pictures are black"]
    world.close()


def test_a_stand_in_for_a_camera_streams_and_sees_no_floor() -> None:
    world, component = VirtualWorld(stand_ins=True), UsesCamera()
    world.connect(component)
    sample = component.Below.getImageData.latest()
    assert sample is not None
    assert sample.value.description == component.Below.getImageDescription()
    assert math.isinf(component.Below.getFloorPoint(10.0, 10.0, 0.0).distance)
    with pytest.raises(
        ConfigurationNotExistException, match="CameraBottom is a stand-in, which has no format"
    ):
        component.Below.getImageData("HSV8")
    world.close()
