"""What a reader writes into another's memory: that it has read, and only where slots begin."""

from __future__ import annotations

from contextlib import closing

import msgspec
import pytest
import zenoh

from zenoh_ice import ConnectionLostException
from zenoh_ice.wire.memory_file import HEADER, SLOT_START, memory_space
from zenoh_ice.wire.memory_reference import decode_reference, encode_reference
from zenoh_ice.wire.pieces import LARGE, Parted, Pieces
from zenoh_ice.wire.shared_memory import SharedMemory


@pytest.mark.skipif(not memory_space(), reason="no memory is shared here")
def test_a_picture_that_looks_like_the_beginning_of_a_slot_is_not_written_into() -> None:
    picture = HEADER.pack(1, 0) * (LARGE // HEADER.size)
    with closing(SharedMemory(enabled=True)) as sender, closing(SharedMemory(enabled=True)) as reader:
        sound = sender.lender.place(Pieces((b"", b""), (picture,), (0,)))
        assert sound is not None
        reference = decode_reference(sound, "it")
        forged = msgspec.structs.replace(
            reference, offset=reference.offset + SLOT_START, sizes=(HEADER.size,)
        )
        with pytest.raises(ConnectionLostException):
            reader.read(zenoh.ZBytes(encode_reference(forged)), LARGE, "it")
        came = reader.read(zenoh.ZBytes(sound), 2 * LARGE, "it")
        assert isinstance(came, Parted)
        assert came.large == [picture]
