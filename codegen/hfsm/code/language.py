"""Tell in which language the code of a document is written: Python or C++.

Documents of old do not say it. What a person jots down as a placeholder is neither.
"""

from __future__ import annotations

import ast
import re
import textwrap
import warnings
from collections.abc import Iterator
from enum import IntEnum
from typing import Final

from ..document import Document
from .python2 import fix_python2, python2_mark
from .text import parse_python

__all__ = ["CPP", "PYTHON", "language_of", "looks_like_cpp"]

CPP: Final = "C++"
PYTHON: Final = "Python"

_CPP_NOISE: Final = re.compile(
    r"""//[^\n]*|/\*.*?(?:\*/|\Z)|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'""", re.DOTALL
)
_CPP_COMMENT: Final = re.compile(r"^[^\S\n]*//|/\*", re.MULTILINE)
_PREPROCESSOR: Final = re.compile(
    r'^[^\S\n]*#[^\S\n]*(?:include[^\S\n]*[<"]|define[^\S\n]+[A-Z_][A-Z_\d]*\b|(?:ifdef|ifndef|endif|pragma)\b)',
    re.MULTILINE,
)
_TYPE: Final = r"""(?:(?:const|static|unsigned|signed|long|short)\s+)*
    (?:void|bool|char|int|long|short|unsigned|float|double|auto|size_t|std::\w+|string|[A-Za-z_]\w*::\w+)
    (?:\s*<[^;{}()]*>)?"""
# What C++ has and Python has not, outside strings and comments of either.
_CPP: Final = re.compile(
    rf"""[\w)\]]\s*->\s*[A-Za-z_]                           # a member through a pointer
      | \b[A-Za-z_]\w*::~?[A-Za-z_]                        # a scoped name
      | (?:^[^\S\n]*|[;{{}}(]\s*){_TYPE}[\s&*]+[A-Za-z_]\w*\s*(?:[;=({{\[,)]|$)   # a declaration
      | ;[^\S\n]*$ | [;{{}})]\s*}}                         # the end of a statement, of a block
      | \)\s*\{{ | \belse\s*\{{
      | && | \|\| | !\s*[A-Za-z_(] | \+\+ | [=(,]\s*new\s+[A-Z]
      | \b(?:cout|cerr|endl|printf|nullptr|NULL|true|false)\b""",
    re.VERBOSE | re.MULTILINE,
)


# Statements, and expressions that C++ writes in other ways.
_STATEMENTS: Final = (
    *(ast.FunctionDef, ast.ClassDef, ast.Import, ast.ImportFrom, ast.Return, ast.Global, ast.Nonlocal),
    *(ast.If, ast.For, ast.While, ast.With, ast.Try, ast.Raise, ast.Pass),
    *(ast.Assign, ast.AugAssign, ast.AnnAssign, ast.BoolOp, ast.List, ast.Dict, ast.Lambda),
)


class _Evidence(IntEnum):
    NONE = 0
    PYTHON = 1
    CPP = 2


def language_of(document: Document) -> str:
    """Return `Python`, `C++`, or an empty text when no code tells.

    The pieces of code vote with the number of their lines: a document is C++ when more of its lines can only
    be that than can only be Python.
    """
    lines = dict.fromkeys(_Evidence, 0)
    for piece, is_condition in _pieces(document):
        lines[_evidence(piece, is_condition=is_condition)] += sum(
            1 for line in piece.split("\n") if line.strip()
        )
    if lines[_Evidence.CPP] > lines[_Evidence.PYTHON]:
        return CPP
    return PYTHON if lines[_Evidence.PYTHON] else ""


def looks_like_cpp(code: str) -> bool:
    """Return whether a piece of code is C++, and not Python of any age."""
    return _evidence(code) is _Evidence.CPP


def _pieces(document: Document) -> Iterator[tuple[str, bool]]:
    """Yield each piece of code, and whether it is a condition."""
    for automaton in document.automata:
        yield automaton.variables.text, False
        yield automaton.functions.text, False
        for state in automaton.states:
            for text in (state.code, state.entry, state.exit):
                yield text.text, False
        for transition in automaton.transitions:
            yield transition.code.text, False
            yield transition.guard.text, True
            if transition.type == "condition":
                yield transition.trigger.text, True


def _evidence(code: str, *, is_condition: bool = False) -> _Evidence:
    if not code.strip():
        return _Evidence.NONE
    if _PREPROCESSOR.search(code):
        return _Evidence.CPP  # to Python it is a comment
    tree = _parsed(code)
    if tree is None and python2_mark(code) is not None:
        try:
            tree = _parsed(fix_python2(code) or code)
        except ModuleNotFoundError:  # without fissix the mark is all that is known
            return _Evidence.PYTHON
    if tree is None:
        return _Evidence.CPP if _has_marks_of_cpp(code) else _Evidence.NONE
    if all(line.rstrip().endswith(";") for line in code.split("\n") if line.strip()):
        return _Evidence.CPP  # `stop();` is valid Python, but nobody ends each line of Python so
    return _Evidence.PYTHON if _is_python(tree, is_condition=is_condition) else _Evidence.NONE


def _is_python(tree: ast.Module, *, is_condition: bool) -> bool:
    """Return whether there is anything that a line of C++ or a few words of prose cannot be."""
    return any(isinstance(node, _STATEMENTS) or _is_own_word(node) for node in ast.walk(tree)) or (
        not is_condition and any(_is_call(statement) for statement in tree.body)
    )


def _is_own_word(node: ast.AST) -> bool:
    match node:
        case ast.Name(id="self") | ast.Constant(value=bool() | None) | ast.UnaryOp(op=ast.Not()):
            return True
        case ast.Compare(ops=operators):
            return any(isinstance(each, ast.In | ast.NotIn | ast.Is | ast.IsNot) for each in operators)
    return False


def _is_call(statement: ast.stmt) -> bool:
    """Return whether a statement is a call, which in C++ would end with a semicolon."""
    return isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call)


def _has_marks_of_cpp(code: str) -> bool:
    if _CPP_COMMENT.search(code):
        return True
    return bool(_CPP.search(_CPP_NOISE.sub('""', code)))


def _parsed(code: str) -> ast.Module | None:
    """Return the tree of a piece of code, or None when it is no Python."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            return parse_python(textwrap.dedent(code).strip("\n"))
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return None
