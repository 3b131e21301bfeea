"""The exceptions of the command `visualhfsm` and of its editor."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import ClassVar, Literal

from codegen.messages import NO_MESSAGE, Message, MessageError, Value
from codegen.reasons import reason

ErrorKind = Literal[
    "malformed",  # no request of this protocol
    "refused",  # a document cannot be changed, opened or saved like this
    "forbidden",  # a path that the page may not reach
    "missing",  # no such file, tab or component
    "unsaved",  # closing would lose changes: ask, then close with discard
    "shared",  # components of others drive the robot: ask, then run with their names in beside
    "exists",  # a file exists: ask, then save with overwrite
    "outside",  # the file was changed by another program: ask, then resolve
    "busy",  # too much at once
    "timeout",  # it took too long
    "internal",  # an internal error; the log says more
]
"""The kinds of errors, which the editor's page gets in addition to their texts."""


class VisualHfsmError(MessageError):
    """The base class of errors that the command reports in one line."""

    kind: ClassVar[ErrorKind] = "refused"

    @classmethod
    @contextmanager
    def in_place_of(
        cls,
        caught: type[Exception] | tuple[type[Exception], ...],
        template: str = "{reason}",
        /,
        **values: Value,
    ) -> Iterator[None]:
        """Raise such an error in place of another one in a `with` block; `{reason}` says what that was."""
        try:
            yield
        except caught as error:
            raise cls.because(template, reason=reason(error), **values) from error


class MissingPackageError(VisualHfsmError):
    """A package is not installed; the message names the command that installs it."""

    def __init__(self, package: str, extra: str) -> None:
        super().__init__(
            Message(
                "{package} is not installed; install it with: pip install 'visualhfsm[{extra}]'",
                package=package,
                extra=extra,
            )
        )


class EditError(VisualHfsmError):
    """A document could not be changed, opened or saved as requested; it is unchanged.

    `what` could not be done, `why`, and `hint`: what to do about it; each a message, or the literal of one.
    """

    def __init__(self, what: str, why: str, hint: str = NO_MESSAGE) -> None:
        self.what, self.why, self.hint = map(_message, (what, why, hint))
        values = {"what": self.what, "why": self.why}
        if hint:
            super().__init__(Message("{what}: {why}; {hint}", hint=self.hint, **values))
        else:
            super().__init__(Message("{what}: {why}", **values))


def _message(text: str) -> Message:
    return text if isinstance(text, Message) else Message(text)


class ChangedOutsideError(EditError):
    """A file was changed by another program since it was read."""

    kind = "outside"


class OldFormatError(EditError):
    """Saving would replace a file of an older format by one of the current format."""

    kind = "exists"


class WouldOverwriteError(VisualHfsmError):
    """Saving would overwrite another file."""

    kind = "exists"


class SharedRobotError(VisualHfsmError):
    """Components that were started elsewhere drive the robot."""

    kind = "shared"


class UnsavedError(VisualHfsmError):
    """Closing would lose changes."""

    kind = "unsaved"


class ForbiddenPathError(VisualHfsmError):
    """A path that the page may not reach."""

    kind = "forbidden"


class MissingError(VisualHfsmError):
    """There is no such tab or file."""

    kind = "missing"


class TooManyError(VisualHfsmError):
    """A limit is reached."""

    kind = "busy"
