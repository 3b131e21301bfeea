"""The examples in docs/how-to/recording.md work as described."""

from __future__ import annotations

import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

from naoserver.fake import FakeRobot
from tests.support.commands import run_here
from tests.support.limits import RUN_LIMIT
from tests.support.pages import DOCS
from tests.support.processes import REPOSITORY
from tests.support.robot_server import served
from visualhfsm.command import app
from visualhfsm.errors import VisualHfsmError

PAGE = DOCS / "how-to/recording.md"


def commands() -> list[str]:
    blocks = re.findall(r"^```sh\n(.*?)^```", PAGE.read_text("utf-8"), re.M | re.S)
    return [line for block in blocks for line in block.splitlines()]


def run(command: str, folder: Path, endpoint: str) -> subprocess.CompletedProcess[str]:
    """Run a command of the page: `visualhfsm` here, since processes take long to start."""
    program, *arguments = shlex.split(command)
    if program == "visualhfsm":
        return run_here(app, program, *arguments, cwd=folder, expected=(VisualHfsmError,))
    return subprocess.run(
        command.replace("python -m", f"{shlex.quote(sys.executable)} -P -m"),
        shell=True,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(REPOSITORY), "VISUALHFSM_CONNECT": endpoint},
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )


def test_every_command_of_the_page_works(tmp_path: Path, endpoint: str) -> None:
    (tmp_path / "behaviors").mkdir()
    (tmp_path / "behaviors" / "dance.xml").write_bytes((REPOSITORY / "behaviors" / "dance.xml").read_bytes())
    codes = []
    with served(FakeRobot(), realm="nao", endpoint=endpoint):
        for command in commands():
            done = run(command, tmp_path, endpoint)
            assert done.returncode in (0, 3), f"{command}\n{done.stdout}{done.stderr}"
            codes.append(done.returncode)
    assert codes == [0, 0, 0, 0, 0, 3]


def test_every_topic_of_the_page_is_recorded_and_every_option_is_there() -> None:
    text = PAGE.read_text("utf-8")
    writers = ("hfsm_runtime/recording", "hfsm_recording", "visualhfsm/live")
    sources = "".join(
        path.read_text("utf-8") for folder in writers for path in (REPOSITORY / folder).glob("*.py")
    )
    topics = {topic.split("/")[1] for topic in re.findall(r"`(/[a-z]+[^`]*)`", text)}
    assert [topic for topic in sorted(topics) if f'"/{topic}' not in sources] == []
    for option in ("--from", "--until", "--json", "--record-images", "--record"):
        assert option in text
