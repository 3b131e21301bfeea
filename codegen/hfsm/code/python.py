"""Understand the Python that people typed into a document: which names it binds, and what it must not do."""

from __future__ import annotations

import ast
import re
import symtable
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Final

from ..document import Text
from .text import (
    FUTURE,
    INDENT,
    Code,
    CodeError,
    compile_source,
    own_nodes,
    parse,
    parse_python,
    split,
    without_warnings,
)

__all__ = [
    "Code",
    "CodeError",
    "analyze_block",
    "analyze_condition",
    "analyze_expression",
    "analyze_library",
    "analyze_methods",
    "global_names",
]

_SELF: Final = "self"


def analyze_block(text: Text, *, returns: bool = True) -> Code | None:
    """Return statements that become the body of a function, or None when there are none and no comment.

    With `returns` false the code runs in the middle of a function, and must not return from it. Raises
    CodeError.
    """
    code = split(text)
    if code is None:
        return None
    tree = parse(code, code.lines)
    _refuse_out_of_place(tree, code, returns=returns)
    # Whether other code binds the names that functions in here take from outside, the whole component shows.
    bound = _bound(_scope(code, _nonlocals(ast.walk(tree))), tree) | _nonlocals(own_nodes(tree))
    if _SELF in bound:
        raise code.error("`self` is the component: no code can assign it")
    if returns:
        _refuse_annotations(tree, code)
    return replace(code, bound=bound, used=_names(tree), has_statements=bool(tree.body))


def analyze_expression(text: Text, what: str = "value") -> Code:
    """Return an expression that may span lines; `what` it is, for the messages. Raises CodeError."""
    code = split(text)
    if code is None:
        raise CodeError(f"the {what} is empty", text.line, text.column)
    # Parentheses on lines of their own let the expression span lines and end with a comment.
    tree = parse(code, ("(", *code.lines, ")"), header=1)
    statement = tree.body[0]
    # A tuple takes in the parentheses, and so does what closes them itself, as in `a) or (b`.
    if len(tree.body) != 1 or not isinstance(statement, ast.Expr) or statement.value.lineno == 1:
        raise code.error(f"a {what} is one expression")
    _refuse_out_of_place(tree, code, returns=False, header=1)
    bound = _bound(_scope(code, frozenset(), expression=True), tree)
    if _SELF in bound:
        raise code.error("`self` is the component: no code can assign it")
    return replace(code, bound=bound, used=_names(tree), is_expression=True)


def analyze_condition(text: Text) -> Code:
    """Return an expression, or the statements that return the value of a condition. Raises CodeError."""
    try:
        return analyze_expression(text, "condition")
    except CodeError:
        if not re.search(r"\breturn\b", text.text):
            raise
    code = analyze_block(text)
    assert code is not None, "a blank text is no expression, and returns nothing"
    statements = parse(code, code.lines)
    if not any(isinstance(node, ast.Return) and node.value is not None for node in own_nodes(statements)):
        raise code.error("a condition is one expression, or statements that return whether it holds")
    return code


def analyze_methods(text: Text) -> tuple[Code, dict[str, int]] | None:
    """Return the functions of an automaton and the document's line of each, by name, or None without code.

    Raises CodeError.
    """
    code = split(text)
    if code is None:
        return None
    tree = parse(code, code.lines)
    source = "\n".join([FUTURE, "class _Component:", *code.indented(1), f"{INDENT}pass"])
    compile_source(source, code, header=2, columns=len(INDENT))
    found: dict[str, int] = {}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            line = code.line + node.lineno - 1
            if node.name in found:
                message = f"the function `{node.name}` is defined twice, first in line {found[node.name]}"
                raise code.error(message, node.lineno, node.col_offset + 1)
            found[node.name] = line
    return replace(code, bound=frozenset(found), used=_names(tree), has_statements=bool(tree.body)), found


def global_names(code: Code) -> dict[str, int]:
    """Return the names that a block declares as global in its own scope, with their lines in the document."""
    if not any("global" in line for line in code.lines):
        return {}
    declared = [node for node in own_nodes(parse(code, code.lines)) if isinstance(node, ast.Global)]
    return {name: code.line + node.lineno - 1 for node in declared for name in node.names}


