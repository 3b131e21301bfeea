"""The entry point by which jupyter-server-proxy finds the editor."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib import util
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import pytest

from tests.support.limits import RUN_LIMIT
from visualhfsm._jupyter import editor_in_jupyter

SOCKET = "/run/jupyter/socket"


def command(folder: Path, before: str = "") -> list[str]:
    """Return the command of a Jupyter server in a folder, with what jupyter-server-proxy replaces in it."""
    program = f"""
import json, os
{before}
from visualhfsm._jupyter import editor_in_jupyter
words = editor_in_jupyter()["command"](unix_socket={SOCKET!r})
print(json.dumps([os.getpid(), *(word.format(port=0, unix_socket={SOCKET!r}, base_url="/") for word in words)]))
"""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", program],
        cwd=folder,
        stdout=subprocess.PIPE,
        text=True,
        timeout=RUN_LIMIT,
        check=True,
    )
    pid, *words = json.loads(done.stdout)
    assert str(pid) in words  # it ends with this process
    return [str(word) for word in words]


def test_the_distribution_has_the_entry_point() -> None:
    (entry,) = (
        each for each in entry_points(group="jupyter_serverproxy_servers") if each.name == "visualhfsm"
    )
    assert entry.load() is editor_in_jupyter


def test_the_editor_listens_at_the_socket_of_the_proxy_alone() -> None:
    entry: dict[str, Any] = editor_in_jupyter()
    assert entry["unix_socket"] is True
    assert "port" not in entry


@pytest.mark.slow  # another process loads Jupyter
def test_the_command_serves_the_current_folder_at_the_socket(tmp_path: Path) -> None:
    words = command(tmp_path)
    assert words[0] == "setsid"
    assert words[words.index("-m") + 1 :] == [
        "visualhfsm", "edit", "--no-browser", f"--socket={SOCKET}", f"--root={tmp_path}",
    ]  # fmt: skip


@pytest.mark.slow  # another process loads Jupyter
def test_braces_in_a_path_are_not_taken_for_what_is_to_be_replaced(tmp_path: Path) -> None:
    folder = tmp_path / "{class} {port} }{"
    folder.mkdir()
    assert command(folder)[-1] == f"--root={folder}"


@pytest.mark.slow  # another process loads Jupyter
def test_the_editor_has_the_folder_that_jupyter_shows(tmp_path: Path) -> None:
    pytest.importorskip("jupyter_server")
    shown = tmp_path / "shown"
    shown.mkdir()
    before = f"from jupyter_server.serverapp import ServerApp; ServerApp.instance(root_dir={str(shown)!r})"
    assert command(tmp_path, before)[-1] == f"--root={shown}"


def test_the_launcher_has_an_icon() -> None:
    entry = editor_in_jupyter()["launcher_entry"]
    assert Path(entry["icon_path"]).read_text("utf-8").startswith("<svg")


@pytest.mark.parametrize("installed", [True, False])
def test_the_launcher_shows_the_editor_where_its_packages_are(
    monkeypatch: pytest.MonkeyPatch, installed: bool
) -> None:
    genuine = util.find_spec
    monkeypatch.setattr(
        "visualhfsm._jupyter.find_spec",
        lambda name: None if name == "starlette" and not installed else genuine(name),
    )
    assert editor_in_jupyter()["launcher_entry"]["enabled"] is installed
