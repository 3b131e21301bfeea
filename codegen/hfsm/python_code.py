"""Understand the Python that people typed into a document: parse it, find its names, indent it anew.

A piece of code becomes the body of a function in the generated component. Its lines stand there as they were
typed, moved to the right; the inside of a multi-line string is not touched.
"""

from __future__ import annotations

import ast
import io
import re
import symtable
import tokenize
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Final

from .document import Text

__all__ = ["Code", "CodeError", "analyze_block", "analyze_condition", "analyze_library", "analyze_methods"]

_INDENT: Final = " " * 4
_SELF: Final = "self"

# What C++ has and Python has not, outside strings and comments of either.
_CPP: Final = re.compile(
    r"""^[^\S\n]*\#\s*(?:include|define|ifdef|ifndef|endif)\b   # the preprocessor
      | ->\s*\w+\s*(?:\(|\[|->|;|=[^=]|<|>)              # a member through a pointer
      | (?<!\[)\b[A-Za-z_]\w*::\w+                       # a scoped name
      | ^[^\S\n]*//                                        # a comment
      | /\*
      | ^[^\S\n]*(?:const\s+)?(?:void|bool|int|float|double|char|auto|unsigned|std::\w+)[\s&*]+\w+\s*[;=(\[]
      | [;{]\s*$                                           # the end of a statement, or a block
      | \)\s*\{
      | &&|\|\||!\w+\s*[()]""",
    re.VERBOSE | re.MULTILINE,
)


class CodeError(Exception):
    """A piece of code cannot be used; `line` and `column` are those of the document."""

    def __init__(self, message: str, line: int, column: int = 1) -> None:
        super().__init__(message)
        self.line = line
        self.column = column


@dataclass(frozen=True, slots=True)
class Code:
    """A piece of code as it will stand in the component.

    `lines` are its lines without the indentation that all share and without empty lines around them; `line`
    is where the first stands in the document, `start` the column of its first character, and `removed` how
    much was taken off the left of the others; `fixed` holds the indices of lines that must not be indented,
    because they begin inside a string. `bound` are the names that it assigns in its own scope and `used` all
    names in it.
    """

    lines: tuple[str, ...]
    line: int
    fixed: frozenset[int] = frozenset()
    start: int = 1
    removed: int = 0
    bound: frozenset[str] = frozenset()
    used: frozenset[str] = frozenset()
    has_statements: bool = True

    def error(self, message: str, line: int = 1, column: int = 1) -> CodeError:
        """Return an error at a line and column of the code, both from 1."""
        line = min(max(1, line), len(self.lines))
        left = self.start - 1 if line == 1 else self.removed
        return CodeError(message, self.line + line - 1, left + max(1, column))

    def indented(self, level: int) -> list[str]:
        """Return the lines moved right by a number of levels."""
        prefix = _INDENT * level
        return [
            line if index in self.fixed or not line.strip() else prefix + line
            for index, line in enumerate(self.lines)
        ]


def analyze_block(text: Text, *, shared: frozenset[str] = frozenset(), returns: bool = True) -> Code | None:
    """Return statements that become the body of a function, or None when there are none and no comment.

    `shared` are the names that the variables of the automaton bind. With `returns` false the code runs in the
    middle of a function, and must not return from it. Raises CodeError.
    """
    code = _split(text)
    if code is None:
        return None
    tree = _parse(code, code.lines)
    _refuse_out_of_place(tree, code, returns=returns)
    declared = frozenset(
        name for node in _own_nodes(tree) if isinstance(node, ast.Nonlocal) for name in node.names
    )
    bound = _bound(_scope(code, shared | declared), tree) | declared
    if _SELF in bound:
        raise code.error("`self` is the component: no code can assign it")
    if returns:
        _refuse_annotations(tree, code)
    return replace(code, bound=bound, used=_names(tree), has_statements=bool(tree.body))