def analyze_library(text: Text) -> tuple[str, frozenset[str]]:
    """Return an import statement and the names that it binds. Raises CodeError."""
    written = text.text.strip()
    statement = written if re.match(r"(import|from)\s", written) else f"import {written}"
    try:
        body = parse_python(statement).body
    except SyntaxError:
        body = []
    if len(body) != 1 or not isinstance(body[0], ast.Import | ast.ImportFrom) or "\n" in statement:
        message = f"`{written[:60]}` is no library: write `cv2`, `numpy as np` or `from math import pi`"
        raise CodeError(message, text.line, text.column)
    if isinstance(body[0], ast.ImportFrom) and body[0].module == "__future__":
        raise CodeError("`__future__` changes how a file is read, and is no library", text.line, text.column)
    names = (alias.asname or alias.name.split(".")[0] for alias in body[0].names)
    return statement, frozenset(names)


def _scope(code: Code, outer: frozenset[str], *, expression: bool = False) -> symtable.SymbolTable:
    """Return the names of the code as the body of a function inside one that binds `outer`."""
    names = " = ".join(sorted(outer | {"_"}))
    lines = [FUTURE, "def _outer():", f"{INDENT}{names} = None", f"{INDENT}def _inner():"]
    lines += [f"{INDENT * 2}return ("] if expression else []
    header = len(lines)
    lines += code.indented(2)
    lines += [f"{INDENT * 2})"] if expression else [f"{INDENT * 2}pass"]
    source = "\n".join(lines) + "\n"
    compile_source(source, code, header, columns=2 * len(INDENT))
    with without_warnings():
        table = symtable.symtable(source, "<document>", "exec")
    return table.get_children()[0].get_children()[0]


def _nonlocals(nodes: Iterable[ast.AST]) -> frozenset[str]:
    return frozenset(name for node in nodes if isinstance(node, ast.Nonlocal) for name in node.names)


def _bound(table: symtable.SymbolTable, tree: ast.Module) -> frozenset[str]:
    """Return the names that the scope binds.

    From Python 3.12 on its table holds the targets of comprehensions, too, which are no names of the scope.
    """
    targets = [
        name
        for node in own_nodes(tree)
        if isinstance(node, ast.comprehension)
        for name in ast.walk(node.target)
        if isinstance(name, ast.Name)
    ]
    inside = {id(name) for name in targets}
    outside = {name for node in own_nodes(tree) if id(node) not in inside for name in _binds(node)}
    local = {symbol.get_name() for symbol in table.get_symbols() if symbol.is_local()}
    return frozenset(local - ({name.id for name in targets} - outside))


def _binds(node: ast.AST) -> Iterator[str]:
    """Yield the names that a node binds by itself."""
    match node:
        case ast.Name(id=name, ctx=ast.Store() | ast.Del()):
            yield name
        case ast.alias(name=name, asname=alias):
            yield alias or name.split(".")[0]
        case ast.FunctionDef(name=name) | ast.AsyncFunctionDef(name=name) | ast.ClassDef(name=name):
            yield name
        case ast.ExceptHandler(name=str(name)) | ast.MatchAs(name=str(name)) | ast.MatchStar(name=str(name)):
            yield name
        case ast.MatchMapping(rest=str(name)):
            yield name


def _refuse_out_of_place(tree: ast.Module, code: Code, *, returns: bool, header: int = 0) -> None:
    for node in own_nodes(tree):
        place = (getattr(node, "lineno", 1) - header, getattr(node, "col_offset", 0) + 1)
        if isinstance(node, ast.Yield | ast.YieldFrom | ast.Await | ast.AsyncFor | ast.AsyncWith):
            word = "yield" if isinstance(node, ast.Yield | ast.YieldFrom) else "await"
            raise code.error(
                f"`{word}` has no place here: the code of a cycle runs from start to end", *place
            )
        if isinstance(node, ast.Return) and not returns:
            raise code.error("`return` has no place in the variables", *place)
        if isinstance(node, ast.Nonlocal) and not returns:
            raise code.error("`nonlocal` has no place in the variables: no code stands around them", *place)
        if isinstance(node, ast.ImportFrom) and any(alias.name == "*" for alias in node.names):
            raise code.error("`import *` has no place here: name it among the libraries", *place)


def _refuse_annotations(tree: ast.Module, code: Code) -> None:
    """Raise CodeError where a name is annotated that has to be shared, which Python does not allow."""
    for node in own_nodes(tree):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            name = node.target.id
            message = f"`{name}` is shared by all code of its automaton: annotate it in the variables"
            raise code.error(message, node.lineno, node.col_offset + 1)


def _names(tree: ast.Module) -> frozenset[str]:
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    return frozenset(names)
