"""The exceptions of trials."""

from __future__ import annotations

from typing import Final

from codegen.messages import template
from codegen.reasons import known_text
from visualhfsm._base.errors import VisualHfsmError

_FILE: Final = (
    template("{place}: there is no such key; there is {keys}"),
    template("{place} = {value}: write text"),
    template("{place} = {value}: write a number"),
    template("{place} = {value}: write true or false"),
    template("{place} = {value}: write a list"),
    template("{place} = {value}: write a table"),
    template("{place} = {value}: write one of {choices}"),
    template("{place} = {value}: Expected `{type}` >= {limit}"),
    template("{place} = {value}: Expected `{type}` > {limit}"),
    template("{place} = {value}: Expected `{type}` <= {limit}"),
    template("{place} = {value}: Expected `{type}` < {limit}"),
    template("{place} = {value}: Expected `{type}`, got `{given}`"),
    template("{place}: write both from and to, or mean and deviation"),
    template("{place}: the list is empty; write the values to choose from"),
    template("{place}: {key} is missing"),
    template("{file}: not TOML: {what}"),
    template("{file}: cannot be read: {what}"),
)
"""The sentences of `zenoh_ice.data.toml_file` and of a plan's quantities about its file."""


class TrialsError(VisualHfsmError):
    """Trials cannot be made, or go on; the text says what to change."""


def wrong_plan(text: str) -> TrialsError:
    """Return the error of a plan's file, with its line and key."""
    return TrialsError(known_text(text, _FILE))
