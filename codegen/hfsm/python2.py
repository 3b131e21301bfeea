"""Find the Python 2 in the code of old documents, and mend it where nothing else is wrong.

Python 3 cannot parse Python 2, and its own tokenizer refuses some of it, so that the code is cut into words
here. Every rule looks at words and proposes edits; what no rule speaks of stays as it is, byte for byte.
"""

from __future__ import annotations

import ast
import re
import textwrap
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise, takewhile
from typing import Final

__all__ = ["Finding", "find_python2", "is_python", "mend"]


@dataclass(frozen=True, slots=True, order=True)
class Finding:
    """Something of Python 2; `line` and `column` count from 1 in the code."""

    line: int
    column: int
    message: str


@dataclass(frozen=True, slots=True)
class _Word:
    """A word of the code: `kind` is name, number, string, operator, newline (of a statement) or end."""

    kind: str
    text: str
    start: int
    depth: int = 0
    """How many brackets are open around it."""

    @property
    def end(self) -> int:
        return self.start + len(self.text)


@dataclass(frozen=True, slots=True)
class _Edit:
    """Text to put in the place of what stands from `start` to `end`."""

    start: int
    end: int
    text: str


@dataclass(frozen=True, slots=True)
class _Match:
    """A place where a rule found something; without edits it has to be mended by hand."""

    start: int
    message: str
    edits: tuple[_Edit, ...] = ()


_Rule = Callable[[str, Sequence[_Word]], Iterator[_Match]]

_MAX_ROUNDS: Final = 50
"""How deep what a rule finds may be nested in what it finds."""

_LEXEMES: Final = re.compile(
    r"""(?P<blank>[^\S\n]+|\\\r?\n)
      | (?P<comment>\#[^\n]*)
      | (?P<newline>\n)
      | (?P<string>(?:[uUbBrRfF]{0,2})(?:
            '''(?:\\.|[^\\])*?''' | \"\"\"(?:\\.|[^\\])*?\"\"\"
          | '(?:\\.|[^'\\\n])*' | "(?:\\.|[^"\\\n])*"))
      | (?P<number>0[xX][\da-fA-F_]+[lL]?|0[bBoO][\d_]+[lL]?
          |(?:\d[\d_]*\.?[\d_]*|\.\d[\d_]*)(?:[eE][+-]?\d+)?[jJlL]?)
      | (?P<name>[^\W\d]\w*)
      | (?P<operator><>|\*\*=?|//=?|>>=?|<<=?|->|:=|[-+*/%@&|^=<>!]=|[^\w\s])""",
    re.VERBOSE | re.DOTALL,
)
_COMPOUND: Final = frozenset(
    ("if", "elif", "else", "for", "while", "try", "except", "finally", "with", "def", "class")
)
_RENAMED: Final = {
    "xrange": "range",
    "unicode": "str",
    "basestring": "str",
    "unichr": "chr",
    "raw_input": "input",
    "long": "int",
}
_RENAMED_METHODS: Final = {"iteritems": "items", "itervalues": "values", "iterkeys": "keys"}
_RENAMED_MODULES: Final = {
    "ConfigParser": "configparser",
    "Queue": "queue",
    "StringIO": "io",
    "Tkinter": "tkinter",
    "cPickle": "pickle",
    "cStringIO": "io",
    "commands": "subprocess",
    "thread": "_thread",
    "urllib2": "urllib.request",
}
# What `print (x)` may be followed by only in Python 2, where the parentheses belong to the value.
_GOES_ON: Final = frozenset(("%", "+", "*", ".", ",", "["))


def find_python2(code: str) -> tuple[Finding, ...]:
    """Return what in a piece of code is Python 2, in the order of its lines.

    Code that is no Python of any age, such as C++, has nothing of the kind: an empty result does not mean
    that the code is valid.
    """
    words = _words(code)
    found = [match for rule in _RULES for match in rule(code, words)]
    findings = {Finding(*_place(code, match.start), match.message) for match in found}
    return tuple(sorted(findings))


def mend(code: str) -> str | None:
    """Return a piece of code as Python 3, or None when that takes more than the mending of Python 2.

    What has nothing of Python 2 in it comes back as it is.
    """
    mended = code
    for rule in _RULES:
        for _ in range(_MAX_ROUNDS):
            matches = list(rule(mended, _words(mended)))
            if any(not match.edits for match in matches):
                return None
            if not matches:
                break
            mended = _edited(mended, matches)
        else:
            return None
    return mended if is_python(mended) else None


