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
from visualhfsm._editor.jupyter import editor_in_jupyter

SOCKET = "/run/jupyter/socket"


def commands(folder: Path, shown: Path) -> list[list[str]]:
    """Return the commands of a server in a folder before Jupyter shows another one, and from then on.

    jupyter-server-proxy has replaced what is to be replaced in them.
    """
    program = f"""
import json, os, sys
sys.modules["rfc3987_syntax"] = None  # Jupyter does without it, and loads it for longer than all else
from jupyter_server.serverapp import ServerApp
from visualhfsm._editor.jupyter import editor_in_jupyter
found = []
for folder in None, {str(shown)!r}:
    if folder:
        ServerApp.instance(root_dir=folder)
    words = editor_in_jupyter()["command"](unix_socket={SOCKET!r})
    found.append([word.format(port=0, unix_socket={SOCKET!r}, base_url="/") for word in words])
print(json.dumps([os.getpid(), *found]))
"""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", program],
        cwd=folder,
        stdout=subprocess.PIPE,
        text=True,
        timeout=RUN_LIMIT,
        check=True,
    )
    pid, *found = json.loads(done.stdout)
    assert all(str(pid) in words for words in found)  # they end with this process
    return [[str(word) for word in words] for words in found]


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
def test_the_command_serves_the_current_folder_or_the_one_that_jupyter_shows(tmp_path: Path) -> None:
    pytest.importorskip("jupyter_server")
    current = tmp_path / "{class} {port} }{"  # braces that are not to be replaced
    shown = tmp_path / "shown"
    current.mkdir()
    shown.mkdir()
    words, later = commands(current, shown)
    assert words[0] == "setsid"
    assert words[words.index("-m") + 1 :] == [
        "visualhfsm", "edit", "--no-browser", f"--socket={SOCKET}", f"--root={current}",
    ]  # fmt: skip
    assert later == [*words[:-1], f"--root={shown}"]


def test_the_launcher_has_an_icon() -> None:
    entry = editor_in_jupyter()["launcher_entry"]
    assert Path(entry["icon_path"]).read_text("utf-8").startswith("<svg")


@pytest.mark.parametrize("installed", [True, False])
def test_the_launcher_shows_the_editor_where_its_packages_are(
    monkeypatch: pytest.MonkeyPatch, installed: bool
) -> None:
    genuine = util.find_spec
    monkeypatch.setattr(
        "visualhfsm._editor.jupyter.find_spec",
        lambda name: None if name == "starlette" and not installed else genuine(name),
    )
    assert editor_in_jupyter()["launcher_entry"]["enabled"] is installed
