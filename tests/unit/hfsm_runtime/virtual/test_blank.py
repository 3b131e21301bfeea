"""What stand-ins return: every declared type is filled, so that code can read it at any depth."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

from hfsm_runtime.virtual import Execution, VirtualWorld
from tests.support.codegen_command import codegen
from tests.support.documents import compile_to, document, load, state, sub

IDL = """
module allotment {
    enum Colour { Green, Red };
    class Place { double x; double y = 1.5; string frame; };
    struct Inner { Place pose; Colour paint; };
    sequence<Inner> Inners;
    dictionary<string, Inner> Named;
    sequence<byte> Bytes;
    class Node;
    sequence<Node> Nodes;
    class Node { int value; Node next; Nodes others; };
    class Derived extends Place { Inner part; optional(1) Inners spare; };
    interface Pot;
    interface Plant { Place where(); Pot* getPot(); };
    interface Pot { Plant* getPlant(); Object* anything(); };
    interface Bed {
        ["stream"] Place getPose();
        Derived getDerived();
        Inners getList();
        Named getNamed();
        Node getNode();
        Bytes getBytes();
        optional(1) Inner perhaps();
        bool several(int number, out Place pose, out Inners parts, out optional(2) string text);
        Plant* getPlant();
        Object value();
    };
};
"""
INTERFACE = """<iceinterface><nameinterface>Bed</nameinterface><nameproxy>Bed</nameproxy>
<interface>Bed</interface></iceinterface>"""


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Return a folder with the package of an interface that has every kind of type."""
    folder = tmp_path_factory.mktemp("allotment")
    (folder / "interfaces").mkdir()
    (folder / "interfaces" / "allotment.idl").write_text(IDL)
    done = codegen("interfaces/allotment.idl", cwd=folder)
    assert done.returncode == 0, done.stderr
    path = [*sys.path]
    yield folder
    sys.path[:] = path  # components add the folder of their interfaces
    for name in [name for name in sys.modules if name.startswith("interfaces.allotment")]:
        del sys.modules[name]


@pytest.fixture
def answers(package: Path) -> Iterator[Any]:
    """Return a proxy of a stand-in for the interface."""
    component = load(
        compile_to(package, document(sub(1, 0, state(1, "a", initial=True)), config=INTERFACE), "reads")
    )
    with closing(VirtualWorld(stand_ins=True)) as world:
        world.connect(component)
        yield vars(component)["Bed"]


def test_a_class_is_there_with_its_members_and_their_defaults(answers: Any) -> None:
    pose = answers.getPose()
    assert (pose.x, pose.y, pose.frame) == (0.0, 1.5, "")
    derived = answers.getDerived()
    assert (derived.y, derived.part.pose.x, derived.part.paint.name) == (1.5, 0.0, "Green")
    assert type(answers.value()).__name__ == "Value"


def test_sequences_dictionaries_and_optional_values_hold_one_that_is_filled(answers: Any) -> None:
    assert [each.pose.y for each in answers.getList()] == [1.5]
    assert [each.pose.y for each in answers.getNamed().values()] == [1.5]
    assert answers.perhaps().pose.y == 1.5
    assert answers.getDerived().spare[0].pose.y == 1.5
    assert answers.getBytes() == b""  # as many as the zeros say that describe them


def test_out_parameters_are_filled(answers: Any) -> None:
    returned, pose, inners, text = answers.several(3)
    assert (returned, pose.y, inners[0].pose.x, text) == (False, 1.5, 0.0, "")


def test_a_class_that_refers_to_itself_ends(answers: Any) -> None:
    node = answers.getNode()
    assert (node.next.value, node.next.next, node.next.others) == (0, None, [])
    assert (node.others[0].value, node.others[0].others) == (0, [])


def test_a_proxy_leads_to_another_stand_in(answers: Any) -> None:
    plant = answers.getPlant()
    assert plant.where().y == 1.5
    assert plant.getPot().getPlant().where().frame == ""
    plant.getPot().anything().ice_ping()


def test_the_stream_of_a_class_yields_samples(answers: Any) -> None:
    assert answers.getPose.latest().value.y == 1.5


def test_a_behavior_that_reads_a_class_can_be_tried(package: Path) -> None:
    code = "self.seen = self.Bed.getPose().x + self.Bed.getList()[0].pose.y"
    component = load(
        compile_to(package, document(sub(1, 0, state(1, "a", code, initial=True)), config=INTERFACE), "tries")
    )
    with Execution(component, VirtualWorld(stand_ins=True)) as run:
        run.advance(0.5)
    assert vars(component)["seen"] == 1.5
