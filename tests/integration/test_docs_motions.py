"""docs/how-to/motions.md: its program runs, its file is a motion, its table lists every motion."""

from __future__ import annotations

import os
import re
import subprocess
import sys

import pytest

from naoserver.bodies import find_body
from naoserver.fake import FakeRobot
from naoserver.moves.motion_file import MotionError, load_motions, parse_motion
from tests.support.limits import RUN_LIMIT
from tests.support.pages import DOCS
from tests.support.robot_server import served

H25 = find_body("H25")
PAGE = (DOCS / "how-to/motions.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, re.DOTALL)


def test_the_program_does_what_the_page_says():
    with served(FakeRobot()) as robot:
        done = subprocess.run(
            [sys.executable, "-c", blocks("python")[0]],
            env={**os.environ, "VISUALHFSM_REALM": robot.realm, "VISUALHFSM_CONNECT": robot.endpoint},
            capture_output=True,
            text=True,
            timeout=RUN_LIMIT,
            check=False,
        )
    assert (done.stdout, done.returncode) == (blocks("text")[0], 0), done.stderr


def test_the_file_is_a_motion_and_what_is_wrong_is_reported_as_the_page_says():
    (text,) = blocks("toml")
    assert parse_motion(text, "nod", "nod.toml", H25).duration == 1.0
    with pytest.raises(MotionError) as reported:
        parse_motion(text.replace("HeadPitch = 0.3", "HeadPitch = 0.9"), "nod", "nod.toml", H25)
    assert f"{reported.value}\n" == blocks("text")[1]


@pytest.mark.parametrize(("body", "column"), [("H25", ""), ("T1", r"T1 \| "), ("G1", r"G1 \| ")])
def test_the_tables_report_every_motion(body, column):
    rows = re.findall(rf"^\| {column}(`.*?`) \| (.*?) \| (.*?) \| ([\d.]+) \|$", PAGE, re.MULTILINE)
    reported: dict[str, object] = {
        name: (begin, end, float(seconds))
        for names, begin, end, seconds in rows
        for name in re.findall(r"`(\w+)`", names)
    }
    assert reported == {
        name: (of.start or "any posture", of.end or "as it began", pytest.approx(of.duration, abs=0.06))
        for name, of in load_motions(find_body(body)).items()
    }
