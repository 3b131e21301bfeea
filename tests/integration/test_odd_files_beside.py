"""Files that cannot be read, such as pipes and looping links, disturb nothing beside a document."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.support.codegen_command import codegen
from tests.support.commands import run_here
from tests.support.documents import document, state, sub
from visualhfsm._commands.app import app

TEXT = document(
    sub(1, 0, state(1, "go", "self.motors.stop()", initial=True)),
    config="<iceinterface><nameinterface>motors</nameinterface><nameproxy>Motors</nameproxy>"
    "<interface>Motors</interface></iceinterface>",
)


def loop(path: Path) -> None:
    path.symlink_to(path.name)


def dangling(path: Path) -> None:
    path.symlink_to("nowhere")


def pipe(path: Path) -> None:
    os.mkfifo(path)


def device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def unreadable(path: Path) -> None:
    path.mkdir()
    path.chmod(0)


ODD = [loop, dangling, pipe, device, unreadable]
PLACES = [
    "odd",
    "odd.py",
    "odd.xml",
    "odd.msg",
    "package/odd.py",
    "package/odd",
    "empty/__init__.py",
    "interfaces/robots/odd.py",
    "interfaces/odd",
    "my_msgs/msg/odd.msg",
]


@pytest.fixture
def project(tmp_path: Path) -> Path:
    """Return a folder with a document, packages of proxies and types of ROS."""
    for name in ("package", "interfaces/robots", "my_msgs/msg", "empty"):
        (tmp_path / name).mkdir(parents=True)
    for name in ("package", "interfaces/robots"):
        (tmp_path / name / "__init__.py").touch()
        (tmp_path / name / "schema.json").write_text("{}")
    (tmp_path / "good.xml").write_text(TEXT)
    return tmp_path


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("make", ODD, ids=lambda make: make.__name__)
def test_documents_beside_it_generate_and_are_checked(
    project: Path, make: Callable[[Path], None], place: str
) -> None:
    make(project / place)
    done = codegen("good.xml", cwd=project)
    assert (done.returncode, done.stderr) == (0, "")
    checked = run_here(app, "visualhfsm", "check", str(project))
    assert checked.returncode == 0, checked.stderr


@pytest.mark.parametrize("make", [loop, dangling, pipe, device], ids=lambda make: make.__name__)
def test_as_a_document_it_is_an_error(tmp_path: Path, make: Callable[[Path], None]) -> None:
    make(tmp_path / "odd.xml")
    done = codegen("odd.xml", cwd=tmp_path)
    assert done.returncode == 1
    assert "odd.xml: error[E500]: cannot be read: " in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize("make", [loop, pipe, device], ids=lambda make: make.__name__)
@pytest.mark.parametrize("name", ["good.py", "good_ext.py"])
def test_as_the_component_or_its_extension_it_is_an_error(
    project: Path, make: Callable[[Path], None], name: str
) -> None:
    make(project / name)
    done = codegen("good.xml", cwd=project)
    assert done.returncode == 1
    assert name in done.stderr
    assert "Traceback" not in done.stderr
