"""Macros: what `#define` gives a name, and what stands in the place of its uses."""

from __future__ import annotations

import re
from collections.abc import KeysView
from dataclasses import dataclass, field
from pathlib import Path

from .lexer import Kind, Source, Token

# What the reference compiler defines too, so that files with parts for one language are read alike.
_PREDEFINED = {"ICE_VERSION": "30711", "__SLICE2PY__": "1"}
# Against macros that grow what they stand in.
_MOST_TOKENS = 200_000
_DEEPEST_EXPANSION = 100

_DEFINE = re.compile(r"(?P<name>[A-Za-z_]\w*)(?:\((?P<parameters>[^()]*)\))?(?P<value>.*)", re.DOTALL)
_PARAMETER = re.compile(r"\s*([A-Za-z_]\w*)\s*")


class MacroError(Exception):
    """A macro cannot be defined or replaced; the message says why."""


class ExpansionTooLargeError(MacroError):
    """The macros of a file grow without end, so that the file cannot be read."""


@dataclass(frozen=True, slots=True)
class _Macro:
    body: list[Token]
    parameters: tuple[str, ...] | None = None
    """None for a macro that is used without parentheses."""


@dataclass(slots=True)
class Macros:
    """The macros that are defined at a point of a translation unit."""

    _macros: dict[str, _Macro] = field(default_factory=dict)
    _budget: int = _MOST_TOKENS

    def __post_init__(self) -> None:
        for name, value in _PREDEFINED.items():
            self._macros[name] = _Macro(Source(Path("<predefined>"), value).tokens[:-1])

    @property
    def names(self) -> KeysView[str]:
        """The names of all macros, those still to be defined too once they are."""
        return self._macros.keys()

    def values(self) -> dict[str, str]:
        """Return the text of each macro, for conditions."""
        return {name: " ".join(part.text for part in macro.body) for name, macro in self._macros.items()}

    def define(self, definition: str, path: Path) -> None:
        """Take `NAME value` or `NAME(parameters) value` from a file. Raises MacroError."""
        match = _DEFINE.fullmatch(definition)
        if match is None:
            raise MacroError("#define needs a name")
        if match["name"] == "defined":
            raise MacroError("`defined` is a word of conditions and cannot be defined")
        value = match["value"]
        if value and not value[0].isspace():
            raise MacroError(f"a space is missing behind `{match['name']}`, or its parameters are wrong")
        parameters = None
        if match["parameters"] is not None:
            parameters = _parameters(match["parameters"])
        self._macros[match["name"]] = _Macro(Source(path, value).tokens[:-1], parameters)

    def undefine(self, name: str) -> None:
        """Forget a macro, if there is one of that name."""
        self._macros.pop(name, None)

    def expand(self, tokens: list[Token], index: int) -> tuple[list[Token], int]:
        """Return what the macro used at `index` stands for, and the index behind its use.

        Raises MacroError for wrong arguments.
        """
        return self._expand(tokens, index, frozenset())

    def _expand(self, tokens: list[Token], index: int, active: frozenset[str]) -> tuple[list[Token], int]:
        use = tokens[index]
        macro = self._macros[use.text]
        end = index + 1
        arguments: list[list[Token]] = []
        if macro.parameters is not None:
            if end >= len(tokens) or tokens[end].text != "(":
                return [use], end
            arguments, end = _arguments(tokens, end, use.text)
            if len(arguments) != len(macro.parameters) and not (macro.parameters == () and arguments == [[]]):
                count = len(macro.parameters)
                raise MacroError(f"macro `{use.text}` takes {count} argument{'s' if count != 1 else ''}")
        inner = active | {use.text}
        if len(inner) > _DEEPEST_EXPANSION:
            raise ExpansionTooLargeError("macros are nested too deeply")
        by_name = dict(zip(macro.parameters or (), arguments, strict=False))
        body: list[Token] = []
        for token in macro.body:
            argument = by_name.get(token.text) if token.kind in {Kind.NAME, Kind.KEYWORD} else None
            if argument is None:
                body.append(token.moved_to(use))
            else:
                body += self._rescan(argument, active)
            self._spend(len(body))
        return self._rescan(body, inner), end

    def _rescan(self, tokens: list[Token], active: frozenset[str]) -> list[Token]:
        result: list[Token] = []
        index = 0
        while index < len(tokens):
            token = tokens[index]
            if token.text in self._macros and token.text not in active and is_macro_use(token):
                replacement, index = self._expand(tokens, index, active)
                result += replacement
            else:
                result.append(token)
                index += 1
        self._spend(len(result))
        return result

    def _spend(self, tokens: int) -> None:
        self._budget -= tokens
        if self._budget < 0:
            raise ExpansionTooLargeError("the file is too large once its macros are replaced")


def is_macro_use(token: Token) -> bool:
    """Return whether a token can be the name of a macro."""
    return (token.kind is Kind.NAME or token.kind is Kind.KEYWORD) and not token.escaped


def _parameters(text: str) -> tuple[str, ...]:
    if not text.strip():
        return ()
    names: list[str] = []
    for part in text.split(","):
        match = _PARAMETER.fullmatch(part)
        if match is None:
            raise MacroError(f"expected the name of a parameter, found `{part.strip()[:20]}`")
        if match[1] in names:
            raise MacroError(f"the parameter `{match[1]}` stands there twice")
        names.append(match[1])
    return tuple(names)


def _arguments(tokens: list[Token], opening: int, name: str) -> tuple[list[list[Token]], int]:
    """Return the arguments between parentheses, and the index behind them."""
    arguments: list[list[Token]] = [[]]
    depth = 0
    for index in range(opening, len(tokens)):
        token = tokens[index]
        if token.kind is Kind.END:
            break
        if token.text == "(":
            depth += 1
            if depth == 1:
                continue
        elif token.text == ")":
            depth -= 1
            if depth == 0:
                return arguments, index + 1
        elif token.text == "," and depth == 1:
            arguments.append([])
            continue
        arguments[-1].append(token)
    raise MacroError(f"the arguments of macro `{name}` have no end")