def analyze_condition(text: Text) -> Code:
    """Return an expression that may span lines. Raises CodeError."""
    code = _split(text)
    if code is None:
        raise CodeError("the condition is empty", text.line, text.column)
    # Parentheses on lines of their own let the expression span lines and end with a comment.
    tree = _parse(code, ("(", *code.lines, ")"), header=1)
    statement = tree.body[0]
    # A tuple takes in the parentheses, and so does what closes them itself, as in `a) or (b`.
    if len(tree.body) != 1 or not isinstance(statement, ast.Expr) or statement.value.lineno == 1:
        raise code.error("a condition is one expression that is true or false")
    _refuse_out_of_place(tree, code, returns=False, header=1)
    bound = _bound(_scope(code, frozenset(), expression=True), tree)
    if _SELF in bound:
        raise code.error("`self` is the component: no code can assign it")
    return replace(code, bound=bound, used=_names(tree))


def analyze_methods(text: Text) -> tuple[Code, dict[str, int]] | None:
    """Return the functions of an automaton and the document's line of each, by name, or None without code.

    Raises CodeError.
    """
    code = _split(text)
    if code is None:
        return None
    tree = _parse(code, code.lines)
    _compile("\n".join(code.lines), code)
    found: dict[str, int] = {}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            line = code.line + node.lineno - 1
            if node.name in found:
                message = f"the function `{node.name}` is defined twice, first in line {found[node.name]}"
                raise code.error(message, node.lineno, node.col_offset + 1)
            found[node.name] = line
    return replace(code, bound=frozenset(found), used=_names(tree), has_statements=bool(tree.body)), found


def analyze_library(text: Text) -> tuple[str, frozenset[str]]:
    """Return an import statement and the names that it binds. Raises CodeError."""
    written = text.text.strip()
    statement = written if re.match(r"(import|from)\s", written) else f"import {written}"
    try:
        body = ast.parse(statement).body
    except SyntaxError:
        body = []
    if len(body) != 1 or not isinstance(body[0], ast.Import | ast.ImportFrom) or "\n" in statement:
        message = f"`{written[:60]}` is no library: write `cv2`, `numpy as np` or `from math import pi`"
        raise CodeError(message, text.line, text.column)
    if isinstance(body[0], ast.ImportFrom) and body[0].module == "__future__":
        raise CodeError("`__future__` changes how a file is read, and is no library", text.line, text.column)
    names = (alias.asname or alias.name.split(".")[0] for alias in body[0].names)
    return statement, frozenset(names)


def _split(text: Text) -> Code | None:
    """Return the lines of a text without what all share on their left, or None when all are blank."""
    lines = text.text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    first = next((index for index, line in enumerate(lines) if line.strip()), None)
    if first is None:
        return None
    last = next(index for index in reversed(range(len(lines))) if lines[index].strip())
    lines = lines[first : last + 1]
    line = text.line + first
    indentation = lines[0][: len(lines[0]) - len(lines[0].lstrip())]
    fixed = _string_lines(lines, indented=bool(indentation))
    if indentation:
        for index, content in enumerate(lines):
            if index in fixed or not content.strip():
                continue
            lines[index] = content.removeprefix(indentation)
    removed = len(indentation)
    start = text.column + removed if first == 0 else removed + 1
    return Code(tuple(lines), line, fixed, start, removed)


def _string_lines(lines: list[str], *, indented: bool) -> frozenset[int]:
    """Return the indices of the lines that begin inside a string."""
    source = "\n".join((["if True:"] if indented else []) + lines) + "\n"
    offset = 2 if indented else 1
    fixed: set[int] = set()
    open_format_strings: list[int] = []
    try:
        for token in tokenize.generate_tokens(io.StringIO(source).readline):
            kind = tokenize.tok_name[token.type]
            start = token.start[0]
            if kind == "FSTRING_START":
                open_format_strings.append(start)
            elif kind == "FSTRING_END":
                start = open_format_strings.pop()
            if kind in ("STRING", "FSTRING_END"):
                fixed.update(range(start + 1 - offset, token.end[0] + 1 - offset))
    except (tokenize.TokenError, SyntaxError):
        pass  # the parser says what is wrong, and where
    return frozenset(fixed)


def _parse(code: Code, lines: Sequence[str], header: int = 0) -> ast.Module:
    """Return the tree of the code in `lines`, which begin with `header` lines of ours."""
    source = "\n".join(lines)
    try:
        with _without_warnings():
            return ast.parse(source)
    except (SyntaxError, ValueError) as error:
        line, column = getattr(error, "lineno", None) or 1, getattr(error, "offset", None) or 1
        reason = error.msg if isinstance(error, SyntaxError) else str(error)
        message = f"not valid Python: {reason}"
        if _CPP.search(source):
            message = f"this is C++, and only Python runs here (Python says: {reason})"
        raise code.error(message, line - header, column) from error
    except (RecursionError, MemoryError) as error:
        raise code.error("the code is nested too deeply") from error


