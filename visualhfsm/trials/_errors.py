"""The exceptions of trials."""

from __future__ import annotations

from typing import Final

from codegen.messages import Message
from codegen.reasons import known_text
from visualhfsm._base.errors import VisualHfsmError

_A: Final = "\N{HORIZONTAL ELLIPSIS}"
"""A value of a template, that stands for any text."""

_FILE: Final = (
    Message("{place}: there is no such key; there is {keys}", place=_A, keys=_A),
    Message("{place} = {value}: write text", place=_A, value=_A),
    Message("{place} = {value}: write a number", place=_A, value=_A),
    Message("{place} = {value}: write true or false", place=_A, value=_A),
    Message("{place} = {value}: write a list", place=_A, value=_A),
    Message("{place} = {value}: write a table", place=_A, value=_A),
    Message("{place} = {value}: write one of {choices}", place=_A, value=_A, choices=_A),
    Message("{place} = {value}: Expected `{type}` >= {limit}", place=_A, value=_A, type=_A, limit=_A),
    Message("{place} = {value}: Expected `{type}` > {limit}", place=_A, value=_A, type=_A, limit=_A),
    Message("{place} = {value}: Expected `{type}` <= {limit}", place=_A, value=_A, type=_A, limit=_A),
    Message("{place} = {value}: Expected `{type}` < {limit}", place=_A, value=_A, type=_A, limit=_A),
    Message("{place} = {value}: Expected `{type}`, got `{given}`", place=_A, value=_A, type=_A, given=_A),
    Message("{place}: write both from and to, or mean and deviation", place=_A),
    Message("{place}: the list is empty; write the values to choose from", place=_A),
    Message("{place}: {key} is missing", place=_A, key=_A),
    Message("{file}: not TOML: {what}", file=_A, what=_A),
    Message("{file}: cannot be read: {what}", file=_A, what=_A),
)
"""What `zenoh_ice.toml_file` and the quantities of a plan say of its file."""


class TrialsError(VisualHfsmError):
    """Trials cannot be made, or go on; the text says what to change."""


def wrong_plan(text: str) -> TrialsError:
    """Return the error of a plan's file, with its line and key."""
    return TrialsError(known_text(text, _FILE))
