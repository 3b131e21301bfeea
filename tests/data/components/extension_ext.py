"""What the component of extension.xml has beside the document."""

from __future__ import annotations

from hfsm_runtime import Component


class ExtensionExtension(Component):
    """Count."""

    counted = 0

    def count(self) -> None:
        """Count one more."""
        self.counted += 1
