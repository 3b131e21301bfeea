"""The launcher with real processes: order, failures, signals, and no leftovers."""

import os
import re
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path

import psutil
import pytest

from nao_tools._command import app
from tests.support.commands import run_here
from tests.support.limits import END_LIMIT, RUN_LIMIT, START_LIMIT
from tests.support.places import ROOT
from tests.support.processes import ComponentProcess, free_endpoint
from tests.support.terminal import read_until
from tests.support.waiting import until
from zenoh_ice.application import LAUNCHER

TETHER = str(Path(__file__).resolve().parents[2] / "zenoh_ice" / "application" / "tether.py")

# A process that prints its pid, says that it is ready, and notes how it is asked to end.
SERVICE = """
import os, pathlib, signal, sys, time
name, directory = sys.argv[1], pathlib.Path(sys.argv[2])
def end(number, frame):
    with (directory / "ended").open("a") as file:
        file.write(f"{name} {signal.Signals(number).name}\\n")
    sys.exit(0)
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, end)
(directory / f"{name}.pid").write_text(str(os.getpid()))
print("ready to serve", flush=True)
time.sleep(600)
"""

DEAF = """
import os, pathlib, signal, subprocess, sys, time
directory = pathlib.Path(sys.argv[2])
for number in (signal.SIGINT, signal.SIGTERM):
    signal.signal(number, lambda number, frame: (directory / "asked").touch())
child = subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"])
(directory / "child.pid").write_text(str(child.pid))
(directory / "deaf.pid").write_text(str(os.getpid()))
print("ready to serve", flush=True)
time.sleep(600)
"""


class Bench:
    """A directory with programs, a stack file and the launcher that runs it."""

    def __init__(self, directory: Path) -> None:
        self.directory = directory
        self.launcher: subprocess.Popen[str] | None = None
        self._stack = f'name = "bench"\nlog_dir = "{directory}/logs"\n'

    def add(self, name: str, program: str, **keys: object) -> None:
        path = self.directory / f"{name}.py"
        path.write_text(program)
        self._stack += f'[[process]]\nname = "{name}"\n'
        self._stack += f'command = ["python", "{path}", "{name}", "{self.directory}"]\n'
        for key, value in keys.items():
            self._stack += f"{key} = {str(value).lower() if isinstance(value, bool) else repr(value)}\n"

    def start(
        self, *options: str, terminal: int | None = None, preexec_fn: Callable[[], object] | None = None
    ) -> subprocess.Popen[str]:
        command = [sys.executable, "-m", "nao_tools", "stack", str(self._written()), *options]
        if terminal is None:
            self.launcher = subprocess.Popen(
                command,
                text=True,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                preexec_fn=preexec_fn,
            )
        else:
            self.launcher = subprocess.Popen(
                ["setsid", "--ctty", *command], text=True, stdin=terminal, stdout=terminal, stderr=terminal
            )
        return self.launcher

    def run(self, *options: str) -> tuple[int, str]:
        """Run the stack to its end, in this process, and return its exit code and output."""
        done = run_here(app, "nao", "stack", self._written(), *options)
        return done.returncode, done.stdout + done.stderr

    def run_in_foreground(self) -> tuple[int, str]:
        """Run the stack to its end as a process, whose output its foreground process shares."""
        launcher = self.start()
        output, _ = launcher.communicate(timeout=RUN_LIMIT)
        return launcher.returncode, output

    def _written(self) -> Path:
        path = self.directory / "stack.toml"
        path.write_text(self._stack)
        return path

    def path(self, name: str) -> Path:
        return self.directory / name

    def text(self, name: str) -> str:
        return self.path(name).read_text()

    def wait_for(self, *names: str) -> None:
        wait(
            lambda: all(self.path(name).exists() and self.text(name) for name in names), f"{names} to appear"
        )

    def alive(self) -> list[str]:
        return [path.stem for path in self.directory.glob("*.pid") if is_alive(int(path.read_text()))]


def wait(condition, what: str) -> None:
    deadline = time.monotonic() + START_LIMIT
    while not condition():
        assert time.monotonic() < deadline, f"waited {START_LIMIT} s for {what}"
        time.sleep(0.02)


