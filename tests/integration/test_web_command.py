"""`visualhfsm edit` as a process: its address, and its end."""

from __future__ import annotations

import os
import re
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from http.cookiejar import CookieJar
from pathlib import Path
from shlex import quote
from urllib.parse import unquote

import psutil
import pytest
from typer.testing import CliRunner
from websockets.sync.client import connect
from websockets.typing import Origin

from tests.support.commands import run_here
from tests.support.editor import DOCUMENT, Window
from tests.support.limits import END_LIMIT, PAGE_LIMIT, RUN_LIMIT, START_LIMIT
from tests.support.ports import free_port
from tests.support.processes import ComponentProcess, free_endpoint, module
from tests.support.soak import cases
from tests.support.waiting import until
from visualhfsm._base.errors import VisualHfsmError
from visualhfsm._commands.app import app
from visualhfsm._editor.launch import open_browser
from visualhfsm._editor.server import Options

ADDRESS = r"http://127\.0\.0\.1:(\d+)/\?token=[\w-]{40,}"


@pytest.fixture
def document(tmp_path: Path) -> Path:
    document = tmp_path / "robot.xml"
    document.write_text(DOCUMENT)
    return document


def refused(tmp_path: Path, *arguments: str) -> str:
    """Return what `visualhfsm edit` reports when it ends before it serves."""
    folder = ("--root", tmp_path, "--no-browser")
    done = run_here(app, "visualhfsm", "edit", *folder, *arguments, expected=(VisualHfsmError,))
    assert done.returncode == 1
    return done.stderr


def edit(tmp_path: Path, *arguments: str) -> ComponentProcess:
    environment = {"XDG_STATE_HOME": str(tmp_path / "state")}
    return ComponentProcess(module("visualhfsm", "edit", "--root", str(tmp_path), *arguments), environment)


def test_a_signal_ends_everything_in_an_orderly_way(document: Path, tmp_path: Path) -> None:
    """`test_stop_signals.py` has the other signals. A port can be chosen."""
    chosen = str(free_port())
    options = ("--no-browser", "--log-level", "debug", "--port", chosen)
    with edit(tmp_path, str(document), *options) as process:
        address = process.wait_for(ADDRESS)
        assert address[1] == chosen
        cookies = CookieJar()
        urllib.request.build_opener(urllib.request.HTTPCookieProcessor(cookies)).open(
            address[0], timeout=PAGE_LIMIT
        ).close()
        (cookie,) = cookies
        port = int(address[1])
        with connect(
            f"ws://127.0.0.1:{port}/ws",
            origin=Origin(f"http://127.0.0.1:{port}"),
            additional_headers={"Cookie": f"{cookie.name}={cookie.value}"},
            proxy=None,
        ) as connection:
            window = Window(connection)
            window.ask("hello")
            window.ask("do", tab=1, command={"command": "addState", "automaton": 1, "x": 1, "y": 1})
            window.wait_for_push("problems", revision=1)
            children = psutil.Process(process.process.pid).children(recursive=True)
            assert children  # the one that checks
            process.process.send_signal(signal.SIGTERM)
            assert process.wait() == 143
        _, left = psutil.wait_procs(children, END_LIMIT)
        assert not [child for child in left if child.status() != psutil.STATUS_ZOMBIE]
        assert re.search("WARNING .*robot has unsaved changes", process.output)
        assert "Traceback" not in process.output
        secrets = {address[0].partition("token=")[2], str(cookie.value)}
        assert len(secrets) == 2
        logged = process.output.replace(address[0], "", 1)
        assert not [secret for secret in secrets if secret in logged]
        with socket.socket() as probe:
            assert probe.connect_ex(("127.0.0.1", port)) != 0
    (journal,) = (tmp_path / "state" / "visualhfsm" / "journals").iterdir()
    assert "addState" in journal.read_text()
    assert journal.stat().st_mode & 0o077 == 0


def test_a_taken_port_is_reported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        error = refused(tmp_path, "--port", str(port))
        assert re.search(rf"error: cannot listen on port {port} .*--port", error)


@pytest.mark.parametrize("number", cases([signal.SIGINT], [signal.SIGTERM]))
def test_without_a_command_it_is_the_editor_and_the_browser_gets_a_page_that_others_cannot_read(
    tmp_path: Path, number: signal.Signals
) -> None:
    launched_path = tmp_path / "launched_path"
    browser = tmp_path / "browser"
    browser.write_text(f'#!/bin/sh\nprintf %s "$1" > {quote(str(launched_path))}\n')
    browser.chmod(0o755)
    runtime = tmp_path / "runtime"
    runtime.mkdir(mode=0o700)
    environment = {
        "BROWSER": f"{quote(str(browser))} %s",
        "XDG_STATE_HOME": str(tmp_path),
        "XDG_RUNTIME_DIR": str(runtime),
        "VISUALHFSM_CONNECT": free_endpoint(),
    }
    with ComponentProcess(module("visualhfsm"), environment) as process:
        printed = process.wait_for(ADDRESS)[0]
        process.wait_for("Ctrl-C ends it")
        launched = content(launched_path, "file://.*[.]html$")
        page = Path(unquote(launched.removeprefix("file://")))
        assert page.is_relative_to(runtime)
        assert [each.stat().st_mode & 0o777 for each in (page, page.parent)] == [0o600, 0o700]
        found = re.search(ADDRESS, page.read_text())
        assert found
        assert found[0] != printed
        process.process.send_signal(number)
        assert process.wait() == 128 + number
    assert not [*runtime.iterdir()]


