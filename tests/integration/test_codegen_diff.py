"""`codegen diff`: which changes of interfaces are breaking, as programs of the two versions find out."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import pytest

from codegen._diff import app
from tests.support.commands import run_here
from tests.support.slice_compiler import imported
from tests.support.suite import Pair
from zenoh_ice import InterfaceMismatchException

HOME = """\
#include "types.idl"

module home {
  sequence<Light> Lights;
  const int Most = 3;

  interface Switch { void off(); };

  /** A lamp. */
  interface Lamp extends Switch {
    idempotent Lights dim(double power, string name) throws Broken;
    ["stream"] idempotent Mode getMode();
  };
};
"""
TYPES = """\
module home {
  enum Mode { Dark, Bright };
  class Model { int year = 2020; };
  struct Light { double power; Mode mode; Model model; };
  struct Unused { int some; };
  exception Broken { string why; };
};
"""
BREAKING = [
    ("void off();", "void off(); void on();", "operation `on` of `home::Switch` added"),
    ("void off();", "void dark();", "operation `off` of `home::Switch` renamed to `dark`"),
    (
        "void off();",
        "int off();",
        "operation `off` of `home::Switch` changed: `(): void` -> `(): int`",
    ),
    (" extends Switch", "", "interface `home::Lamp` changed"),
    ("double power, string name", "string name, double power", "(string name, double power)"),
    ("double power, string", "float power, string", "(float power, string name)"),
    ("double power, string", "double level, string", "(double level, string name)"),
    (" throws Broken", "", "operation `dim` of `home::Lamp` changed"),
    ('["stream"] ', "", "operation `getMode` of `home::Lamp` changed: `(): ::home::Mode idempotent stream`"),
    ("    idempotent Lights", "    Lights", "operation `dim` of `home::Lamp` changed"),
    ("Dark, Bright", "Dark, Bright, Off", "enumerator `Off` of `home::Mode` added"),
    ("Dark, Bright", "Dark, Bright = 5", "enumerator `Bright` of `home::Mode` changed: `1` -> `5`"),
    ("Dark, Bright", "Dark", "enumerator `Bright` of `home::Mode` removed"),
    ("Mode mode;", "Mode mode; int age;", "member `age` of `home::Light` added"),
    ("int year", "long year", "member `year` of `home::Model` changed: `int` -> `long`"),
    ("string why", "string what", "member `why` of `home::Broken` renamed to `what`"),
    ("sequence<Light> Lights", "sequence<Model> Lights", "sequence `home::Lights` changed"),
]
COMPATIBLE = [
    ("A lamp.", "A bright lamp.", "interface `home::Lamp`: its description changed"),
    ("year = 2020", "year = 2026", "class `home::Model`: the order, default values or names"),
    ("double power; Mode mode;", "Mode mode; double power;", "struct `home::Light`: the order, default values"),
    ("Most = 3", "Most = 4", "constant `home::Most` changed"),
    ("  /** A", "  interface More extends Switch { void on(); };\n  /** A", "interface `home::More` added"),
]  # fmt: skip


def changed(old: str, new: str) -> dict[str, str]:
    """Return the files with a change in one of them."""
    assert (HOME + TYPES).count(old) == 1, old
    return {"types.idl": TYPES.replace(old, new), "home.idl": HOME.replace(old, new)}


def write(folder: Path, files: dict[str, str]) -> Path:
    folder.mkdir(parents=True)
    for name, text in files.items():
        (folder / name).write_text(text)
    return folder


def diff(*arguments: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    return run_here(app, "codegen diff", *arguments, cwd=cwd)


def refuses(pair: Pair, servant: Any, proxy: Any, identity: str) -> bool:
    """Return whether a proxy of one version refuses a servant of another."""
    pair.adapter.add(servant, identity)
    try:
        proxy.checkedCast(pair.client.stringToProxy(identity))
    except InterfaceMismatchException:
        return True
    return False


def lamp(api: Any) -> Any:
    """Return a servant of a version of Lamp."""
    operations = {name: lambda self, *arguments: None for name in ("off", "on", "dark", "dim", "getMode")}
    return type("LampI", (api.Lamp,), operations)()


@pytest.mark.parametrize(("changes", "breaking"), [(BREAKING, True), (COMPATIBLE, False)])
def test_what_it_calls_breaking_is_what_programs_refuse(
    tmp_path: Path, pair: Pair, changes: list[tuple[str, str, str]], *, breaking: bool
) -> None:
    write(tmp_path / "old", changed("A lamp.", "A lamp."))
    with imported(tmp_path / "a", "home_before", changed("A lamp.", "A lamp.")) as package:
        before = __import__(f"{package.__name__}.home", fromlist=["Lamp"])
        for number, (old, new, message) in enumerate(changes):
            files = changed(old, new)
            write(tmp_path / f"new{number}", files)
            done = diff("--format", "json", "old", f"new{number}", cwd=tmp_path)
            assert not done.stderr
            found = json.loads(done.stdout)
            assert any(message in each["message"] for each in found["changes"]), (message, found)
            assert {each["breaking"] for each in found["changes"]} == {breaking}, found
            assert done.returncode == (1 if breaking else 0)
            refused = [each["interface"] for each in found["refused"]]
            with imported(tmp_path / f"b{number}", f"home_after{number}", files) as later:
                after = __import__(f"{later.__name__}.home", fromlist=["Lamp"])
                assert refuses(pair, lamp(before), after.LampPrx, f"a{number}") is ("::home::Lamp" in refused)
                assert refuses(pair, lamp(after), before.LampPrx, f"b{number}") is ("::home::Lamp" in refused)
                assert ("::home::Lamp" in refused) is breaking


def test_changes_are_listed_with_their_places(tmp_path: Path) -> None:
    write(tmp_path / "old", {"types.idl": TYPES, "home.idl": HOME})
    write(tmp_path / "new", changed("void off();", "void off(int when);"))
    (tmp_path / "new" / "types.idl").write_text(TYPES.replace("  struct Unused { int some; };\n", ""))
    done = diff("old", "new", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (1, "")
    assert done.stdout.splitlines() == [
        "new/home.idl:7:27: breaking: operation `off` of `home::Switch` changed: `(): void` -> `(int when): void`",
        "old/types.idl:5:10: breaking: struct `home::Unused` removed",
        "programs of the two versions refuse each other at: home::Lamp, home::Switch",
    ]


def test_an_interface_that_is_gone_is_breaking(tmp_path: Path) -> None:
    old = write(tmp_path / "old", {"a.idl": "module m { interface A { void x(); }; };"})
    new = write(tmp_path / "new", {"a.idl": "module m { interface B { void x(); }; };"})
    done = diff(old / "a.idl", new / "a.idl", cwd=tmp_path)
    assert done.returncode == 1
    assert "breaking: interface `m::A` removed" in done.stdout
    assert "compatible: interface `m::B` added" in done.stdout
    assert done.stdout.endswith("refuse each other at: m::A\n")


def test_equal_interfaces_have_no_changes(tmp_path: Path) -> None:
    old = write(tmp_path / "old", {"types.idl": TYPES, "home.idl": HOME})
    new = write(tmp_path / "new", {"types.idl": f"// the same\n{TYPES}", "home.idl": HOME})
    done = diff(old, new, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "")
    done = diff("--format", "json", old, new, cwd=tmp_path)
    assert (done.returncode, json.loads(done.stdout)) == (0, {"changes": [], "refused": []})


def test_included_files_are_searched_for_in_other_folders(tmp_path: Path) -> None:
    write(tmp_path / "shared", {"types.idl": TYPES})
    write(tmp_path / "old", {"home.idl": HOME})
    write(tmp_path / "new", {"home.idl": HOME})
    assert diff("old", "new", cwd=tmp_path).returncode == 2
    assert diff("old", "new", "-I", "shared", cwd=tmp_path).returncode == 0


def test_files_with_errors_are_trouble(tmp_path: Path) -> None:
    write(tmp_path / "old", {"types.idl": TYPES})
    write(tmp_path / "new", {"types.idl": TYPES.replace("string why", "strin why")})
    write(tmp_path / "empty", {})
    (tmp_path / "notes.txt").touch()
    done = diff("old", "new", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert "new/types.idl:6:" in done.stderr
    for new, problem in (
        ("nothing.idl", "cannot be read"),
        ("notes.txt", "expected .ice or .idl"),
        ("empty", "empty has no interfaces"),
    ):
        done = diff("old", new, cwd=tmp_path)
        assert done.returncode == 2
        assert problem in done.stderr
