"""Texts for people that can be said in other languages.

A `Message` is its English text, so that commands, logs and programs use it like any other string. It also
keeps the template and the values from which it was made: the editor, which shows it in the language of a
page, looks up the template in a catalog of gettext (`visualhfsm._base.languages`).
"""

from __future__ import annotations

import re
import string
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, Final, Protocol, Self

Value = str | int | float
"""A value of a message, itself a `Message` where it has words."""

_DECIMAL: Final = re.compile(r"( *-?[0-9]+)\.([0-9]+(?:e[-+]?[0-9]+)?%?)", re.ASCII)


class Catalog(Protocol):
    """Translations by their English templates, such as `gettext.NullTranslations`."""

    def gettext(self, message: str, /) -> str:
        """Return the translation of a template, or the template itself without one."""

    def ngettext(self, one: str, many: str, count: int, /) -> str:
        """Return the translation of the template for a number of things, or the English one."""


class Message(str):
    """An English text, made from a template as `str.format` does, which remembers how it was made.

    The first argument is a literal, because Babel collects the templates from the code. Values have names, so
    that a translation may change their order. Two messages of the same English text are equal.
    """

    __slots__ = ("_plural", "_template", "_values")

    _template: str | None
    _plural: str | None
    _values: Mapping[str, Value]

    def __new__(cls, template: str, /, **values: Value) -> Message:
        """Return a message; raises KeyError when a value is missing."""
        return _make(template, None, values)

    @classmethod
    def counted(cls, one: str, many: str, /, *, count: int, **values: Value) -> Message:
        """Return a message about a number of things, `{count}`, which decides on the template."""
        return _make(one, many, {"count": count, **values})

    @classmethod
    def verbatim(cls, text: str) -> Message:
        """Return a text from elsewhere, such as Python or the document, as it is in every language.

        A text that is a message already is returned itself.
        """
        return text if isinstance(text, Message) else _make(None, None, {"": text})

    def said_in(self, catalog: Catalog) -> str:
        """Return the text in the language of a catalog, English where that has no usable translation."""
        if self._template is None:
            return str(self)
        if self._plural is None:
            template = catalog.gettext(self._template)
        else:
            template = catalog.ngettext(self._template, self._plural, int(self._values["count"]))
        values = {name: _said(value, catalog) for name, value in self._values.items()}
        try:
            return template.format_map(values)
        except (KeyError, ValueError, IndexError, AttributeError):  # a catalog that somebody has added
            return str(self)

    def again(self, values: Mapping[str, Value]) -> Message:
        """Return a message of the same template with other values."""
        return _make(self._template, self._plural, values)

    @property
    def values(self) -> Mapping[str, Value]:
        """The values of the template, by name."""
        return self._values

    def pieces(self) -> Iterable[tuple[str, str | None, str | None, str | None]]:
        """Return the pieces of the template, as `string.Formatter.parse` does."""
        return string.Formatter().parse(self._template or "")

    def __reduce__(self) -> tuple[Any, ...]:
        return _make, (self._template, self._plural, dict(self._values))

    def to_data(self) -> object:
        """Return what JSON can hold; `from_data` makes the message from that again."""
        if self._template is None:
            return str(self)
        values = {
            name: value.to_data() if isinstance(value, Message) else value
            for name, value in self._values.items()
        }
        return {"template": self._template, "plural": self._plural, "values": values}

    @classmethod
    def from_data(cls, data: Any) -> Message:  # noqa: ANN401 - checked here
        """Return the message of which `to_data` returned this. Raises ValueError for other data."""
        if isinstance(data, str):
            return cls.verbatim(data)
        try:
            values = {
                name: cls.from_data(value) if isinstance(value, dict) else value
                for name, value in data["values"].items()
            }
            return _make(data["template"], data["plural"], values)
        except (AttributeError, IndexError, KeyError, TypeError) as error:
            raise ValueError(f"not a message: {error}") from error


class MessageError(Exception):
    """The base of errors whose text is a message."""

    def __init__(self, message: Message) -> None:
        super().__init__(message)
        self.message = message

    @classmethod
    def because(cls, template: str, /, **values: Value) -> Self:
        """Return an error with a `Message` of a template, which is a literal, and its values."""
        return cls(Message(template, **values))


class _Number(float):
    """A number that is written with the decimal point, or comma, of a language."""

    catalog: Catalog

    def __format__(self, how: str) -> str:
        return number(float(self).__format__(how)).said_in(self.catalog)


def _said(value: Value, catalog: Catalog) -> Value:
    if isinstance(value, Message):
        return value.said_in(catalog)
    if isinstance(value, float):
        said = _Number(value)
        said.catalog = catalog
        return said
    return value


def _make(template: str | None, plural: str | None, values: Mapping[str, Value]) -> Message:
    if template is None:
        text = str(values[""])
    elif plural is not None and values["count"] != 1:
        text = plural.format_map(values)
    else:
        text = template.format_map(values)
    message = str.__new__(Message, text)
    message._template, message._plural, message._values = template, plural, values
    return message


def template(text: str) -> Message:
    """Return a message of a template in which an ellipsis stands for each value; the text is a literal."""
    names = (name for _, name, _, _ in string.Formatter().parse(text) if name)
    return _make(text, None, dict.fromkeys(names, "\N{HORIZONTAL ELLIPSIS}"))


NO_MESSAGE: Final = Message.verbatim("")
"""The empty text, where there is nothing to say."""


def any_of(items: Sequence[str]) -> Message:
    """Return alternatives, of which there is at least one: `a, b or c`."""
    *others, last = items
    if not others:
        return Message.verbatim(last)
    return Message("{others} or {last}", others=joined(", ", others), last=last)


def all_of(items: Sequence[str]) -> Message:
    """Return a list of at least one thing: `a, b and c`."""
    *others, last = items
    if not others:
        return Message.verbatim(last)
    return Message("{others} and {last}", others=joined(", ", others), last=last)


def number(text: str) -> Message:
    """Return a number such as `1.5` with the decimal point, or comma, of each language."""
    found = _DECIMAL.fullmatch(text)
    if found is None:
        return Message.verbatim(text)
    # Translators: a number, such as 1.5
    return Message("{whole}.{fraction}", whole=found[1], fraction=found[2])


def joined(separator: str, items: Sequence[str]) -> Message:
    """Return texts with a separator between them that no language changes; some may be messages."""
    values = {f"text{number}": item for number, item in enumerate(items)}
    return _make(separator.join(f"{{{name}}}" for name in values), None, values)
