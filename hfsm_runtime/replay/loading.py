"""Load a generated component from its file, without running it."""

from __future__ import annotations

import importlib.util
import sys
from itertools import count
from pathlib import Path

from ..component import Component
from ..control.loading import components_in
from .errors import ReplayError

__all__ = ["load"]

_numbers = count(1)


def load(file: Path) -> type[Component]:
    """Return the class of the component that a file defines; raises ReplayError.

    Its imports run, as they do when it is started.
    """
    name = f"{file.stem}_{next(_numbers)}"  # two versions of a component must not be one module
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise ReplayError(f"{file} is no Python file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses and the like look themselves up
    sys.path.insert(0, str(file.parent))  # what is written by hand stands beside it
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        raise ReplayError(f"{file.name} cannot be loaded: {type(error).__name__}: {error}") from error
    finally:
        sys.path.remove(str(file.parent))
    components = components_in(module)
    if len(components) != 1:
        raise ReplayError(f"{file.name} defines {len(components)} components, not one")
    return components[0]
