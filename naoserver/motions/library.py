"""The motions that can be played: one for each file."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from types import MappingProxyType

from naoserver.motions.keyframes import Motion
from naoserver.motions.reader import MotionError, read_motion

__all__ = ["load_motions"]


def load_motions(folder: Path | None = None) -> Mapping[str, Motion]:
    """Return the motions in the files `*.toml` of a folder by name, or our own. Raises MotionError."""
    if folder is None:
        return _own_motions()
    if not folder.is_dir():
        raise MotionError(f"{folder}: there is no such folder of motions")
    motions = (read_motion(path) for path in sorted(folder.glob("*.toml")))
    return MappingProxyType({motion.name: motion for motion in motions})


@cache
def _own_motions() -> Mapping[str, Motion]:
    with resources.as_file(resources.files("naoserver.motions") / "files") as own:
        return load_motions(own)
