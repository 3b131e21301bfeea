"""What `nao doctor` finds on a misconfigured machine."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace

import pytest

from nao_tools._connection import listens
from nao_tools._doctor import installation
from nao_tools._doctor.installation import check_installation
from nao_tools._doctor.machine import check_machine, check_robots
from nao_tools._doctor.network import check_network, holder_of
from nao_tools.findings import Finding, Level
from naoserver.safety.latch import Latch, latch_of
from tests.support.limits import RUN_LIMIT
from tests.support.nao_command import nao
from tests.support.places import ROOT
from tests.support.plugins import without
from zenoh_ice.settings import Settings, load_settings

RENAME = "rename it, or take its folder from PYTHONPATH"


def reported(findings: Iterator[Finding], level: Level) -> list[str]:
    return [f"{each.text} | {each.fix}" for each in findings if each.level == level]


def test_an_installation_in_order_has_no_failures() -> None:
    findings = list(check_installation())
    assert reported(iter(findings), Level.FAILURE) == []
    assert any(each.text.startswith("Python ") for each in findings)


def test_libraries_that_are_missing_or_old_are_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    versions = {"eclipse-zenoh": "1.2", "mujoco": ""}
    monkeypatch.setattr(installation, "version_of", lambda name, *_: versions.get(name, "999"))
    findings = list(check_installation())
    (failure,) = (each.text for each in findings if each.level == Level.FAILURE)
    assert failure.startswith("eclipse-zenoh 1.2 is older than 1.")
    (missing,) = (each for each in findings if each.level == Level.NOTE)
    assert missing.text == "the simulated robot, naoserver-sim: mujoco is not installed"
    assert "'visualhfsm[sim]'" in missing.fix


def test_a_module_that_hides_our_interfaces_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "interfaces").mkdir()
    monkeypatch.chdir(tmp_path)
    assert reported(check_installation(), Level.FAILURE) == []
    hiding = tmp_path / "interfaces" / "__init__.py"
    hiding.touch()
    (text,) = reported(check_installation(), Level.FAILURE)
    assert text.startswith(f"{hiding} hides the package interfaces of VisualHFSM")
    assert "delete this file" in text


def test_a_file_that_hides_what_we_need_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folders = [tmp_path / name for name in ("here", "listed", "installed")]
    for folder in folders:
        folder.mkdir()
    monkeypatch.chdir(folders[0])
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(map(str, folders[1:])))
    (folders[0] / "tempfile.py").touch()
    (folders[1] / "zenoh").mkdir()
    (folders[1] / "numpy.py").touch()
    for name in ("zenoh/__init__.py", "unknown.py", "os.py"):  # Python has its `os` before it looks for one
        (folders[1] / name).touch()
    (folders[2] / "msgspec.py").touch()
    (folders[2] / "msgspec-0.20.dist-info").mkdir()
    (folders[2] / "msgspec-0.20.dist-info" / "METADATA").write_text("Name: msgspec\nVersion: 0.20\n")
    assert reported(check_installation(), Level.FAILURE) == [
        f"{folders[0] / 'tempfile.py'} hides Python's own tempfile | {RENAME}",
        f"{folders[1] / 'numpy.py'} hides the package numpy, which VisualHFSM needs | {RENAME}",
        f"{folders[1] / 'zenoh' / '__init__.py'} hides the package zenoh, which VisualHFSM needs | {RENAME}",
    ]


def test_where_only_ascii_is_known_a_folder_with_other_letters_keeps_python_from_starting(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("site.getsitepackages", lambda: [str(tmp_path)])
    (tmp_path / "ours.pth").write_text("/home/anna/visualhfsm\n", "utf-8")
    assert [each for each in reported(check_installation(), Level.NOTE) if "ours.pth" in each] == []
    (tmp_path / "ours.pth").write_text("/home/añna/visualhfsm\n", "utf-8")
    (text,) = (each for each in reported(check_installation(), Level.NOTE) if "ours.pth" in each)
    assert text.startswith(f"{tmp_path / 'ours.pth'} names a folder with letters beyond ASCII: with LC_ALL=C")
    assert "set LC_ALL=C.UTF-8" in text


def mujoco_in_part(folder: Path) -> str:
    """Return where Python finds, before the genuine one, what `pip install mujoco==4.0.0` makes of a 3.12.0."""
    (folder / "mujoco").mkdir()
    (folder / "mujoco" / "__init__.py").write_text("""\
try:
    import mujoco._specs
except ImportError as error:
    raise ImportError(
        "The 'mujoco' package is installed, but its core bindings ('mujoco-core') are missing or corrupted (for"
        " example, after uninstalling a previous monolithic 'mujoco' package). Repair your environment with:\\n"
        "  pip install --force-reinstall --no-deps mujoco mujoco-core mujoco-studio"
    ) from error