def is_python(code: str) -> bool:
    """Return whether a piece of code is valid Python 3: statements, or an expression that may span lines."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for source in (textwrap.dedent(code).strip("\r\n"), f"(\n{code}\n)"):
            try:
                ast.parse(source)
            except (SyntaxError, ValueError, RecursionError, MemoryError):
                continue
            return True
    return False


def _edited(code: str, matches: Sequence[_Match]) -> str:
    """Return the code with all edits that are not inside one another, so that those come next."""
    start = len(code)
    for match in sorted(matches, key=lambda match: match.start, reverse=True):
        edits = sorted(match.edits, key=lambda edit: edit.start, reverse=True)
        if edits[0].end > start:
            continue
        for edit in edits:
            code = code[: edit.start] + edit.text + code[edit.end :]
        start = edits[-1].start
    return code


def _place(code: str, offset: int) -> tuple[int, int]:
    before = code[:offset]
    return before.count("\n") + 1, offset - (before.rfind("\n") + 1) + 1


# Words


def _words(code: str) -> list[_Word]:
    """Cut code into words without blanks and comments; line ends inside brackets are no words."""
    words: list[_Word] = []
    depth = 0
    for found in _LEXEMES.finditer(code):
        kind, text = str(found.lastgroup), found.group()
        if kind in ("blank", "comment") or (kind == "newline" and depth):
            continue
        if text in ("(", "[", "{"):
            words.append(_Word(kind, text, found.start(), depth))
            depth += 1
            continue
        if text in (")", "]", "}"):
            depth = max(0, depth - 1)
        words.append(_Word(kind, text, found.start(), depth))
    words.append(_Word("end", "", len(code)))
    return words


def _statements(words: Sequence[_Word]) -> Iterator[Sequence[_Word]]:
    """Yield the words of each simple statement, and those of each head of a compound one."""
    start = 0
    in_head = False
    lambdas = 0
    for index, word in enumerate(words):
        if index == start:
            in_head, lambdas = word.text in _COMPOUND, 0
        lambdas += word.text == "lambda" and word.depth == 0
        ends = word.kind in ("newline", "end") or (word.text == ";" and word.depth == 0)
        if word.text == ":" and word.depth == 0 and in_head:
            ends = ends or not lambdas
            lambdas -= bool(lambdas)
        if ends:
            if index > start:
                yield words[start:index]
            start = index + 1


def _split_at_commas(words: Sequence[_Word], depth: int) -> list[Sequence[_Word]]:
    """Return the words between the commas at one depth."""
    parts: list[Sequence[_Word]] = []
    start = 0
    for index, word in enumerate(words):
        if word.text == "," and word.depth == depth:
            parts.append(words[start:index])
            start = index + 1
    return [*parts, words[start:]]


def _text(code: str, words: Sequence[_Word]) -> str:
    return code[words[0].start : words[-1].end] if words else ""


def _closing(words: Sequence[_Word], opening: int) -> int | None:
    """Return the index of the bracket that closes the one at an index."""
    depth = words[opening].depth
    for index in range(opening + 1, len(words)):
        if words[index].text in (")", "]", "}") and words[index].depth == depth:
            return index
    return None


# Rules


def _prints(code: str, words: Sequence[_Word]) -> Iterator[_Match]:
    for statement in _statements(words):
        head = statement[0]
        if (head.kind, head.text) != ("name", "print") or not _is_print_statement(statement):
            continue
        yield _Match(head.start, "`print` is a function in Python 3", _print_edits(code, statement))


def _is_print_statement(statement: Sequence[_Word]) -> bool:
    if len(statement) == 1:
        return True
    follower = statement[1]
    if follower.text == "(":
        closing = _closing(statement, 1)
        return (
            closing is not None and closing + 1 < len(statement) and statement[closing + 1].text in _GOES_ON
        )
    if follower.text == "not":
        return len(statement) > 2 and statement[2].text != "in"
    if follower.kind in ("name", "number", "string"):
        return follower.text not in ("in", "is", "and", "or", "if")
    return follower.text in (">>", "[", "{", "-", "+", "~", "`")


def _print_edits(code: str, statement: Sequence[_Word]) -> tuple[_Edit, ...]:
    head, values = statement[0], list(statement[1:])
    if not values:
        return (_Edit(head.end, head.end, "()"),)
    options: list[str] = []
    edits: list[_Edit] = []
    start = values[0].start
    if values[0].text == ">>":
        target, *rest = _split_at_commas(values[1:], 0)
        if not target:
            return ()
        options.append(f"file={_text(code, target)}")
        values = [word for part in rest for word in part] and list(values[len(target) + 2 :])
        start = values[0].start if values else target[-1].end
    if values and values[-1].text == ",":
        options.append('end=" "')
        values.pop()
    end = values[-1].end if values else statement[-1].end
    edits.append(_Edit(head.end, start, "("))
    inner = code[start:end] if values else ""
    tail = ", ".join(options)
    separator = ", " if values and options else ""
    edits.append(_Edit(start, statement[-1].end, f"{inner}{separator}{tail})"))
    return tuple(edits)


def _excepts(_code: str, words: Sequence[_Word]) -> Iterator[_Match]:
    for statement in _statements(words):
        parts = _split_at_commas(statement[1:], 0)
        if statement[0].text == "except" and len(parts) == 2 and all(parts):
            comma = parts[0][-1].end
            message = "`except X, e` is `except X as e` in Python 3"
            yield _Match(statement[0].start, message, (_Edit(comma, parts[1][0].start, " as "),))


def _raises(code: str, words: Sequence[_Word]) -> Iterator[_Match]:
    for statement in _statements(words):
        parts = _split_at_commas(statement[1:], 0)
        if statement[0].text != "raise" or len(parts) not in (2, 3) or not all(parts):
            continue
        kind, value, *trace = (_text(code, part) for part in parts)
        is_group = parts[1][0].text == "(" and _closing(parts[1], 0) == len(parts[1]) - 1
        call = kind + (value if is_group else f"({value})")
        if trace:
            call += f".with_traceback({trace[0]})"
        edit = _Edit(parts[0][0].start, statement[-1].end, call)
        yield _Match(statement[0].start, "`raise X, value` is `raise X(value)` in Python 3", (edit,))


def _execs(code: str, words: Sequence[_Word]) -> Iterator[_Match]:
    for statement in _statements(words):
        head, values = statement[0], statement[1:]
        if head.text != "exec" or not values:
            continue
        split = next((i for i, word in enumerate(values) if word.text == "in" and word.depth == 0), None)
        if values[0].kind != "string" and (values[0].kind != "name" or split == 0):
            closing = _closing(values, 0) if values[0].text == "(" else None
            if closing is None or split != closing + 1:
                continue
        source = _text(code, values[:split])
        scopes = "" if split is None else f", {_text(code, values[split + 1 :])}"
        edits = (_Edit(head.end, statement[-1].end, f"({source}{scopes})"),)
        yield _Match(head.start, "`exec` is a function in Python 3", edits)


def _backquotes(_code: str, words: Sequence[_Word]) -> Iterator[_Match]:
    quotes = [word for word in words if word.text == "`"]
    for opening, closing in zip(quotes[::2], quotes[1::2], strict=False):
        edits = (_Edit(opening.start, opening.end, "repr("), _Edit(closing.start, closing.end, ")"))
        yield _Match(opening.start, "`` `x` `` is `repr(x)` in Python 3", edits)


def _operators(_code: str, words: Sequence[_Word]) -> Iterator[_Match]:
    for word in words:
        if word.text == "<>":
            edits = (_Edit(word.start, word.end, "!="),)
            yield _Match(word.start, "`<>` is `!=` in Python 3", edits)


def _numbers(_code: str, words: Sequence[_Word]) -> Iterator[_Match]:
    for word in words:
        if word.kind != "number":
            continue
        digits = word.text.rstrip("lL")
        if re.fullmatch(r"0\d*[1-9]\d*", digits):
            if not set(digits) <= set("01234567"):
                continue
            digits = f"0o{digits[1:]}"
        if digits != word.text:
            message = f"the number `{word.text}` is `{digits}` in Python 3"
            yield _Match(word.start, message, (_Edit(word.start, word.end, digits),))


def _strings(_code: str, words: Sequence[_Word]) -> Iterator[_Match]:
    for word in words:
        prefix = word.text[: len(word.text) - len(word.text.lstrip("uUbBrRfF"))]
        if word.kind != "string" or prefix.lower() != "ur":
            continue
        message = "a string cannot begin with `ur` in Python 3"
        edits = (_Edit(word.start, word.start + 1, ""),)
        # Only Python 2 puts characters in the place of escapes there.
        yield _Match(word.start, message, () if re.search(r"\\[uU]", word.text) else edits)


def _names(_code: str, words: Sequence[_Word]) -> Iterator[_Match]:
    bound = set(_bound_names(words))
    for before, word, after in zip([_Word("end", "", 0), *words], words, words[1:], strict=False):
        if word.kind != "name" or after.text == "=":
            continue
        if before.text == ".":
            new = _RENAMED_METHODS.get(word.text) if after.text == "(" else None
        else:
            new = None if word.text in bound else _RENAMED.get(word.text)
        if new:
            message = f"`{word.text}` is `{new}` in Python 3"
            yield _Match(word.start, message, (_Edit(word.start, word.end, new),))


def _modules(_code: str, words: Sequence[_Word]) -> Iterator[_Match]:
    for statement in _statements(words):
        if statement[0].text not in ("import", "from") or len(statement) < 2:
            continue
        module = statement[1]
        new = _RENAMED_MODULES.get(module.text)
        if new is None or (len(statement) > 2 and statement[2].text == "."):
            continue
        plain = statement[0].text == "import" and (len(statement) == 2 or statement[2].text != "as")
        edit = _Edit(module.start, module.end, f"{new} as {module.text}" if plain else new)
        yield _Match(module.start, f"the module `{module.text}` is `{new}` in Python 3", (edit,))


def _bound_names(words: Sequence[_Word]) -> Iterator[str]:
    """Yield names that the code seems to give a meaning of its own."""
    introducing = ("def", "class", "as", "import", "global", "lambda")
    for index, (word, after) in enumerate(pairwise(words)):
        if word.kind == "name" and (after.text == "=" or (index and words[index - 1].text in introducing)):
            yield word.text
        if word.text == "for":
            yield from (each.text for each in takewhile(lambda each: each.text != "in", words[index + 1 :]))
        if word.text == "def" and index + 2 < len(words):
            closing = _closing(words, index + 2) or index
            yield from (each.text for each in words[index + 2 : closing])


def _has_keys(code: str, words: Sequence[_Word]) -> Iterator[_Match]:
    for index, word in enumerate(words[:-1]):
        if word.text != "has_key" or words[index + 1].text != "(" or words[index - 1].text != ".":
            continue
        closing = _closing(words, index + 1)
        start = _start_of_primary(words, index - 1)
        message = "`d.has_key(k)` is `k in d` in Python 3"
        if closing is None or start is None:
            yield _Match(word.start, message)
            continue
        key = code[words[index + 1].end : words[closing].start].strip()
        owner = code[words[start].start : words[index - 1].start]
        edit = _Edit(words[start].start, words[closing].end, f"({key} in {owner})")
        yield _Match(word.start, message, (edit,))


def _start_of_primary(words: Sequence[_Word], dot: int) -> int | None:
    """Return the index of the first word of what stands before a dot: `a.b(c)[d]`."""
    index = dot - 1
    while index >= 0:
        word = words[index]
        if word.text in (")", "]"):
            opening = (i for i in range(index - 1, -1, -1) if words[i].depth == word.depth)
            index = next((i for i in opening if words[i].text in ("(", "[")), -1)
            before = words[index - 1] if index > 0 else None
            if before is None or (before.kind != "name" and before.text not in (")", "]")):
                return index if index >= 0 else None
            index -= 1
        elif word.kind not in ("name", "string"):
            return None
        elif index > 1 and words[index - 1].text == ".":
            index -= 2
        else:
            return index
    return None


def _tabs(code: str, words: Sequence[_Word]) -> Iterator[_Match]:
    """Tell of tabs that stand for eight columns, as Python 2 had it, where Python 3 sees no order."""
    if "\t" not in code or not _mixes_tabs(code):
        return
    for word, before in zip(words, [_Word("newline", "", 0), *words], strict=False):
        if before.kind != "newline" or word.kind in ("newline", "end"):
            continue
        start = code.rfind("\n", 0, word.start) + 1
        margin = code[start : word.start]
        if "\t" in margin and not margin.strip():
            edits = (_Edit(start, word.start, margin.expandtabs(8)),)
            yield _Match(start, "tabs and spaces are mixed in the indentation", edits)


def _mixes_tabs(code: str) -> bool:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            ast.parse(code.strip("\r\n"))
    except TabError:
        return True
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return False
    return False


_RULES: Final[tuple[_Rule, ...]] = (
    *(_operators, _numbers, _strings, _backquotes, _excepts, _raises, _execs, _prints),
    *(_has_keys, _names, _modules, _tabs),
)
