"""A user's body is read from JSON or TOML without MuJoCo, as a robot's own computer has none."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from naoserver.bodies import read_body_file
from naoserver.body import write_body
from naoserver.errors import RobotError
from tests.support.bodies import ARM
from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT

BUST = ROOT / "visualhfsm/_commands/template_hardware/bust.toml"


def test_facts_are_read_from_json_and_toml(tmp_path: Path) -> None:
    path = tmp_path / "arm.json"
    path.write_text(write_body(ARM), "utf-8")
    assert write_body(read_body_file(path)) == write_body(ARM)
    assert read_body_file(BUST).joint_names == ("pan", "tilt", "shoulder", "elbow")


@pytest.mark.parametrize(
    ("file", "text", "says"),
    [
        ("a.toml", 'model = "a.urdf"\n', "naoserver-sim --body {0} --write-body {1}/a.json"),
        ("a.urdf", "<robot/>", "naoserver-sim --body {0} --write-body {1}/a.json"),
        ("a.toml", 'name = "A"\nlinks = [{{ name = "a", mass = 1 }}]\nwings = 2\n', "{0}:3: wings: there is"),
        ("a.toml", "name =", "{0}: not TOML"),
        ("a.json", '{{"name": "A"}}', "{0}: links is missing"),
        ("a.json", "[", "{0}: not JSON"),
    ],
)
def test_a_file_that_is_no_body_is_refused_with_its_place(
    tmp_path: Path, file: str, text: str, says: str
) -> None:
    path = tmp_path / file
    path.write_text(text.format(), "utf-8")
    with pytest.raises(RobotError, match=re.escape(says.format(path, tmp_path))):
        read_body_file(path)


@pytest.mark.slow
def test_a_server_of_hardware_loads_neither_mujoco_nor_opencv_nor_libqi() -> None:
    code = (
        "import sys; sys.path.insert(0, sys.argv[1]); import server; server.make().close()\n"
        "print(sorted({'mujoco', 'cv2', 'qi', 'PIL'} & sys.modules.keys()))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(BUST.parent)],
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=True,
    )
    assert done.stdout == "[]\n"
