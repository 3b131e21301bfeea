"""docs/how-to/sounds.md: its program runs, its table lists every sound."""

from __future__ import annotations

import os
import re
import subprocess
import sys

from naoserver.fake import FakeRobot
from naoserver.protocol.expression import SOUNDS
from tests.support.limits import RUN_LIMIT
from tests.support.pages import DOCS
from tests.support.robot_server import served

PAGE = (DOCS / "how-to/sounds.md").read_text(encoding="utf-8")


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


def test_the_table_lists_every_sound():
    rows = re.findall(r"^\| `(\w+)` \| (.*?) \| ([\d.]+) \|$", PAGE, re.MULTILINE)
    assert rows == [(of.name, of.description, f"{of.duration:.2f}") for of in SOUNDS.values()]
