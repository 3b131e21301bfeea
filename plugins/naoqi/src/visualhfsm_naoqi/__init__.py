"""What speaks NAOqi, the system of the Nao: programs written for it, and the real robot."""

from __future__ import annotations

import sys

from zenoh_ice.application import missing_package


def lacking(error: ModuleNotFoundError) -> str:
    """Return what to install, or which Python to use, where libqi or what goes with it is missing."""
    if error.name == "qi" and sys.version_info >= (3, 13):
        return "qi is not available for Python 3.13 and newer: the real robot needs Python 3.11 or 3.12"
    return missing_package(error, "naoqi")
