"""Exceptions of the runtime: what is wrong with a component, and how its code is told to end."""

from __future__ import annotations

__all__ = [
    "ComponentError",
    "ComponentStoppedError",
    "DefinitionError",
    "MissingLibraryError",
    "NotConnectedError",
    "VariablesError",
]


class ComponentError(Exception):
    """The root of what the runtime raises about a component."""


class DefinitionError(ComponentError):
    """The automata of a component do not make sense, such as one without an initial state."""


class MissingLibraryError(ComponentError, ImportError):
    """A library that the document names is not installed, or cannot be imported."""


class ComponentStoppedError(BaseException):
    """The component ends: raised out of `self.sleep`, so that no cycle outlives its component.

    It is no Exception, so that `except Exception` in user code lets it pass.
    """


class NotConnectedError(ComponentError, AttributeError):
    """A proxy was used before the component was connected."""


class VariablesError(ComponentError):
    """The variables of a document could not be given their first values."""
