"""tests/support/README.md has each module once: a newcomer finds it there, in one group."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator

from tools.lint.sources import TESTS


def mistakes() -> Iterator[str]:
    """Yield the modules that are missing, gone or there twice."""
    folder = TESTS / "support"
    named = Counter(re.findall(r"`(\w+)`", (folder / "README.md").read_text("utf-8")))
    there = Counter(path.stem for path in folder.glob("*.py") if path.stem != "__init__")
    for name in sorted(named.keys() | there.keys()):
        if named[name] != there[name]:
            times = f"{named[name]} times, and should be {there[name]}"
            yield f"tests/support/README.md: `{name}` is there {times}"
