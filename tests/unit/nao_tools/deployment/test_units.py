"""The units of systemd for a stack."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from nao_tools._deployment.stack import ProcessSpec, StackError, load_stack, stack_path
from nao_tools._deployment.units import write_units
from tests.support.limits import RUN_LIMIT
from tests.support.plugins import needs

AWKWARD = ("python", "-c", "a b", 'q"\\', "50%", "$HOME", "two\nlines", "")
PROCESSES = [
    ProcessSpec(name="robot", command=("python", "-m", "robot"), ready="^ready", notify=True,
                watchdog=12.5, restart="on-failure", restart_limit=3, restart_pause=2.0),
    ProcessSpec(name="ball", command=AWKWARD, after=("robot",), environment={"A": "x y%", "B": "$C"},
                stop_timeout=7.5),
    ProcessSpec(name="view", command=("view",), after=("ball",), foreground=True),
]  # fmt: skip


@pytest.fixture
def units(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, str]:
    """Return the units of a stack, which are in the present directory."""
    monkeypatch.chdir(tmp_path)
    return {path.name: path.read_text("utf-8") for path in write_units("lab", PROCESSES, tmp_path)}


def verified(folder: Path, names: list[str]) -> list[str]:
    """Return what systemd finds wrong with units, in its words."""
    if shutil.which("systemd-analyze") is None:
        pytest.skip("systemd-analyze is not installed")
    done = subprocess.run(
        ["systemd-analyze", "verify", *(str(folder / name) for name in names)],
        env={**os.environ, "SYSTEMD_LOG_COLOR": "0"}, capture_output=True, text=True, timeout=RUN_LIMIT,
    )  # fmt: skip
    return [line for line in done.stderr.splitlines() if any(name in line for name in names)]


@pytest.mark.slow
def test_systemd_takes_the_units(units: dict[str, str], tmp_path: Path) -> None:
    assert sorted(units) == ["lab-alert@.service", "lab-ball.service", "lab-robot.service", "lab.target"]
    assert verified(tmp_path, sorted(units)) == []


@pytest.mark.slow
def test_systemd_finds_a_mistake(units: dict[str, str], tmp_path: Path) -> None:
    (tmp_path / "lab-robot.service").write_text(units["lab-robot.service"].replace("KillMode", "KilMode"))
    assert any("KilMode" in line for line in verified(tmp_path, sorted(units)))


@pytest.mark.slow
@pytest.mark.parametrize(
    "machine", [pytest.param("robot", marks=needs("visualhfsm_naoqi")), "simulation", "operator"]
)
def test_systemd_takes_the_units_of_the_laboratory(machine: str, tmp_path: Path) -> None:
    stack = load_stack(stack_path("lab")).on_machine(machine)
    files = write_units(stack.name, stack.with_variables({}), tmp_path)
    assert verified(tmp_path, [file.name for file in files]) == []


def test_a_unit_starts_in_order_is_ready_when_it_says_so_and_is_restarted(units: dict[str, str]) -> None:
    robot, ball = units["lab-robot.service"].splitlines(), units["lab-ball.service"].splitlines()
    assert {"Type=notify", "Restart=on-failure", "RestartSec=2", "StartLimitBurst=4", "KillSignal=SIGINT",
            "StartLimitIntervalSec=328", "RestartPreventExitStatus=2 127", "PartOf=lab.target"} < set(robot)  # fmt: skip
    assert {"Type=exec", "Restart=no", "TimeoutStopSec=15", f"WorkingDirectory={Path.cwd()}",
            "Wants=network-online.target lab-robot.service"} < set(ball)  # fmt: skip
    (after,) = (line for line in ball if line.startswith("After="))
    assert after.endswith(" lab-robot.service")
    assert "Wants=lab-robot.service lab-ball.service" in units["lab.target"].splitlines()


def test_a_unit_that_hangs_is_ended_and_one_that_fails_for_good_starts_an_alert(
    units: dict[str, str],
) -> None:
    robot, ball = units["lab-robot.service"].splitlines(), units["lab-ball.service"].splitlines()
    assert {"WatchdogSec=12.5", "KillMode=process"} < set(robot), "its dead man's switch is to stop the robot"
    assert "KillMode=mixed" in ball
    assert not any(line.startswith("WatchdogSec") for line in ball), "it reports nothing to systemd"
    for lines in (robot, ball):
        assert lines.index("OnFailure=lab-alert@%n.service") < lines.index("[Service]")
    assert "systemctl edit lab-alert@.service" in units["lab-alert@.service"]


def test_a_unit_has_limits_and_may_change_nothing_of_the_system(units: dict[str, str]) -> None:
    for name in ("lab-robot.service", "lab-ball.service"):
        assert {"MemoryMax=2G", "TasksMax=4096", "LimitNOFILE=8192", "NoNewPrivileges=yes",
                "ProtectSystem=full", "CapabilityBoundingSet="} < set(units[name].splitlines())  # fmt: skip


def test_words_of_a_command_reach_it_as_they_are(units: dict[str, str]) -> None:
    (line,) = re.findall("^ExecStart=(.*)$", units["lab-ball.service"], re.M)
    python = f'"{sys.executable}"' if " " in sys.executable else sys.executable
    assert line == rf'{python} -c "a b" "q\"\\" "50%%" "$$HOME" "two\nlines" ""'
    assert 'Environment=PYTHONUNBUFFERED=1 "A=x y%%" "B=$C"' in units["lab-ball.service"].splitlines()


def test_only_what_was_written_before_is_written_again(tmp_path: Path) -> None:
    for _ in range(2):
        write_units("lab", PROCESSES, tmp_path)
    target = tmp_path / "lab.target"
    target.write_text("[Unit]")
    with pytest.raises(StackError, match=r"lab\.target: was not written by `nao stack`: delete it, or"):
        write_units("lab", PROCESSES, tmp_path)
    assert target.read_text() == "[Unit]"
    with pytest.raises(StackError, match=r"lab\.target/lab\.target: cannot be written: File exists"):
        write_units("lab", PROCESSES, target)


def test_what_needs_a_terminal_is_no_unit(tmp_path: Path) -> None:
    with pytest.raises(StackError, match="lab: all of it needs a terminal"):
        write_units("lab", PROCESSES[2:], tmp_path)
