"""The demo as its user starts it: five processes from one command, and none of them remains."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from tests.support.limits import RUN_LIMIT
from tests.support.processes import REPOSITORY, ComponentProcess, assert_gone, free_endpoint, module
from tests.support.watching import content

pytestmark = [pytest.mark.slow, pytest.mark.gl]


@pytest.fixture
def demo(tmp_path: Path) -> Iterator[ComponentProcess]:
    """Start the demo; faster, a busy machine could miss the ball for longer than its share is counted."""
    stack = tmp_path / "demo.toml"
    text = (REPOSITORY / "deploy" / "demo.toml").read_text("utf-8")
    stack.write_text(text.replace('log_dir = "demo/logs"', f'log_dir = "{tmp_path}/logs"'))
    command = module(
        "nao_tools", "stack", str(stack), "--seconds", "4",
        "--set", f"report={tmp_path / 'report.html'}", "--set", f"endpoint={free_endpoint()}",
    )  # fmt: skip
    with ComponentProcess(command) as demo:
        yield demo


def test_the_demo_ends_by_itself_with_a_summary_and_a_report(demo: ComponentProcess, tmp_path: Path) -> None:
    demo.wait_for(r"images/s", RUN_LIMIT)
    running = list(psutil.Process(demo.process.pid).children(recursive=True))
    assert len(running) == 5

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
