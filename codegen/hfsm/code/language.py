"""Find the code of a document, and tell in which language it is: Python, Python 2 or C++.

Documents of old do not say it. What a person jots down as a placeholder is neither.
"""

from __future__ import annotations

import ast
import re
import textwrap
import warnings
from collections.abc import Callable, Iterator
from dataclasses import replace
from enum import IntEnum
from pathlib import Path
from typing import Final, NamedTuple

from ...diagnostics import Diagnostics, Location, Note
from ..codes import Code
from ..document import Automaton, Document, State, Text, Transition
from .python2 import fix_python2, python2_mark
from .text import parse_piece, parse_python

__all__ = [
    "CPP",
    "PYTHON",
    "CodeText",
    "change_code",
    "code_of",
    "first_foreign",
    "is_foreign",
    "language_of",
    "looks_like_cpp",
    "notes_about",
    "report_foreign",
]

CPP: Final = "C++"
PYTHON: Final = "Python"
_PYTHON: Final = ("", "python", "py", "python3")


class CodeText(NamedTuple):
    """A text with code that is not blank, what it is, and the file that it stands in."""

    what: str
    text: Text
    path: Path
    is_condition: bool

    @property
    def place(self) -> Location:
        """Where its first character stands."""
        return Location(self.path, self.text.line, max(1, self.text.column))


def code_of(document: Document, path: Path) -> Iterator[CodeText]:
    """Yield the code of the automata in the order of the document, which lies at `path`."""
    for automaton in document.automata:
        for what, text in _texts(automaton):
            if not text.is_blank:
                yield CodeText(what, text, automaton.path or path, what.startswith(_CONDITIONS))


_CONDITIONS: Final = ("the condition", "the guard")


def _texts(automaton: Automaton) -> Iterator[tuple[str, Text]]:
    yield f"the variables of automaton {automaton.id}", automaton.variables
    yield f"a function of automaton {automaton.id}", automaton.functions
    for state in automaton.states:
        label = f"`{state.name}`" if state.name.strip() else f"{state.id}"
        yield f"the entry code of state {label}", state.entry
        yield f"the code of state {label}", state.code
        yield f"the exit code of state {label}", state.exit
        for argument in state.arguments:
            yield f"the argument `{argument.name}` of state {label}", argument.value
    for transition in automaton.transitions:
        label = f"`{transition.name}`" if transition.name.strip() else f"{transition.id}"
        if transition.type == "condition":
            yield f"the condition of transition {label}", transition.trigger
        yield f"the guard of transition {label}", transition.guard
        yield f"the code of transition {label}", transition.code


def change_code(document: Document, change: Callable[[Text], Text]) -> Document:
    """Return a document in which each piece of code that is not blank is what `change` makes of it."""

    def changed(text: Text) -> Text:
        return text if text.is_blank else change(text)

    def state(old: State) -> State:
        arguments = tuple(replace(each, value=changed(each.value)) for each in old.arguments)
        entry, code = changed(old.entry), changed(old.code)
        return replace(old, entry=entry, code=code, exit=changed(old.exit), arguments=arguments)

    def transition(old: Transition) -> Transition:
        trigger = changed(old.trigger) if old.type == "condition" else old.trigger
        return replace(old, trigger=trigger, guard=changed(old.guard), code=changed(old.code))

    def automaton(old: Automaton) -> Automaton:
        return replace(
            old,
            states=tuple(map(state, old.states)),
            transitions=tuple(map(transition, old.transitions)),
            variables=changed(old.variables),
            functions=changed(old.functions),
        )

    return replace(document, automata=tuple(map(automaton, document.automata)))


def is_foreign(document: Document) -> bool:
    """Return whether a document says that its code is in another language than Python."""
    return document.language.text.strip().lower() not in _PYTHON


def first_foreign(document: Document, path: Path) -> CodeText | None:
    """Return the first code of another language in a document that says to be in one, or None without code.

    `path` is where the document lies.
    """
    found = list(code_of(document, path)) if is_foreign(document) else []
    return next((each for each in found if looks_like_cpp(each.text.text)), found[0] if found else None)


def report_foreign(first: CodeText, language: str, diagnostics: Diagnostics, *notes: Note) -> None:
    """Report that a document is in another language, by the `first` code of it."""
    message = f"{language} in {first.what}: it is kept, but only Python runs here"
    diagnostics.error(Code.FOREIGN_LANGUAGE, message, first.place, notes)


def notes_about(code: str) -> list[Note]:
    """Return in which language code may be that is no Python 3; none for code that is."""
    if parse_piece(code) is not None:
        return []
    try:
        if fix_python2(code) is not None:
            return [Note("this is Python 2: `visualhfsm convert --fix-python2` fixes it")]
    except ModuleNotFoundError as error:
        if python2_mark(code) is not None:
            return [Note(f"this may be Python 2: `visualhfsm convert --fix-python2` fixes it; {error}")]
    if looks_like_cpp(code):
        return [Note("if the document is in C++, let it say so: `<language>C++</language>`")]
    return []


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
    for each in code_of(document, Path()):
        code = each.text.text
        written = sum(1 for line in code.split("\n") if line.strip())
        lines[_evidence(code, is_condition=each.is_condition)] += written
    if lines[_Evidence.CPP] > lines[_Evidence.PYTHON]:
        return CPP
    return PYTHON if lines[_Evidence.PYTHON] else ""


def looks_like_cpp(code: str) -> bool:
    """Return whether a piece of code is C++, and not Python of any age."""
    return _evidence(code) is _Evidence.CPP


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
