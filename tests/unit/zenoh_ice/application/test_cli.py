"""What commands share: exit codes, logging, and quick help."""

from __future__ import annotations

import os
import shlex
import socket
import subprocess
import sys
import textwrap
from contextlib import closing
from pathlib import Path

import pytest

from tests.support.limits import RUN_LIMIT
from zenoh_ice.application.cli import report_ready

pytestmark = pytest.mark.slow

HEADER = """
from zenoh_ice.application import begin_loading
begin_loading()
import gc, sys, time, typer
from pathlib import Path
from zenoh_ice.application.cli import *
from zenoh_ice.settings import Settings
from zenoh_ice.data.exceptions import ConnectFailedException

app = typer.Typer()
"""


def script(body: str) -> list[str]:
    return [sys.executable, "-c", HEADER + textwrap.dedent(body) + "\nrun(app)\n"]


def finish(process: subprocess.Popen[str]) -> tuple[int, str, str]:
    try:
        out, err = process.communicate(timeout=RUN_LIMIT)
    finally:
        process.kill()
    return process.returncode, out, err


def start(body: str, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [*script(body), *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


OPTIONS = """
@app.command()
@with_settings(defaults={"listen": ["tcp/127.0.0.1:7447"]})
def command(*, settings: Settings) -> None:
    import logging
    logging.getLogger("robot.arm").info("reached %d", 3)
    assert gc.isenabled()
    typer.echo(settings.realm)
"""


def test_options_become_settings_and_logs_go_to_stderr() -> None:
    code, out, err = finish(start(OPTIONS, "--realm", "lab", "--log-level", "info"))
    assert (code, out) == (0, "lab\n")
    assert "INFO     robot.arm: reached 3" in err


LONG_HELP = """
@app.command()
def command() -> None:
    \"\"\"Do something.

    This paragraph has two lines, which end
    where those of the terminal do not.
    \"\"\"
"""


def test_help_ends_its_lines_where_the_terminal_does(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "60")
    code, out, _ = finish(start(LONG_HELP, "--help"))
    assert code == 0
    assert [line.strip() for line in out.splitlines() if "end" in line] == [
        "This paragraph has two lines, which end where those of the"
    ]


@pytest.mark.parametrize("kind", ["path", "abstract"])
def test_ready_is_printed_and_reported_to_systemd_once(
    kind: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    name = f"{tmp_path}/notify"
    with closing(socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM)) as systemd:
        systemd.bind(name if kind == "path" else f"\0{name}")
        systemd.setblocking(False)
        monkeypatch.setenv("NOTIFY_SOCKET", name if kind == "path" else f"@{name}")
        report_ready("ready: now")
        assert systemd.recv(64) == b"READY=1"
        report_ready()  # nor do its own processes
        assert "NOTIFY_SOCKET" not in os.environ
        with pytest.raises(BlockingIOError):
            systemd.recv(64)
    assert capsys.readouterr().out == "ready: now\n"


def test_a_lost_systemd_does_not_end_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setenv("NOTIFY_SOCKET", f"{tmp_path}/nowhere")
    report_ready()
    assert caplog.messages == ["cannot report READY=1 to systemd: [Errno 2] No such file or directory"]


def test_show_config_reports_values_and_origins(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("VISUALHFSM_TIMEOUT")
    file = tmp_path / "robot.toml"
    file.write_text("timeout = 1.5")
    flags = ["--connect", "tcp/10.0.0.1:7447", "--connect", "tcp/10.0.0.2:7447", "--config", str(file)]
    code, out, err = finish(start(OPTIONS, "--show-config", "--listen", "tcp/0.0.0.0:7447", *flags))
    assert code == 0
    assert err.startswith("warning: listening on tcp/0.0.0.0:7447 without TLS")
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert "connect ['tcp/10.0.0.1:7447', 'tcp/10.0.0.2:7447'] --connect" in lines
    assert f"timeout 1.5 {file}" in lines
    assert "realm 'nao' default" in lines
    assert "listen ['tcp/0.0.0.0:7447'] --listen" in lines


def test_our_errors_are_one_line_and_exit_code_1() -> None:
    body = """
    @app.command()
    def command() -> None:
        raise ConnectFailedException("nobody answers at tcp/127.0.0.1:1\\nstart naoserver-sim")
    """
    code, out, err = finish(start(body))
    assert (code, out) == (1, "")
    assert err == "-c: error: nobody answers at tcp/127.0.0.1:1 start naoserver-sim\n"


WRITES = """
@app.command()
def command() -> None:
    sys.stdout.write("a line\\n")
"""
FLUSHES = f"{WRITES}    sys.stdout.flush()\n"


def run_writing_to(output: int, body: str) -> tuple[int, str]:
    done = subprocess.run(
        script(body), stdout=output, stderr=subprocess.PIPE, text=True, timeout=RUN_LIMIT, check=False
    )
    return done.returncode, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("body", [WRITES, FLUSHES], ids=["in the end", "at once"])
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no /dev/full")
def test_a_full_disk_is_no_crash(body: str) -> None:
    with Path("/dev/full").open("wb") as full:
        assert run_writing_to(full.fileno(), body) == (
            1,
            "-c: error: cannot write: No space left on device\n",
        )


@pytest.mark.slow
@pytest.mark.parametrize("body", [WRITES, FLUSHES], ids=["in the end", "at once"])
def test_an_output_that_nobody_reads_is_no_crash(body: str) -> None:
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "wb") as pipe:
        assert run_writing_to(pipe.fileno(), body) == (1, "")


@pytest.mark.slow
def test_a_closed_output_is_no_crash() -> None:
    closed = subprocess.run(
        ["sh", "-c", f"{shlex.join(script(FLUSHES))} >&-"],
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert (closed.returncode, closed.stderr) == (0, "")


def test_a_bad_setting_names_its_flag() -> None:
    code, _, err = finish(start(OPTIONS, "--realm", "a/b"))
    assert code == 1
    assert err.startswith("-c: error: --realm: realm = 'a/b': ")
    assert err.count("\n") == 1


def test_wrong_usage_is_exit_code_2() -> None:
    code, _, err = finish(start(OPTIONS, "--reelm", "lab"))
    assert code == 2
    assert "--reelm" in err


def test_help_loads_nothing_heavy() -> None:
    body = """
    import sys, zenoh_ice.application.cli
    heavy = {"numpy", "mujoco", "cv2", "asyncio"} & set(sys.modules)
    sys.exit(", ".join(sorted(heavy)) or 0)
    """
    result = subprocess.run(
        [sys.executable, "-c", textwrap.dedent(body)],
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert result.stderr == ""
    assert result.returncode == 0
