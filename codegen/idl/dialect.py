"""Which rules of Slice hold: those of Ice 3.7 to the letter, or those that files in use keep."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Dialect:
    """What is allowed beyond Slice 3.7; each field allows one thing."""

    underscores: bool = True
    """Underscores inside of names: `left_arm`."""
    ice_names: bool = True
    """Names that begin with `ice`: `iceberg`."""
    colon_extends: bool = True
    """`:` for `extends`, as in Ice 3.8."""
    value_as_name: bool = True
    """`Value`, a keyword since 3.7, as the name of a member or a parameter."""


DEFAULT = Dialect()
STRICT_3_7 = Dialect(underscores=False, ice_names=False, colon_extends=False, value_as_name=False)
