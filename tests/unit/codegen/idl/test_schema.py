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
    "same",
    [
        "// comments\n" + BEGIN.replace("float", "/** docs */ float"),
        BEGIN.replace("float power; Color color;", "Color color; float power;"),
        BEGIN.replace("Lights", "LightSeq"),
        BEGIN.replace("Color color)", "m::Color color)").replace("throws Broken", "throws ::m::Broken"),
        BEGIN.replace("{ red, green }", "{ green = 1, red = 0 }"),
        BEGIN.replace("void off()", '["amd"] void off()'),
        BEGIN.replace("idempotent void rest()", '["stop"] idempotent void rest()'),
        BEGIN + "module m { struct Other { int a; }; };",
        BEGIN.replace(SWITCH, "").replace("  enum", f"{SWITCH}  enum"),
    ],
)
def test_what_does_not_show_on_the_wire_does_not_count(tmp_path: Path, same: str) -> None:
    assert same != BEGIN
    assert description(tmp_path, same) == description(tmp_path, BEGIN)


def test_files_do_not_count(tmp_path: Path) -> None:
    head, mark, tail = BEGIN.partition("  interface Switch")
    split = f'#include "types.idl"\nmodule m {{\n{mark}{tail}'
    assert description(tmp_path, split, types=f"{head}}};") == description(tmp_path, BEGIN)


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("float power", "double power", "::m::Light::power: double"),
        ("power", "candela", "::m::Light::candela: float"),
        ("green", "blue", "::m::Color::blue = 1"),
        ("green", "green = 2", "::m::Color::green = 2"),
        ("string what", "long what", "::m::Broken::what: long"),
        ("void off()", "void off(int a)", "::m::Switch::off(int a): void"),
        ("void off()", "idempotent void off()", "::m::Switch::off(): void idempotent"),
        (" extends Switch", "", "interface ::m::Lamp\n"),
        ("string which", "string name", "::m::Lamp::get(string name)"),
        ("out Color color", "out int color", "int color throws"),
        (" throws Broken", "", "::m::Lamp::get(string which): sequence<::m::Light>, ::m::Color color idem"),
        ('["stream"] ', "", "throws ::m::Broken idempotent\n"),
        ("sequence<Light> Lights", "dictionary<int, Light> Lights", "dictionary<int, ::m::Light>"),
    ],
)
def test_what_shows_on_the_wire_counts_and_is_named(tmp_path: Path, old: str, new: str, line: str) -> None:
    before, after = description(tmp_path, BEGIN), description(tmp_path, BEGIN.replace(old, new, 1))
    assert before[0] != after[0]
    assert re.fullmatch("[0-9a-f]{16}", after[0])
    assert line in after[1]
    assert line not in before[1]


CLASSES = """
module m {
  class Animal { string name; };
  class Dog(7) extends Animal { int legs = 4; optional(1) int tricks; };
  interface Lamp { Dog get(optional(2) Animal mother, Lamp* other); };
};
"""


@pytest.mark.parametrize(
    "same",
    [
        CLASSES.replace("Dog(7)", "Dog"),
        CLASSES.replace("legs = 4", "legs"),
        CLASSES.replace("optional(1)", "optional(5)").replace("optional(2)", "optional(3)"),
        CLASSES.replace("int legs = 4; optional(1) int tricks;", "optional(1) int tricks; int legs = 4;"),
    ],
)
def test_numbers_and_default_values_do_not_count(tmp_path: Path, same: str) -> None:
    assert same != CLASSES
    assert description(tmp_path, same) == description(tmp_path, CLASSES)


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [
        ("optional(1) int tricks", "int tricks", "::m::Dog::tricks: int"),
        ("optional(2) Animal mother", "Animal mother", "get(::m::Animal mother, ::m::Lamp* other)"),
        (" extends Animal", "", "class ::m::Dog\n"),
        ("Dog get", "optional(4) Dog get", "): optional ::m::Dog\n"),
        ("Lamp* other", "Object* other", "Object* other)"),
        ("class Animal { string name; }", "class Animal { string name; Object any; }", "::any: Object\n"),
    ],
)
def test_changes_of_classes_and_optional_members_count(tmp_path: Path, old: str, new: str, line: str) -> None:
    before, after = description(tmp_path, CLASSES), description(tmp_path, CLASSES.replace(old, new, 1))
    assert before[0] != after[0]
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
