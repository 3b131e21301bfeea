"""Payloads that are not CDR of their type, except by chance."""

from __future__ import annotations

import random

__all__ = ["malformed"]


def malformed(data: bytes, chance: random.Random) -> bytes:
    """Return a payload that is cut, lengthened, changed in some bytes or in a length, or altogether random."""
    changed = bytearray(data)
    match chance.randrange(6):
        case 0:
            del changed[chance.randrange(len(changed)) :]
        case 1:
            changed += chance.randbytes(chance.randrange(4, 64))
        case 2:
            for _ in range(chance.randrange(1, 9)):
                changed[chance.randrange(len(changed))] = chance.randrange(256)
        case 3:  # where many messages have a length
            place = chance.randrange(4, max(5, len(changed) - 3)) & ~3
            changed[place : place + 4] = chance.choice([0xFFFFFFFF, 0x7FFFFFFF, 1 << 20, 0]).to_bytes(
                4, "little"
            )
        case 4:
            changed[:4] = chance.choice([b"\0\0\0\0", b"\0\x02\0\0", b"\xff\xff\xff\xff", b"\0\x07\0\0"])
        case _:
            changed = bytearray(chance.randbytes(chance.randrange(2 * 64)))
    return bytes(changed)
