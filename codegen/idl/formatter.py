"""Lay out a Slice file in the canonical way: same words, same comments, one set of spaces and lines.

Two spaces a level, a member or an operation a line, an empty line around definitions with a body, `};` behind
a body, at most one empty line in a row. Comments and preprocessor directives stay where they are.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from codegen.diagnostics import Diagnostics, Location, Severity

from .codes import Code
from .lexer import Kind, Source
from .parser import parse
from .preprocessor import Preprocessor

__all__ = ["FormattingError", "format_file", "format_source", "words_of"]

_WIDTH = 110  # characters of a line, comments left aside
_INDENT = "  "
_DEEPER = "    "
_CLAUSES = frozenset({"throws", "extends", "implements"})
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
    preprocessor = Preprocessor([], found)
    source = preprocessor.load(path)
    if source is not None:
        parse(preprocessor.unit(source, found), found)
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


# Words and comments


@dataclass(slots=True)
class Word:
    """A token, a comment or a directive, with the number of line breaks before it."""

    kind: Kind
    text: str
    newlines: int


def words_of(source: Source) -> list[Word]:
    """Return everything in a file but its spaces."""
    words: list[Word] = []
    newlines = 0
    for lexeme in source.lexemes:
        if lexeme.kind is Kind.SPACE:
            newlines = lexeme.text.count("\n")
        else:
            words.append(Word(lexeme.kind, lexeme.text, newlines))
            newlines = 0
    return words


def _is_inline(word: Word) -> bool:
    """Return whether code can follow on the line of a comment."""
    return word.text.startswith("/*") and "\n" not in word.text


def _comment_lines(word: Word) -> list[str]:
    """Return the lines of a comment, the first at the margin and the others below it.

    Lines that begin with a star have it below the first; others keep their indentation among themselves.
    """
    first, *others = (line.expandtabs(4).rstrip() for line in word.text.split("\n"))
    if all(line.lstrip().startswith("*") for line in others if line):
        return [first, *(f" {line.lstrip()}" if line else "" for line in others)]
    closing = [" */"] if others[-1].strip() == "*/" else []
    inner = textwrap.dedent("\n".join(others[: len(others) - len(closing)])).split("\n")
    return [first, *(f"   {line}" if line else "" for line in inner), *closing]


# The file


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
        first, *others = _comment_lines(word)
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
            self._emit(_comment_lines(word), word)
            self._group = len(self._lines) - len(_comment_lines(word))
        else:
            follows_comment = self._words[index - 1].kind is Kind.COMMENT
            if not follows_comment or self._words[index - 1].newlines == 0:
                self._group = len(self._lines)
            self._emit(_comment_lines(word), word)

    def _file_metadata(self, index: int) -> None:
        """Put `[["..."]]` on its own line."""
        end, depth = index, 0
        for end in range(index, len(self._words)):
            word = self._words[end]
            if word.kind is Kind.PUNCTUATION:
                depth += word.text.count("[") - word.text.count("]")
            if depth == 0:
                break
        lines = _statement_lines(self._words[index : end + 1], "", len(self._indent))
        self._emit(lines, self._words[index])
        self._group = len(self._lines)
        self._written.update(range(index, end + 1))

    def _end_statement(self, ending: str, word: Word) -> None:
        """Write the statement read so far; comments at its end come behind its last punctuation."""
        words, behind = self._take_statement()
        lines = _statement_lines(words, ending, len(self._indent)) if words else [ending]
        self._emit(lines, words[0] if words else word)
        self._group = len(self._lines)
        self._comments_behind(behind)

    def _take_statement(self) -> tuple[list[Word], list[Word]]:
        """Return the words of the statement, and the comments at its end that no code can follow."""
        words, self._statement = self._statement, []
        if any(word.kind is Kind.COMMENT and not _is_inline(word) for word in words):
            self._spoil()
        end = len(words)
        while end and words[end - 1].kind is Kind.COMMENT and not _is_inline(words[end - 1]):
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
                self._emit(_comment_lines(comment), comment)

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
        lines = _statement_lines(header, " {", len(self._indent)) if header else ["{"]
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
        if whole and len(whole) <= _WIDTH:
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


# One statement: on one line when it fits, else broken at its clauses and parameters


def _one_line(words: Sequence[Word]) -> str:
    """Return words with one set of spaces between them."""
    text = ""
    for index, word in enumerate(words):
        text += (_gap(words[index - 1], word) if index else "") + word.text
    return text


def _statement_lines(words: Sequence[Word], ending: str, indent: int) -> list[str]:
    """Return the lines of a statement with its `ending`, without the `indent` characters before each."""
    plain = all(word.kind is not Kind.COMMENT or _is_inline(word) for word in words)
    if plain:
        line = _one_line(words) + ending
        if indent + len(line) <= _WIDTH:
            return [line]
    lines: list[str] = []
    for breaks in _ways_to_break(words, plain=plain):
        lines = _flow(words, breaks)
        lines[-1] += ending
        if all(indent + _code_length(line) <= _WIDTH for line in lines):
            break
    return lines


def _gap(before: Word, after: Word) -> str:
    """Return the space between two words."""
    if before.kind is Kind.PUNCTUATION and before.text in {"(", "[", "[[", "<", "::"}:
        return ""
    if after.kind is Kind.PUNCTUATION:
        if after.text in {",", ";", ")", "]", "]]", ">", "(", "<", "*"}:
            return ""
        if after.text == "::":
            return "" if before.kind is Kind.NAME else " "
    return " "


def _ways_to_break(words: Sequence[Word], *, plain: bool) -> Iterator[dict[int, str]]:
    """Yield, from the mildest on, where lines may begin and with what indentation."""
    depths = list(_depths(words))
    clauses = {
        index: _INDENT for index, word in enumerate(words) if index and _begins_clause(word, depths[index])
    }
    commas = {
        index + 1: _DEEPER
        for index, word in enumerate(words)
        if word.text == "," and depths[index] == 0 and clauses and index > min(clauses)
    }
    parameters = _parameter_breaks(words, depths)
    if plain or not parameters:
        yield clauses
        yield {**clauses, **commas}
    if parameters:
        yield parameters
        yield {**parameters, **clauses, **commas}


def _depths(words: Sequence[Word]) -> Iterator[int]:
    """Yield for each word how many parentheses are open around it."""
    depth = 0
    for word in words:
        if word.kind is Kind.PUNCTUATION and word.text == ")":
            depth -= 1
        yield depth
        if word.kind is Kind.PUNCTUATION and word.text == "(":
            depth += 1


def _begins_clause(word: Word, depth: int) -> bool:
    named = word.kind is Kind.KEYWORD and word.text in _CLAUSES
    return depth == 0 and (named or (word.kind is Kind.PUNCTUATION and word.text == ":"))


def _parameter_breaks(words: Sequence[Word], depths: Sequence[int]) -> dict[int, str]:
    """Return the breaks that put each parameter of an operation on its own line."""
    opening = max(
        (
            i
            for i, word in enumerate(words)
            if word.text == "(" and depths[i] == 0 and _names_operation(words, i)
        ),
        default=None,
    )
    if opening is None:
        return {}
    closing = next((i for i in range(opening + 1, len(words)) if depths[i] == 0), len(words))
    if closing == opening + 1:
        return {}
    breaks = {opening + 1: _INDENT}
    breaks.update(
        (i + 1, _INDENT) for i in range(opening, closing) if words[i].text == "," and depths[i] == 1
    )
    breaks[closing] = ""
    for index in [index for index in breaks if index < closing and _stays_behind(words, index)]:
        breaks.setdefault(index + 1, breaks.pop(index))
    return breaks


def _names_operation(words: Sequence[Word], opening: int) -> bool:
    before = next((word for word in reversed(words[:opening]) if word.kind is not Kind.COMMENT), None)
    return before is not None and before.text not in {"optional", "tag"}


def _stays_behind(words: Sequence[Word], index: int) -> bool:
    """Return whether a comment that follows a comma belongs to the parameter before it."""
    word = words[index]
    if word.kind is not Kind.COMMENT or word.newlines:
        return False
    ends_line = index + 1 < len(words) and words[index + 1].newlines > 0
    return ends_line or not _is_inline(word) or word.text.startswith("/**<")


def _flow(words: Sequence[Word], breaks: dict[int, str]) -> list[str]:
    """Return the words in lines that begin at `breaks` and behind comments that end a line."""
    lines = [""]
    prefix: str | None = None
    inner = _INDENT
    for index, word in enumerate(words):
        inner = breaks.get(index) or inner
        if index in breaks:
            prefix = breaks[index]
        lines_of_word = _comment_lines(word) if word.kind is Kind.COMMENT else [word.text]
        ends_line = word.kind is Kind.COMMENT and not _is_inline(word)
        if ends_line and word.newlines and index:
            prefix = inner
        if prefix is not None and lines[-1].strip():
            lines.append(prefix)
        elif index and lines[-1].strip():
            lines[-1] += _gap(words[index - 1], word)
        prefix = inner if ends_line else None
        lines[-1] += lines_of_word[0]
        lines += [inner + line if line else "" for line in lines_of_word[1:]]
    return lines


def _code_length(line: str) -> int:
    """Return the length of a line without the comment at its end."""
    for mark in ("//", "/*"):
        line = line.partition(mark)[0]
    return len(line.rstrip())
