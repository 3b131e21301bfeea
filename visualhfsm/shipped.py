"""Find the folders of files that come with the project and are no packages: `behaviors` and `deploy`.

They stand at the top of a checkout, where people see them, and in the wheel below this package, where no
folder of the same name can hide them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

__all__ = ["shipped"]

_PACKAGE: Final = Path(__file__).parent


def shipped(folder: str) -> Path:
    """Return one of these folders by its name."""
    installed = _PACKAGE / "_shipped" / folder
    return installed if installed.is_dir() else _PACKAGE.parent / folder
