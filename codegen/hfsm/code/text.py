"""Parse the code in a document, and reject what is not valid in a component.

A piece of code becomes the body of a function in the generated component. Its lines are only indented; the
inside of a multi-line string is not touched.
"""

from __future__ import annotations

import ast
import io
import re
import textwrap
import tokenize
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

from ...messages import Message, MessageError
from ...parsing import parse_python
from ...python_layout import INDENT
from ...reasons import reason
from ..document import Text


@lru_cache(maxsize=8192)
def all_nodes(tree: ast.AST) -> tuple[ast.AST, ...]:
    """Return the nodes of a tree in the order of `ast.walk`, cached for repeated use."""
    found = [tree]
    for node in found:  # grows
        found += child_nodes(node)
    return tuple(found)


def child_nodes(node: ast.AST) -> list[ast.AST]:
    """Return what `ast.iter_child_nodes` yields, in half of its time."""
    found: list[ast.AST] = []
    for name in node._fields:
        value = getattr(node, name, None)
        if isinstance(value, ast.AST):
            found.append(value)
        elif isinstance(value, list):
            found += [each for each in value if isinstance(each, ast.AST)]
    return found


@lru_cache(maxsize=8192)
def own_nodes(node: ast.AST) -> tuple[ast.AST, ...]:
    """Return the nodes below a node that belong to its scope, cached for repeated use.

    For functions and classes these are the parts that are evaluated at the definition: decorators, default
    values and base classes. Annotations are not evaluated.
    """
    # Not recursive: a long chain of `elif` or of `+` is deeper than Python's stack.
    found: list[ast.AST] = []
    pending = child_nodes(node)[::-1]
    while pending:
        child = pending.pop()
        found.append(child)
        pending += evaluated_at_once(child)[::-1]
    return tuple(found)


def evaluated_at_once(node: ast.AST) -> list[ast.AST]:
    """Return the nodes that are evaluated at once; of definitions, the parts outside the body."""
    match node:
        case ast.FunctionDef(args=arguments) | ast.AsyncFunctionDef(args=arguments):
            return [*node.decorator_list, *_defaults(arguments)]
        case ast.Lambda(args=arguments):
            return [*_defaults(arguments)]
        case ast.ClassDef():
            return [*node.decorator_list, *node.bases, *node.keywords]
    return child_nodes(node)


def _defaults(arguments: ast.arguments) -> Iterator[ast.expr]:
    yield from arguments.defaults
    yield from (default for default in arguments.kw_defaults if default is not None)


def dotted(node: ast.AST) -> list[str]:
    """Return the names in `a.b.c`, or nothing if the expression does not start with a name."""
    names: list[str] = []
    while isinstance(node, ast.Attribute):
        names.append(node.attr)
        node = node.value
    return [node.id, *names[::-1]] if isinstance(node, ast.Name) else []


def full_name(node: ast.AST, modules: Mapping[str, str]) -> str:
    """Return `a.b.c` with the full name of `a`; empty if the expression does not start with a name."""
    first, *others = dotted(node) or [""]
    return ".".join([modules.get(first, first), *others])


def parse_piece(source: str) -> ast.Module | None:
    """Return the tree of statements or of an expression that may span lines, or None for invalid code."""
    text = textwrap.dedent(source)
    for written in (text, f"(\n{text}\n)"):
        try:
            with warnings.catch_warnings(action="ignore"):
                return parse_python(written if written.strip("(\n )") else "")
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            continue
    return None


FUTURE: Final = "from __future__ import annotations"
"""The first line of a component, which changes what Python accepts in an annotation."""

_ESCAPED: Final = re.compile("&(?:lt|gt|amp);")
_OLD_LIBRARY: Final = re.compile(r"(?:import\s+)?(jderobot(?:\s+as\s+\w+)?)|from\s+jderobot\s+(import\s.*)")


class CodeError(MessageError):
    """A piece of code is unusable; `line` and `column` are those in the document."""

    def __init__(self, message: Message, line: int, column: int = 1) -> None:
        super().__init__(message)
        self.line = line
        self.column = column


