"""Load a component's own file again, as it is on the disk now."""

from __future__ import annotations

import inspect
import linecache
import sys
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from itertools import count
from pathlib import Path
from types import CodeType, ModuleType
from typing import Final

from ..component import Component, source_of
from ..errors import ReloadRefusedError
from ..source_map import locate

__all__ = ["components_in", "forget", "load_again"]

_numbers = count(1)
_MARK: Final = "_reloaded_"


class _FreshLoader(SourceFileLoader):
    """Compile a file whenever it is loaded: what was cached may be of the same second and the same size."""

    def get_code(self, fullname: str) -> CodeType:
        path = self.get_filename(fullname)
        return self.source_to_code(self.get_data(path), path)


def load_again(component: Component) -> type[Component]:
    """Return the class of a component as its file, and its extension, define it now.

    The module gets a name of its own; the one that the component came from stays as it is. Raises
    ReloadRefusedError.
    """
    former = type(component)
    path = source_of(component)
    if not Path(path).is_file():
        raise ReloadRefusedError(f"the component was not loaded from a file that is there: {path}")
    module = _load(path, former)
    try:
        return _component_of(module, former)
    finally:
        linecache.checkcache(path)


def components_in(module: ModuleType) -> list[type[Component]]:
    """Return the components that a module defines itself, which it may have under other names, too."""
    found = (
        value
        for value in vars(module).values()
        if isinstance(value, type) and issubclass(value, Component) and value.__module__ == module.__name__
    )
    return [value for value in dict.fromkeys(found) if "automaton" in vars(value)]


def forget(component: type[Component]) -> None:
    """Let go of the module that a component was loaded from anew; its code may still run."""
    if _MARK in component.__module__:
        sys.modules.pop(component.__module__, None)


def _load(path: str, former: type[Component]) -> ModuleType:
    origin = inspect.getmodule(former)
    package = (getattr(origin, "__package__", "") or "") if origin else ""
    stem = f"{Path(path).stem}{_MARK}{next(_numbers)}"
    name = f"{package}.{stem}" if package else stem
    extension = f"{package}.{Path(path).stem}_ext" if package else f"{Path(path).stem}_ext"
    former_extension = sys.modules.pop(extension, None)  # so that the component imports it again
    spec = spec_from_loader(name, _FreshLoader(name, path))
    assert spec is not None, "a loader of a file has a spec"
    module = module_from_spec(spec)
    sys.modules[name] = module  # whoever asks a class or a function for its module finds it there
    try:
        spec.loader.exec_module(module)  # type: ignore[union-attr]
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        if former_extension is not None:
            sys.modules[extension] = former_extension
        raise ReloadRefusedError(_explain(error, path, former)) from error
    return module


def _component_of(module: ModuleType, former: type[Component]) -> type[Component]:
    found = components_in(module)
    if len(found) > 1:
        found = [value for value in found if value.__name__ == former.__name__]
    if len(found) != 1:
        del sys.modules[module.__name__]
        raise ReloadRefusedError(f"{Path(module.__file__ or '').name} does not define one component any more")
    return found[0]


def _explain(error: BaseException, path: str, former: type[Component]) -> str:
    if isinstance(error, SyntaxError) and error.filename == path:
        return f"{Path(path).name}:{error.lineno}: {error.msg}"
    place = locate(error, path, former._hfsm_document)
    text = f"{Path(path).name} cannot be loaded: {type(error).__name__}: {error}"
    return f"{text} at {place}" if place else text
