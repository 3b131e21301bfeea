"""The servant that describes the robot."""

from __future__ import annotations

import json
from typing import Any

import msgspec
import pytest

from naoserver.bodies import BODY_NAMES, find_body
from naoserver.body import Body, read_body
from naoserver.serving._description import DescriptionI
from tests.support.bodies import ARM, CART, GIANT

CURRENT: Any = None


@pytest.mark.parametrize(
    "body", [*map(find_body, BODY_NAMES), ARM, CART, GIANT], ids=lambda body: str(body.name)
)
def test_who_reads_the_description_has_the_same_body(body: Body) -> None:
    described = DescriptionI(body, str).getBody(CURRENT)
    assert msgspec.to_builtins(read_body(described, "here")) == msgspec.to_builtins(body)


def test_it_is_json_that_every_reader_knows_also_of_wheels_that_turn_without_end() -> None:
    def refuse(constant: str) -> None:
        pytest.fail(f"{constant} is no JSON")

    described = json.loads(DescriptionI(CART, str).getBody(CURRENT), parse_constant=refuse)
    wheel = next(joint for joint in described["joints"] if joint["name"] == "drive_port")
    assert not {"lower", "upper"} & wheel.keys()


def test_the_looks_are_asked_for_once() -> None:
    asked = []

    def looks() -> str:
        asked.append(1)
        return '{"shapes": []}'

    servant = DescriptionI(CART, looks)
    assert asked == []
    assert [servant.getLooks(CURRENT) for _ in range(3)] == ['{"shapes": []}'] * 3
    assert asked == [1]