def test_without_a_display_no_browser_of_text_takes_the_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    for variable in ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER"):
        monkeypatch.delenv(variable, raising=False)
    launches: list[object] = []
    monkeypatch.setattr("visualhfsm._editor.server.serve", lambda *_, launch: launches.append(launch))
    assert CliRunner().invoke(app, ["edit"]).exit_code == 0
    monkeypatch.setenv("BROWSER", "firefox")
    assert CliRunner().invoke(app, ["edit"]).exit_code == 0
    assert CliRunner().invoke(app, ["edit", "--no-browser"]).exit_code == 0
    assert launches == [None, open_browser, None]


@pytest.mark.parametrize("mode", [0o600, 0o644])
def test_a_file_that_others_can_read_gets_no_token(tmp_path: Path, mode: int) -> None:
    printed = tmp_path / "printed"
    printed.touch(mode)
    command = module("visualhfsm", "edit", "--root", str(tmp_path), "--no-browser")
    environment = {**os.environ, "XDG_STATE_HOME": str(tmp_path / "state"), "PYTHONUNBUFFERED": "1"}
    with printed.open("w") as output:
        process = subprocess.Popen(command, stdout=output, env=environment)
    try:
        text = content(printed, r"The editor is at .*\n")
    finally:
        process.terminate()
        process.wait(END_LIMIT)
    assert re.search(r"The editor is at http://127\.0\.0\.1:\d+/", text)
    assert bool(re.search(ADDRESS, text)) is (mode == 0o600)


def test_each_address_lets_in_one_browser_and_the_next_one_is_printed(tmp_path: Path) -> None:
    with edit(tmp_path, "--no-browser") as process:
        address = process.wait_for(ADDRESS)[0]
        urllib.request.build_opener(urllib.request.HTTPCookieProcessor()).open(address).close()
        other = process.wait_for(rf"For another browser the editor is at ({ADDRESS})")[1]
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(address, timeout=PAGE_LIMIT)
        assert address != other
        urllib.request.build_opener(urllib.request.HTTPCookieProcessor()).open(other).close()


@pytest.mark.parametrize("name", ["http://robots.example", "robots.example:8080", "robots.example/", ""])
def test_a_name_that_no_machine_has_is_refused(name: str) -> None:
    result = CliRunner().invoke(app, ["edit", "--no-browser", "--allow-host", name])
    assert result.exit_code == 2
    assert "--allow-host" in result.output


MISSING = """
import os, sys
from visualhfsm.__main__ import main
sys.argv = ["visualhfsm", "edit", "--no-browser"]
for package in ("uvicorn", "websockets", "jedi"):
    if os.fork() == 0:
        sys.modules[package] = None
        main()
    print(package, os.waitstatus_to_exitcode(os.wait()[1]), file=sys.stderr, flush=True)
"""


def test_a_missing_package_is_named_with_the_command_that_installs_it() -> None:
    ended = subprocess.run(
        [sys.executable, "-c", MISSING], capture_output=True, text=True, timeout=RUN_LIMIT, check=False
    )
    for package in ("uvicorn", "websockets", "jedi"):
        expected = f"{package} is not installed; install it with: pip install 'visualhfsm[web]'"
        assert re.search(rf"{re.escape(expected)}.*\n{package} 1\n", ended.stderr), ended.stderr


def test_a_document_that_cannot_be_opened_is_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    broken = tmp_path / "broken.xml"
    broken.write_text("<VisualHFSM>")
    assert "error: Cannot open broken.xml" in refused(tmp_path, str(broken))


def test_one_recording_can_be_opened_at_the_start(tmp_path: Path) -> None:
    files = [tmp_path / name for name in ("a.mcap", "b.MCAP")]
    for file in files:
        file.touch()
    done = run_here(app, "visualhfsm", "edit", *files)
    assert done.returncode == 2
    assert "one recording can be opened at the start" in done.stderr


def content(file: Path, wanted: str) -> str:
    """Wait for a file with a text, and return its content."""
    until(lambda: file.exists() and re.search(wanted, file.read_text()), START_LIMIT)
    return file.read_text()


def test_without_a_command_the_editor_is_opened_with_a_demo(monkeypatch: pytest.MonkeyPatch) -> None:
    served: list[Options] = []
    monkeypatch.setattr("visualhfsm._editor.server.serve", lambda options, *_, **__: served.append(options))
    for arguments in ([], ["edit"]):
        assert CliRunner().invoke(app, arguments).exit_code == 0
    assert [options.demo for options in served] == [True, False]
