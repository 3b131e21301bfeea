"""What `nao doctor` says of a computer that is to grade: whether it can contain submissions."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from typing import Final

from nao_tools.findings import Finding, note, ok, warn
from visualhfsm_classes._errors import SandboxUnavailable
from visualhfsm_classes._walls import check_walls

_PACKAGE: Final = "sudo apt-get install bubblewrap"
_FIX: Final = f"{_PACKAGE} (0.8 or newer), and allow user namespaces: plugins/classes/docs/class.md"


def check_grading() -> Iterator[Finding]:
    """Yield whether submissions can be graded here; where nobody has prepared it, it may be intended."""
    try:
        check_walls()
    except SandboxUnavailable as error:
        if shutil.which("bwrap") is None:
            yield note(f"grading: {error}", f"where submissions are graded: {_PACKAGE}")
        else:
            yield warn(f"grading: {error}", _FIX)
    else:
        yield ok("grading: bubblewrap contains submissions")
