"""Find the code of a document, and recognize Python 2 and C++.

Old documents do not name their language. A placeholder in words is neither Python nor C++.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final, NamedTuple

from ...diagnostics import Diagnostics, Location, Note
from ...messages import Message
from ...reasons import reason
from ..codes import Code
from ..document import Automaton, Document, State, Text, Transition
from .python2 import fix_python2, python2_mark
from .text import parse_piece

CPP: Final = "C++"
_PYTHON: Final = ("", "python", "py", "python3")


class DocumentCode(NamedTuple):
    """A text with code, its description, and its file."""

    what: Message
    text: Text
    path: Path

    @property
    def place(self) -> Location:
        """The place of its first character."""
        return Location(self.path, self.text.line, max(1, self.text.column))


def code_of(document: Document, path: Path) -> Iterator[DocumentCode]:
    """Yield the code of the automata in the order of the document at `path`."""
    for automaton in document.automata:
        for what, text in _texts(automaton):
            if not text.is_blank:
                yield DocumentCode(what, text, automaton.path or path)


def _texts(automaton: Automaton) -> Iterator[tuple[Message, Text]]:
    yield Message("the variables of automaton {id}", id=automaton.id), automaton.variables
    yield Message("a function of automaton {id}", id=automaton.id), automaton.functions
    for state in automaton.states:
        label = f"`{state.name}`" if state.name.strip() else f"{state.id}"
        yield Message("the entry code of state {label}", label=label), state.entry
        yield Message("the code of state {label}", label=label), state.code
        yield Message("the exit code of state {label}", label=label), state.exit
        for argument in state.arguments:
            yield (
                Message("the argument `{name}` of state {label}", name=argument.name, label=label),
                argument.value,
            )
    for transition in automaton.transitions:
        label = f"`{transition.name}`" if transition.name.strip() else f"{transition.id}"
        if transition.type == "condition":
            yield Message("the condition of transition {label}", label=label), transition.trigger
        yield Message("the guard of transition {label}", label=label), transition.guard
        yield Message("the code of transition {label}", label=label), transition.code


def change_code(document: Document, change: Callable[[Text], Text]) -> Document:
    """Return a document in which `change` has been applied to each piece of code that is not blank."""

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
    """Return whether the declared language of a document is not Python."""
    return document.language.text.strip().lower() not in _PYTHON


def first_foreign(document: Document, path: Path) -> DocumentCode | None:
    """Return the first code of a document in another language, or None.

    The language is that which the document declares; `path` is that of the document.
    """
    found = list(code_of(document, path)) if is_foreign(document) else []
    return next((each for each in found if _is_cpp(each.text.text)), found[0] if found else None)


def is_undeclared_cpp(document: Document) -> bool:
    """Return whether a document without a language is C++: most looks so, and all that is no Python does."""
    if not document.language.is_blank or not is_mostly_cpp(document):
        return False
    refused = [each.text.text for each in code_of(document, Path()) if parse_piece(each.text.text) is None]
    return bool(refused) and all(map(_is_cpp, refused))


def report_foreign(first: DocumentCode, language: str, diagnostics: Diagnostics, *notes: Note) -> None:
    """Report that a document is in another language, at its `first` code."""
    message = Message(
        "{language} in {what}: it is kept, but only Python can run", language=language, what=first.what
    )
    diagnostics.error(Code.FOREIGN_LANGUAGE, message, first.place, notes)


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
