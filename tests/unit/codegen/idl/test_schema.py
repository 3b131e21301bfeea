"""What changes the fingerprint of an interface, and that the schema has everything it is computed from."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path

import msgspec
import pytest

from tests.support.slice_compiler import compile_text
from zenoh_ice.data.reflection import Definition, Schema, canonical_lines

SWITCH = "  interface Switch { void off(); idempotent void rest(); };\n"

BEGIN = """
module m {
  enum Color { red, green };
  struct Light { float power; Color color; };
  sequence<Light> Lights;
  exception Broken { string what; };
  interface Switch { void off(); idempotent void rest(); };
  interface Lamp extends Switch {
    ["stream"] idempotent Lights get(string which, out Color color) throws Broken;
  };
};
"""

CLASSES = """
module m {
  class Animal { string name; };
  class Dog(7) extends Animal { int legs = 4; optional(1) int tricks; };
  interface Lamp { Dog get(optional(2) Animal mother, Lamp* other); };
};
"""


def description(directory: Path, text: str, **others: str) -> tuple[str, str]:
    """Return the fingerprint of the interface Lamp, and the canonical form that its schema has."""
    compilation, diagnostics = compile_text(directory, text, **others)
    assert not diagnostics.has_errors, diagnostics.render()
    written = next(file.text for file in compilation.files if file.path.name == "schema.json")
    definitions = msgspec.convert(json.loads(written)["definitions"], dict[str, Definition])
    schema = Schema("::m::Lamp", definitions).part("::m::Lamp")
    form = "\n".join(sorted(canonical_lines(schema).values())) + "\n"
    fingerprint = schema.definitions["::m::Lamp"].fingerprint
    assert hashlib.sha256(form.encode()).hexdigest().startswith(fingerprint)
    modules = "".join(file.text for file in compilation.files if file.path.suffix == ".py")
    generated = re.search(r'id="::m::Lamp",\s+fingerprint="(\w+)"', modules)
    assert generated is not None
    assert generated[1] == fingerprint
    return fingerprint, form


@pytest.mark.parametrize(
    ("begin", "same"),
    [
        (BEGIN, "// comments\n" + BEGIN.replace("float", "/** docs */ float")),
        (BEGIN, BEGIN.replace("float power; Color color;", "Color color; float power;")),
        (BEGIN, BEGIN.replace("Lights", "LightSeq")),
        (
            BEGIN,
            BEGIN.replace("Color color)", "m::Color color)").replace("throws Broken", "throws ::m::Broken"),
        ),
        (BEGIN, BEGIN.replace("{ red, green }", "{ green = 1, red = 0 }")),
        (BEGIN, BEGIN.replace("void off()", '["amd"] void off()')),
        (BEGIN, BEGIN.replace("idempotent void rest()", '["stop"] idempotent void rest()')),
        (BEGIN, BEGIN + "module m { struct Other { int a; }; };"),
        (BEGIN, BEGIN.replace(SWITCH, "").replace("  enum", f"{SWITCH}  enum")),
        (CLASSES, CLASSES.replace("Dog(7)", "Dog")),
        (CLASSES, CLASSES.replace("legs = 4", "legs")),
        (CLASSES, CLASSES.replace("optional(1)", "optional(5)").replace("optional(2)", "optional(3)")),
        (
            CLASSES,
            CLASSES.replace("int legs = 4; optional(1) int tricks;", "optional(1) int tricks; int legs = 4;"),
        ),
    ],
)
def test_what_does_not_show_on_the_wire_does_not_count(tmp_path: Path, begin: str, same: str) -> None:
    assert same != begin
    assert description(tmp_path, same) == description(tmp_path, begin)


def test_files_do_not_count(tmp_path: Path) -> None:
    head, mark, tail = BEGIN.partition("  interface Switch")
    split = f'#include "types.idl"\nmodule m {{\n{mark}{tail}'
    assert description(tmp_path, split, types=f"{head}}};") == description(tmp_path, BEGIN)


@pytest.mark.parametrize(
    ("begin", "old", "new", "line"),
    [
        (BEGIN, "float power", "double power", "::m::Light::power: double"),
        (BEGIN, "power", "candela", "::m::Light::candela: float"),
        (BEGIN, "green", "blue", "::m::Color::blue = 1"),
        (BEGIN, "green", "green = 2", "::m::Color::green = 2"),
        (BEGIN, "string what", "long what", "::m::Broken::what: long"),
        (BEGIN, "void off()", "void off(int a)", "::m::Switch::off(int a): void"),
        (BEGIN, "void off()", "idempotent void off()", "::m::Switch::off(): void idempotent"),
        (BEGIN, " extends Switch", "", "interface ::m::Lamp\n"),
        (BEGIN, "string which", "string name", "::m::Lamp::get(string name)"),
        (BEGIN, "out Color color", "out int color", "int color throws"),
        (
            BEGIN,
            " throws Broken",
            "",
            "::m::Lamp::get(string which): sequence<::m::Light>, ::m::Color color idem",
        ),
        (BEGIN, '["stream"] ', "", "throws ::m::Broken idempotent\n"),
        (BEGIN, "sequence<Light> Lights", "dictionary<int, Light> Lights", "dictionary<int, ::m::Light>"),
        (CLASSES, "optional(1) int tricks", "int tricks", "::m::Dog::tricks: int"),
        (CLASSES, "optional(2) Animal mother", "Animal mother", "get(::m::Animal mother, ::m::Lamp* other)"),
        (CLASSES, " extends Animal", "", "class ::m::Dog\n"),
        (CLASSES, "Dog get", "optional(4) Dog get", "): optional ::m::Dog\n"),
        (CLASSES, "Lamp* other", "Object* other", "Object* other)"),
        (CLASSES, "{ string name; }", "{ string name; Object any; }", "::any: Object\n"),
    ],
)
def test_what_shows_on_the_wire_counts_and_is_named(
    tmp_path: Path, begin: str, old: str, new: str, line: str
) -> None:
    before, after = description(tmp_path, begin), description(tmp_path, begin.replace(old, new, 1))
    assert before[0] != after[0]
    assert re.fullmatch("[0-9a-f]{16}", after[0])
    assert line in after[1]
    assert line not in before[1]


def test_every_type_has_a_fingerprint_of_its_own(tmp_path: Path) -> None:
    def fingerprints(text: str) -> dict[str, str]:
        compilation, diagnostics = compile_text(tmp_path, text)
        assert not diagnostics.has_errors, diagnostics.render()
        schema = next(file.text for file in compilation.files if file.path.name == "schema.json")
        return {name: entry["fingerprint"] for name, entry in json.loads(schema)["definitions"].items()}

    before = fingerprints(BEGIN)
    assert len(set(before.values())) == len(before) == 6
    after = fingerprints(BEGIN.replace("green", "blue"))
    changed = {name for name in before if before[name] != after[name]}
    assert changed == {"::m::Color", "::m::Light", "::m::Lights", "::m::Lamp"}
