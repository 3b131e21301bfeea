"""Functions of a plan: Python files beside it, which judge and measure trials."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

from codegen.reasons import reason
from hfsm_runtime.errors import describe
from hfsm_runtime.loading import load_module

from ._errors import TrialsError

T = TypeVar("T")


class FunctionFailed(Exception):
    """A function of a plan raised an exception; the text says which one."""


def call_function(reference: str, folder: Path, run: object, take: Callable[[Any], T]) -> T:
    """Return what is taken from the result of a function of a plan for a run.

    Raises TrialsError; and FunctionFailed, also for a result that cannot be taken.
    """
    function = load_function(reference, folder)
    try:
        return take(function(run))
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # what `sys.exit` and `pytest.fail` raise, too
        raise FunctionFailed(f"{reference}: {describe(error)}") from error


def load_function(reference: str, folder: Path) -> Callable[..., Any]:
    """Return a function by `FILE.py:NAME`, the file relative to the plan's folder. Raises TrialsError."""
    file, _, name = reference.rpartition(":")
    path = (folder / file).resolve()
    if not path.is_file():
        raise TrialsError.because("{reference}: there is no file {path}", reference=reference, path=str(path))
    module = _load(path, path.stat().st_mtime_ns)
    function = getattr(module, name, None)
    if not callable(function):
        raise TrialsError.because(
            "{reference}: {path} defines no function {name}", reference=reference, path=path.name, name=name
        )
    return function  # type: ignore[no-any-return]


def forget_functions() -> None:
    """Load the files again when they are used again."""
    _load.cache_clear()


@lru_cache(maxsize=32)
def _load(path: Path, changed: int) -> ModuleType:  # noqa: ARG001 - loaded again when it was edited
    try:
        return load_module(f"_trials_{path.stem}", path)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise TrialsError.because(
            "{path}: cannot be loaded: {name}: {reason}",
            path=str(path),
            name=type(error).__name__,
            reason=reason(error),
        ) from error
