"""Single messages with fixed keys, for what must work with every release and on a bad network.

A communicator announces itself, follows who is present, and checks versions. This does nothing of the kind.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import TracebackType
from typing import Final, Self

import zenoh
from zenoh.handlers import RingChannel

from zenoh_ice.carriers.zenoh.session import close_session, open_session
from zenoh_ice.data.codec import LARGEST_PAYLOAD
from zenoh_ice.data.wire import ERROR_ENCODING
from zenoh_ice.settings import Settings

_MOST_ANSWERS: Final = 16  # to one message; a ring, since a full queue would block the whole session
_MOST_TOKENS: Final = 4096


class Messenger:
    """A session that sends messages and waits for their answers; leaving a `with` block closes it."""

    def __init__(self, settings: Settings) -> None:
        """Connect; a client waits for its first link. Raises as `open_session` does."""
        self._session: Final = open_session(settings)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the session; takes two seconds at most."""
        close_session(self._session)

    @property
    def linked(self) -> bool:
        """Return whether it has a link to any other process."""
        info = self._session.info
        return bool(info.routers_zid() or info.peers_zid())

    def ask(self, messages: Mapping[str, bytes], timeout: float) -> dict[str, list[tuple[bool, bytes]]]:
        """Send a payload to each key, all at once; return the answers by key, of everybody who serves it.

        Each says whether it is a result, and has the result or the error, encoded.
        Waits until each has been answered, at most `timeout` s. Without an answer the list is empty: nobody
        serves the key, access control denies it, or it is late.
        """
        begun = {key: self._begin(key, payload, timeout) for key, payload in messages.items()}
        return {
            key: [answer for reply in replies if (answer := _answer_of(reply)) is not None]
            for key, replies in begun.items()
        }

    def tokens(self, pattern: str, timeout: float) -> list[str]:
        """Return the liveliness tokens that match a pattern, as far as they arrive within `timeout` s."""
        ring: RingChannel[zenoh.Reply] = RingChannel(_MOST_TOKENS)
        replies = self._session.liveliness().get(pattern, ring, timeout=timeout)
        return [str(reply.ok.key_expr) for reply in replies if reply.ok is not None]

    def _begin(self, key: str, payload: bytes, timeout: float) -> zenoh.Handler[zenoh.Reply]:
        ring: RingChannel[zenoh.Reply] = RingChannel(_MOST_ANSWERS)
        return self._session.get(
            key,
            ring,
            payload=payload,
            timeout=timeout,
            # Two servers of one identity are a mistake; but then the message is for both.
            target=zenoh.QueryTarget.ALL,
            consolidation=zenoh.ConsolidationMode.NONE,
            congestion_control=zenoh.CongestionControl.BLOCK,
            priority=zenoh.Priority.REAL_TIME,
            express=True,
        )


def _answer_of(reply: zenoh.Reply) -> tuple[bool, bytes] | None:
    """Return the answer in a reply; None for Zenoh's own error at the end of the limit."""
    content = reply.ok or reply.err
    if content is None or len(content.payload) > LARGEST_PAYLOAD:
        return None
    if reply.ok is None and str(content.encoding) != ERROR_ENCODING:
        return None
    return reply.ok is not None, content.payload.to_bytes()