@dataclass(frozen=True, slots=True)
class CodeText:
    """A piece of code as it will be in the component.

    `lines` are its lines without common indentation and without empty lines around them. `line` is the first
    line in the document, and `left` has the columns to the left of each line there, no values if there are
    none. `fixed` has the indices of lines that must not be indented, because they start inside a string.
    """

    lines: tuple[str, ...]
    line: int
    fixed: frozenset[int] = frozenset()
    left: tuple[int, ...] = ()

    def error(self, message: Message, line: int = 1, column: int = 1) -> CodeError:
        """Return an error at a line and column of the code, both from 1."""
        return CodeError(message, *self.place(line, column))

    def place(self, line: int, column: int) -> tuple[int, int]:
        """Return the line and the column in the document of those in the code, all from 1."""
        index = min(max(1, line), len(self.lines)) - 1
        left = self.left[index] if self.left else 0
        return self.line + index, left + max(1, column)

    def column(self, line: int, offset: int) -> int:
        """Return the column in a line of the code of an offset in it in bytes of UTF-8, as trees have it."""
        text = self.lines[min(max(1, line), len(self.lines)) - 1]
        return _characters(text, offset) + 1

    def indented(self, level: int) -> list[str]:
        """Return the lines, indented by a number of levels."""
        prefix = INDENT * level
        return [
            line if index in self.fixed or not line.strip() else prefix + line
            for index, line in enumerate(self.lines)
        ]


def split(text: Text) -> CodeText | None:
    """Return the lines of a text without common indentation, or None if all are blank."""
    lines = text.text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    first = next((index for index, line in enumerate(lines) if line.strip()), None)
    if first is None:
        return None
    last = next(index for index in reversed(range(len(lines))) if lines[index].strip())
    lines = lines[first : last + 1]
    line = text.line + first
    indentation = lines[0][: len(lines[0]) - len(lines[0].lstrip())]
    fixed = _string_lines(tuple(lines), indented=bool(indentation))
    left = [0] * len(lines)
    for index, content in enumerate(lines):
        if index not in fixed and content.strip() and content.startswith(indentation):
            lines[index] = content.removeprefix(indentation)
            left[index] = len(indentation)
    if first == 0:
        left[0] += text.column - 1
    return CodeText(tuple(lines), line, fixed, tuple(left))


def _characters(line: str, offset: int) -> int:
    """Return the number of characters in a number of bytes of UTF-8."""
    return len(line.encode()[:offset].decode(errors="replace"))


@lru_cache(maxsize=2048)
def _string_lines(lines: tuple[str, ...], *, indented: bool) -> frozenset[int]:
    """Return the indices of the lines that start inside a string."""
    if not any(quote in line for line in lines for quote in "\"'"):
        return frozenset()
    source = "\n".join((*(["if True:"] if indented else []), *lines)) + "\n"
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
        pass  # the parser reports the error with its place
    return frozenset(fixed)


@lru_cache(maxsize=4096)
def _parsed(source: str) -> ast.Module:
    """Return the tree of a text, cached: an editor parses all code again after each change."""
    with warnings.catch_warnings(action="ignore"):
        return parse_python(source)


def parse(code: CodeText, lines: Sequence[str], header: int = 0) -> ast.Module:
    """Return the tree of the code in `lines`, of which the first `header` lines are generated."""
    source = "\n".join(lines)
    try:
        tree = _parsed(source)
    except (SyntaxError, ValueError) as error:
        line, column = getattr(error, "lineno", None) or 1, getattr(error, "offset", None) or 1
        why = reason(error)
        message = Message("not valid Python: {reason}", reason=why)
        if _ESCAPED.search(source):
            message = Message(
                "not valid Python: {reason}; `<` and `>` were escaped twice when the document was saved",
                reason=why,
            )
        raise code.error(message, line - header, column) from error
    except (RecursionError, MemoryError) as error:
        raise code.error(Message("the code is nested too deeply")) from error
    for node in ast.walk(tree) if "__future__" in source else ():
        if isinstance(node, ast.ImportFrom) and node.module == "__future__":
            message = Message(
                "`from __future__` is not allowed here: it is for a whole file, and Python 3 needs none"
            )
            line = node.lineno - header
            raise code.error(message, line, code.column(line, node.col_offset))
    return tree


