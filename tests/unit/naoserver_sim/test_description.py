"""A body with its looks as a file, which the editor's page draws."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from naoserver.errors import RobotError
from naoserver_sim._description import describe
from tests.support.arm import ARM, ARM_TOML
from tests.support.plugins import OWN_ROBOTS

pytestmark = OWN_ROBOTS


@pytest.mark.sim
def test_a_body_of_ones_own_is_described_by_the_text_that_its_file_is_to_have(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "draft").write_text(ARM_TOML)
    describe(tmp_path / "found", str(tmp_path / "mine.toml"), tmp_path / "draft")
    found = json.loads((tmp_path / "found").read_text())
    assert (found["body"]["name"], found["body"]["title"]) == ("mine", "An arm")
    assert {shape["link"] for shape in found["looks"]["shapes"]} == {"base", "upper", "hand"}


@pytest.mark.sim
def test_what_is_wrong_is_said_with_the_name_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    (tmp_path / "draft").write_text('model = "arm.urdf"\nmounted = 7\n')
    with pytest.raises(RobotError, match=r"mine\.toml:2: mounted = 7"):
        describe(tmp_path / "found", str(tmp_path / "mine.toml"), tmp_path / "draft")
    assert not (tmp_path / "found").exists()
