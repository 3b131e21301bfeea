"""What every run of pytest loads: the options of the suite exist only in a run that names the suite.

So nobody's own option `--robot` meets ours.
"""

from __future__ import annotations

import re
from typing import Final

import pytest

_SUITE: Final = re.compile(r"\bnaoserver[./]conformance\b")


def pytest_load_initial_conftests(early_config: pytest.Config, args: list[str]) -> None:
    """Load the suite's plugin if the command names the suite."""
    if any(_SUITE.search(argument) for argument in args):
        early_config.pluginmanager.import_plugin("naoserver.conformance._plugin")
