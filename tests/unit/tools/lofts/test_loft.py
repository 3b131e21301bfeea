"""The meshes of looks are those of their lofts."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.support.limits import END_LIMIT
from tests.support.places import ROOT

TOOL = ROOT / "tools" / "lofts" / "loft.py"
BODIES = ROOT / "naoserver" / "bodies"


def read(file: Path) -> tuple[list[str], np.ndarray]:
    """Return all of a file of meshes but its vertices, and these."""
    lines = file.read_text().splitlines()
    vertices = np.array([line.split()[1:] for line in lines if line.startswith("v ")], float)
    return [line for line in lines if not line.startswith("v ")], vertices


@pytest.mark.slow
@pytest.mark.parametrize("lofts", sorted(TOOL.parent.glob("*.toml")), ids=lambda file: file.stem)
def test_the_meshes_are_current(lofts: Path, tmp_path: Path) -> None:
    made = tmp_path / "made.obj"
    subprocess.run([sys.executable, TOOL, lofts, made], check=True, timeout=END_LIMIT)
    rest, vertices = read(made)
    kept_rest, kept_vertices = read(BODIES / lofts.stem / "looks.obj")
    message = (
        f"type: python tools/lofts/loft.py tools/lofts/{lofts.name} naoserver/bodies/{lofts.stem}/looks.obj"
    )
    assert rest == kept_rest, message
    # Roundings of other versions of NumPy differ.
    assert vertices == pytest.approx(kept_vertices, abs=1.5e-4), message
