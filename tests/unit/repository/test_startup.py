"""Commands start quickly: they load what takes long only where they need it."""

from __future__ import annotations

import subprocess
import sys

import pytest

from tests.support.limits import RUN_LIMIT
from tests.support.places import ROOT

LOADED = "import sys, {module}; print(sorted({{*sys.modules}} & {{*sys.argv[1:]}}))"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("module", "unneeded"),
    [
        ("nao_tools._command", ["asyncio", "rich", "ssl", "zenoh"]),
        ("visualhfsm._commands.app", ["asyncio", "rich", "ssl", "starlette", "zenoh"]),
        ("codegen.command", ["msgspec", "pyflakes", "rich", "ssl"]),
        ("hfsm_runtime.command", ["asyncio", "email", "html", "importlib.metadata", "json", "numpy"]),
        ("hfsm_runtime.command", ["rich", "ssl", "tomllib", "zenoh"]),
        ("naoserver_sim._command", ["OpenGL", "asyncio", "rich", "ssl", "visualhfsm_own_robots", "zenoh"]),
    ],
)
def test_what_a_command_may_not_need_is_not_loaded(module: str, unneeded: list[str]) -> None:
    done = subprocess.run(
        [sys.executable, "-c", LOADED.format(module=module), *unneeded],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        text=True,
        timeout=RUN_LIMIT,
        check=True,
    )
    assert done.stdout.strip() == "[]"
