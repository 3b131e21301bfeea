"""No name has two meanings in a component: whatever an interface is called, its component starts."""

from __future__ import annotations

from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document
from tests.support.documents import compile_to, document, state, sub, transition
from tests.support.plugins import OLD_DOCUMENTS
from visualhfsm.testing import MakeBehavior


def interface(name: str, type: str = "Motors", identity: str = "Motors") -> str:
    """Return the declaration of an interface."""
    return (
        f"<iceinterface><nameinterface>{name}</nameinterface><nameproxy>{identity}</nameproxy>"
        f"<interface>{type}</interface></iceinterface>"
    )


def started(text: str, directory: Path, behavior: MakeBehavior, name: str = "behavior") -> object:
    """Run a document for a moment with a stub of motors, and return `self.found`."""
    compile_to(directory, text, name)
    run = behavior(directory / f"{name}.xml", stubs={"Motors": {"getV": 0.5}})
    run.advance(0.1)
    assert not run.errors
    return vars(run.component)["found"]


@OLD_DOCUMENTS
@pytest.mark.parametrize(
    ("names", "used"),
    [
        (["Motors"], "self.MotorsPrx"),
        (["Motors"], "getattr(self, 'MotorsPrx')"),
        (["MotorsPrx"], "self.MotorsPrx"),
        (["MotorsPrx", "other"], "self.other"),
        (["MotorsPrx", "MotorsPrxPrx"], "self.MotorsPrxPrx"),
        (["Motors", "MotorsPrx"], "self.MotorsPrx"),
        (["JderobotMotorsPrx", "MotorsPrx"], "self.MotorsPrx"),
        (["motors", "lock"], "self.lock"),
        (["time"], "self.timePrx"),
    ],
)
def test_a_component_starts_whatever_its_interfaces_are_called(
    tmp_path: Path, behavior: MakeBehavior, names: list[str], used: str
) -> None:
    config = "".join(map(interface, names))
    text = document(sub(1, 0, state(1, "go", f"self.found = {used}.getV()", initial=True)), config=config)
    assert started(text, tmp_path, behavior) == 0.5


@OLD_DOCUMENTS
def test_code_may_name_the_class_of_a_proxy_that_is_hidden(tmp_path: Path, behavior: MakeBehavior) -> None:
    code = "self.found = MotorsPrx.checkedCast(self.MotorsPrx).getV()"
    text = document(sub(1, 0, state(1, "go", code, initial=True)), config=interface("Motors"))
    assert started(text, tmp_path, behavior) == 0.5


def test_a_library_may_have_the_name_of_a_proxy_class(tmp_path: Path, behavior: MakeBehavior) -> None:
    (tmp_path / "proxies_of_mine.py").write_text("MotorsPrx = 2.5\n")
    text = document(
        sub(1, 0, state(1, "go", "self.found = MotorsPrx + self.motors.getV()", initial=True)),
        libraries=("from proxies_of_mine import MotorsPrx",),
        config=interface("motors"),
    )
    assert started(text, tmp_path, behavior) == 3.0


def test_a_library_may_have_the_name_of_a_module_that_the_old_generator_imported(
    tmp_path: Path, behavior: MakeBehavior
) -> None:
    text = document(
        sub(1, 0, state(1, "go", "self.found = time() > 0 and self.motors.getV()", initial=True)),
        libraries=("from time import time",),
        config=interface("motors"),
    )
    assert started(text, tmp_path, behavior) == 0.5


@pytest.mark.parametrize("name", ["event", "motors_prx", "parameter"])
def test_a_document_may_be_called_like_what_its_component_imports(
    tmp_path: Path, behavior: MakeBehavior, name: str
) -> None:
    parameter = (
        "<parameters><parameter><name>x</name><type>int</type><default>1</default></parameter></parameters>"
    )
    text = document(
        sub(
            1,
            0,
            state(1, "go", "self.found = self.motors.getV()", initial=True),
            transition(1, 1, 1, "again", type="event"),
        ),
        config=interface("motors"),
        head=parameter,
    )
    assert started(text, tmp_path, behavior, name) == 0.5


@OLD_DOCUMENTS
@pytest.mark.parametrize("name", ["Proxy", "property"])
def test_a_name_that_the_component_cannot_do_without_is_refused(tmp_path: Path, name: str) -> None:
    path = tmp_path / "behavior.xml"
    config = interface(name) + "\n" + interface("other")
    path.write_text(document(sub(1, 0, state(1, "go", "self.otherPrx", initial=True)), config=config))
    diagnostics = Diagnostics()
    assert compile_document(path, None, diagnostics) is None
    (error,) = diagnostics.errors
    assert (error.code, error.location.line) == ("E521", 11)
    assert error.message == f"`{name}` would have two meanings in the component: choose another name"


def test_what_people_define_twice_themselves_is_theirs(tmp_path: Path) -> None:
    functions = "limit = 1\nlimit = 2"
    text = document(sub(1, 0, state(1, "go", "self.limit", initial=True), functions=functions))
    assert "limit = 2" in compile_to(tmp_path, text).read_text()
