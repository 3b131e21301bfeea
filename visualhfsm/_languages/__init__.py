"""The languages in which the editor speaks: catalogs of gettext for the texts that Python makes.

Each language is a folder beside this file, named by its code. `messages.po` is what a translator edits, by
the English texts; `make texts` adds those that are new, and compiles it to `messages.mo`, which is read here.
The texts that the page itself has are in `page.po`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from gettext import GNUTranslations, NullTranslations
from pathlib import Path
from typing import Final

import msgspec

from codegen.messages import Message

__all__ = ["ENGLISH", "FOLDER", "LANGUAGES", "decode_message", "encode_message", "encoder", "known_language"]

FOLDER: Final = Path(__file__).parent
ENGLISH: Final = "en"
LANGUAGES: Final = (ENGLISH, *sorted(each.parent.name for each in FOLDER.glob("*/messages.mo")))
"""The codes of the languages, English first."""


def known_language(wanted: str) -> str:
    """Return the code of the language that a browser names, such as `es` for `es-ES`; English if unknown."""
    spoken = {language.lower(): language for language in LANGUAGES}
    name = wanted.lower()
    return spoken.get(name) or spoken.get(name.partition("-")[0], ENGLISH)


@cache
def encoder(language: str) -> msgspec.json.Encoder:
    """Return what writes messages to a page in its language, one of LANGUAGES, as JSON."""
    catalog = _catalog(language)
    return msgspec.json.Encoder(enc_hook=_hook(lambda message: message.said_in(catalog)))


@cache
def _catalog(language: str) -> NullTranslations:
    if language == ENGLISH:
        return NullTranslations()
    with (FOLDER / language / "messages.mo").open("rb") as file:
        return GNUTranslations(file)


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