@lru_cache(maxsize=4096)
def _try_compiling(source: str) -> None:
    """Compile a text, and remember that it could be: an editor compiles all code again after each change."""
    with warnings.catch_warnings(action="ignore"):
        compile(source, "<document>", "exec", dont_inherit=True)


def compile_source(source: str, code: CodeText, header: int = 0, columns: int = 0) -> None:
    """Raise CodeError for what the parser accepts but the compiler rejects, such as a stray `break`."""
    try:
        _try_compiling(source)
    except SyntaxError as error:
        # What parses has been refused by the compiler, which counts bytes.
        text = source.split("\n")[(error.lineno or 1) - 1]
        line, column = (error.lineno or 1) - header, _characters(text, (error.offset or 1) - 1) + 1 - columns
        raise code.error(Message("not valid Python: {reason}", reason=reason(error)), line, column) from error
    except (RecursionError, MemoryError) as error:
        raise code.error(Message("the code is nested too deeply")) from error


def parse_expression(code: CodeText, what: Message) -> ast.Module:
    """Return the tree of an expression that may span lines, after one generated line.

    `what` names it in messages. Raises CodeError.
    """
    # With parentheses on separate lines the expression can span lines and end with a comment.
    tree = parse(code, ("(", *code.lines, ")"), header=1)
    statement = tree.body[0]
    # The node of a tuple includes the parentheses, and so does code that closes them, as in `a) or (b`.
    if len(tree.body) != 1 or not isinstance(statement, ast.Expr) or statement.value.lineno == 1:
        raise code.error(Message("a {what} must be one expression", what=what))
    return tree


def library_today(name: str) -> str:
    """Return a library, with the package of today where it is that of JdeRobot's components."""
    found = _OLD_LIBRARY.fullmatch(name.strip())
    if found is None:
        return name
    return f"from interfaces import {found[1]}" if found[1] else f"from interfaces.jderobot {found[2]}"


def parse_import(text: Text) -> tuple[str, ast.Import | ast.ImportFrom]:
    """Return a library as an import statement with its tree. Raises CodeError."""
    written = library_today(text.text).strip()
    statement = written if re.match(r"(import|from)\s", written) else f"import {written}"
    try:
        body = parse_python(statement).body
    except SyntaxError:
        body = []
    if len(body) != 1 or not isinstance(body[0], ast.Import | ast.ImportFrom) or "\n" in statement:
        message = Message(
            "`{written}` is not a library: write `cv2`, `numpy as np` or `from math import pi`",
            written=written[:60],
        )
        raise CodeError(message, text.line, text.column)
    if isinstance(body[0], ast.ImportFrom) and body[0].module == "__future__":
        raise CodeError(
            Message("`__future__` is not a library: it changes how a file is parsed"), text.line, text.column
        )
    return statement, body[0]


