"""plugins/naoqi/docs/virtual-nao.md: its programs run, and what it names exists."""

import queue
import re
import subprocess
import sys

import pytest

pytest.importorskip("qi")

from plugins.naoqi.tests.support.naoqi import connected
from tests.support.limits import EVENT_LIMIT, RUN_LIMIT
from tests.support.pages import blocks_of
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess, module
from visualhfsm_naoqi.programs import _service as service

PAGE = (ROOT / "plugins/naoqi/docs/virtual-nao.md").read_text("utf-8")


def test_the_program_says_what_the_page_says(tmp_path):
    blocks = blocks_of(PAGE)
    program = next(block for block in blocks if block.name == "greet.py")
    (tmp_path / "greet.py").write_text(program.text, "utf-8")
    said = next(block.text for block in blocks if block.text.startswith("$ python greet.py"))
    with ComponentProcess(
        module("visualhfsm_naoqi.programs", "--qi", "tcp://127.0.0.1:0", "--speed", "3")
    ) as server:
        url = server.wait_for(r"^ready: (\S+)")[1]
        result = subprocess.run(
            [sys.executable, "greet.py", url],
            cwd=tmp_path,
            capture_output=True,
            text=True,
            timeout=RUN_LIMIT,
            check=False,
        )
    assert result.returncode == 0, result.stderr
    own = [line for line in result.stdout.splitlines() if not line.startswith("[")]  # the others are libqi's
    assert own == said.splitlines()[1:]


def test_typed_speech_is_recognized_as_the_page_says() -> None:
    section = PAGE.partition("## Typed speech")[2].partition("## ")[0]
    (example,) = blocks_of(section)
    with (
        ComponentProcess(module("plugins.naoqi.tests.support.faulty", "--qi", "tcp://127.0.0.1:0")) as server,
        connected(server.wait_for(r"^ready: (\S+)")[1]) as session,
    ):
        heard: queue.Queue[object] = queue.Queue()
        names = {"session": session, "print": heard.put}  # they keep the subscriber
        exec(compile(example.text, "virtual-nao.md", "exec"), names)
        assert session.service("Faults").say("Please go left") == "go left"
        value = heard.get(timeout=EVENT_LIMIT)
    assert str(value).replace("'", '"') in section


def test_every_service_is_in_the_table() -> None:
    table = PAGE.partition("## Services")[2].partition("[NAOqi on")[0]
    assert set(re.findall(r"AL\w+", table)) == set(service.SERVICES)
