"""Convert Python 2 in the code of old documents to Python 3, with fissix, a maintained fork of lib2to3."""

from __future__ import annotations

import ast
import re
import textwrap
import threading
import warnings
from collections.abc import Collection
from functools import cache
from typing import TYPE_CHECKING, Final

from codegen.hfsm.code.text import all_nodes, binds, parse_piece

if TYPE_CHECKING:
    from fissix.refactor import RefactoringTool

_SYNTAX: Final = ("except", "exec", "ne", "numliterals", "print", "raise", "repr", "throw")
_RENAMED: Final = ("dict", "filter", "has_key", "itertools", "map", "next", "renames", "types", "zip")
_METHODS: Final = frozenset(("has_key", "iteritems", "iterkeys", "itervalues"))
_BUILTINS: Final = {
    **{name: name for name in ("basestring", "long", "raw_input", "unicode", "xrange")},
    "unichr": "unicode",
}
"""Functions and types that Python 3 no longer has, with their fixers."""
_MODULES: Final = {
    "ConfigParser": "configparser",
    "Queue": "queue",
    "StringIO": "io",
    "Tkinter": "tkinter",
    "cPickle": "pickle",
    "cStringIO": "io",
    "commands": "subprocess",
    "thread": "_thread",
    "urllib2": "urllib.request",
}
_IMPORT: Final = re.compile(
    rf"^(\s*(?:from|import)[ \t]+)({'|'.join(_MODULES)})\b(?!\.)([ \t]*$)?", re.MULTILINE
)
_MARGIN: Final = re.compile(r"^[ \t]+", re.MULTILINE)
_MARK: Final = re.compile(r"""<>|\bprint[ \t]+[\w"']|\bexcept\b[^:\n]*,[ \t]*\w+[ \t]*:|\braise\s+\w+,|`""")
_ONE_AT_A_TIME: Final = threading.Lock()  # the fixers have state


def fix_python2(code: str, bound: Collection[str] = ()) -> str | None:
    """Return a piece of code as Python 3, or None if it is not valid Python 2 either.

    Python 3 is returned unchanged, and every line keeps its number. `bound` are names that other code
    defines, such as `long`. Raises ModuleNotFoundError with the command that installs fissix.
    """
    tree, fixed = parse_piece(code), code
    if tree is None or any(isinstance(each, ast.Expr) and _is_print(each.value) for each in all_nodes(tree)):
        for source in dict.fromkeys((code, _MARGIN.sub(lambda margin: margin[0].expandtabs(8), code))):
            fixed = _refactored(source, _SYNTAX)
            if (tree := parse_piece(fixed)) is not None:
                break
    if tree is None:
        return None
    fixed = _IMPORT.sub(_renamed_module, fixed)
    names = defined_names(tree).union(bound)
    used = {node.id for node in all_nodes(tree) if isinstance(node, ast.Name)} & _BUILTINS.keys() - names
    methods = {node.attr for node in all_nodes(tree) if isinstance(node, ast.Attribute)} & _METHODS
    if fixed != code or used or methods:
        fixers = (*_RENAMED, *sorted({_BUILTINS[name] for name in used}))
        fixed = _refactored(fixed, fixers, is_python3=True)
    return fixed if parse_piece(fixed) is not None else None


def python2_mark(code: str) -> re.Match[str] | None:
    """Return the first match of syntax that only Python 2 has, found by its text."""
    return _MARK.search(code)


def defined_names(tree: ast.Module) -> frozenset[str]:
    """Return the names that code defines, in any scope."""
    names = {name for node in all_nodes(tree) for name in binds(node)}
    for node in all_nodes(tree):
        match node:
            case ast.arg(arg=name):
                names.add(name)
            case ast.Global(names=found):
                names.update(found)
    return frozenset(names)


def _is_print(node: ast.expr) -> bool:
    """Return whether a statement that Python 3 can parse is a `print` of Python 2."""
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        return False
    while True:
        match node:
            case ast.Name(id=name):
                return name == "print"
            case ast.BinOp(left=inner) | ast.Compare(left=inner) | ast.Tuple(elts=[inner, *_]):
                node = inner
            case ast.Attribute(value=inner) | ast.Subscript(value=inner) | ast.Call(func=inner):
                node = inner
            case _:
                return False


def _renamed_module(found: re.Match[str]) -> str:
    keyword = found[1]
    module = found[2]
    end = found[3]
    alias = f" as {module}{end}" if end is not None and keyword.strip() == "import" else end or ""
    return f"{keyword}{_MODULES[module]}{alias}"


def _refactored(code: str, fixers: tuple[str, ...], *, is_python3: bool = False) -> str:
    """Return the result of fissix, or the code itself if fissix fails or would move lines."""
    lines = code.replace("\r", "").split("\n")
    plain = textwrap.dedent("\n".join(lines)).split("\n")
    margin = next((a.removesuffix(b) for a, b in zip(lines, plain, strict=True) if b), "")
    for head, tail in (("", "\n"), ("(\n", "\n)\n")):  # statements, or an expression that spans lines
        with _ONE_AT_A_TIME, warnings.catch_warnings(action="ignore"):
            tool = _tool(fixers, is_python3=is_python3)
            try:
                text = str(tool.refactor_string(head + "\n".join(plain) + tail, ""))
            except Exception:  # noqa: BLE001, S112 - its parser and fixers fail in many ways
                continue
        fixed = text.removeprefix(head).removesuffix(tail).split("\n")
        if len(fixed) == len(lines):
            kept = zip(code.split("\n"), plain, fixed, strict=True)
            return "\n".join(
                line if new == old else margin + new + "\r" * line.endswith("\r") for line, old, new in kept
            )
    return code


@cache
def _tool(fixers: tuple[str, ...], *, is_python3: bool) -> RefactoringTool:
    try:
        from fissix.refactor import RefactoringTool
    except ImportError as error:
        message = f"{error.name} is not installed; install it with: pip install 'visualhfsm[python2]'"
        raise ModuleNotFoundError(message, name=error.name) from error
    names = [f"fissix.fixes.fix_{name}" for name in fixers]
    return RefactoringTool(names, {"print_function": is_python3})
