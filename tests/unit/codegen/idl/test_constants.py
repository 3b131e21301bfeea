"""The values of constants, defaults, tags and compact ids."""

from __future__ import annotations

from pathlib import Path

from codegen._idl import ast
from codegen._idl.compiler import Units
from codegen.diagnostics import Diagnostics
from tests.support.slice_compiler import in_module, write_sources


def test_names_and_numbers_have_their_values_once_checked(tmp_path: Path) -> None:
    text = """
    const int k = 5; enum E { x, y = k };
    class C(E::y) { optional(k) int a = k; E e = y; };
    interface I { optional(1) int f(optional(E::y) int a); };
    """
    (path,) = write_sources(tmp_path, {"main.idl": in_module(text)})
    diagnostics = Diagnostics()
    units = Units([], diagnostics)
    source = units.load(path)
    unit = units.read(source, diagnostics) if source else None
    assert not len(diagnostics), diagnostics.render()
    assert unit
    (module,) = unit.tree.definitions
    assert isinstance(module, ast.Module)
    class_, interface = module.definitions[2:]
    assert isinstance(class_, ast.Class)
    assert isinstance(interface, ast.Interface)
    numbers = [class_.compact_id, class_.members[0].tag, class_.members[0].default, class_.members[1].default]
    numbers += [interface.operations[0].return_tag, interface.operations[0].parameters[0].tag]
    assert [number.value if number else None for number in numbers] == [5, 5, 5, 5, 1, 5]
