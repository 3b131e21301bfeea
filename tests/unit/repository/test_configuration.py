"""What pyproject.toml names is there."""

from __future__ import annotations

import tomllib

from tests.support.places import ROOT


def test_the_configuration_names_files_that_are_there() -> None:
    tool = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["tool"]
    mutated = tool["mutmut"]
    patterns = [
        *tool["ruff"]["lint"]["per-file-ignores"],
        *mutated["only_mutate"],
        *mutated["pytest_add_cli_args_test_selection"],
    ]
    named = [name for pattern in patterns for name in alternatives(pattern)]
    assert [name for name in named if not any(ROOT.glob(name))] == []


def alternatives(pattern: str) -> list[str]:
    """Return the patterns that one with braces, `{a,b/c}.py`, stands for."""
    before, brace, rest = pattern.partition("{")
    if not brace:
        return [pattern]
    inside, _, after = rest.partition("}")
    return [f"{before}{each}{end}" for each in inside.split(",") for end in alternatives(after)]
