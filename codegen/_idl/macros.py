"""Macros: what `#define` gives a name, the replacement of its uses, and the conditions of `#if`.

A macro is text, so its words are those of C, with spaces between them. The result of a replacement becomes
tokens of Slice again, at the place of the use.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from .conditions import evaluate
from .lexer import Kind, Source, Token

# The reference compiler also defines these: files can have parts for one language or version.
_PREDEFINED = {"ICE_VERSION": "30711", "__ICE_VERSION__": "30711", "__SLICE2PY__": "1"}
# Limits macros that grow with each replacement.
_MOST_WORDS = 1_000_000
_DEEPEST_REPLACEMENT = 100

_WORD = re.compile(
    r"""
      \s+ | "(?:[^"\\]|\\.)*" | \\?[A-Za-z_]\w* | \d\w*
    | :: | \[\[ | \]\] | && | \|\| | << | >> | [=!<>]= | .
    """,
    re.VERBOSE | re.DOTALL | re.ASCII,
)
_DEFINITION = re.compile(
    r"(?P<name>[A-Za-z_]\w*)(?:\((?P<parameters>[^()]*)\))?(?P<body>.*)", re.DOTALL | re.ASCII
)
_NAME = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_DEFINED = re.compile(r"\bdefined\s*(?:\(\s*([A-Za-z_]\w*)\s*\)|([A-Za-z_]\w*))", re.ASCII)


class MacroError(Exception):
    """A macro cannot be defined or replaced; the message says why."""


class MacroGrowthError(MacroError):
    """Macros grow beyond all limits when they are replaced: the rest of the file cannot be read."""


@dataclass(frozen=True, slots=True)
class _Macro:
    body: list[str]
    parameters: tuple[str, ...] | None = None
    """None for a macro that is used without parentheses."""


class Macros:
    """The macros that are defined at one point of a translation unit."""

    def __init__(self) -> None:
        self._macros = {name: _Macro([value]) for name, value in _PREDEFINED.items()}
        self._words_left = _MOST_WORDS

    def __contains__(self, name: str) -> bool:
        return name in self._macros

    def define(self, definition: str) -> None:
        """Define `NAME body` or `NAME(parameters) body`, without comments. Raises MacroError."""
        match = _DEFINITION.fullmatch(definition)
        if match is None:
            raise MacroError("#define needs a name")
        name, body = match["name"], match["body"]
        if name == "defined":
            raise MacroError("`defined` cannot be the name of a macro")
        if body.startswith("("):
            raise MacroError(f"the parameters of `{name}` are not names in parentheses")
        words = _WORD.findall(body.strip())
        if "#" in words:
            raise MacroError("`#` and `##` are not supported in the body of a macro")
        parameters = match["parameters"]
        self._macros[name] = _Macro(words, None if parameters is None else _parameters(parameters))

    def undefine(self, name: str) -> None:
        """Remove a macro, if there is one with this name."""
        self._macros.pop(name, None)

    def replace(self, tokens: Sequence[Token], index: int) -> tuple[list[Token], int]:
        """Return the tokens that replace the use of a macro at `index`, and the index after the use.

        Raises MacroError for wrong arguments, and MacroGrowthError.
        """
        use = tokens[index]
        end = index + 1
        if self._macros[use.text].parameters is not None and tokens[end].text == "(":
            end = _end_of_arguments(tokens, end)
        words = [use.text]
        for token in tokens[index + 1 : end]:
            words += [" ", f"\\{token.text}" if token.escaped else token.text]
        text = "".join(self._replaced(words, frozenset()))
        made = [_moved(token, use) for token in Source(use.source.path, text).tokens[:-1]]
        if made:
            made[0].doc = use.doc
            made[-1].trailing_doc = tokens[end - 1].trailing_doc
        return made, end

    def holds(self, condition: str) -> bool:
        """Return whether the condition of an `#if` holds. Raises MacroError and ConditionError."""
        condition = _DEFINED.sub(lambda match: f" {int((match[1] or match[2]) in self._macros)} ", condition)
        words = _WORD.findall(condition)
        if "defined" in words:
            raise MacroError("`defined` needs a name")
        return evaluate([word for word in self._replaced(words, frozenset()) if not word.isspace()])

    # Words

    def _replaced(self, words: Sequence[str], hidden: frozenset[str]) -> list[str]:
        """Return words with all macros replaced, except those in `hidden`, which are being replaced."""
        result: list[str] = []
        index = 0
        while index < len(words):
            word = words[index]
            index += 1
            macro = None if word in hidden else self._macros.get(word)
            arguments: list[list[str]] = []
            if macro is not None and macro.parameters is not None:
                opening = next((i for i in range(index, len(words)) if not words[i].isspace()), len(words))
                if words[opening : opening + 1] == ["("]:
                    arguments, index = _arguments(words, opening, word)
                else:
                    macro = None
            result += [word] if macro is None else self._replacement(word, macro, arguments, hidden)
        self._spend(len(result))
        return result

    def _replacement(
        self, name: str, macro: _Macro, arguments: list[list[str]], hidden: frozenset[str]
    ) -> list[str]:
        parameters = macro.parameters or ()
        if len(arguments) != len(parameters) and (parameters or arguments != [[]]):
            count = f"{len(parameters)} argument{'s' if len(parameters) != 1 else ''}"
            raise MacroError(f"macro `{name}` takes {count}, not {len(arguments)}")
        if len(hidden) == _DEEPEST_REPLACEMENT:
            raise MacroGrowthError("macros are nested too deeply")
        values = {
            parameter: self._replaced(argument, hidden)
            for parameter, argument in zip(parameters, arguments, strict=False)
        }
        body = [part for word in macro.body for part in values.get(word, [word])]
        self._spend(len(body))
        return [" ", *self._replaced(body, hidden | {name}), " "]

    def _spend(self, words: int) -> None:
        self._words_left -= words
        if self._words_left < 0:
            raise MacroGrowthError("the file is too large after its macros are replaced")


def _parameters(text: str) -> tuple[str, ...]:
    names = [part.strip() for part in text.split(",")] if text.strip() else []
    for number, name in enumerate(names):
        if not _NAME.fullmatch(name):
            raise MacroError(f"`{name[:20]}` is not the name of a parameter")
        if name in names[:number]:
            raise MacroError(f"two parameters have the name `{name[:20]}`")
    return tuple(names)


def _end_of_arguments(tokens: Sequence[Token], opening: int) -> int:
    """Return the index after the parenthesis that closes the one at `opening`."""
    depth = 0
    for index in range(opening, len(tokens)):
        token = tokens[index]
        if token.kind in {Kind.END, Kind.DIRECTIVE}:
            break
        depth += (token.text == "(") - (token.text == ")")
        if depth == 0:
            return index + 1
    raise MacroError(f"the arguments of macro `{tokens[opening - 1].text}` have no end")


def _arguments(words: Sequence[str], opening: int, name: str) -> tuple[list[list[str]], int]:
    """Return the arguments in parentheses, without spaces around them, and the index after them."""
    arguments: list[list[str]] = [[]]
    depth = 0
    for index in range(opening, len(words)):
        word = words[index]
        depth += (word == "(") - (word == ")")
        if depth == 0:
            return arguments, index + 1
        if word == "," and depth == 1:
            arguments.append([])
        elif index != opening and (arguments[-1] or not word.isspace()):
            arguments[-1].append(word)
    raise MacroError(f"the arguments of macro `{name}` have no end")


def _moved(token: Token, use: Token) -> Token:
    """Return a token at the place of the use of a macro."""
    moved = Token(token.kind, token.text, use.source, use.offset)
    moved.escaped = token.escaped
    return moved
