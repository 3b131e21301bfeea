"""Lay out a Slice file in the canonical way: same words, same comments, one set of spaces and lines.

Two spaces a level, a member or an operation a line, an empty line around definitions with a body, `};` behind
a body, at most one empty line in a row. Comments and preprocessor directives stay where they are.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from codegen.diagnostics import Diagnostics, Location, Severity

from .codes import Code
from .format_statement import WIDTH, Word, comment_lines, is_inline, statement_lines, words_of
from .lexer import Kind, Source
from .parser import parse
from .preprocessor import Preprocessor, SourceFiles

__all__ = ["FormattingError", "format_file", "format_source"]

_INDENT = "  "
_BODIES = frozenset({"module", "struct", "class", "exception", "interface", "enum"})
# Punctuation that the layout adds or leaves out: `;` behind a body, the last comma of an enumeration.
_OPTIONAL = frozenset({";", ","})
_DIRECTIVE = re.compile(r"#\s*(?P<name>[a-z]*)[ \t]*(?P<rest>.*)", re.DOTALL)


class FormattingError(Exception):
    """The layout would have changed more than spaces; the file is left alone."""


def format_file(path: Path, diagnostics: Diagnostics) -> str | None:
    """Return the text of a file in canonical layout, or None after reporting what is wrong with its syntax.

    What is wrong with files that it includes, or that they are missing, is not reported.
    Raises FormattingError.
    """
    found = Diagnostics()
    files = SourceFiles(found)
    source = files.load(path)
    if source is not None:
        parse(Preprocessor(files, []).unit(source, found), found)
        diagnostics.add_source(path, source.text)
    own = [
        each
        for each in found
        if each.location.path == path
        and each.severity is Severity.ERROR
        and each.code != Code.INCLUDE_NOT_FOUND
    ]
    for each in own:
        diagnostics.error(each.code, each.message, each.location, each.notes)
    if source is None or own or _holds_what_is_no_word(source, diagnostics):
        return None
    return format_source(source)


def _holds_what_is_no_word(source: Source, diagnostics: Diagnostics) -> bool:
    """Report text in a branch that no condition chooses, which may be anything."""
    for lexeme in source.lexemes:
        if lexeme.kind is Kind.INVALID or lexeme.kind is Kind.UNTERMINATED:
            line, column = source.position(lexeme.offset)
            place = Location(source.path, line, column)
            if lexeme.text.startswith("/*"):
                diagnostics.error(Code.UNTERMINATED, "this comment has no end", place)
            else:
                message = "a file with such text in an unused branch of #ifdef cannot be laid out"
                diagnostics.error(Code.UNEXPECTED_CHARACTER, message, place)
            return True
    return False


def format_source(source: Source) -> str:
    """Return the text of a file in canonical layout; formatting it again changes nothing.

    The file must be free of syntax errors. Raises FormattingError when words would not survive, which a file
    whose braces stand in several branches of a condition can bring about.
    """
    words = words_of(source)
    text = _Layout(words).text()
    if _essence(words) != _essence(words_of(Source(source.path, text))):
        raise FormattingError(f"{source.path}: cannot be laid out without changing it")
    return text


def _essence(words: Iterable[Word]) -> tuple[list[str], list[str]]:
    """Return what a layout must keep: words in order, and comments in order, whatever their spaces."""
    tokens: list[str] = []
    comments: list[str] = []
    for word in words:
        text = " ".join(word.text.split())
        if word.kind is Kind.COMMENT:
            comments.append(text)
        elif word.kind is Kind.DIRECTIVE:
            tokens.append(_canonical_directive(text))
        elif word.text not in _OPTIONAL:
            tokens.append(word.text)
    return tokens, comments


def _canonical_directive(text: str) -> str:
    """Return a directive with one space behind its name and none before."""
    match = _DIRECTIVE.match(text)
    if match is None or not match["name"]:
        return text
    return f"#{match['name']} {match['rest']}".rstrip()


@dataclass(slots=True)
class _Scope:
    """A body that is open."""

    kind: str
    header: int
    """The index of the line that ends with its brace."""
    plain: bool = True
    """Whether neither a comment nor a directive stands in it, so that it may share the line."""


class _Layout:
    """The lines of a file, made word by word."""

    def __init__(self, words: Sequence[Word]) -> None:
        self._words = words
        self._lines: list[str] = []
        self._scopes: list[_Scope] = []
        self._branches: list[list[_Scope]] = []
        self._statement: list[Word] = []
        self._written: set[int] = set()
        """Indices of words that were written with an earlier one."""
        self._blank_due = False
        self._room_behind = 0
        """The number of lines when nothing keeps a comment from following on the last one."""
        self._group = 0
        """The line at which the comments before the next definition begin."""

    def text(self) -> str:
        """Return the whole file."""
        for index, word in enumerate(self._words):
            if index in self._written:
                continue
            if word.kind is Kind.DIRECTIVE:
                self._directive(word)
            elif word.kind is Kind.COMMENT:
                self._comment(word, index)
            elif self._is_punctuation(word, "{") and self._depth() == 0:
                self._open(word)
            elif self._is_punctuation(word, "}"):
                self._close(word, index)
            elif self._is_punctuation(word, ";") and self._depth() == 0:
                self._end_statement(";", word)
            elif self._is_punctuation(word, ",") and self._in_enumeration() and self._depth() == 0:
                if self._statement:
                    last = self._is_next(index, "}")
                    self._end_statement("" if last else ",", word)
            elif not self._statement and self._begins_file_metadata(index):
                self._file_metadata(index)
            else:
                self._statement.append(word)
        if self._statement:
            self._end_statement("", self._statement[0])
        return "\n".join(self._lines) + "\n" if self._lines else ""

    # What the words say

    @staticmethod
    def _is_punctuation(word: Word, text: str) -> bool:
        return word.kind is Kind.PUNCTUATION and word.text == text

    def _is_next(self, index: int, text: str) -> bool:
        """Return whether the next word, comments left aside, is this punctuation."""
        index += 1
        while index < len(self._words) and self._words[index].kind is Kind.COMMENT:
            index += 1
        return index < len(self._words) and self._is_punctuation(self._words[index], text)

    def _begins_file_metadata(self, index: int) -> bool:
        word = self._words[index]
        return self._is_punctuation(word, "[[") or (
            self._is_punctuation(word, "[") and self._is_next(index, "[")
        )

    def _semicolon_behind(self, index: int) -> int | None:
        """Return the index of the `;` that belongs behind a body, the body's own when it lacks one.

        None stands for a `;` that a directive separates from the body.
        """
        separated = False
        for later in range(index + 1, len(self._words)):
            word = self._words[later]
            if self._is_punctuation(word, ";"):
                return None if separated else later
            if word.kind is not Kind.COMMENT and word.kind is not Kind.DIRECTIVE:
                break
            separated = separated or word.kind is Kind.DIRECTIVE
        return index

    def _depth(self) -> int:
        """Return how many parentheses and brackets of the statement are open."""
        return sum(
            (w.text in "([<") - (w.text in ")]>") for w in self._statement if w.kind is Kind.PUNCTUATION
        )

    def _in_enumeration(self) -> bool:
        return bool(self._scopes) and self._scopes[-1].kind == "enum"

    def _in_module(self) -> bool:
        return not self._scopes or self._scopes[-1].kind == "module"

    @property
    def _indent(self) -> str:
        return _INDENT * len(self._scopes)

    # Lines

    def _emit(self, lines: Sequence[str], first: Word, *, indent: str | None = None) -> None:
        """Append lines, after an empty one when there was one before `first` or one is due."""
        if (first.newlines > 1 or self._blank_due) and self._lines and not self._behind_opening():
            self._blank()
        self._blank_due = False
        prefix = self._indent if indent is None else indent
        self._lines += [prefix + line if line else "" for line in lines]
        self._room_behind = 0 if lines[-1].startswith("//") else len(self._lines)

    def _behind_opening(self) -> bool:
        """Return whether the last line opens a body that has no empty line at its beginning."""
        if not self._scopes or self._scopes[-1].header != len(self._lines) - 1:
            return False
        return self._scopes[-1].kind != "module"

    def _blank(self) -> None:
        if self._lines and self._lines[-1]:
            self._lines.append("")

    def _append_comment(self, word: Word) -> None:
        """Put a comment behind the last line."""
        first, *others = comment_lines(word)
        self._lines[-1] += f" {first}"
        self._lines += [self._indent + line if line else "" for line in others]
        self._room_behind = 0 if first.startswith("//") else len(self._lines)

    def _spoil(self) -> None:
        """Keep the bodies around from sharing a line."""
        for scope in self._scopes:
            scope.plain = False

    # Words

    def _directive(self, word: Word) -> None:
        if self._statement:
            self._end_statement("", self._statement[0])
        self._spoil()
        text = _canonical_directive("\n".join(line.rstrip() for line in word.text.strip().split("\n")))
        match = _DIRECTIVE.match(text)
        name = match["name"] if match else ""
        if name in {"ifdef", "ifndef"}:
            self._branches.append([replace(scope) for scope in self._scopes])
        elif name == "else" and self._branches:
            self._scopes = [replace(scope) for scope in self._branches[-1]]
        elif name == "endif" and self._branches:
            self._branches.pop()
        self._emit(text.split("\n"), word, indent="")
        self._group = len(self._lines)

    def _comment(self, word: Word, index: int) -> None:
        if self._statement:
            self._statement.append(word)
            return
        self._spoil()
        if word.newlines == 0 and index and self._room_behind == len(self._lines):
            self._append_comment(word)
            return
        if not self._lines or word.newlines > 1 or self._blank_due:
            self._emit(comment_lines(word), word)
            self._group = len(self._lines) - len(comment_lines(word))
        else:
            follows_comment = self._words[index - 1].kind is Kind.COMMENT
            if not follows_comment or self._words[index - 1].newlines == 0:
                self._group = len(self._lines)
            self._emit(comment_lines(word), word)

    def _file_metadata(self, index: int) -> None:
        """Put `[["..."]]` on its own line."""
        end, depth = index, 0
        for end in range(index, len(self._words)):
            word = self._words[end]
            if word.kind is Kind.PUNCTUATION:
                depth += word.text.count("[") - word.text.count("]")
            if depth == 0:
                break
        lines = statement_lines(self._words[index : end + 1], "", len(self._indent))
        self._emit(lines, self._words[index])
        self._group = len(self._lines)
        self._written.update(range(index, end + 1))

    def _end_statement(self, ending: str, word: Word) -> None:
        """Write the statement read so far; comments at its end come behind its last punctuation."""
        words, behind = self._take_statement()
        lines = statement_lines(words, ending, len(self._indent)) if words else [ending]
        self._emit(lines, words[0] if words else word)
        self._group = len(self._lines)
        self._comments_behind(behind)

    def _take_statement(self) -> tuple[list[Word], list[Word]]:
        """Return the words of the statement, and the comments at its end that no code can follow."""
        words, self._statement = self._statement, []
        if any(word.kind is Kind.COMMENT and not is_inline(word) for word in words):
            self._spoil()
        end = len(words)
        while end and words[end - 1].kind is Kind.COMMENT and not is_inline(words[end - 1]):
            end -= 1
        return words[:end], words[end:]

    def _comments_behind(self, comments: Sequence[Word]) -> None:
        """Write the comments that stood before the punctuation at the end of a statement."""
        if comments:
            self._spoil()
        for comment in comments:
            if comment.newlines == 0:
                self._append_comment(comment)
            else:
                self._emit(comment_lines(comment), comment)

    def _open(self, brace: Word) -> None:
        kinds = [word.text for word in self._statement if word.kind is Kind.KEYWORD and word.text in _BODIES]
        kind = kinds[0] if kinds else ""
        if self._in_module() and self._lines:
            before = self._lines[self._group - 1] if self._group else ""
            among_directives = bool(self._scopes) and before.startswith("#")
            opening = bool(self._scopes) and self._group - 1 == self._scopes[-1].header
            if self._group == len(self._lines):
                self._blank_due = self._blank_due or not among_directives
            elif before and self._lines[self._group] and not among_directives and not opening:
                self._lines.insert(self._group, "")
        header, behind = self._take_statement()
        lines = statement_lines(header, " {", len(self._indent)) if header else ["{"]
        self._emit(lines, header[0] if header else brace)
        self._scopes.append(_Scope(kind, len(self._lines) - 1))
        self._group = len(self._lines)
        self._blank_due = kind == "module"
        self._comments_behind(behind)

    def _close(self, brace: Word, index: int) -> None:
        if self._statement:
            self._end_statement("", self._statement[0])
        scope = self._scopes.pop() if self._scopes else _Scope("", -1, plain=False)
        semicolon = self._semicolon_behind(index)
        ending = "}" if semicolon is None else "};"
        inner = self._lines[scope.header + 1 :]
        joined = " ".join(line.strip() for line in inner if line)
        if scope.plain and scope.kind == "enum" and joined:
            whole = f"{self._lines[scope.header]} {joined} {ending}"
        elif scope.plain and scope.header >= 0 and not joined:
            whole = f"{self._lines[scope.header]}{ending}"
        else:
            whole = ""
        if whole and len(whole) <= WIDTH:
            self._lines[scope.header :] = [whole]
            self._room_behind = len(self._lines)
        else:
            self._blank_due = scope.kind == "module"
            while self._lines and not self._lines[-1]:
                self._lines.pop()
            self._emit([ending], replace(brace, newlines=1))
        self._blank_due = self._in_module()
        self._group = len(self._lines)
        if semicolon is not None:
            self._written.add(semicolon)
