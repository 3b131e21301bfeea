"""The programs of the project as typer applications, and a check of the words of a command that runs nothing."""

from __future__ import annotations

import sys
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec, module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any, Final
from unittest.mock import patch

import typer

from hfsm_runtime.command import make_app
from hfsm_runtime.component import Component

__all__ = ["PROGRAMS", "app_of", "component_app", "expand", "take"]

PROGRAMS: Final = {
    "ballmover": ("ballmover._cli", "app"),
    "codegen": ("codegen.command", "app"),
    "codegen diff": ("codegen._diff", "app"),
    "nao": ("nao_tools._command", "app"),
    "naoserver-naoqi": ("visualhfsm_naoqi.robot._command", "app"),
    "naoserver-ros2": ("visualhfsm_ros2.gateway._command", "app"),
    "naoserver-sim": ("naoserver_sim._command", "app"),
    "python -m naoserver.fake": ("naoserver.fake.__main__", "app"),
    "visualhfsm": ("visualhfsm._commands.app", "app"),
}
"""Module and name of the application of each program."""
for _name, (_module, _) in [*PROGRAMS.items()]:
    if find_spec(_module.partition(".")[0]) is None:  # a plug-in whose folder is not there
        del PROGRAMS[_name]


def app_of(program: str) -> typer.Typer:
    """Return the application of a program."""
    module, name = PROGRAMS[program]
    app = getattr(import_module(module), name)
    assert isinstance(app, typer.Typer)
    return app


def component_app(file: Path) -> typer.Typer:
    """Return the application of a generated component, whose file has one class."""
    spec = spec_from_file_location(f"component_{file.stem}", file)
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    before = set(sys.modules)
    try:
        with patch.object(sys, "path", [str(file.parent), *sys.path]):
            sys.modules[spec.name] = module
            spec.loader.exec_module(module)
            (component,) = (
                each
                for each in vars(module).values()
                if isinstance(each, type) and issubclass(each, Component) and each.__module__ == spec.name
            )
            return make_app(component)
    finally:
        # Its own ones alone: others, which it was the first to load, are in use from now on.
        for name in set(sys.modules) - before:
            if Path(getattr(sys.modules[name], "__file__", None) or "/").is_relative_to(file.parent):
                del sys.modules[name]


def expand(words: list[str], folder: Path) -> list[str]:
    """Return words as a shell in a folder passes them on: file names for patterns."""
    return [
        found
        for word in words
        for found in (
            sorted(str(path.relative_to(folder)) for path in folder.glob(word)) if "*" in word else []
        )
        or [word]
    ]


def take(app: typer.Typer, program: str, words: list[str]) -> None:
    """Check the words of a command as it does itself, without doing anything.

    Raises AssertionError if it refuses them. Paths are relative to the working directory.
    """
    command: Any = _command(app)
    text = " ".join([program, *words])
    while words and hasattr(command, "commands"):
        program, *words = words
        inner = command.get_command(None, program)  # of a plug-in, too
        assert inner is not None, f"{text}: no such command"
        command = inner
    try:
        command.make_context(program, words)
    except Exception as refused:
        if hasattr(refused, "format_message"):
            raise AssertionError(f"{text}: {refused.format_message()}") from refused
        raise


@lru_cache
def _command(app: typer.Typer) -> Any:
    return typer.main.get_command(app)
