"""Code that an agent may run: it computes and calls the servants of its document, and reaches nothing else.

Modules of a closed list may be imported, and no name leads out of them: neither to files, programs and other
modules, nor around the proxies of the component, which keep a person's limits. All else is refused.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from ._limits import AgentError


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


_MODULES: Final = _words("""
    __future__ cmath collections cv2 dataclasses enum functools interfaces itertools json math numpy random re
    statistics string time typing
""")
_OF_RUNTIME: Final = _words("""
    Automaton Component Event Input Output Parameter Proxy State Transition load_extension main source_map
""")
_NAMES: Final = _words("""
    __builtins__ breakpoint compile delattr eval exec exit getattr globals help input locals open quit setattr
    type vars
""")
_ALSO_METHODS: Final = _words("abc array cmd code copy queue select signal site this token trace")
"""Names of modules that are those of methods, too; what they lead to has other names."""
_FILES: Final = _words("""
    DataSource FileStorage VideoCapture VideoWriter ctypeslib dnn dump dumps f2py fromfile fromregex
    genfromtxt imread imreadmulti imwrite imwritemulti load loadtxt memmap open_memmap samples save savetxt
    savez savez_compressed testing tofile
""")
"""What numpy and cv2 read and write files by, and load code."""
_AROUND: Final = _words("""
    checkedCast communicator createObjectAdapter generated initialize stringToProxy uncheckedCast zenoh
    zenoh_ice
""")
"""What leads around the proxies."""
_ATTRIBUTES: Final = _FILES | _AROUND | (sys.stdlib_module_names - _MODULES - _ALSO_METHODS)
_OF_GENERATED: Final = frozenset({"__file__", "__package__", "load_extension"})


def require_tame(folder: Path) -> None:
    """Raise AgentError, with file and line, unless all code in a folder with a component is tame."""
    files = sorted(folder.rglob("*.py"))
    beside = {each.stem for each in files}
    for file in files:
        try:
            tree = ast.parse(file.read_bytes())
        except (SyntaxError, ValueError, RecursionError) as error:
            raise AgentError.because("{file} cannot be read as Python", file=file.name) from error
        for line, what in _wild(tree, beside):
            raise AgentError.because(
                "{file}, line {line}: an agent's code may not use {what}",
                file=file.name,
                line=line,
                what=what,
            )


def identities_of(component: Path) -> frozenset[str]:
    """Return the identities of the servants that a generated component declares."""
    calls = (node for node in ast.walk(ast.parse(component.read_bytes())) if isinstance(node, ast.Call))
    return frozenset(
        str(call.args[0].value)
        for call in calls
        if isinstance(call.func, ast.Name)
        and call.func.id == "Proxy"
        and isinstance(call.args[0], ast.Constant)
    )


def _wild(tree: ast.Module, beside: set[str]) -> Iterator[tuple[int, str]]:
    """Yield the lines of what is not tame, and its names."""
    known = {id(each) for node in ast.walk(tree) for each in _harmless(node)}
    for node in ast.walk(tree):
        found: list[str] = []
        match node:
            case ast.Import(names=names):
                found = [each.name for each in names if not _may_import(each.name, beside)]
            case ast.ImportFrom(module="hfsm_runtime", names=names, level=0):
                found = [each.name for each in names if each.name not in _OF_RUNTIME or each.asname]
            case ast.ImportFrom(module=module, names=names, level=level):
                found = [each.name for each in names if _leads_out(each.name) and not _is_proxy(each)]
                if level or not _may_import(module or "", beside):
                    found.append(module or ".")
            case ast.Name(id=name) if id(node) not in known:
                if (
                    name in _NAMES | _OF_GENERATED
                    or name.endswith("Prx")
                    or (name.startswith("__") and name != "__name__")
                ):
                    found = [name]
            case ast.Attribute(value=ast.Name(id="self"), attr=name):
                found = [name] if name.startswith(("__", "_hfsm", "ice_")) else []
            case ast.Attribute(attr=name) if _leads_out(name):
                found = [name]
            case ast.MatchClass(kwd_attrs=names):
                found = [each for each in names if _leads_out(each)]
        yield from ((getattr(node, "lineno", 0), name) for name in found)


def _harmless(node: ast.AST) -> Iterator[ast.AST]:
    """Yield names that may be used in this way, as generated code does, and no other."""
    match node:
        case ast.Call(
            func=ast.Name(id="load_extension") as called,
            args=[ast.Name(id="__file__") as file, ast.Name(id="__package__") as package, *rest],
            keywords=[],
        ) if all(isinstance(each, ast.Constant) and str(each.value).isidentifier() for each in rest):
            yield from (called, file, package)
        case ast.Call(func=ast.Name(id="source_map"), args=[ast.Name(id="__file__") as file, *_]):
            yield file
        case ast.Call(func=ast.Name(id="Proxy"), args=[ast.Constant(), ast.Name() as kind]):
            yield kind
        case ast.Call(
            func=ast.Name(id="getattr") as called,
            args=[ast.Name(id="self"), ast.JoinedStr(values=[*_, ast.Constant(value=str() as end)]), *_],
        ) if end.isalpha():  # what is not a user's ends otherwise
            yield called
        case ast.Call(
            func=ast.Name(id="getattr" | "setattr") as called,
            args=[_, ast.Constant(value=str() as attribute), *_],
        ) if not _leads_out(attribute):
            yield called


def _may_import(module: str, beside: set[str]) -> bool:
    """Return whether a module may be imported: one of the list, or code beside the component."""
    first, *inner = module.split(".")
    return first in _MODULES | beside and not any(map(_leads_out, inner))


def _is_proxy(name: ast.alias) -> bool:
    return name.name.endswith("Prx") and (name.asname or name.name).endswith("Prx")


def _leads_out(name: str) -> bool:
    return name in _ATTRIBUTES or name.startswith(("_", "ice_")) or name.endswith("Prx") or name == "*"
