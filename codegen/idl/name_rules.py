"""The rules for the spelling of names, wherever a name stands."""

from __future__ import annotations

from collections.abc import Collection

from .dialect import Dialect

_RESERVED_SUFFIXES = ("Helper", "Holder", "Prx", "Ptr")


def why_reserved(name: str, dialect: Dialect, file_metadata: Collection[str]) -> str:
    """Return why a name is reserved in a file with this metadata; nothing when it is not."""
    for suffix in _RESERVED_SUFFIXES:
        if name.endswith(suffix):
            return f"the suffix `{suffix}` is reserved"
    if name.startswith("_") or name.endswith("_") or "__" in name:
        return "a name neither begins nor ends with an underscore nor has two together"
    if "_" in name and not dialect.underscores and "underscore" not in file_metadata:
        return "names have no underscores in Slice 3.7"
    reserved_prefix = name[:3].lower() == "ice"
    if reserved_prefix and not dialect.ice_names and "ice-prefix" not in file_metadata:
        return "the prefix `ice` is reserved in Slice 3.7"
    return ""
