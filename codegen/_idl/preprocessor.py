"""Read a file with everything that it includes into one list of tokens.

Of the C preprocessor it has what Slice files need: includes, guards, and conditions on which names are
defined. A macro that is used is refused, not replaced; `#line` is ignored.
"""

from __future__ import annotations

import errno
import os
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

from codegen.diagnostics import Diagnostics, Location, Note

from ..files import read_regular
from ..reasons import reason
from .lexer import Source, Token, TokenKind
from .report import Code, SourceReport, note_at

EXTENSIONS = (".idl", ".ice")

_LARGEST_FILE = 16 * 2**20
_DEEPEST_INCLUDE = 64
# Limits files that include each other without guards.
_MOST_INCLUDES = 10_000
_MOST_TOKENS = 2_000_000

# The reference compiler defines these: files can have parts for one language or version.
_PREDEFINED = frozenset({"ICE_VERSION", "__ICE_VERSION__", "__SLICE2PY__"})
_FOLDERS_OF_ICE = frozenset({"Glacier2", "Ice", "IceBox", "IceGrid", "IcePatch2", "IceSSL", "IceStorm"})

_DIRECTIVE = re.compile(r"#\s*(?P<name>\w*)\s*(?P<rest>.*)", re.DOTALL)
_INCLUDE = re.compile(r'"(?P<quoted>[^"]+)"|<(?P<angled>[^>]+)>')
_NAME = re.compile(r"(?!defined\b)[A-Za-z_]\w*", re.ASCII)
_DEFINED = re.compile(rf"\bdefined\b\s*(?:\(\s*({_NAME.pattern})\s*\)|({_NAME.pattern}))", re.ASCII)
_AND_OR = re.compile(r"&&|\|\|")
_TERM = re.compile(r"[\s!]*+[01]\s*+")
_FALSE = re.compile(r"(?<!!)0|!1")
_STRING_OR_COMMENT = re.compile(r'("(?:[^"\\]|\\.)*")|//.*|/\*.*?\*/', re.DOTALL)


@dataclass(slots=True)
class Preprocessed:
    """A file with everything that it includes: the remaining tokens without directives."""

    tokens: list[Token] = field(default_factory=list)
    included: list[Source] = field(default_factory=list)
    """Every file that it includes, directly or not, once."""
    complete: bool = True
    """False if files are missing, which may define names that are undefined."""


class Preprocessor:
    """Reads each file once in a run, and joins it with its includes.

    `include_directories` are searched for `#include <x>` and, after the directory of the including file, for
    `#include "x"`. Files that cannot be read are reported to `diagnostics`.
    """

    def __init__(self, include_directories: Sequence[Path], diagnostics: Diagnostics) -> None:
        self._include_directories = tuple(include_directories)
        self._diagnostics = diagnostics
        self._report = SourceReport(diagnostics)
        self._sources: dict[Path, Source | None] = {}
        self._identities: dict[Path, Path] = {}

    def load(self, path: Path, included_at: Location | None = None) -> Source | None:
        """Return the source at `path`, or None after reporting an error."""
        identity = self.identity(path)
        if identity not in self._sources:
            self._sources[identity] = self._read(path, included_at or Location(path))
        return self._sources[identity]

    def identity(self, path: Path) -> Path:
        """Return the file to which the links of a path lead."""
        identity = self._identities.get(path)
        if identity is None:
            identity = self._identities[path] = path.resolve()
        return identity

    def _read(self, path: Path, requested_at: Location) -> Source | None:
        try:
            if not path.name.isprintable():  # it becomes part of the generated code
                raise OSError(errno.EINVAL, "its name has unprintable characters")
            content = read_regular(path, _LARGEST_FILE + 1)
            if len(content) > _LARGEST_FILE:
                size = path.stat().st_size
                raise OSError(errno.EFBIG, f"{size} bytes are more than {_LARGEST_FILE}")
        except OSError as error:
            self._report.error(Code.UNREADABLE_FILE, f"{path} cannot be read: {reason(error)}", requested_at)
            return None
        try:
            text = content.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            line = content.count(b"\n", 0, error.start) + 1
            column = error.start - content.rfind(b"\n", 0, error.start)
            message = "the file is not UTF-8 and is read as Latin-1"
            self._report.warning(Code.UNKNOWN_ENCODING, message, Location(path, line, column))
            text = content.decode("latin-1")
        text = text.replace("\r\n", "\n")
        if text and not text.endswith("\n"):
            text += "\n"
        self._diagnostics.add_source(path, text)
        return Source(path, text)

    def preprocess(self, source: Source, diagnostics: Diagnostics) -> Preprocessed:
        """Return a file as the main file of a translation unit; report errors to `diagnostics`."""
        reader = _Reader(source, self, diagnostics)
        reader.read(source)
        reader.result.tokens.append(source.tokens[-1])
        return reader.result

    def searched(self, own: Path) -> str:
        """Return the directories that are searched, for messages."""
        return ", ".join(str(directory) for directory in (own, *self._include_directories))

    def find(self, name: str, own: Path, *, own_directory_first: bool) -> Path | None:
        """Return the file for an `#include` in a file of the directory `own`.

        A name with one extension, `.idl` or `.ice`, also finds a file with the other.
        """
        if "\0" in name:
            return None
        directories = list(self._include_directories)
        directories.insert(0 if own_directory_first else len(directories), own)
        stem, extension = os.path.splitext(name)  # noqa: PTH122 - `name` may have parts that Path would normalize
        others = [stem + other for other in EXTENSIONS if other != extension and extension in EXTENSIONS]
        for candidate in (name, *others):
            for directory in directories:
                path = Path(os.path.normpath(directory / candidate))
                if path.is_file():
                    return path
        return None


