"""docs/how-to/streams.md: its programs print the documented output."""

from __future__ import annotations

import pytest

from naoserver.fake import FakeRobot
from tests.support.pages import DOCS, blocks_of
from tests.support.robot_server import served

BLOCKS = blocks_of((DOCS / "how-to/streams.md").read_text("utf-8"))
PROGRAMS = [block.text for block in BLOCKS if block.language == "python"]
OUTPUTS = [block.text for block in BLOCKS if block.language == "text"]


@pytest.mark.parametrize(
    ("program", "output"), list(zip(PROGRAMS, OUTPUTS, strict=True)), ids=["threads", "asyncio"]
)
def test_its_programs_say_what_it_says(
    program: str, output: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with served(FakeRobot()) as server:
        monkeypatch.setenv("VISUALHFSM_REALM", server.realm)
        monkeypatch.setenv("VISUALHFSM_CONNECT", server.endpoint)
        exec(compile(program, "streams.md", "exec"), {})
    assert capsys.readouterr().out == output
