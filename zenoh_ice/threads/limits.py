"""How long the parts of a communicator wait, and how much they keep."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from zenoh_ice.data.codec import LARGEST_BULK
from zenoh_ice.threads._starting import PULSE_PERIOD


@dataclass(frozen=True, kw_only=True)
class Limits:
    """The limits of a communicator that are no settings: nobody who runs a component needs to know them."""

    idle_thread: float = 5.0
    """s after which a thread ends that has nothing to do."""
    quick_job: float = 0.0005
    """s that a job takes at most while its thread keeps the source that it came from."""
    look_period: float = PULSE_PERIOD
    """s between two looks of the pool's watch."""
    stalled_looks: int = 100
    """Looks, 2 s, in which jobs wait and none is taken, until the pool counts as stalled."""
    status: float = 0.5
    """s to wait for the status of a process that seems to be present."""
    retry: float = 0.5
    """s for which the only retry of an idempotent call waits for the servant to be back."""
    waiting_bytes: int = LARGEST_BULK
    """Bytes of the calls of a servant that wait for their turn."""
    drain: float = 1.0
    """s to wait for the running calls of servants that are withdrawn."""
    token_delay: float = 0.5
    """s for which word of a servant may be on its way, four times as long in an empty realm.

    Over a link it comes within milliseconds, and gossip makes the links to others within tens of them.
    """
    longest_grace: float = 2.0
    """s that a long limit of a call adds to that at most."""
    tokens: int = 1 << 14
    """Tokens of all servants: no robot has more, so that more mean a flood."""
    loss_notice: float = 0.25
    """s in which the token of a servant that died disappears; measured 2-3 ms."""
    token_looks: int = 100
    """Looks, 2 s, after which a client that has called should have a token; measured 14 ms under load."""
    linger: float = 10.0
    """s after which an unused stream is closed."""
    callback: float = 2.0
    """s to wait for a running callback of a stream that is closed."""
    unread_bytes: int = 32 << 20
    """Bytes, but for one sample, that a listener may leave unread in lent memory: an eighth of it."""
    hello: float = 0.5
    """s to wait for the other process to accept a connection."""
    hello_share: float = 0.1
    """The same as a share of a call's limit: after a vain attempt, it is made over the network."""
    sending: float = 1.0
    """s that a client may take none of its answers."""
    last_reads: float = 5.0
    """s after which memory is used again that was lent over a link that ended: it may still be read."""
    memory: int = 256 << 20
    """Bytes of memory to lend; the system allocates them as they are used."""


LIMITS: Final = Limits()
"""Those of every communicator that gets no others."""
