"""The documents of the original's users become components that run, where their code is Python 3."""

from __future__ import annotations

import ast
import builtins
import dis
import importlib.util
import sys
import textwrap
from collections.abc import Iterator
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any

import pytest

from codegen.diagnostics import Diagnostics
from codegen.hfsm import compile_document, read_document
from codegen.hfsm.code.pieces import is_foreign, pieces_of
from codegen.hfsm.document import Document
from codegen.hfsm.known_interfaces import find_interfaces
from hfsm_runtime import Component, VirtualRun
from hfsm_runtime.component import proxies_of
from tests.support.codegen_command import codegen
from tests.support.documents import generate, load

DIRECTORY = Path(__file__).resolve().parents[3] / "shared" / "automata"
FILES = sorted(DIRECTORY.rglob("*.xml"))

pytestmark = pytest.mark.skipif(not FILES, reason="the documents of the original's users are not here")


class Anything:
    """Stand for a proxy, a message or a module: it has every attribute, and counts and compares as 1 does."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        return Anything()

    def __call__(self, *arguments: object, **named: object) -> Anything:
        return Anything()

    def __getitem__(self, index: object) -> Anything:
        if isinstance(index, int) and index >= 10:
            raise IndexError(index)
        return Anything()

    def __len__(self) -> int:
        return 10

    def __index__(self) -> int:
        return 1

    def __float__(self) -> float:
        return 1.0

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Anything) or other == 1

    __hash__ = None  # type: ignore[assignment]

    def __lt__(self, other: Any) -> bool:
        return float(self) < float(other)

    def __gt__(self, other: Any) -> bool:
        return float(self) > float(other)

    def __le__(self, other: Any) -> bool:
        return float(self) <= float(other)

    def __ge__(self, other: Any) -> bool:
        return float(self) >= float(other)

    def _number(self, *_other: object) -> Anything:
        return self

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = _number
    __truediv__ = __rtruediv__ = __neg__ = __abs__ = _number


def parsed(path: Path) -> Document:
    diagnostics = Diagnostics()
    document = read_document(path, diagnostics)
    assert document is not None, diagnostics.render()
    return document


def is_python(document: Document, path: Path) -> bool:
    """Return whether each piece of code is valid Python 3, with a `return` or without."""
    for piece in pieces_of(document, path):
        body = textwrap.indent(textwrap.dedent(piece.text.text.strip("\n")), " ")
        try:
            ast.parse(f"def f():\n{body}\n pass")
        except SyntaxError:
            return False
    return not is_foreign(document) or next(pieces_of(document, path), None) is None


@pytest.fixture(scope="module")
def stubs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A directory with proxies of the interfaces that the documents name and the project does not have."""
    directory = tmp_path_factory.mktemp("stubs")
    known = find_interfaces()
    named = {interface.type for path in FILES for interface in parsed(path).interfaces}
    unknown = sorted(name for name in named if name.isidentifier() and not known.find(name))
    interfaces = "\n".join(f"  interface {name} {{}};" for name in unknown)
    (directory / "robot_of_old.idl").write_text(f"module robotOfOld {{\n{interfaces}\n}};\n")
    done = codegen("robot_of_old.idl", cwd=directory)
    assert done.returncode == 0, done.stderr
    return directory


def unknown_names(code: CodeType, known: set[str]) -> Iterator[str]:
    """Yield the names that a component's code takes from its module, which does not have them."""
    for instruction in dis.get_instructions(code):
        if instruction.opname in {"LOAD_GLOBAL", "LOAD_NAME"} and instruction.argval not in known:
            yield instruction.argval
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield from unknown_names(constant, known)


def make(file: Path, document: Document, monkeypatch: pytest.MonkeyPatch) -> Component:
    """Load a component with something in place of what it needs from elsewhere."""
    for library in document.libraries:
        module = library.name.text.split()[0].split(".")[0]
        if library.is_module and importlib.util.find_spec(module) is None:
            stub = ModuleType(module)
            vars(stub)["__getattr__"] = lambda _name: Anything()
            monkeypatch.setitem(sys.modules, module, stub)
    made = load(file)
    scope = type(made).automaton.__globals__
    compiled = compile(file.read_text(), str(file), "exec")
    for name in set(unknown_names(compiled, {*vars(builtins), *scope})):
        scope[name] = Anything
    monkeypatch.setattr(type(made), "__getattr__", lambda _self, _name: Anything(), raising=False)
    vars(made).update(dict.fromkeys(proxies_of(made), Anything()))
    return made


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_a_document_runs_for_ten_seconds(
    path: Path, stubs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    document = parsed(path)
    monkeypatch.syspath_prepend(stubs)
    if not is_python(document, path):
        diagnostics = Diagnostics()
        assert compile_document(path, tmp_path, diagnostics, [stubs]) is None
        assert {error.code for error in diagnostics.errors} <= {"E520", "E525"}
        return
    virtual = VirtualRun(make(generate(path, tmp_path, (stubs,)), document, monkeypatch))
    virtual.advance(10)
    assert virtual.errors == ()
    assert virtual.tree.root.cycles == 1 + round(10 / virtual.tree.root.automaton.period)


def test_documents_of_each_dialect_run() -> None:
    running = {path.parent.name for path in FILES if is_python(parsed(path), path)}
    assert running == {path.parent.name for path in FILES}
