"""docs/how-to/virtual-nao.md: its programs run, and what it names exists."""

import ast
import re
import subprocess
import sys

import pytest

pytest.importorskip("qi")

from naoserver_qi.calls import Faults
from naoserver_qi.leds import ALLeds
from naoserver_qi.life import ALAutonomousLife, ALBattery, ALSystem
from naoserver_qi.memory import ALMemory, ALSonar
from naoserver_qi.motion import ALMotion
from naoserver_qi.postures import ALBehaviorManager, ALRobotPosture
from naoserver_qi.speech import ALTextToSpeech
from naoserver_qi.video import ALVideoDevice
from tests.support.limits import RUN_LIMIT
from tests.support.pages import DOCS, blocks_of
from tests.support.processes import ComponentProcess, module

PAGE = (DOCS / "how-to/virtual-nao.md").read_text("utf-8")
SERVICES = (
    *(
        ALAutonomousLife,
        ALBattery,
        ALBehaviorManager,
        ALLeds,
        ALMemory,
        ALMotion,
        ALRobotPosture,
        ALSonar,
        ALSystem,
    ),
    *(ALTextToSpeech, ALVideoDevice),
)


def operations(service):
    return {name for name in dir(service) if not name.startswith("_")}


def test_the_program_says_what_the_page_says(tmp_path):
    blocks = blocks_of(PAGE)
    program = next(block for block in blocks if block.name == "greet.py")
    (tmp_path / "greet.py").write_text(program.text, "utf-8")
    said = next(block.text for block in blocks if block.text.startswith("$ python greet.py"))
    with ComponentProcess(module("naoserver_qi", "--qi", "tcp://127.0.0.1:0", "--speed", "3")) as server:
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


def test_every_operation_in_the_table_is_there_and_no_other_is_left_out():
    table = PAGE.partition("## Services")[2].partition("ALMemory holds")[0]
    named = {name for name in re.findall(r"`(\w+)`", table) if name[0].islower()}
    there = set().union(*(operations(service) for service in SERVICES))
    switches = {name for name in there if name.endswith("Enabled")}
    settings = {
        name for name in there if re.match(r"[gs]et(Resolution|ColorSpace|FrameRate|.*Language|Volume)", name)
    }
    assert named - there == set()
    assert (
        there - named - switches - settings
        == {"getActiveCamera", "getAvailableLanguages", "setParameter"} - settings
    )


def test_the_faults_that_it_shows_exist():
    example = next(block.text for block in blocks_of(PAGE) if "faults.slow" in block.text)
    called = {
        node.func.attr
        for node in ast.walk(ast.parse(example))
        if isinstance(node, ast.Call)
        and isinstance(node.func, ast.Attribute)
        and isinstance(node.func.value, ast.Name)
        and node.func.value.id == "faults"
    }
    assert called <= operations(Faults)
