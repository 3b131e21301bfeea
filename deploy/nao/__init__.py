"""The command `nao`: look at a running robot and everything around it, and call whatever it serves."""

from __future__ import annotations

from zenoh_ice import ZenohIceError

__all__ = ["NaoError"]


class NaoError(ZenohIceError):
    """Something that the command cannot do; the text says why, and what to do."""