def refuse_code(tree: ast.Module, code: CodeText, header: int = 0, *, is_variables: bool = False) -> None:
    """Raise CodeError for code that is not valid as the body of a function; an expression has a `header`.

    Variables are in the middle of a function, and must not return from it.
    """
    for node in own_nodes(tree):
        line = getattr(node, "lineno", 1) - header
        place = (line, code.column(line, getattr(node, "col_offset", 0)))
        match node:
            case ast.Yield() | ast.YieldFrom() | ast.Await() | ast.AsyncFor() | ast.AsyncWith():
                word = "yield" if isinstance(node, ast.Yield | ast.YieldFrom) else "await"
                message = Message(
                    "`{word}` is not allowed here: the code of a cycle runs from start to end", word=word
                )
                raise code.error(message, *place)
            case ast.Return() if is_variables:
                raise code.error(Message("`return` is not allowed in the variables"), *place)
            case ast.Nonlocal() if is_variables:
                message = Message(
                    "`nonlocal` is not allowed in the variables: there is no enclosing function"
                )
                raise code.error(message, *place)
            case ast.ImportFrom(names=names) if any(alias.name == "*" for alias in names):
                raise code.error(Message("`import *` is not allowed here: declare a library"), *place)
    source, first = as_function(tree, code, header)
    compile_source(source, code, first, columns=2 * len(INDENT))
    if "self" in bound_names(tree):
        place = place_of_bound("self", tree, code, header)
        raise code.error(Message("`self` is the component and cannot be assigned"), *place)
    for node in own_nodes(tree) if not is_variables else ():
        match node:
            case ast.AnnAssign(target=ast.Name(id=name)):
                message = Message(
                    "`{name}` is shared by all code of the automaton: annotate it in the variables", name=name
                )
                raise code.error(message, node.lineno, code.column(node.lineno, node.col_offset))


def refuse_functions(code: CodeText) -> None:
    """Raise CodeError for code that is not valid as the body of a class."""
    source = as_class(code)
    compile_source(source, code, header=2, columns=len(INDENT))


def as_function(tree: ast.Module, code: CodeText, header: int = 0) -> tuple[str, int]:
    """Return code as the body of a function in a file, and the number of lines before it.

    Outer names that its own functions assign are bound around it: whether other code binds them is checked in
    the whole component.
    """
    outer = {name for node in all_nodes(tree) if isinstance(node, ast.Nonlocal) for name in node.names}
    lines = [FUTURE, "def _outer():", f"{INDENT}{' = '.join(sorted(outer | {'_'}))} = None"]
    lines += [f"{INDENT}def _inner():", *([f"{INDENT * 2}return ("] if header else [])]
    end = f"{INDENT * 2})" if header else f"{INDENT * 2}pass"
    return "\n".join([*lines, *code.indented(2), end]) + "\n", len(lines)


def as_class(code: CodeText) -> str:
    """Return code as the body of a class in a file, after two lines."""
    return "\n".join([FUTURE, "class _Component:", *code.indented(1), f"{INDENT}pass"])


def definitions(tree: ast.Module) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef]:
    """Yield the top-level functions and classes that code defines."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            yield node


def bound_names(tree: ast.AST) -> frozenset[str]:
    """Return the names that code binds in its own scope: assigns, deletes, defines, imports or captures."""
    nodes = own_nodes(tree)
    names = {name for node in _binding(nodes) for name in binds(node)}
    declared = (node.names for node in nodes if isinstance(node, ast.Global))
    return frozenset(names.difference(*declared))


def place_of_bound(name: str, tree: ast.AST, code: CodeText, header: int = 0) -> tuple[int, int]:
    """Return the line and the column of `code`, both from 1, where it first binds a name in its own scope."""
    places = [
        (node.lineno - header, node.col_offset)  # type: ignore[attr-defined]  # what binds has a place
        for node in _binding(own_nodes(tree))
        if name in binds(node)
    ]
    line, offset = min(places)
    column = code.column(line, offset)
    text = code.lines[min(max(1, line), len(code.lines)) - 1]
    found = re.compile(rf"\b{re.escape(name)}\b").search(text, column - 1)  # behind `def`, `as` or `import`
    return line, found.start() + 1 if found else column


def _binding(nodes: Sequence[ast.AST]) -> Iterator[ast.AST]:
    """Return the nodes that may bind names of the scope: not the targets of comprehensions."""
    comprehensions = (node for node in nodes if isinstance(node, ast.comprehension))
    inside = {target for each in comprehensions for target in ast.walk(each.target)}
    return (node for node in nodes if node not in inside)


def binds(node: ast.AST) -> Iterator[str]:
    """Yield the names that a node binds, or declares as global or nonlocal."""
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
        case ast.Nonlocal(names=names):
            yield from names
