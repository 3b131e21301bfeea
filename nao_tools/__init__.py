"""The command `nao`, for operators: inspect a running robot and its programs, call its servants, stop it.

`deployment` starts the processes of a stack file, or writes units for systemd, and is the router; `doctor`
finds problems; `security` makes certificates.
"""

from __future__ import annotations

from zenoh_ice import ZenohIceError


class NaoError(ZenohIceError):
    """Something that the command cannot do; the text says why, and what to do."""
