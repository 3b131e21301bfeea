"""The command `nao`: inspect a running robot and its programs, and call its servants."""

from __future__ import annotations

from zenoh_ice import ZenohIceError


class NaoError(ZenohIceError):
    """Something that the command cannot do; the text says why, and what to do."""