def is_alive(pid: int) -> bool:
    try:
        return bool(psutil.Process(pid).status() != psutil.STATUS_ZOMBIE)
    except psutil.NoSuchProcess:
        return False


@pytest.fixture
def bench(tmp_path):
    bench = Bench(tmp_path)
    yield bench
    if bench.launcher is not None:
        if bench.launcher.poll() is None:
            bench.launcher.kill()
            bench.launcher.wait(END_LIMIT)
        if bench.launcher.stdout is not None:
            bench.launcher.stdout.close()
    for path in tmp_path.glob("*.pid"):
        if is_alive(int(path.read_text())):
            os.kill(int(path.read_text()), signal.SIGKILL)


def test_the_end_of_the_foreground_process_ends_the_others_and_gives_the_exit_code(bench):
    bench.add("first", SERVICE, ready="ready")
    bench.add("second", SERVICE, ready="ready")
    bench.add("view", "import sys; print('seen'); sys.exit(7)", after=["first", "second"], foreground=True)
    code, output = bench.run_in_foreground()
    assert code == 7
    assert "seen" in output
    assert bench.text("ended").splitlines() == ["second SIGINT", "first SIGINT"]
    assert bench.alive() == []


def test_a_process_starts_only_when_those_before_it_are_ready(bench):
    slow = "import time; time.sleep(0.4); open(__file__ + '.up', 'w').close(); print('ready'); time.sleep(60)"
    bench.add("slow", slow, ready="^ready$")
    bench.add("view", f"import os, sys; sys.exit(7 if os.path.exists('{bench.path('slow.py.up')}') else 8)",
              after=["slow"], foreground=True)  # fmt: skip
    assert bench.run()[0] == 7


def test_output_goes_to_a_log_with_date_and_time_of_each_line(bench):
    before = datetime.now(UTC) - timedelta(seconds=1)
    bench.add("talker", SERVICE, ready="ready")
    bench.add("view", "", after=["talker"], foreground=True)
    for _ in range(2):
        bench.run()
    lines = bench.text("logs/talker.log").splitlines()
    assert [line.split(maxsplit=2)[2] for line in lines] == ["ready to serve"] * 2
    times = [datetime.fromisoformat(line[:23]).astimezone(UTC) for line in lines]
    assert before < times[0] < times[1] < datetime.now(UTC)


def test_lines_of_a_log_with_a_date_get_no_other(bench):
    lines = ["2026-11-21 13:00:00.000 INFO     robot: up", '{"time": "2026-11-21T13:00:00.000+00:00"}']
    bench.add("talker", "\n".join(f"print({line!r})" for line in lines))
    bench.run()
    assert bench.text("logs/talker.log").splitlines() == lines


def test_a_log_rotates_at_its_size(bench):
    bench.add("talker", "for n in range(2_000): print('x' * 6_000)\nprint('last')")
    bench.run()
    assert bench.path("logs/talker.log.1").stat().st_size <= 10_000_000
    assert bench.text("logs/talker.log").endswith("last\n")


def test_the_death_of_one_process_ends_all_and_shows_its_last_words(bench):
    bench.add("healthy", SERVICE, ready="ready")
    bench.add("broken", "import sys; sys.exit('no such robot')", after=["healthy"])
    code, output = bench.run()
    assert code == 1
    assert "broken ended with exit code 1" in output
    assert "    no such robot" in output
    assert "broken.log" in output
    assert bench.alive() == []


RESTARTED = """
import pathlib, sys, time
starts = pathlib.Path(sys.argv[2]) / "starts"
number = len(starts.read_text()) + 1 if starts.exists() else 1
print("ready", number, flush=True)
with starts.open("a") as file:
    file.write("x")
if number < 3:
    sys.exit("lost")
"""


UNTIL_RESTARTED = """
import os, pathlib, sys, time
directory = pathlib.Path(sys.argv[2])
while not ((directory / "starts").exists() and (directory / "starts").read_text() == "xxx"):
    time.sleep(0.02)
os.kill(int((directory / "healthy.pid").read_text()), 0)
"""


