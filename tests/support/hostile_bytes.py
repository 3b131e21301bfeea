"""Hostile bytes, always the same for a seed: MessagePack that is almost right, wrong, or meant to harm."""

from __future__ import annotations

import random
import re
import struct
from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import msgpack

from .wire_values import Pairs

__all__ = ["HostileBytes", "Packed", "bombs"]


class Packed(bytes):
    """A part of a payload that is MessagePack, or looks like it, already."""

    __slots__ = ()


_LEAVES: tuple[Any, ...] = (
    None,
    True,
    0,
    -1,
    255,
    256,
    -(1 << 63),
    (1 << 64) - 1,
    0.0,
    -1.0,
    1e308,
    float("nan"),
    float("inf"),
    float("-inf"),
    "",
    "a" * 200,
    "\x1b]0;owned\x07\n\u202e",
    "Head@nao",
    "../..",
    "**",
    b"",
    b"\x00" * 40,
    (),
    Pairs(),
    Packed(b"\xc1"),  # a byte that MessagePack does not use
    Packed(b"\xa2\xff\xfe"),  # not UTF-8
    Packed(b"\xa3\xed\xa0\x80"),  # half a surrogate pair
    Packed(b"\xd4\x05x"),  # an extension of one byte
    Packed(b"\xd7\xff" + b"\xff" * 8),  # a timestamp
    Packed(b"\xc7\x0c\xff" + b"\xff" * 12),  # a timestamp with too many nanoseconds
    Packed(b"\xc9\xff\xff\xff\xff\x01"),  # an extension of 4 GB
    Packed(b"\xc6\xff\xff\xff\xff"),  # 4 GB of bytes
    Packed(b"\xdb\xff\xff\xff\xff"),  # 4 GB of text
    Packed(b"\xdd\xff\xff\xff\xff"),  # an array of 4 billion
    Packed(b"\xdf\xff\xff\xff\xff"),  # a map of as many
    Packed(b"\xdd\x05\xf5\xe1\x00"),  # an array of 100 million
    Packed(b"\x81\x80\x01"),  # a map as key
    Packed(b"\x82\xa1a\x01\xa1a\x02"),  # a key twice
    Packed(b"\x81\xc0\xc0"),  # nil as key
    Packed(b"\x81\xcb\x7f\xf8\0\0\0\0\0\0\x01"),  # not a number as key
    Packed(b"\x91" * 300 + b"\xc0"),
    Packed(b"\x81\xa1a" * 300 + b"\xc0"),
)


@cache
def bombs() -> tuple[bytes, ...]:
    """Return payloads meant to cost their receiver many times their size."""
    return (
        b"\x91" * 100_000,
        b"\x81\xa1a" * 100_000,
        b"\x81" * 100_000,
        b"\xdd\x00\x00\xff\xff" * 20_000,
        b"\x9f" + b"\xdd\xff\xff\xff\xff" * 1000,
        b"\xdf\x00\x01\x86\xa0" + b"".join(b"\xce" + struct.pack(">I", n) + b"\xc0" for n in range(100_000)),
        b"\xc9\x00\x01\x00\x00\x05" + bytes(1 << 16),
    )


_WORD = re.compile(rb"\w+|\s+|[^\w\s]+")
_WORDS = (
    b"",
    b"x",
    b"__class__",
    b"__dict__",
    b"__init__",
    b"__post_init__",
    b"__struct_fields__",
    b"__traceback__",
    b"self",
    b"None",
    b"mro",
    b"_",
    b"import",
    b"0",
    b"-1",
    b"9" * 30,
    b"9" * 5000,
    b"x" * 300,
    b"nan",
    b"\xff",
    b"*",
    b"@",
    b"/",
    b"::",
    b"<",
    b">" * 40,
    b"[" * 300,
    b"sequence<" * 40,
    b"[[a]]",
    b"::menagerie::Animal",
    b"returnValue",
)