@dataclass(slots=True)
class _Condition:
    token: Token
    active: bool
    """True in a branch that is read."""
    otherwise: bool
    """True while a branch after `#elif` or `#else` may be read; with neither, all branches are skipped."""
    else_seen: bool = False


class _Reader:
    """Reads one translation unit."""

    def __init__(self, main: Source, preprocessor: Preprocessor, diagnostics: Diagnostics) -> None:
        self.result = Preprocessed()
        self._main = main
        self._preprocessor = preprocessor
        self._report = SourceReport(diagnostics)
        self._macros = set(_PREDEFINED)
        self._once: set[Source] = set()
        self._depth = 0
        self._includes = 0
        self._stopped = False

    def read(self, source: Source) -> None:
        """Append the tokens of `source` and of its includes to the result."""
        conditions: list[_Condition] = []
        active = True
        output = self.result.tokens
        for token in source.tokens:
            kind = token.kind
            if kind is TokenKind.DIRECTIVE:
                active = self._directive(token, conditions)
                if self._stopped:
                    return
            elif kind is TokenKind.UNTERMINATED:
                self._report_bad_token(token)  # also in a skipped branch, like slice2py
            elif not active or kind is TokenKind.END:
                continue
            elif kind is TokenKind.INVALID:
                self._report_bad_token(token)
            else:
                if token.text in self._macros and not token.escaped:
                    message = f"macros are not replaced: write the text of `{_cut(token.text)}` here"
                    self._incomplete(message, token)
                output.append(token)
        for condition in conditions:
            end = Token(TokenKind.END, "", source, max(0, len(source.text.rstrip()) - 1))
            begin = note_at("the condition starts here", condition.token)
            self._report.error(Code.BAD_DIRECTIVE, "the file ends without an #endif", end, begin)

    def _report_bad_token(self, token: Token) -> None:
        if token.kind is TokenKind.UNTERMINATED:
            if token.text.startswith("/*"):
                self._report.warning(Code.COMMENT_WITHOUT_END, "this comment has no end", token)
            else:
                self._report.error(Code.UNTERMINATED, "this string has no end", token)
        elif token.text[0].isdigit() or token.text[1:2].isdigit():
            self._report.error(Code.BAD_LITERAL, f"`{_cut(token.text)}` is not a number", token)
        else:
            self._report.error(Code.UNEXPECTED_CHARACTER, f"unexpected {_cut(token.text)!r}", token)

    # Directives

    def _directive(self, token: Token, conditions: list[_Condition]) -> bool:
        """Execute a directive; return whether the following tokens are active."""
        spliced = token.text.replace("\\\n", " ")
        text = _STRING_OR_COMMENT.sub(lambda match: match[1] or " ", spliced)
        if "/*" in text:
            self._report.error(Code.UNTERMINATED, "a comment that starts on this line has no end", token)
            text = text.partition("/*")[0]
        match = _DIRECTIVE.match(text)
        name, rest = (match["name"], match["rest"].strip()) if match else ("", "")
        active = not conditions or conditions[-1].active
        match name:
            case "if" | "ifdef" | "ifndef":
                holds = active and self._holds(name, rest, token)
                conditions.append(_Condition(token, active=holds, otherwise=active and not holds))
            case "elif" | "else" | "endif":
                self._next_branch(name, rest, token, conditions)
            case "include" if active:
                self._include(rest, token)
            case "define" | "undef" if active:
                self._define(name, rest, token)
            case "pragma" if active and rest == "once":
                self._once.add(token.source)
            case "error" if active:
                self._incomplete(f"#error {rest}", token)
            case "line" if active and rest[:1].isdigit():
                pass  # places stay those of the file
            case _ if active and (name or rest):  # `#` alone does nothing
                directive = f"#{name or rest} {rest if name == 'pragma' else ''}".strip()
                self._incomplete(f"unknown directive `{_cut(directive)}`", token)
        return not conditions or conditions[-1].active

    def _incomplete(self, message: str, token: Token, code: Code = Code.BAD_DIRECTIVE, *notes: Note) -> None:
        """Report a part that cannot be read, so that names of the rest may be undefined."""
        self.result.complete = False
        self._report.error(code, message, token, *notes)

    def _nothing_behind(self, rest: str, name: str, token: Token) -> None:
        if rest.strip():
            message = f"only a comment can follow #{name}, not `{_cut(rest.strip())}`"
            self._report.error(Code.BAD_DIRECTIVE, message, token)

    def _holds(self, name: str, rest: str, token: Token) -> bool:
        """Return whether the branch after `#if`, `#elif`, `#ifdef` or `#ifndef` is active."""
        if name in {"if", "elif"}:
            return self._condition_holds(name, rest, token)
        match = self._name(name, rest, token)
        if match is None:
            return False
        self._nothing_behind(rest[match.end() :], name, token)
        return (match[0] in self._macros) == (name == "ifdef")

    def _condition_holds(self, name: str, condition: str, token: Token) -> bool:
        known = _DEFINED.sub(lambda each: f" {int((each[1] or each[2]) in self._macros)} ", condition)
        # Not one pattern of all: Python 3.11.4 and older err in possessive groups (cpython issue 106052).
        if not all(_TERM.fullmatch(term) for term in _AND_OR.split(known)):
            message = (
                f"the condition of #{name} can have `defined NAME`, 0, 1, `!`, `&&` and `||`, not "
                f"`{_cut(condition)}`; nest #ifdef and #ifndef for others"
            )
            self._incomplete(message, token)
            return False
        terms = "".join(known.split()).replace("!!", "")
        return any(not _FALSE.search(alternative) for alternative in terms.split("||"))

    def _name(self, name: str, rest: str, token: Token) -> re.Match[str] | None:
        match = _NAME.match(rest)
        if match is None:
            self._report.error(Code.BAD_DIRECTIVE, f"#{name} needs a name", token)
        return match

    def _next_branch(self, name: str, rest: str, token: Token, conditions: list[_Condition]) -> None:
        if not conditions:
            self._report.error(Code.BAD_DIRECTIVE, f"#{name} without #if, #ifdef or #ifndef", token)
            return
        condition = conditions[-1]
        if name != "elif":
            self._nothing_behind(rest, name, token)
        if name == "endif":
            conditions.pop()
            return
        if condition.else_seen:
            begin = note_at("the condition starts here", condition.token)
            self._report.error(Code.BAD_DIRECTIVE, f"#{name} after #else", token, begin)
        condition.active = condition.otherwise and (name == "else" or self._holds(name, rest, token))
        condition.otherwise = condition.otherwise and not condition.active
        condition.else_seen = condition.else_seen or name == "else"

    def _define(self, name: str, rest: str, token: Token) -> None:
        """Define or undefine a macro; its text does not matter, because uses are refused."""
        match = self._name(name, rest, token)
        if match is None:
            return
        behind = rest[match.end() :]
        if name == "undef":
            self._nothing_behind(behind, name, token)
            self._macros.discard(match[0])
            return
        if behind.startswith("("):
            name = _cut(match[0])
            message = f"macros with parameters are not supported: write the text of `{name}` where it is used"
            self._incomplete(message, token)
        self._macros.add(match[0])

    def _include(self, rest: str, token: Token) -> None:
        match = _INCLUDE.match(rest)
        if match is None:
            self._report.error(Code.BAD_DIRECTIVE, '#include needs a file: "name.idl" or <name.idl>', token)
            return
        name = match["quoted"] or match["angled"]
        self._nothing_behind(rest[match.end() :], "include", token)
        own = token.source.path.parent
        path = self._preprocessor.find(name, own, own_directory_first=match["quoted"] is not None)
        if path is None:
            searched = self._preprocessor.searched(own)
            notes = [note_at(f"searched in {searched}; -I DIR adds a directory")]
            if name.partition("/")[0] in _FOLDERS_OF_ICE:
                notes.append(
                    note_at(
                        "it belongs to Ice: `pip install zeroc-ice` installs the directory `slice` for -I"
                    )
                )
            self._incomplete(f"`{name}` is not found", token, Code.INCLUDE_NOT_FOUND, *notes)
            return
        # Lines of the file would be in our messages, whatever it is.
        if self._preprocessor.identity(path).suffix not in EXTENSIONS:
            known = " or ".join(EXTENSIONS)
            self._incomplete(f"`{name}` is not included: it must end in {known}", token, Code.UNREADABLE_FILE)
            return
        source = self._preprocessor.load(path, token.location)
        if source is None or source in self._once:
            return
        self._includes += 1
        too_large = self._includes > _MOST_INCLUDES or len(self.result.tokens) > _MOST_TOKENS
        if self._depth >= _DEEPEST_INCLUDE or too_large:
            self._stopped = True
            message = f"`{name}` is included recursively: are there include guards?"
            self._report.error(Code.INCLUDE_TOO_DEEP, message, token)
            return
        if source not in self.result.included and source is not self._main:
            self.result.included.append(source)
        self._depth += 1
        self.read(source)
        self._depth -= 1


def _cut(text: str) -> str:
    return text if len(text) <= 20 else text[:20] + "..."