def test_a_process_is_restarted_on_failure_and_the_others_run_on(bench):
    bench.add("healthy", SERVICE, ready="ready")
    bench.add(
        "fragile", RESTARTED + "time.sleep(600)", after=["healthy"], restart="on-failure", restart_pause=0.01
    )
    bench.add("view", UNTIL_RESTARTED, after=["healthy"], foreground=True)
    code, output = bench.run()
    assert code == 0  # the healthy one was there to the end
    assert bench.text("ended") == "healthy SIGINT\n"
    assert output.count("fragile ended with exit code 1 after") == 2
    assert output.count("starting it again in 0.01 s") == 2
    log = [line.split(maxsplit=2)[2] for line in bench.text("logs/fragile.log").splitlines()]
    assert log[:5] == ["ready 1", "lost", "ready 2", "lost", "ready 3"]


def test_a_stack_runs_on_without_what_failed_too_often_or_is_done_until_none_is_left(bench):
    bench.add("fragile", RESTARTED, restart="on-failure", restart_limit=1, restart_pause=0.01)
    bench.add("done", "print('done')", restart="on-failure")
    code, output = bench.run()
    assert code == 1
    assert bench.text("starts") == "xx"
    assert "    lost\n  not starting fragile again" in output
    assert "done ended with exit code 0" in output


def test_a_stack_ends_when_what_others_may_wait_for_never_gets_ready(bench):
    bench.add("broken", "import sys; sys.exit('no such robot')", ready="ready", restart="on-failure",
              restart_limit=1, restart_pause=0.01)  # fmt: skip
    bench.add("view", SERVICE, after=["broken"], foreground=True)
    code, output = bench.run()
    assert code == 1
    assert output.count("broken ended with exit code 1") == 2
    assert not bench.path("view.pid").exists()


def test_a_process_killed_by_a_signal_is_reported_by_its_name(bench):
    bench.add("victim", "import os, signal; os.kill(os.getpid(), signal.SIGKILL)")
    assert "victim was terminated by SIGKILL" in bench.run()[1]


def test_a_process_that_does_not_get_ready_ends_the_stack(bench):
    bench.add("silent", SERVICE, ready="never said", ready_timeout=0.5)
    code, output = bench.run()
    assert code == 1
    assert "silent was not ready within 0.5 s" in output
    assert bench.alive() == []


def test_a_program_that_does_not_exist_is_named(bench):
    bench.add("absent", "")
    bench._stack = bench._stack.replace('"python"', '"no-such-program"')
    code, output = bench.run()
    assert code == 1
    assert "cannot run no-such-program: No such file or directory" in output


def test_a_signal_ends_everything_in_reverse_order(bench):
    """As SIGTERM does in `test_nohup_is_respected`, and SIGHUP in `test_closing_the_terminal_ends_everything`."""
    for name in ("first", "second", "third"):
        bench.add(name, SERVICE)
    launcher = bench.start()
    bench.wait_for("first.pid", "second.pid", "third.pid")
    launcher.send_signal(signal.SIGINT)
    assert launcher.wait(END_LIMIT) == 130
    assert bench.text("ended").splitlines() == ["third SIGINT", "second SIGINT", "first SIGINT"]
    assert bench.alive() == []


def test_nohup_is_respected(bench):
    bench.add("first", SERVICE)
    launcher = bench.start(preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_IGN))
    bench.wait_for("first.pid")
    launcher.send_signal(signal.SIGHUP)
    launcher.send_signal(signal.SIGTERM)
    assert launcher.wait(END_LIMIT) == 128 + signal.SIGTERM
    assert bench.text("ended") == "first SIGINT\n"


def test_a_signal_while_the_stack_is_starting_leaves_nothing_behind(bench):
    bench.add("first", SERVICE, ready="never said")
    bench.add("second", SERVICE, after=["first"])
    launcher = bench.start()
    bench.wait_for("first.pid")
    launcher.send_signal(signal.SIGINT)
    assert launcher.wait(END_LIMIT) == 130
    assert bench.alive() == []
    assert not bench.path("second.pid").exists()


