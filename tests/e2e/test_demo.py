"""The demo as its user starts it: five processes from one command, and none of them remains."""

from __future__ import annotations

import re
import signal
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from tests.support.limits import END_LIMIT, RUN_LIMIT
from tests.support.processes import REPOSITORY, ComponentProcess, free_endpoint, module
from tests.support.watching import content

pytestmark = [pytest.mark.slow, pytest.mark.gl]


@pytest.fixture
def demo(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[ComponentProcess]:
    """Start the demo at three times its speed for longer than any test takes, or as the parameter says."""
    seconds, speed = getattr(request, "param", (600, 3))
    stack = tmp_path / "demo.toml"
    text = (REPOSITORY / "deploy" / "demo.toml").read_text("utf-8")
    stack.write_text(text.replace('log_dir = "demo/logs"', f'log_dir = "{tmp_path}/logs"'))
    command = module(
        "deploy.nao", "stack", str(stack), "--seconds", str(seconds),
        "--set", f"speed={speed}", "--set", f"report={tmp_path / 'report.html'}", "--set", f"endpoint={free_endpoint()}",
    )  # fmt: skip
    with ComponentProcess(command) as demo:
        yield demo


def components(demo: ComponentProcess) -> list[psutil.Process]:
    """Return the processes of the demo once all of them run."""
    demo.wait_for(r"images/s", RUN_LIMIT)
    running = list(psutil.Process(demo.process.pid).children(recursive=True))
    assert len(running) == 5
    return running


def assert_gone(processes: list[psutil.Process]) -> None:
    _, alive = psutil.wait_procs(processes, timeout=END_LIMIT)
    assert [
        " ".join(process.cmdline()) for process in alive if process.status() != psutil.STATUS_ZOMBIE
    ] == []


# Faster, a busy machine could miss the ball for longer than its share is counted.
@pytest.mark.parametrize("demo", [(8, 1)], indirect=True, ids=["8 s"])
def test_the_demo_ends_by_itself_with_a_summary_and_a_report(demo: ComponentProcess, tmp_path: Path) -> None:
    running = components(demo)

    assert demo.wait(RUN_LIMIT) == 0, demo.output
    assert_gone(running)
    assert re.search(r"watched +\d+\.\d s", demo.output)
    assert re.search(r"ball in the middle third +\d", demo.output)
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    found, _ = content(page)
    assert found["pictures"]["Camera"]
    assert found["world"]
    assert {log.name for log in (tmp_path / "logs").iterdir()} == {
        "naoserver.log", "ball-red.log", "ball-green.log", "dance_and_follow.log",
    }  # fmt: skip


def test_ctrl_c_ends_every_process_of_the_demo(demo: ComponentProcess) -> None:
    running = components(demo)
    demo.process.send_signal(signal.SIGINT)

    assert demo.wait(END_LIMIT) == 130, demo.output
    assert_gone(running)
    assert re.search(r"watched +\d+\.\d s", demo.output)
    assert "Traceback" not in demo.output


def test_the_death_of_a_component_ends_the_demo_and_is_reported(demo: ComponentProcess) -> None:
    running = components(demo)
    robot = next(process for process in running if "naoserver-sim" in " ".join(process.cmdline()))
    robot.kill()

    assert demo.wait(RUN_LIMIT) == 1, demo.output
    assert_gone(running)
    assert re.search(r"naoserver was terminated by SIGKILL after \d+\.\d s\. The last lines of ", demo.output)
