"""What `nao doctor` finds on a machine, made wrong on purpose."""

from __future__ import annotations

import mmap
import os
import resource
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from uuid import uuid4

import pytest

from deploy.nao.doctor import Finding, Level, machine
from deploy.nao.doctor.installation import check_installation
from deploy.nao.doctor.machine import check_machine
from deploy.nao.doctor.network import check_network
from deploy.nao.ports import holder_of, listens
from zenoh_ice._zenoh.shared_memory import memory_space
from zenoh_ice.settings import load_settings

SHARED_MEMORY = Path("/dev/shm")


def told(findings: Iterator[Finding], level: Level) -> list[str]:
    return [f"{each.text} | {each.fix}" for each in findings if each.level == level]


@pytest.fixture
def without_gl(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave out the check of rendering, which takes a process."""
    monkeypatch.setattr(machine, "_check_rendering", lambda: iter(()))


def test_an_installation_in_order_has_no_failures() -> None:
    findings = list(check_installation())
    assert told(iter(findings), Level.FAILURE) == []
    assert any(each.text.startswith("Python ") for each in findings)


def test_files_that_are_named_like_packages_are_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "zenoh.py").touch()
    (tmp_path / "behaviors").mkdir()
    monkeypatch.chdir(tmp_path)
    assert not any("behaviors" in text for text in told(check_installation(), Level.WARNING))
    (tmp_path / "behaviors" / "__init__.py").touch()
    (text,) = told(check_installation(), Level.WARNING)
    assert "behaviors/__init__.py, zenoh.py" in text


def test_packages_that_come_from_elsewhere_are_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "ballmover").mkdir()
    (tmp_path / "ballmover" / "__init__.py").touch()
    monkeypatch.delitem(sys.modules, "ballmover", raising=False)
    monkeypatch.syspath_prepend(tmp_path)
    (text,) = told(check_installation(), Level.FAILURE)
    assert text.startswith(f"imported from {tmp_path} instead of ours: ballmover")


@pytest.mark.skipif(not SHARED_MEMORY.is_dir(), reason="there is no /dev/shm")
@pytest.mark.usefixtures("without_gl")
def test_a_segment_is_left_behind_once_no_process_has_it() -> None:
    path = SHARED_MEMORY / f"{uuid4().int}.zenoh"
    size = 2 << 20
    path.touch()
    os.truncate(path, size)
    try:
        with path.open("r+b") as file, mmap.mmap(file.fileno(), size):
            assert path.name not in dict(machine._left_behind())
        assert dict(machine._left_behind())[path.name] == size
        assert any("left behind" in text for text in told(check_machine(), Level.NOTE))
    finally:
        path.unlink()


def about_shared_memory() -> list[Finding]:
    return [each for each in check_machine() if each.text.startswith("shared memory")]


@pytest.mark.skipif(not memory_space(), reason="no memory is shared here")
@pytest.mark.usefixtures("without_gl")
class TestSharedMemory:
    def test_that_works_is_told(self) -> None:
        assert about_shared_memory() == [Finding(Level.OK, "shared memory works")]

    def test_of_a_process_with_capabilities_is_not_used(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(machine, "memory_space", lambda: "")
        (found,) = about_shared_memory()
        assert (found.level, "go over the network" in found.text) == (Level.NOTE, True)
        assert str(Path(sys.executable).resolve()) in found.fix

    def test_without_proc_is_not_used(self, monkeypatch: pytest.MonkeyPatch) -> None:
        is_dir = Path.is_dir
        monkeypatch.setattr(Path, "is_dir", lambda path: not path.is_relative_to("/proc") and is_dir(path))
        (found,) = about_shared_memory()
        assert (found.level, "no /proc" in found.text) == (Level.NOTE, True)

    def test_without_room_is_told_with_where_to_look(self) -> None:
        limits = resource.getrlimit(resource.RLIMIT_FSIZE)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, limits[1]))
        try:
            (found,) = about_shared_memory()
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        assert (found.level, "no room" in found.text) == (Level.WARNING, True)
        assert "ulimit -f" in found.fix

    def test_that_another_process_cannot_read_is_told_with_why(self, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(os, "getpid", lambda: 1)  # whose memory is another
        (found,) = about_shared_memory()
        assert found.level == Level.WARNING
        assert "another process cannot read it: an image" in found.text
        assert "shared_memory = false" in found.fix


def test_a_process_that_cannot_render_is_told_with_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "off")
    (text,) = told(check_machine(), Level.FAILURE)
    assert "rendering is switched off by MUJOCO_GL=off" in text


def test_who_holds_a_port_is_told() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        endpoint = f"tcp/127.0.0.1:{server.getsockname()[1]}"
        assert listens(endpoint) is True
        assert holder_of(endpoint).endswith(f" {os.getpid()}")
    assert (listens(endpoint), holder_of(endpoint)) == (False, "")


def test_what_cannot_be_looked_at_is_not_guessed(tmp_path: Path) -> None:
    assert listens("quic/127.0.0.1:7447") is None
    assert listens(f"unixsock-stream/{tmp_path / 'socket'}") is False


NO_ZENOH = """
import socket
with socket.create_server(("127.0.0.1", 0)) as server:
    print(server.getsockname()[1], flush=True)
    while True:
        server.accept()[0].sendall(b"220 no Zenoh")
"""


def test_a_port_that_speaks_something_else_is_told() -> None:
    with subprocess.Popen([sys.executable, "-c", NO_ZENOH], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            endpoint = f"tcp/127.0.0.1:{process.stdout.readline().strip()}"
            settings = load_settings(flags={"connect": [endpoint], "clock": "wall"})
            (text,) = told(check_network(settings), Level.FAILURE)
        finally:
            process.kill()
    assert text.startswith("no link: ")
    assert "something else has it" in text
