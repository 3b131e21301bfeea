"""docs/how-to/plug-in.md: the plug-in of the page, outside the checkout, drives a robot as the page shows."""

from __future__ import annotations

import socket
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

from interfaces.jderobot import EncodersPrx
from tests.support.limits import CALL_LIMIT, MOVE_LIMIT
from tests.support.pages import DOCS, blocks_of
from tests.support.plugins import write_distribution
from tests.support.processes import STEADY, ComponentProcess, free_endpoint, module
from tests.support.waiting import until
from zenoh_ice import initialize

PAGE: Final = (DOCS / "how-to/plug-in.md").read_text("utf-8")
LONGEST: Final = 60
"""Lines of code of the plug-in, at most, without blank ones."""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """The plug-in, installed as `pip install .` does it."""
    files = {block.name: block.text for block in blocks_of(PAGE) if block.name}
    project = tomllib.loads(files["pyproject.toml"])["project"]
    (tmp_path / "robot_by_lines.py").write_text(files["robot_by_lines.py"])
    write_distribution(tmp_path, project["name"], project["entry-points"])
    return tmp_path


def environment(folder: Path) -> dict[str, str]:
    return {**STEADY, "PYTHONPATH": str(folder)}


@pytest.fixture
def served(folder: Path) -> Iterator[tuple[str, tuple[str, int]]]:
    """The endpoint of a simulated robot that serves it, and the address for lines of text."""
    endpoint = free_endpoint()
    command = module("naoserver_sim", "--listen", endpoint, "--no-skin", "--lines", "0")
    with ComponentProcess(command, environment(folder)) as process:
        host, port = process.wait_for(r"^Lines: ([\d.]+):(\d+)$").groups()
        process.wait_for("^ready: ")
        yield endpoint, (host, int(port))


def test_it_is_short(folder: Path) -> None:
    lines = (folder / "robot_by_lines.py").read_text().splitlines()
    assert len([line for line in lines if line.strip()]) <= LONGEST


def test_the_dialog_of_the_page_is_so(served: tuple[str, tuple[str, int]]) -> None:
    (dialog,) = (
        block.text for block in blocks_of(PAGE) if block.info == "text" and "drive 0.05" in block.text
    )
    said, answered = dialog.splitlines()[::2], dialog.splitlines()[1::2]
    with socket.create_connection(served[1], CALL_LIMIT) as program, program.makefile("rw") as lines:
        for line, answer in zip(said, answered, strict=True):
            lines.write(f"{line}\n")
            lines.flush()
            assert lines.readline() == f"{answer}\n"


def test_it_walks_until_the_program_goes(served: tuple[str, tuple[str, int]]) -> None:
    endpoint, address = served
    with initialize(connect=[endpoint], listen=["tcp/127.0.0.1:0"]) as communicator:
        encoders = EncodersPrx.checkedCast(communicator.stringToProxy("Encoders"))

        def moved() -> float:
            return encoders.getEncodersData().robotx

        with socket.create_connection(address, CALL_LIMIT) as program, program.makefile("rw") as lines:

            def walks() -> bool:
                lines.write("drive 0.05 0 0\n")
                lines.flush()
                assert lines.readline() == "ok\n"
                return moved() > 0.02

            until(walks, MOVE_LIMIT)
