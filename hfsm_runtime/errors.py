"""Exceptions of the runtime: what is wrong with a component, and how its code is told to end."""

from __future__ import annotations

__all__ = [
    "ArgumentError",
    "ComponentError",
    "ComponentStoppedError",
    "CycleCutError",
    "DefinitionError",
    "EventError",
    "MissingLibraryError",
    "NotConnectedError",
    "ReloadRefusedError",
    "UnknownElementError",
    "ValueTypeError",
    "VariablesError",
]


class ComponentError(Exception):
    """The root of what the runtime raises about a component."""


class ArgumentError(ComponentError, TypeError):
    """A state hands something to an input of its automata that the input cannot be."""


class DefinitionError(ComponentError):
    """The automata of a component do not make sense, such as one without an initial state."""


class EventError(ComponentError, ValueError):
    """An event cannot be sent with such a name or such data."""


class MissingLibraryError(ComponentError, ImportError):
    """A library that the document names is not installed, or cannot be imported."""


class ComponentStoppedError(BaseException):
    """The component ends: raised out of `self.sleep`, so that no cycle outlives its component.

    It is no Exception, so that `except Exception` in user code lets it pass.
    """


class CycleCutError(BaseException):
    """The running cycle has to end now: raised out of `self.sleep`, and told nobody.

    Either an ancestor has left the state above, or the component pauses. It is no Exception, so that
    `except Exception` in user code lets it pass.
    """


class NotConnectedError(ComponentError, AttributeError):
    """A proxy was used before the component was connected."""


class ReloadRefusedError(ComponentError):
    """A component cannot be replaced by what its file holds now; it runs on as it was."""


class UnknownElementError(ComponentError):
    """A request names something that the component does not have, or not now."""


class ValueTypeError(ComponentError, TypeError):
    """A value from outside is not of the type of what it is for, or is no value at all."""


class VariablesError(ComponentError):
    """The variables of a document could not be given their first values."""