class HostileBytes:
    """Make inputs from sound ones: damaged as bytes and as values, and some that never were sound."""

    def __init__(self, seed: int) -> None:
        self._random = random.Random(seed)
        self._makers: tuple[Callable[[bytes], bytes], ...] = (
            self._same,
            self._truncated,
            self._damaged,
            self._changed,
            self._changed,
            self._changed,
            self._reworded,
            self._alone,
            self._noise,
        )

    def next_input(self, sound: Sequence[bytes]) -> bytes:
        """Return another input that looks like one of some sound ones."""
        return self._random.choice(self._makers)(self._random.choice(sound))

    def choose(self, choices: Sequence[Any]) -> Any:
        """Return one of several."""
        return self._random.choice(choices)

    def _same(self, sound: bytes) -> bytes:
        return sound

    def _truncated(self, sound: bytes) -> bytes:
        return sound[: self._random.randint(0, len(sound))]

    def _damaged(self, sound: bytes) -> bytes:
        content = bytearray(sound)
        for _ in range(self._random.randint(1, 4)):
            begin = self._random.randint(0, len(content))
            end = min(len(content), begin + self._random.choice((0, 1, 1, 1, 4)))
            content[begin:end] = self._random.randbytes(self._random.choice((0, 1, 1, 1, 3)))
        return bytes(content)

    def _changed(self, sound: bytes) -> bytes:
        """Change some of the values in it, so that it stays MessagePack."""
        try:
            value = msgpack.unpackb(sound, strict_map_key=False, object_pairs_hook=Pairs, use_list=False)
            for _ in range(self._random.randint(1, 3)):
                value = self._change(value)
            return _packed(value)
        except (ValueError, RecursionError):  # it is no MessagePack, or too deep for us
            return self._damaged(sound)

    def _change(self, value: Any) -> Any:
        if type(value) in (tuple, Pairs) and value and self._random.random() < 0.8:
            at = self._random.randrange(len(value))
            inside = [*value]
            match self._random.randrange(6):
                case 0:
                    del inside[at]
                case 1:
                    inside.insert(at, value[at])
                case 2:
                    inside[at:at] = [value[at]] * 30
                case _:
                    inside[at] = self._change(value[at])
            return type(value)(inside)
        return self._random.choice(_LEAVES)

    def _reworded(self, sound: bytes) -> bytes:
        """Change some of the words and lines in it, where it is text."""
        lines = sound.split(b"\n")
        for _ in range(self._random.randint(1, 3)):
            at = self._random.randrange(len(lines))
            words = _WORD.findall(lines[at])
            match self._random.randrange(5):
                case 0:
                    lines.insert(at, self._random.choice(lines))
                case 1 if len(lines) > 1:
                    del lines[at]
                case _ if words:
                    other = self._random.choice((*_WORDS, *_WORD.findall(self._random.choice(lines))))
                    words[self._random.randrange(len(words))] = other
                    lines[at] = b"".join(words)
        return b"\n".join(lines)

    def _alone(self, _: bytes) -> bytes:
        return _packed(self._random.choice(_LEAVES))

    def _noise(self, _: bytes) -> bytes:
        return self._random.randbytes(self._random.randint(0, 60))


def _packed(value: Any) -> bytes:
    if isinstance(value, Packed):
        return bytes(value)
    packer = msgpack.Packer()
    if isinstance(value, Pairs):
        return bytes(packer.pack_map_header(len(value))) + b"".join(
            _packed(part) for pair in value for part in _pair(pair)
        )
    if type(value) is tuple:
        return bytes(packer.pack_array_header(len(value))) + b"".join(map(_packed, value))
    try:
        return bytes(packer.pack(value))
    except (ValueError, OverflowError):  # a timestamp that nothing else can hold
        return b"\xc0"


def _pair(pair: Any) -> tuple[Any, Any]:
    """Return a changed entry of a map as a pair: the changes may have made it something else."""
    if isinstance(pair, tuple) and len(pair) == 2:
        return pair
    return ("a", pair)