""")
    return f"{folder}{os.pathsep}{ROOT}"


@pytest.mark.slow
def test_rendering_that_is_switched_off_is_reported_with_what_to_do(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "off")
    done = nao("doctor", "--json")
    assert done.code == 1
    (found,) = (each for each in json.loads(done.out) if "rendering" in each["text"])
    assert "rendering is switched off by MUJOCO_GL=off" in found["text"]
    assert found["fix"] == "unset MUJOCO_GL"


@pytest.mark.slow
def test_a_mujoco_that_is_installed_in_part_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    in_part = mujoco_in_part(tmp_path)
    monkeypatch.setenv("PYTHONPATH", in_part)
    text = "MuJoCo is installed in part"
    (found,) = (each for each in check_machine() if "MuJoCo" in each.text)
    remedy = "pip install --force-reinstall --no-deps mujoco mujoco-core mujoco-studio"
    assert found == Finding(Level.FAILURE, text, remedy)
    command = [sys.executable, "-P", "-m", "naoserver_sim"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=RUN_LIMIT)
    assert (done.returncode, done.stderr) == (1, f"naoserver-sim: error: {text}: {remedy}\n")


@pytest.mark.slow
@pytest.mark.gl
def test_a_process_that_can_render_takes_a_picture() -> None:
    (text,) = (each.text for each in check_machine() if each.text.startswith("GL"))
    assert text.startswith("GL renders a picture of 64x64 with ")


def test_robots_that_start_stopped_are_listed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    assert list(check_robots()) == [Finding(Level.OK, "none is stopped")]

    def serving(realm: str, body: str = "") -> Latch:
        latch = latch_of(Settings(realm=realm, listen=("tcp/127.0.0.1:7447",)), body=body)
        assert isinstance(latch, Latch)
        return latch

    with serving("ended"):
        pass
    with serving("red") as red:
        red.keep("a hand in the way", None)
    serving("killed").__enter__().release()
    with serving("simulated", "T1") as simulated:
        simulated.keep("smoke", None)
    with serving("simulated", "G1"):
        pass
    killed, stopped, aside = check_robots()
    assert aside.text == "the simulated T1 of realm simulated is stopped: smoke"
    assert aside.fix == "start it, then: nao stop --reset --realm simulated"
    assert (killed.level, stopped.level) == (Level.NOTE, Level.NOTE)
    assert killed.text == "a server of realm killed runs, or was killed: then the next one starts stopped"
    assert stopped.text == "a robot of realm red is stopped: a hand in the way"
    assert stopped.fix == "look at it, then: nao stop --reset --realm red"
    (tmp_path / "visualhfsm" / "robots" / "nao-0.json").write_text("{")
    assert "cannot be read" in next(each.text for each in check_robots() if "realm nao" in each.text)


def test_where_no_stop_can_be_kept_no_server_starts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "visualhfsm").touch()
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    (text,) = reported(check_robots(), Level.FAILURE)
    place = tmp_path / "visualhfsm" / "robots"
    assert text.startswith(
        f"no emergency stop can be kept in {place}, so that no robot server starts: Not a "
    )
    assert "set XDG_STATE_HOME to a folder that can be written" in text


@pytest.mark.slow
def test_who_holds_a_port_is_reported() -> None:
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


@pytest.mark.slow
def test_a_port_that_speaks_something_else_is_reported() -> None:
    with subprocess.Popen([sys.executable, "-c", NO_ZENOH], stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            endpoint = f"tcp/127.0.0.1:{process.stdout.readline().strip()}"
            settings = load_settings(flags={"connect": [endpoint], "clock": "wall", "timeout": 0.5})
            (text,) = reported(check_network(settings), Level.FAILURE)
        finally:
            process.kill()
    assert text.startswith("no link: ")
    assert "a server that hangs or another program holds it" in text


@pytest.mark.slow
@pytest.mark.parametrize("error", [RuntimeError, SystemExit])
def test_what_cannot_be_checked_leaves_the_rest(
    error: type[BaseException], monkeypatch: pytest.MonkeyPatch
) -> None:
    def check_grading() -> Iterator[Finding]:
        yield Finding(Level.WARNING, "dust on the lens", "wipe it")
        raise error("no wheels")

    monkeypatch.setitem(sys.modules, "visualhfsm_classes", SimpleNamespace(check_grading=check_grading))
    monkeypatch.setenv("TMPDIR", "/nonexistent")
    found = list(check_machine())
    assert "dust on the lens | wipe it" in reported(iter(found), Level.WARNING)
    (failure,) = (each for each in reported(iter(found), Level.FAILURE) if each.startswith("grading"))
    assert failure.startswith("grading: it cannot be checked: no wheels")
    assert any(each.text.startswith("TMPDIR=/nonexistent: ") for each in found)


@pytest.mark.slow
def test_without_the_plug_in_that_grades_nothing_is_said_of_it() -> None:
    with without("visualhfsm_classes"):
        assert not [each for each in check_machine() if each.text.startswith("grading")]