def _scope(code: Code, outer: frozenset[str], *, expression: bool = False) -> symtable.SymbolTable:
    """Return the names of the code as the body of a function inside one that binds `outer`."""
    names = " = ".join(sorted(outer | {"_"}))
    lines = ["def _outer():", f"{_INDENT}{names} = None", f"{_INDENT}def _inner():"]
    lines += [f"{_INDENT * 2}return ("] if expression else []
    header = len(lines)
    lines += code.indented(2)
    lines += [f"{_INDENT * 2})"] if expression else [f"{_INDENT * 2}pass"]
    source = "\n".join(lines) + "\n"
    _compile(source, code, header, columns=2 * len(_INDENT))
    with _without_warnings():
        table = symtable.symtable(source, "<document>", "exec")
    return table.get_children()[0].get_children()[0]


def _bound(table: symtable.SymbolTable, tree: ast.Module) -> frozenset[str]:
    """Return the names that the scope binds.

    From Python 3.12 on its table holds the targets of comprehensions, too, which are no names of the scope.
    """
    targets = [
        name
        for node in ast.walk(tree)
        if isinstance(node, ast.comprehension)
        for name in ast.walk(node.target)
        if isinstance(name, ast.Name)
    ]
    inside = {id(name) for name in targets}
    outside = {name for node in _own_nodes(tree) if id(node) not in inside for name in _binds(node)}
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


def _compile(source: str, code: Code, header: int = 0, columns: int = 0) -> None:
    """Raise CodeError for what the parser lets pass and the compiler does not, such as a stray `break`."""
    try:
        with _without_warnings():
            compile(source, "<document>", "exec", dont_inherit=True)
    except SyntaxError as error:
        line, column = (error.lineno or 1) - header, (error.offset or 1) - columns
        raise code.error(f"not valid Python: {error.msg}", line, column) from error
    except (RecursionError, MemoryError) as error:
        raise code.error("the code is nested too deeply") from error


@contextmanager
def _without_warnings() -> Iterator[None]:
    """Let doubtful code pass, such as an escape sequence that Python does not know."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield


def _refuse_out_of_place(tree: ast.Module, code: Code, *, returns: bool, header: int = 0) -> None:
    for node in _own_nodes(tree):
        place = (getattr(node, "lineno", 1) - header, getattr(node, "col_offset", 0) + 1)
        if isinstance(node, ast.Yield | ast.YieldFrom | ast.Await | ast.AsyncFor | ast.AsyncWith):
            word = "yield" if isinstance(node, ast.Yield | ast.YieldFrom) else "await"
            raise code.error(
                f"`{word}` has no place here: the code of a cycle runs from start to end", *place
            )
        if isinstance(node, ast.Return) and not returns:
            raise code.error("`return` has no place in the variables", *place)
        if isinstance(node, ast.ImportFrom) and any(alias.name == "*" for alias in node.names):
            raise code.error("`import *` has no place here: name it among the libraries", *place)


def _refuse_annotations(tree: ast.Module, code: Code) -> None:
    """Raise CodeError where a name is annotated that has to be shared, which Python does not allow."""
    for node in _own_nodes(tree):
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            name = node.target.id
            message = f"`{name}` is shared by all code of its automaton: annotate it in the variables"
            raise code.error(message, node.lineno, node.col_offset + 1)


def _own_nodes(node: ast.AST) -> Iterator[ast.AST]:
    """Yield the nodes below one, without those inside functions and classes of their own."""
    # Without recursion: a long chain of `elif` or of `+` is deeper than Python's stack.
    pending = [*ast.iter_child_nodes(node)][::-1]
    while pending:
        child = pending.pop()
        yield child
        if not isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef | ast.Lambda):
            pending += [*ast.iter_child_nodes(child)][::-1]


def _names(tree: ast.Module) -> frozenset[str]:
    names = {node.id for node in ast.walk(tree) if isinstance(node, ast.Name)}
    return frozenset(names)