def test_who_ignores_signals_is_killed_with_its_children(bench):
    bench.add("deaf", DEAF, stop_timeout=0.2)
    launcher = bench.start()
    bench.wait_for("deaf.pid", "child.pid")
    launcher.send_signal(signal.SIGINT)
    assert launcher.wait(END_LIMIT) == 130
    assert bench.alive() == []


def test_a_second_signal_does_not_wait_for_the_deaf(bench):
    bench.add("deaf", DEAF, stop_timeout=600)
    launcher = bench.start()
    bench.wait_for("deaf.pid", "child.pid")
    launcher.send_signal(signal.SIGINT)
    wait(bench.path("asked").exists, "the deaf to be asked")
    assert launcher.poll() is None
    launcher.send_signal(signal.SIGINT)
    assert launcher.wait(END_LIMIT) == 130
    assert bench.alive() == []


def test_a_launcher_that_is_killed_takes_its_stack_along(bench):
    bench.add("first", SERVICE)
    bench.add("view", SERVICE, foreground=True)
    launcher = bench.start()
    bench.wait_for("first.pid", "view.pid")
    launcher.kill()
    wait(lambda: not bench.alive(), "the processes of a killed launcher to end")


def test_seconds_end_a_stack_without_foreground_process(bench):
    bench.add("first", SERVICE)
    code, _ = bench.run("--seconds", "0.2")
    assert code == 0
    assert bench.alive() == []


def test_ctrl_c_reaches_the_foreground_process_alone_and_the_terminal_comes_back(bench):
    """What the terminal sends must not end the servers before the view has written its summary."""
    view = SERVICE.replace("sys.exit(0)", "print('summary', flush=True); sys.exit(130)")
    bench.add("server", SERVICE)
    bench.add("view", view, foreground=True)
    main, terminal = os.openpty()
    try:
        launcher = bench.start(terminal=terminal)
        bench.wait_for("server.pid", "view.pid")
        wait(lambda: os.tcgetpgrp(main) == int(bench.text("view.pid")), "the view to own the terminal")
        os.write(main, b"\x03")
        assert launcher.wait(END_LIMIT) == 130
        read_until(main, "summary")
        assert bench.text("ended").splitlines() == ["view SIGINT", "server SIGINT"]
        assert bench.alive() == []
    finally:
        os.close(main)
        os.close(terminal)


def test_a_killed_foreground_process_leaves_a_usable_terminal_and_is_reported(bench):
    bench.add("view", SERVICE, foreground=True)
    main, terminal = os.openpty()
    try:
        launcher = bench.start(terminal=terminal)
        bench.wait_for("view.pid")
        os.kill(int(bench.text("view.pid")), signal.SIGKILL)
        assert launcher.wait(END_LIMIT) == 128 + signal.SIGKILL
        output = read_until(main, "view was terminated by SIGKILL")
        assert "\x1b[?1049l\x1b[?25h" in output  # out of the full screen, with a cursor
    finally:
        os.close(main)
        os.close(terminal)


