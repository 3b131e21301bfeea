"""Recognize Python 2 and C++ in the code of documents that do not name their language.

A placeholder in words is neither Python nor C++.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Final

from codegen.diagnostics import Note
from codegen.hfsm.code.language import code_of
from codegen.hfsm.code.text import parse_piece
from codegen.hfsm.document import Document
from codegen.messages import Message
from codegen.reasons import reason

from ._python2 import fix_python2, python2_mark

CPP: Final = "C++"


def is_other_language(code: str) -> bool:
    """Return whether a piece of code is certainly not Python."""
    return bool(_is_cpp(code))


def language_of(document: Document) -> str:
    """Return C++ for a document that does not say it: most looks so, and all that is no Python does."""
    if not document.language.is_blank or not is_mostly_cpp(document):
        return ""
    refused = [each.text.text for each in code_of(document, Path()) if parse_piece(each.text.text) is None]
    return CPP if refused and all(map(_is_cpp, refused)) else ""


def notes_about(code: str) -> list[Note]:
    """Return notes about the language of code that is not Python 3; none for code that is."""
    if parse_piece(code) is not None:
        return []
    try:
        if fix_python2(code) is not None:
            return [Note(Message("this is Python 2: `visualhfsm convert --fix-python2` fixes it"))]
    except ModuleNotFoundError as error:
        if python2_mark(code) is not None:
            message = Message(
                "this may be Python 2: `visualhfsm convert --fix-python2` fixes it; {reason}",
                reason=reason(error),
            )
            return [Note(message)]
    if _is_cpp(code):
        return [Note(Message("if the document is in C++, declare it: `<language>C++</language>`"))]
    return []


_CPP_COMMENT: Final = re.compile(r"^[^\S\n]*//|/\*", re.MULTILINE)
_NOISE: Final = re.compile(
    r"""//[^\n]*|/\*.*?(?:\*/|\Z)|"(?:\\.|[^"\\\n])*"|'(?:\\.|[^'\\\n])*'""", re.DOTALL
)
"""Comments and strings."""
_PREPROCESSOR: Final = re.compile(
    r'^[^\S\n]*#[^\S\n]*(?:include[^\S\n]*[<"]|define[^\S\n]+[A-Z_][A-Z_\d]*\b|(?:ifdef|ifndef|endif|pragma)\b)',
    re.MULTILINE,
)
_PYTHON_WORD: Final = re.compile(r"\b(?:and|False|in|is|lambda|None|not|or|self|True)\b")
"""Shows that an expression is Python, although it could also be C++."""
_CPP: Final = re.compile(
    r"""[\w)\]]\s*->\s*[A-Za-z_]              # a member through a pointer
      | \b[A-Za-z_]\w*::~?[A-Za-z_]           # a scoped name
      | ;[^\S\n]*$ | [;{})]\s*}              # the end of a statement, of a block
      | \)\s*\{ | \belse\s*\{
      | && | \|\| | !\s*[A-Za-z_(] | \+\+
      | \b(?:NULL|nullptr|true|false)\b""",
    re.VERBOSE | re.MULTILINE,
)
"""Syntax of C++ that Python does not have, outside strings and comments."""


def is_mostly_cpp(document: Document) -> bool:
    """Return whether more lines of a document's code are C++ than Python; other lines do not count."""
    lines = dict.fromkeys((True, False, None), 0)
    for each in code_of(document, Path()):
        code = each.text.text
        lines[_is_cpp(code)] += sum(1 for line in code.split("\n") if line.strip())
    return lines[True] > lines[False]


def _is_cpp(code: str) -> bool | None:
    """Return whether a piece of code is C++, or None if it is neither C++ nor Python 2 or 3."""
    if _PREPROCESSOR.search(code):
        return True  # to Python it is a comment
    if (tree := parse_piece(code)) is not None:
        if all(line.rstrip().endswith(";") for line in code.split("\n") if line.strip()):
            return True  # `stop();` is valid Python, but nobody ends each line of Python like this
        is_neutral = all(isinstance(statement, ast.Expr) for statement in tree.body)
        return None if is_neutral and not _PYTHON_WORD.search(code) else False
    try:
        if python2_mark(code) is not None and fix_python2(code) is not None:
            return False
    except ModuleNotFoundError:  # without fissix there is only the mark
        return False
    return bool(_CPP_COMMENT.search(code) or _CPP.search(_NOISE.sub('""', code))) or None
