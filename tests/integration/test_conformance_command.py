"""`pytest --pyargs naoserver.conformance --robot ...`: what it says of robots that keep the contract, and of others."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from naoserver.conformance import test_joints, test_life, test_setpoints
from naoserver.conformance._plugin import made_by, pytest_sessionstart
from naoserver.errors import RobotError
from tests.support import broken_robots
from tests.support.limits import FOREVER
from tests.support.pages import DOCS, blocks_of
from tests.support.places import ROOT
from tests.support.reader import matches
from tests.support.robot_server import served_to_client
from tests.support.soak import cases

PAGE = (DOCS / "reference/conformance.md").read_text("utf-8")


def run(folder: Path, *options: str) -> tuple[int, str]:
    """Run the suite in a folder; return its exit code and what it has written."""
    done = subprocess.run(
        [
            sys.executable,
            "-m",
            "pytest",
            "-p",
            "no:cacheprovider",
            "--pyargs",
            "naoserver.conformance",
            *options,
        ],
        cwd=folder,
        env={
            **os.environ,
            "COLUMNS": "80",
            "PYTHONPATH": os.pathsep.join([str(ROOT), os.environ.get("PYTHONPATH", "")]),
        },
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=FOREVER,
        check=False,
    )
    return done.returncode, done.stdout


def outcomes(output: str) -> dict[str, set[str]]:
    """Return the sentences that hold, those that are broken, and those that were skipped."""
    lines = re.findall(r"^  (holds|BROKEN|skipped) +(.*)$", output, re.M)
    return {word: {text for each, text in lines if each == word} for word in ("holds", "BROKEN", "skipped")}


# -- robots that keep it ----------------------------------------------------------------------------------------


@pytest.mark.sim
@pytest.mark.gl
@pytest.mark.parametrize(
    ("robot", "lacks", "holds"),
    cases(
        [
            pytest.param(
                "simulated_wheels", {"no joint that may move alone", "no couplings"}, "It walks ahead"
            ),
        ],
        [
            pytest.param(
                "fake_arm", {"no walk", "no camera", "no inertial unit", "no lights"}, "velocity command"
            ),
            pytest.param("simulated_arm", {"no walk", "no inertial unit", "no lights"}, "velocity command"),
            pytest.param("simulated_head", {"no walk", "no touch sensors"}, "velocity command"),
            pytest.param("fake_head", {"no walk", "no mechanisms"}, "An image has the size"),
            pytest.param("fake_wheels", {"no joint that may move alone"}, "It walks ahead"),
        ],
    ),
)
def test_a_robot_of_one_part_passes_and_what_it_lacks_is_named(
    robot: str, lacks: set[str], holds: str, tmp_path: Path
) -> None:
    code, output = run(tmp_path, "--robot", f"tests.support.small_robots:{robot}", "--room")
    found = outcomes(output)
    assert code == 0, output
    assert not found["BROKEN"]
    assert any(sentence.startswith((holds, f"A {holds}")) for sentence in found["holds"])
    reasons = {re.sub(r".*\((.*)\)$", r"\1", sentence) for sentence in found["skipped"]}
    assert lacks <= reasons


def test_the_server_that_visualhfsm_new_makes_passes_on_its_simulated_bus() -> None:
    code, output = run(ROOT / "visualhfsm/_commands/template_hardware", "--robot", "server:make")
    assert code == 0, output
    assert "no walk" in output


def test_the_page_shows_what_the_command_writes(tmp_path: Path) -> None:
    file, shown, broken = (block for block in blocks_of(PAGE) if block.language in ("python", "text"))
    assert file.name is not None
    quick = "from tests.support.robot_server import clock_at\n" + file.text.replace(
        "Robot(", "Robot(clock_at(4.0), "
    )
    (tmp_path / file.name).write_text(quick, "utf-8")
    (command,) = re.findall(r"^pytest --pyargs naoserver\.conformance (.*)$", PAGE, re.M)
    code, output = run(tmp_path, *command.split())
    assert code == 0, output
    assert matches(shown.text.strip(), output.strip()), output
    code, output = run(tmp_path, "--robot", "tests.support.broken_robots:Blocks", "-k", "blocks or limits")
    assert code == 1
    assert matches(f"...{broken.text.strip()}...", output), output


# -- robots that break it ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("broken", "test", "promise"),
    [
        (
            broken_robots.Swaps,
            test_joints.test_each_value_is_that_of_its_joint,
            "grip was commanded, and .*swivel",
        ),
        (broken_robots.Blocks, test_joints.test_nothing_blocks, "read blocks: it took 0.01"),
        (
            broken_robots.HurriesOn,
            test_joints.test_the_state_says_how_far_the_torso_tilts,
            "it tilts by 0.00 rad, and `fallen` is True",
        ),
    ],
)
def test_a_broken_reading_is_described(broken, test, promise) -> None:
    with served_to_client(broken(), limit=2.0) as nao, pytest.raises(AssertionError, match=promise):
        test(nao)


@pytest.mark.parametrize(
    ("broken", "test", "promise"),
    [
        (
            broken_robots.IgnoresSpeeds,
            test_setpoints.test_a_position_command_moves_the_setpoint_no_faster_than_given,
            "the setpoint of grip moved faster than the given",
        ),
        (
            broken_robots.RunsOn,
            test_setpoints.test_a_velocity_command_moves_the_setpoint_until_the_next,
            "velocity 0 does not hold the setpoint of grip",
        ),
        (
            broken_robots.Forgets,
            test_setpoints.test_a_velocity_command_moves_the_setpoint_until_the_next,
            "not within 2 s: the setpoint of grip moves at the commanded velocity",
        ),
        (
            broken_robots.RunsOn,
            test_setpoints.test_the_newest_command_replaces_the_one_before,
            "a velocity, 0, ends the way to a position",
        ),
        (
            broken_robots.Jumps,
            test_setpoints.test_a_limp_joint_heeds_nobody_and_does_not_jump_when_it_becomes_stiff,
            "grip jumped by .* when it became stiff again",
        ),
    ],
)
def test_a_broken_setpoint_is_described(broken, test, promise) -> None:
    with served_to_client(broken(), limit=2.0) as nao, pytest.raises(AssertionError, match=promise):
        test(test_setpoints.moved_of(nao))


def test_a_reading_that_goes_on_after_close_is_described() -> None:
    robot = broken_robots.CountsOn()
    robot.close()
    with pytest.raises(AssertionError, match="a reading goes on after `close`"):
        test_life.test_close_may_be_called_again_and_ends_all_motion(robot)


# -- what cannot be tested --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({}, "which robot\\? Say --robot MODULE:FUNCTION"),
        ({"robot": "naoserver.fake:FakeRobot", "numprocesses": 2}, "one robot is tested by one process"),
        ({"robot": "naoserver.fake:FakeRobot", "robot_limit": 0.0}, "it must be more than 0 s"),
    ],
)
def test_a_run_without_a_robot_or_with_several_is_refused(options: dict[str, Any], message: str) -> None:
    option = SimpleNamespace(**({"robot": None, "robot_limit": 1.0, "collectonly": False} | options))
    session: Any = SimpleNamespace(config=SimpleNamespace(option=option, stash={}))
    with pytest.raises(pytest.UsageError, match=message):
        pytest_sessionstart(session)


@pytest.mark.parametrize("error", cases(["SystemExit"], ["ValueError"]))
def test_a_robot_that_cannot_be_made_ends_the_run_with_the_place_where_that_was_raised(
    error: str,
    tmp_path: Path,
) -> None:
    (tmp_path / "mine.py").write_text(f"def make():\n    raise {error}('no bus')\n")
    code, output = run(tmp_path, "--robot", "mine:make")
    assert code == 1
    assert output.count(f"{error}: no bus") == 1
    assert 'mine.py", line 2, in make' in output


@pytest.mark.parametrize(
    ("named", "message"),
    [
        ("nowhere:make", "No module named 'nowhere'"),
        (":make", "no module"),
        ("naoserver.fake:nothing", "naoserver.fake has no function 'nothing'"),
        ("tests.support.broken_robots:half_a_robot", "a JointReading lacks balancer, body, cameras"),
    ],
)
def test_what_makes_no_robot_is_named(named: str, message: str) -> None:
    with pytest.raises((pytest.UsageError, RobotError), match=message), made_by(named)():
        pass


def test_another_run_of_pytest_knows_no_option_of_the_suite(tmp_path: Path) -> None:
    (tmp_path / "conftest.py").write_text("def pytest_addoption(parser): parser.addoption('--robot')")
    (tmp_path / "test_own.py").write_text(
        "def test_own(request): assert request.config.option.robot == 'mine'"
    )
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "--robot", "mine", "test_own.py"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        text=True,
        timeout=FOREVER,
        check=False,
    )
    assert done.returncode == 0, done.stdout
