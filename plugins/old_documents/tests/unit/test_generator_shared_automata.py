"""The documents of the original users become components that run, if their code is Python."""

from __future__ import annotations

import csv
import math
import re
from collections import Counter
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document
from tests.support.codegen_command import ROOT
from tests.support.documents import load
from visualhfsm._document.conversion import convert_document
from visualhfsm.simulation import Behavior
from visualhfsm.testing import MakeBehavior

FOLDER = ROOT.parent / "shared" / "automata"
MANIFEST = FOLDER / "manifest.tsv"

pytestmark = pytest.mark.skipif(
    not MANIFEST.exists(), reason="the documents of the origin's users are not here"
)


def _rows() -> list[dict[str, str]]:
    if not MANIFEST.exists():
        return []
    with MANIFEST.open(newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))


CONTROL = "float64 throttle\nfloat64 brake\nfloat64 steer\n"
"""As much of a message of the Prius as a document uses."""

ERRORS_OF_THEIR_AUTHORS = {"visualstates/deneme-091ea35b.xml": "`self.setMotors` is not declared"}
NOT_GENERATED = {"cpp": 16, "plain": 4}
"""By the kind of their code: C++, and words that are no code, such as `go on`."""


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a message of another project that a document uses."""
    folder = tmp_path_factory.mktemp("packages")
    (folder / "prius_msgs" / "msg").mkdir(parents=True)
    (folder / "prius_msgs" / "msg" / "Control.msg").write_text(CONTROL)
    return folder


def _generate(row: dict[str, str], folder: Path, packages: Path, diagnostics: Diagnostics) -> Path | None:
    """Fix the Python 2 of a document, and generate its component into a folder."""
    source = FOLDER / row["file"]
    path = folder / f"{re.sub(r'[^a-z0-9]', '_', source.stem.lower())}.xml"
    path.write_text(convert_document(source, Diagnostics(), fixes_python2=True))
    files = compile_document(path, folder, diagnostics, (packages,))
    if files is None:
        return None
    files[0].path.write_text(files[0].text)
    return files[0].path


@pytest.mark.slow
def test_all_but_cpp_and_words_generate_and_run_for_ten_seconds_with_stand_ins(
    tmp_path: Path, packages: Path
) -> None:
    rows = _rows()
    failed: Counter[str] = Counter()
    for row in rows:
        diagnostics = Diagnostics()
        file = _generate(row, tmp_path, packages, diagnostics)
        if file is None:
            failed[row["lang"]] += 1
            assert {error.code for error in diagnostics.errors} <= {"E520", "E525"}
        else:
            assert_runs(row["file"], file)
    assert failed == NOT_GENERATED
    assert len(rows) - failed.total() == 32


def assert_runs(name: str, file: Path) -> None:
    """Assert that the component of a document starts with stand-ins for all that it uses, and runs for 10 s."""
    component = load(file)
    with Behavior(component, robot="fake", stand_ins=True, on_error="stop") as virtual:
        virtual.advance(10)
    if name in ERRORS_OF_THEIR_AUTHORS:
        assert ERRORS_OF_THEIR_AUTHORS[name] in virtual.errors[0].message, name
    else:
        assert virtual.errors == (), name
        assert virtual.tree.root.cycle.count == 1 + round(10 / virtual.tree.root.automaton.period), name


def converted(name: str, folder: Path) -> Path:
    """Write a document of VisualStates as one of ours, and return its path."""
    path = folder / f"{name}.xml"
    path.write_text(convert_document(FOLDER / "visualstates" / f"{name}.xml", Diagnostics()))
    return path


@pytest.mark.parametrize("name", ["obstacleAvoidancePython-5f5a6d73", "obstacle_avoidance_python-2eb2ad81"])
def test_a_turtlebot_of_visualstates_avoids_obstacles(
    name: str, behavior: MakeBehavior, tmp_path: Path
) -> None:
    run = behavior(converted(name, tmp_path))
    scan, velocity = (
        run.ros.topic(f"/turtlebotROS/{each}") for each in ("laser/scan", "mobile_base/commands/velocity")
    )
    run.advance(0.5)
    assert (run.active.lower(), velocity.messages[-1].linear.x) == ("move", 0.3)
    scan.publish(ranges=[2.0, 0.3, 2.0])
    run.advance(0.5)
    assert (run.active.lower(), velocity.messages[-1].angular.z) == ("avoid", 0.1)
    scan.publish(ranges=[2.0, 0.5, 2.0])
    run.advance(0.5)
    assert run.active.lower() == "move"


@pytest.mark.parametrize("name", ["BumpAndGoPython-53490bff", "bump_and_go_python-87302ff6"])
def test_a_turtlebot_of_visualstates_bumps_and_goes(
    name: str, behavior: MakeBehavior, tmp_path: Path
) -> None:
    run = behavior(converted(name, tmp_path))
    scan, odometry = (run.ros.topic(f"/turtlebotROS/{each}") for each in ("laser/scan", "odom"))
    odometry.publish(pose={"pose": {"orientation": {"z": math.sin(-0.5), "w": math.cos(-0.5)}}})
    scan.publish(ranges=[0.3])
    run.run_until("GetBack", limit=0.5)
    scan.publish(ranges=[2.0])
    run.run_until("Rotate", limit=2.5)
    run.advance(1.0)
    assert run.active == "Rotate"
    odometry.publish(pose={"pose": {"orientation": {"z": math.sin(0.5), "w": math.cos(0.5)}}})
    run.run_until("Go", limit=0.5)


def test_documents_of_each_dialect_and_kind_are_there() -> None:
    assert {(row["dialect"], row["lang"]) for row in _rows()} >= {
        ("spanish2013", "none"),
        ("visualhfsm", "python"),
        ("visualstates", "python"),
    }