def test_an_early_ctrl_c_is_no_traceback():
    """Start it like the launcher: with SIGINT blocked until the tether can handle it."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        tether = subprocess.Popen(
            [sys.executable, "-I", "-S", TETHER, str(os.getpid()), "background", "sleep", "600"],
            stderr=subprocess.PIPE,
            start_new_session=True,
        )
    finally:
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})
    tether.send_signal(signal.SIGINT)
    _, errors = tether.communicate(timeout=RUN_LIMIT)
    assert tether.returncode == -signal.SIGINT
    assert errors == b""


def test_closing_the_terminal_ends_everything(bench):
    bench.add("server", SERVICE)
    bench.add("view", SERVICE, foreground=True)
    main, terminal = os.openpty()
    launcher = bench.start(terminal=terminal)
    os.close(terminal)
    bench.wait_for("server.pid", "view.pid")
    os.close(main)
    assert launcher.wait(END_LIMIT) in (128 + signal.SIGHUP, 1)
    assert bench.alive() == []


def test_a_taken_endpoint_is_replaced_and_reported(bench):
    with socket.create_server(("127.0.0.1", 0)) as server:
        taken = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        bench._stack += f'endpoint = "{taken}"\n'
        bench.add("view", "import sys; print(sys.argv)", foreground=True)
        bench._stack = bench._stack.replace('"view", "', '"{endpoint}", "')
        code, output = bench.run_in_foreground()
    assert code == 0
    assert f"{taken} is in use" in output
    assert f"'{taken}'" not in output


def test_a_free_endpoint_is_kept(bench):
    free = free_endpoint()
    bench._stack += f'endpoint = "{free}"\n'
    bench.add("view", "", foreground=True)
    assert f"endpoint {free}\n" in bench.run()[1]


def test_a_wrong_stack_file_is_one_line_on_stderr(bench):
    bench._stack = "[[process]]\n"
    code, output = bench.run()
    assert (code, output) == (1, f"nao: error: {bench.path('stack.toml')}:1: process[0]: name is missing\n")


def test_a_place_where_no_logs_can_be_written_is_named(bench):
    bench.add("first", SERVICE)
    bench.path("file").write_text("")
    bench._stack = bench._stack.replace("/logs", "/file/logs")
    code, output = bench.run()
    assert code == 1
    assert (
        output.splitlines()[-1]
        == f"nao: error: {bench.path('file')}/logs: cannot write logs there: Not a directory"
    )


def test_a_log_that_cannot_be_written_does_not_hold_its_process_up(bench):
    """A full disk, here Linux's device for it, must not stop the robot's server."""
    talker = "import time\nfor n in range(400): print('x' * 8000, flush=True)\nprint('done'); open(__file__ + '.up', 'w').write('1'); time.sleep(60)"
    bench.add("talker", talker)
    bench.path("logs").mkdir()
    bench.path("logs/talker.log").symlink_to("/dev/full")
    bench.add("view", f"import os, time\nwhile not os.path.exists('{bench.path('talker.py.up')}'): time.sleep(0.02)",
              foreground=True)  # fmt: skip
    assert bench.run()[0] == 0


def test_a_log_that_cannot_be_written_is_reported_once(bench):
    bench.add("talker", "import sys\nprint('one')\nprint('two')\nsys.exit('lost')")
    bench.path("logs").mkdir()
    bench.path("logs/talker.log").symlink_to("/dev/full")
    _, output = bench.run()
    full = "(cannot write more of its log: [Errno 28] No space left on device)"
    assert [line.strip() for line in output.splitlines()[-4:]] == [full, "one", "two", "lost"]


STARTS = """
import asyncio, os, sys
from zenoh_ice.application.child import ChildProcess


async def main():
    child = ChildProcess(lambda _descriptor, written: None)
    await child.start([sys.executable, *sys.argv[1:]], os.environ, at_once=True)
    print("started", child.pid, flush=True)
    await child.wait()


asyncio.run(main())
"""
"""Starts a component like the editor."""


def test_a_component_that_ties_itself_ends_with_its_killed_launcher():
    component = [str(ROOT / "behaviors/dance.py"), "--server-wait", "600", "--connect", free_endpoint()]
    with ComponentProcess([sys.executable, "-c", STARTS, *component]) as launcher:
        child = psutil.Process(int(launcher.wait_for(r"^started (\d+)")[1]))
        until(lambda: signal.SIGINT not in blocked_by(child.pid), START_LIMIT)  # it has tied itself
        launcher.process.kill()
        child.wait(END_LIMIT)


def blocked_by(pid):
    """Return the signals that a process blocks."""
    (mask,) = re.findall(r"^SigBlk:\s+(\w+)", Path(f"/proc/{pid}/status").read_text(), re.MULTILINE)
    return {number for number in signal.valid_signals() if int(mask, 16) >> (number - 1) & 1}


def test_a_component_whose_launcher_died_before_it_was_tied_ends():
    with subprocess.Popen([sys.executable, "-c", ""]) as dead:
        dead.wait(RUN_LIMIT)
    done = subprocess.run(
        [sys.executable, str(ROOT / "behaviors/dance.py"), "--show-config"],
        env={**os.environ, LAUNCHER: str(dead.pid)},
        timeout=RUN_LIMIT,
        check=False,
    )
    assert done.returncode == 128 + signal.SIGTERM
