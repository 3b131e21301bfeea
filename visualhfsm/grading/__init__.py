"""Grade submissions: documents of strangers, whose code runs in another process, behind walls."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from ._containment import Containment as Containment
    from ._errors import SandboxUnavailable as SandboxUnavailable

_MODULES: Final = {
    "Containment": "._containment",
    "SandboxUnavailable": "._errors",
}


# The command line is read before any of them is needed.
__getattr__ = import_on_use(__name__, _MODULES)
