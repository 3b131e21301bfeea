"""Follow includes, guards and conditions: from the tokens of files to those of one translation unit."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from codegen.diagnostics import Diagnostics, Note

from .codes import Code
from .conditions import ConditionError, evaluate
from .lexer import Kind, Source, Token
from .macros import ExpansionTooLargeError, MacroError, Macros, is_macro_use
from .source_files import IncludePath, SourceFiles

_DEEPEST_INCLUDE = 64
# Against files that include each other without guards.
_MOST_INCLUDES = 10_000
_MOST_TOKENS = 2_000_000

_FOLDERS_OF_ICE = frozenset({"Glacier2", "Ice", "IceBox", "IceGrid", "IcePatch2", "IceSSL", "IceStorm"})

_DIRECTIVE = re.compile(r"#\s*(?P<name>[a-z]*)\s*(?P<rest>.*)", re.DOTALL)
_INCLUDE = re.compile(r'"(?P<quoted>[^"]+)"|<(?P<angled>[^>]+)>')
_NAME = re.compile(r"[A-Za-z_]\w*")
_COMMENT = re.compile(r"//.*|/\*.*?\*/", re.DOTALL)


@dataclass(slots=True)
class TranslationUnit:
    """What one file says, with all that it includes."""

    source: Source
    tokens: list[Token] = field(default_factory=list)
    included: list[Source] = field(default_factory=list)
    """Every file that it includes, directly or not, each once."""
    complete: bool = True
    """Whether every included file was found; if not, names that seem undefined may be defined there."""


@dataclass(slots=True)
class _Condition:
    token: Token
    active: bool
    """Whether the present branch is read."""
    taken: bool
    """Whether a branch has been read, so that no further one is."""
    outer_active: bool
    else_seen: bool = False


class Preprocessor:
    """Turn files into translation units.

    `include_directories` are searched for `#include <x>` and, after the directory of the including file, for
    `#include "x"`.
    """

    def __init__(
        self, files: SourceFiles, include_directories: Sequence[Path], diagnostics: Diagnostics
    ) -> None:
        self._files = files
        self._include_path = IncludePath(include_directories)
        self._diagnostics = diagnostics

    def unit(self, source: Source) -> TranslationUnit:
        """Return the translation unit of a file."""
        unit = TranslationUnit(source)
        _Reader(unit, self._files, self._include_path, self._diagnostics).read(source)
        unit.tokens.append(source.tokens[-1])
        return unit


class _Reader:
    """The state while one translation unit is read."""

    def __init__(
        self,
        unit: TranslationUnit,
        files: SourceFiles,
        include_path: IncludePath,
        diagnostics: Diagnostics,
    ) -> None:
        self._unit = unit
        self._files = files
        self._include_path = include_path
        self._diagnostics = diagnostics
        self._macros = Macros()
        self._once: set[Source] = set()
        self._depth = 0
        self._includes = 0
        self._stopped = False

    def read(self, source: Source) -> None:
        """Append the tokens of `source` that count to the unit."""
        conditions: list[_Condition] = []
        active = True
        output = self._unit.tokens
        macros = self._macros.names
        tokens = source.tokens
        index = 0
        while index < len(tokens):
            token = tokens[index]
            index += 1
            kind = token.kind
            if kind is Kind.DIRECTIVE:
                active = self._directive(token, conditions)
                if self._stopped:
                    return
            elif not active or kind is Kind.END:
                continue
            elif token.text in macros and is_macro_use(token):
                index = self._expand(tokens, index - 1)
                if self._stopped:
                    return
            elif kind is Kind.INVALID or kind is Kind.UNTERMINATED:
                self._report_bad_token(token)
            else:
                output.append(token)
        for condition in conditions:
            end = Token(Kind.END, "", source, max(0, len(source.text.rstrip()) - 1))
            begin = Note("the condition begins here", condition.token.location)
            self._error(Code.BAD_DIRECTIVE, "the file ends without an #endif", end, begin)

    def _error(self, code: Code, message: str, token: Token, *notes: Note) -> None:
        self._diagnostics.error(code, message, token.location, notes)

    def _expand(self, tokens: list[Token], index: int) -> int:
        """Append what the macro used at `index` stands for; return the index behind its use."""
        try:
            replacement, index = self._macros.expand(tokens, index)
        except MacroError as error:
            self._error(Code.BAD_DIRECTIVE, str(error), tokens[index])
            self._stopped = isinstance(error, ExpansionTooLargeError)
            return index + 1
        self._unit.tokens += replacement
        return index

    def _stop(self, message: str, token: Token) -> None:
        self._stopped = True
        self._error(Code.INCLUDE_TOO_DEEP, message, token)

    def _report_bad_token(self, token: Token) -> None:
        if token.kind is Kind.UNTERMINATED:
            if token.text.startswith("/*"):
                message = "this comment has no end"
                self._diagnostics.warning(Code.COMMENT_WITHOUT_END, message, token.location)
            else:
                self._error(Code.UNTERMINATED, "this string has no end", token)
        elif token.text[0].isdigit() or token.text[1:2].isdigit():
            self._error(Code.BAD_LITERAL, f"`{_cut(token.text)}` is not a number", token)
        else:
            self._error(Code.UNEXPECTED_CHARACTER, f"unexpected {_cut(token.text)!r}", token)

    def _directive(self, token: Token, conditions: list[_Condition]) -> bool:
        """Do what a directive says; return whether the tokens behind it are read."""
        text = _COMMENT.sub(" ", token.text.replace("\\\n", " "))
        if "/*" in text:
            self._error(Code.UNTERMINATED, "a comment that begins on this line has no end", token)
        match = _DIRECTIVE.match(text)
        name, rest = (match["name"], match["rest"].strip()) if match else ("", "")
        active = not conditions or conditions[-1].active
        if name in {"if", "ifdef", "ifndef"}:
            holds = active and self._holds(name, rest, token)
            conditions.append(_Condition(token, holds, holds, active))
        elif name in {"elif", "else", "endif"}:
            self._next_branch(name, rest, token, conditions)
        elif active:
            self._plain_directive(name, rest, token)
        return not conditions or conditions[-1].active

    def _next_branch(self, name: str, rest: str, token: Token, conditions: list[_Condition]) -> None:
        if not conditions:
            self._error(Code.BAD_DIRECTIVE, f"#{name} without #if", token)
            return
        if name != "elif":
            self._nothing_behind(rest, name, token)
        if name == "endif":
            conditions.pop()
            return
        condition = conditions[-1]
        if condition.else_seen:
            begin = Note("the condition begins here", condition.token.location)
            self._error(Code.BAD_DIRECTIVE, f"#{name} behind #else", token, begin)
        open_ = condition.outer_active and not condition.taken
        condition.active = open_ and (name == "else" or self._holds("if", rest, token))
        condition.taken = condition.taken or condition.active
        condition.else_seen = condition.else_seen or name == "else"

    def _holds(self, name: str, rest: str, token: Token) -> bool:
        if name == "if":
            try:
                return evaluate(rest, self._macros.values())
            except ConditionError as error:
                self._error(Code.BAD_DIRECTIVE, f"#if: {error}", token)
                return False
        match = _NAME.match(rest)
        if match is None:
            self._error(Code.BAD_DIRECTIVE, f"#{name} needs a name", token)
            return False
        self._nothing_behind(rest[match.end() :], name, token)
        return (match[0] in self._macros.names) == (name == "ifdef")

    def _plain_directive(self, name: str, rest: str, token: Token) -> None:
        match name:
            case "include":
                self._include(rest, token)
            case "define":
                self._define(rest, token)
            case "undef":
                undefined, _, behind = rest.partition(" ")
                if not undefined:
                    self._error(Code.BAD_DIRECTIVE, "#undef needs a name", token)
                self._nothing_behind(behind, name, token)
                self._macros.undefine(undefined)
            case "pragma":
                if rest == "once":
                    self._once.add(token.source)
                else:
                    self._error(Code.BAD_DIRECTIVE, f"unknown #pragma {rest}", token)
            case "error":
                self._error(Code.BAD_DIRECTIVE, f"#error {rest}", token)
            case "" if not rest or rest[0].isdigit():  # `#` alone, and the line marks of a C preprocessor
                pass
            case "line":
                pass
            case _:
                self._error(Code.BAD_DIRECTIVE, f"unknown directive #{name}", token)

    def _nothing_behind(self, rest: str, name: str, token: Token) -> None:
        if rest.strip():
            message = f"only a comment can stand behind #{name}, not `{_cut(rest.strip())}`"
            self._error(Code.BAD_DIRECTIVE, message, token)

    def _define(self, rest: str, token: Token) -> None:
        try:
            self._macros.define(rest, token.source.path)
        except MacroError as error:
            self._error(Code.BAD_DIRECTIVE, str(error), token)

    def _include(self, rest: str, token: Token) -> None:
        match = _INCLUDE.match(rest)
        if match is None:
            self._error(Code.BAD_DIRECTIVE, '#include needs a file: "name.idl" or <name.idl>', token)
            return
        name = match["quoted"] or match["angled"]
        self._nothing_behind(rest[match.end() :], "include", token)
        own = token.source.path.parent
        path = self._include_path.find(name, own, own_directory_first=match["quoted"] is not None)
        if path is None:
            notes = [Note(f"searched in {self._include_path.described(own)}; -I DIR adds a directory")]
            if name.partition("/")[0] in _FOLDERS_OF_ICE:
                notes.append(
                    Note("it is a file of Ice: `pip install zeroc-ice` brings the directory `slice` for -I")
                )
            self._error(Code.INCLUDE_NOT_FOUND, f"`{name}` is not found", token, *notes)
            self._unit.complete = False
            return
        source = self._files.load(path, token.location)
        if source is None or source in self._once:
            return
        self._includes += 1
        too_large = self._includes > _MOST_INCLUDES or len(self._unit.tokens) > _MOST_TOKENS
        if self._depth >= _DEEPEST_INCLUDE or too_large:
            self._stop(f"`{name}` is included without end: do the files lack guards?", token)
            return
        if source not in self._unit.included and source is not self._unit.source:
            self._unit.included.append(source)
        self._depth += 1
        self.read(source)
        self._depth -= 1


def _cut(text: str) -> str:
    return text if len(text) <= 20 else text[:20] + "..."
