"""What all doors share: a fake robot and a simulated one. Everything else is a door's own."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import pytest

from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT
from tests.support.processes import STEADY, ComponentProcess, free_endpoint, module
from zenoh_ice import Communicator, initialize


@dataclass(frozen=True)
class ServedRobot:
    """A robot that a process serves on loopback, in the realm `nao`."""

    endpoint: str
    process: ComponentProcess

    @property
    def environment(self) -> dict[str, str]:
        """What leads the clients of other processes to it."""
        return {"VISUALHFSM_CONNECT": self.endpoint}

    @contextmanager
    def client(self) -> Iterator[Communicator]:
        """Open a session that calls it."""
        with initialize(connect=[self.endpoint], clock="wall") as communicator:
            yield communicator


def printed(*command: str | Path, folder: Path, **environment: str) -> str:
    """Return what a program of one's own prints, which has ended well."""
    done = subprocess.run(
        [sys.executable, *map(str, command)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": f"{folder}{os.pathsep}{ROOT}", **environment},
        capture_output=True,
        text=True,
        timeout=RUN_LIMIT,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@contextmanager
def _served(name: str, *options: str) -> Iterator[ServedRobot]:
    endpoint = free_endpoint()
    with ComponentProcess(module(name, "--listen", endpoint, *options), STEADY) as process:
        process.wait_for("^ready")
        yield ServedRobot(endpoint, process)


# Of the package, so that they stand before the checks of each file for what it leaves behind.
@pytest.fixture(scope="package", autouse=True)
def fake() -> Iterator[ServedRobot]:
    """A Nao without physics."""
    with _served("naoserver.fake") as robot:
        yield robot


@pytest.fixture(scope="package", autouse=True)
def simulated() -> Iterator[ServedRobot]:
    """A Nao in MuJoCo, which is a NAOqi, too, where that is there."""
    pytest.importorskip("mujoco")
    naoqi = ("--qi", "tcp://127.0.0.1:0") if find_spec("visualhfsm_naoqi") and find_spec("qi") else ()
    with _served("naoserver_sim", *naoqi) as robot:
        yield robot
