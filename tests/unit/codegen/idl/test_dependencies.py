"""Modules of Slice that depend on each other become packages that can be imported in any order."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest

from codegen._idl import Compilation, compile_interfaces
from codegen.diagnostics import Diagnostics
from codegen.files import apply, compare_with_disk
from tests.support.slice_compiler import imported, write_sources

VALUES = """
module m { struct A { int x = 7; }; };
module n { struct B { m::A a; }; };
module m { struct C { n::B b; }; exception Lost { n::B b; }; };
module n { interface Finder { m::C find() throws m::Lost; }; sequence<Finder*> Finders; };
module m { interface Guide extends n::Finder { n::Finders others(); }; };
"""
ANNOTATIONS = """
module m { interface Left; sequence<Left*> Lefts; };
module n { interface Right { m::Left* left(); void swap(m::Lefts all, out m::Lefts rest); }; };
module m { interface Left extends n::Right { n::Right* right(); }; class Tree { Left* left; Tree next; }; };
"""
NESTED = """
module m { struct A { int x; }; module inner { struct B { A a; }; interface I; };
           struct C { inner::B b; }; interface J { inner::I* i(); }; };
module other { struct D { m::inner::B b; }; };
module m { struct E { other::D d; }; module inner { interface I extends J { E end(); }; }; };
"""
# A file's module is loaded while its package waits for another package.
FILES = {
    "last.idl": '#include "middle.idl"\nmodule n { struct Last { m::Middle middle; }; };',
    "middle.idl": '#include "first.idl"\nmodule m { struct Middle { n::First first; }; };',
    "first.idl": "module n { struct First { int x; }; };",
}


@pytest.mark.parametrize(
    "sources",
    [{"a.idl": VALUES}, {"a.idl": ANNOTATIONS}, {"a.idl": NESTED}, FILES],
    ids=["values", "annotations", "nested", "files"],
)
def test_every_module_can_be_imported_first(tmp_path: Path, sources: dict[str, str]) -> None:
    with imported(tmp_path, "circle", sources):
        root = tmp_path / "circle"
        names = [
            ".".join(path.relative_to(tmp_path).with_suffix("").parts).removesuffix(".__init__")
            for path in sorted(root.rglob("*.py"))
        ]
        assert len(names) > 4
        for name in names:
            for loaded in [each for each in sys.modules if each.partition(".")[0] == "circle"]:
                del sys.modules[loaded]
            importlib.import_module(name)


def test_values_of_modules_that_depend_on_each_other_have_their_defaults(tmp_path: Path) -> None:
    with imported(tmp_path, "circle", {"a.idl": VALUES}):
        m = importlib.import_module("circle.m")
        n = importlib.import_module("circle.n")
        assert m.C() == m.C(n.B(m.A(7)))
        assert issubclass(m.GuidePrx, n.FinderPrx)
        assert n.FinderPrx.find.exceptions == (m.Lost,)
        assert list(m.GuidePrx.others.result.fields) == ["returnValue"]


def test_a_package_stays_the_same_when_only_a_part_of_its_circle_is_compiled_again(tmp_path: Path) -> None:
    last, middle, first = write_sources(tmp_path, FILES)
    everything = compiled([last], tmp_path)
    assert "import n as _n" in text_of(everything, "m/__init__.py")
    assert "import m as _m" in text_of(everything, "n/__init__.py")
    apply(compare_with_disk(everything.files))
    for path in (first, middle):
        again = compiled([path], tmp_path)
        assert not compare_with_disk(again.files, again.leftovers)


def test_a_module_that_needs_no_division_is_one_module(tmp_path: Path) -> None:
    text = """
    module m { struct A { int x; }; };
    module n { struct B { m::A a; }; };
    module m { struct C { int y; }; sequence<A> As; };
    """
    (path,) = write_sources(tmp_path, {"a.idl": text})
    names = {file.path.name for file in compiled([path], tmp_path).files}
    assert names == {"__init__.py", "a.py", "py.typed", "schema.json"}


def test_the_parts_of_a_module_that_are_no_longer_needed_are_leftovers(tmp_path: Path) -> None:
    (path,) = write_sources(tmp_path, {"a.idl": VALUES})
    apply(compare_with_disk(compiled([path], tmp_path).files))
    assert (tmp_path / "out" / "m" / "a_part2.py").is_file()
    path.write_text("module m { struct A { int x; }; };")
    assert tmp_path / "out" / "m" / "a_part2.py" in compiled([path], tmp_path).leftovers


def compiled(paths: list[Path], directory: Path) -> Compilation:
    diagnostics = Diagnostics()
    compilation = compile_interfaces(paths, [], directory / "out", diagnostics)
    assert not diagnostics.has_errors, diagnostics.render()
    return compilation


def text_of(compilation: Compilation, path: str) -> str:
    return next(file.text for file in compilation.files if str(file.path).endswith(path))
