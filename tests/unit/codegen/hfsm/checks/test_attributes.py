"""What the checks know about operations: those in the schemas of packages, and those of streams."""

from __future__ import annotations

import inspect
import json
from pathlib import Path

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm._checks.attributes import STREAM
from codegen.hfsm.loading import check_document
from tests.support.checked_documents import with_code
from tests.support.documents import document, problems, state, sub
from zenoh_ice.objects.proxy import StreamedCall


def test_streams_are_known_as_they_are() -> None:
    methods = {name: method for name, method in vars(StreamedCall).items() if not name.startswith("_")}
    assert set(STREAM) == set(methods)
    for name, method in methods.items():
        parameters = list(inspect.signature(method).parameters.values())[1:]
        by_position = tuple(each.name for each in parameters if each.kind is not each.KEYWORD_ONLY)
        by_name = frozenset(each.name for each in parameters if each.kind is each.KEYWORD_ONLY)
        required = sum(each.default is each.empty for each in parameters)
        known = STREAM[name]
        assert (known.parameters, known.by_name, known.required) == (by_position, by_name, required)


LAMP = {
    "kind": "interface",
    "operations": [
        {"name": "light", "parameters": [{"name": "from"}, {"name": "level", "optional": True}]},
        {
            "name": "say",
            "parameters": [{"name": "words", "type": "string"}, {"name": "pause", "type": "double"}],
        },
    ],
}
RED_LAMP = {"kind": "interface", "bases": ["::lab::Lamp"], "operations": [{"name": "blink"}]}
CONFIG = "<iceinterface><nameinterface>lamp</nameinterface><interface>RedLamp</interface></iceinterface>"


def warnings_of(directory: Path, code: str, *, described: bool = True) -> list[str]:
    package = directory / "lab"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "lamp.py").write_text("class LampPrx(P):\n    pass\nclass RedLampPrx(LampPrx):\n    pass\n")
    if described:
        definitions = {"::lab::Lamp": LAMP, "::lab::RedLamp": RED_LAMP}
        (package / "schema.json").write_text(json.dumps({"definitions": definitions}))
    path, diagnostics = directory / "main.xml", Diagnostics()
    path.write_text(document(sub(1, 0, state(1, "a", code, initial=True)), config=CONFIG))
    check_document(path, diagnostics, [directory], limit=0)
    return [f"{found.code}: {found.message}" for found in diagnostics]


@pytest.mark.parametrize(
    "code",
    [
        "self.lamp.blink()",
        "self.lamp.light(1)",
        "self.lamp.light(1, level=2)",
        "self.lamp.say('no', 1)",
        "self.lamp.say(str(1), pause=None)",
    ],
)
def test_operations_of_an_interface_and_its_bases_are_described(tmp_path: Path, code: str) -> None:
    assert warnings_of(tmp_path, code) == []


@pytest.mark.parametrize(
    ("code", "warning"),
    [
        ("self.lamp.glow()", "W528: `lab::RedLamp` has no operation `glow`"),
        ("self.lamp.say(1, 2.0)", "W529: `words` of `say` must be text"),
        ("self.lamp.say('hush', pause='long')", "W529: `pause` of `say` must be a number"),
        ("self.lamp.light()", "W529: `light` is called without `_from`"),
        ("self.lamp.light(1, 2, 3)", "W529: `light` takes 2 arguments, but gets 3"),
    ],
)
def test_a_wrong_call_is_found_by_the_description(tmp_path: Path, code: str, warning: str) -> None:
    assert warnings_of(tmp_path, code) == [warning]


def test_a_proxy_that_is_not_described_may_do_anything(tmp_path: Path) -> None:
    assert warnings_of(tmp_path, "self.lamp.glow()", described=False) == []


def test_the_extension_gives_attributes(path: Path) -> None:
    text = with_code("self.wave(self.speed)")
    assert len(problems(path, text)) == 2
    path.with_name("behavior_ext.py").write_text(
        "class BehaviorExtension:\n    speed = 3\n\n    def wave(self, speed):\n        self.last = speed\n"
    )
    assert problems(path, text) == []


def test_an_extension_with_a_base_may_give_any_attribute(path: Path) -> None:
    path.with_name("behavior_ext.py").write_text(
        "from lab import Base\n\n\nclass BehaviorExtension(Base):\n    pass\n"
    )
    assert problems(path, with_code("self.wave()")) == []
