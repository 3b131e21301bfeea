"""Name the extras to Hatchling: those of plug-ins are the folders of a checkout, or distributions.

pyproject.toml has them as `visualhfsm-NAME`, in the table of this hook. In a checkout, where `plugins/NAME/`
stands, it is installed from there; a distribution asks for the one of its own version.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Final

from hatchling.metadata.plugin.interface import MetadataHookInterface

PLUG_IN: Final = re.compile(r"visualhfsm-([\w-]+?)(\[[\w,]+\])?$")


class Extras(MetadataHookInterface):  # type: ignore[misc]  # which only the build installs
    """What `[tool.hatch.metadata.hooks.custom.extras]` says, for this place."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Add the extras to the metadata of the project."""
        metadata["optional-dependencies"] = {
            extra: [self._placed(each, metadata["version"]) for each in requirements]
            for extra, requirements in self.config["extras"].items()
        }

    def _placed(self, requirement: str, version: str) -> str:
        found = PLUG_IN.match(requirement)
        if found is None:
            return requirement
        root = Path(self.root)
        folder = root / "plugins" / found[1].replace("-", "_")
        # A source distribution has the folders, too, but is unpacked somewhere for a moment.
        if (folder / "pyproject.toml").exists() and not (root / "PKG-INFO").exists():
            return f"{requirement} @ {folder.as_uri()}"
        return f"{requirement}=={version}"
