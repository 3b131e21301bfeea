"""The languages in which the editor speaks: catalogs of gettext for the texts that Python makes.

Each language is a folder beside this file, named by its code. `messages.po` is what a translator edits, by
the English texts; `make texts` adds those that are new, and compiles it to `messages.mo`, which is read here.
So it does with `sentences.po`, the templates of what robots and components say over the network in English,
to `sentences.json`. The texts that the page itself has are in `page.po`.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import cache
from gettext import GNUTranslations, NullTranslations
from pathlib import Path
from typing import Final

import msgspec

from codegen.messages import Message, template
from zenoh_ice.data import typed

__all__ = [
    "ENGLISH",
    "FOLDER",
    "LANGUAGES",
    "accepted_language",
    "decode_message",
    "encode_message",
    "encoder",
    "in_all_languages",
    "known_language",
    "said",
    "sentences",
    "system_languages",
]

FOLDER: Final = Path(__file__).parent
ENGLISH: Final = "en"
LANGUAGES: Final = (ENGLISH, *sorted(each.parent.name for each in FOLDER.glob("*/messages.mo")))
"""The codes of the languages, English first."""


_LONGEST_HEADER: Final = 500
"""Characters of `Accept-Language` that are read."""


def known_language(wanted: str) -> str:
    """Return the code of the language that a browser names, such as `es` for `es-ES`; English if unknown."""
    return _spoken(wanted) or ENGLISH


def accepted_language(header: str) -> str:
    """Return the code of the most wanted language of a header `Accept-Language` (RFC 9110, section 12.5.4).

    Of languages that are wanted alike it is the first; without any that is known, English.
    """
    wanted = [each.strip().partition(";") for each in header[:_LONGEST_HEADER].split(",")]
    by_weight = sorted(((name, _weight(weight)) for name, _, weight in wanted), key=lambda each: -each[1])
    found = (_spoken(name) for name, weight in by_weight if weight > 0)
    return next(filter(None, found), ENGLISH)


def system_languages(environment: Mapping[str, str]) -> list[str]:
    """Return the codes of the languages that a user's environment names, the most wanted first.

    A name counts also where its locale was not generated, as in most containers.
    """
    locale = next(filter(None, map(environment.get, ("LC_ALL", "LC_MESSAGES", "LANG"))), "")
    wanted = locale if locale in {"C", "POSIX"} else environment.get("LANGUAGE") or locale
    return [re.split(r"[_.@]", name)[0] for name in wanted.split(":")]


def said(message: Message, language: str) -> str:
    """Return a message in a language, one of LANGUAGES."""
    return message.said_in(_catalog(language))


def in_all_languages(message: object) -> object:
    """Return a message in each language that says it differently, for a file of unknown readers.

    It is the `enc_hook` with which `msgspec` writes what `onefile/unpacked.js` reads.
    """
    if not isinstance(message, Message):
        raise NotImplementedError(f"a file cannot contain {type(message).__name__}")
    texts = {language: said(message, language) for language in LANGUAGES}
    return {"said": texts} if len(set(texts.values())) > 1 else str(message)


def _spoken(wanted: str) -> str | None:
    spoken = {language.lower(): language for language in LANGUAGES}
    name = wanted.strip().lower()
    return spoken.get(name) or spoken.get(name.partition("-")[0])


def _weight(parameter: str) -> float:
    """Return the weight in `q=0.8`, 1 without any, 0 of what is none."""
    if not parameter.strip():
        return 1.0
    found = re.fullmatch(r"\s*q\s*=\s*(0(?:\.\d*)?|1(?:\.0*)?)\s*", parameter, re.ASCII | re.IGNORECASE)
    return float(found[1]) if found else 0.0


@cache
def encoder(language: str) -> msgspec.json.Encoder:
    """Return what writes messages to a page in its language, one of LANGUAGES, as JSON."""
    catalog = _catalog(language)
    return msgspec.json.Encoder(enc_hook=_hook(lambda message: message.said_in(catalog)))


@cache
def sentences() -> tuple[Message, ...]:
    """Return the templates of what robots and components say, which a language has."""
    texts = {text for language in LANGUAGES if language != ENGLISH for text in _sentences_in(language)}
    return tuple(template(text) for text in sorted(texts) if text)


def _sentences_in(language: str) -> dict[str, str]:
    return typed.from_json((FOLDER / language / "sentences.json").read_bytes(), dict[str, str])


class _Sentences(NullTranslations):
    """The catalog of what robots and components say, in a language."""

    def __init__(self, language: str) -> None:
        super().__init__()
        self._texts = _sentences_in(language)

    def gettext(self, message: str) -> str:
        return self._texts.get(message, message)


@cache
def _catalog(language: str) -> NullTranslations:
    if language == ENGLISH:
        return NullTranslations()
    with (FOLDER / language / "messages.mo").open("rb") as file:
        catalog = GNUTranslations(file)
    catalog.add_fallback(_Sentences(language))
    return catalog


def _hook(said: Callable[[Message], object]) -> Callable[[object], object]:
    def encode(value: object) -> object:
        if isinstance(value, Message):
            return said(value)
        raise NotImplementedError(f"a message cannot contain {type(value).__name__}")

    return encode


# Between our processes messages keep their templates.

encode_message: Final = _hook(Message.to_data)
"""Writes messages with `msgspec`, as its `enc_hook`, for `decode_message`."""


def decode_message(kind: type, data: object) -> object:
    """Return the message that `encode_message` has written, as `msgspec`'s `dec_hook`."""
    if kind is not Message:
        raise NotImplementedError(f"{kind.__name__} is not a type of JSON")
    return Message.from_data(data)
