"""The distributions of this repository: the core, and one for each folder of plugins/."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

__all__ = ["CORE", "DISTRIBUTIONS", "EXTRAS", "PLUG_INS", "ROOT", "WHOLE", "Distribution"]

ROOT: Final = Path(__file__).resolve().parents[1]


@dataclass(frozen=True)
class Distribution:
    """A folder with a pyproject.toml, which becomes one wheel."""

    folder: Path
    """The core's is the root of the repository."""
    settings: dict[str, Any]
    """What its pyproject.toml says."""

    @property
    def project(self) -> dict[str, Any]:
        """What pip knows of it: name, version, dependencies, entry points."""
        found: dict[str, Any] = self.settings["project"]
        return found

    @property
    def packages(self) -> list[Path]:
        """The folders of its import packages."""
        return [self.folder / name for name in self._wheel["packages"]]

    @property
    def shipped(self) -> dict[Path, str]:
        """Other files and folders that its wheel carries, each with its place there."""
        named = self._wheel.get("force-include", {})
        return {(self.folder / name).resolve(): place for name, place in named.items()}

    @property
    def _wheel(self) -> dict[str, Any]:
        found: dict[str, Any] = self.settings["tool"]["hatch"]["build"]["targets"]["wheel"]
        return found


def _read(folder: Path) -> Distribution:
    return Distribution(folder, tomllib.loads((folder / "pyproject.toml").read_text("utf-8")))


CORE: Final = _read(ROOT)
PLUG_INS: Final = [_read(path.parent) for path in sorted(ROOT.glob("plugins/*/pyproject.toml"))]
DISTRIBUTIONS: Final = [CORE, *PLUG_INS]
EXTRAS: Final[dict[str, list[str]]] = CORE.settings["tool"]["hatch"]["metadata"]["hooks"]["custom"]["extras"]
"""What each extra of the core asks for, with plug-ins as `visualhfsm-NAME`."""
WHOLE: Final = all(
    (ROOT / name).exists() for name in tomllib.loads((ROOT / "weights.toml").read_text("utf-8"))["python"]
)
"""Whether the checkout has every plug-in: who deletes the folder of one keeps a core whose checks hold."""
