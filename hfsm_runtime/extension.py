"""Load the code that a person wrote beside a generated component."""

from __future__ import annotations

import importlib
import importlib.util
import sys
from pathlib import Path, PurePath
from typing import Any

from .errors import ComponentError

__all__ = ["load_extension"]


def load_extension(file: str, package: str | None, module: str, name: str) -> type[Any]:
    """Return the class `name` of a module that lies in the directory of a component's `file`.

    In a package it is the package's module, and otherwise, as when the file is run or loaded by its path, the
    one of its directory. Raises ComponentError when there is no such file or no such class in it, which ends
    the program that the component is, and what importing raises.
    """
    try:
        return _class(Path(file), package, module, name)
    except ComponentError as error:
        if getattr(sys.modules.get("__main__"), "__file__", None) == file:  # nobody is there to catch it
            sys.exit(f"{PurePath(sys.argv[0]).name}: error: {error}")
        raise


def _class(component: Path, package: str | None, module: str, name: str) -> type[Any]:
    path = component.with_name(f"{module}.py")
    if not path.is_file():
        raise ComponentError(
            f"{path.name} is gone, which {component.name} extends: bring it back, or run codegen"
        )
    loaded = importlib.import_module(f"{package}.{module}") if package else _load(component, module)
    found = getattr(loaded, name, None)
    if not isinstance(found, type):
        raise ComponentError(f"{path.name} has no class {name}: write it, or remove the file and run codegen")
    return found


def _load(component: Path, module: str) -> object:
    path = component.with_name(f"{module}.py").resolve()
    known = sys.modules.get(module)
    if known is not None and Path(getattr(known, "__file__", None) or "").resolve() == path:
        return known
    spec = importlib.util.spec_from_file_location(module, path)
    if spec is None or spec.loader is None:
        raise ComponentError(f"{path.name} cannot be loaded")
    loaded = importlib.util.module_from_spec(spec)
    sys.modules[module] = loaded  # whoever asks its classes for their module finds it there
    try:
        spec.loader.exec_module(loaded)
    except BaseException:
        del sys.modules[module]
        raise
    return loaded
