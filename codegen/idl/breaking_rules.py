"""The codes of changes that break programs, and what each breaks."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum, StrEnum

__all__ = ["Break", "BreakingRule"]


class Break(StrEnum):
    """How a change breaks: WIRE, old and new programs refuse each other; SOURCE, code must be rewritten."""

    WIRE = "wire"
    SOURCE = "source"


@dataclass(frozen=True, slots=True)
class _Facts:
    code: str
    breaks: tuple[Break, ...]
    consequence: str


_BOTH = (Break.WIRE, Break.SOURCE)


class BreakingRule(Enum):
    """A kind of change, with its code, what it breaks, and whom it hits."""

    INTERFACE_REMOVED = _Facts("B101", _BOTH, "clients no longer find it, and servants of it no longer run")
    TYPE_REMOVED = _Facts("B102", (Break.SOURCE,), "code that names it no longer runs")
    KIND_CHANGED = _Facts("B103", _BOTH, "values of the old kind are refused, and code for it no longer runs")

    OPERATION_REMOVED = _Facts("B201", _BOTH, "clients that call it fail")
    OPERATION_ADDED = _Facts("B202", _BOTH, "servants must implement it, and old servants are refused")
    RETURN_CHANGED = _Facts("B203", _BOTH, "clients misread the result")
    PARAMETER_REMOVED = _Facts("B204", _BOTH, "calls and servants have one parameter too many")
    PARAMETER_ADDED = _Facts("B205", _BOTH, "calls and servants lack a parameter")
    PARAMETER_TYPE_CHANGED = _Facts("B206", _BOTH, "the value is refused where it arrives")
    PARAMETER_RENAMED = _Facts("B207", _BOTH, "parameters travel by name")
    PARAMETERS_REORDERED = _Facts("B208", _BOTH, "callers pass values in the old order")
    EXCEPTION_ADDED = _Facts("B209", _BOTH, "clients do not expect it")
    EXCEPTION_REMOVED = _Facts(
        "B210", _BOTH, "a servant that still throws it is answered with UnknownException"
    )
    IDEMPOTENCE_CHANGED = _Facts(
        "B211", (Break.WIRE,), "the sides disagree whether a lost call may be repeated"
    )
    STREAM_REMOVED = _Facts(
        "B212", _BOTH, "subscribers wait for ever, and servants no longer have its publisher"
    )
    STREAM_ADDED = _Facts("B213", (Break.WIRE,), "old servants publish nothing and are refused")
    BASE_REMOVED = _Facts("B214", _BOTH, "proxies of the base no longer accept the servant")
    BASE_ADDED = _Facts("B215", _BOTH, "servants must implement its operations")
    BASES_REARRANGED = _Facts(
        "B216", (Break.WIRE,), "the sides refuse each other, although nothing else changed"
    )
    AMD_REMOVED = _Facts("B217", (Break.SOURCE,), "servants must return values: no futures, no coroutines")
    STOP_REMOVED = _Facts("B218", (Break.SOURCE,), "a component that ends no longer stops what it commanded")

    MEMBER_REMOVED = _Facts("B301", _BOTH, "receivers miss it, and code that reads it fails")
    MEMBER_ADDED = _Facts("B302", _BOTH, "old senders lack it, and code that makes the value must give it")
    OPTIONAL_MEMBER_ADDED = _Facts("B303", (Break.WIRE,), "old receivers leave it out and are refused")
    MEMBER_TYPE_CHANGED = _Facts("B304", _BOTH, "the value is refused where it arrives")
    MEMBER_RENAMED = _Facts("B305", _BOTH, "members travel by name")
    MEMBERS_REORDERED = _Facts("B306", (Break.SOURCE,), "code passes members in the old order")
    MEMBER_NOW_OPTIONAL = _Facts("B307", _BOTH, "receivers may miss it, and code must expect None")
    MEMBER_NOW_REQUIRED = _Facts("B308", _BOTH, "senders may leave it out")
    DEFAULT_REMOVED = _Facts("B309", (Break.SOURCE,), "code that relies on the default value must give one")
    PARENT_CHANGED = _Facts("B310", _BOTH, "code that expects the old base misses it")

    ENUMERATOR_REMOVED = _Facts(
        "B401", _BOTH, "its value is refused where it arrives, and code that names it fails"
    )
    ENUMERATOR_ADDED = _Facts("B402", (Break.WIRE,), "old receivers refuse its value")
    ENUMERATOR_VALUE_CHANGED = _Facts("B403", _BOTH, "one value means two things")

    ELEMENT_CHANGED = _Facts("B501", _BOTH, "the elements are refused where they arrive")
    CONSTANT_CHANGED = _Facts("B502", (Break.SOURCE,), "the sides work with different values")

    @property
    def code(self) -> str:
        """The code, as `B101`."""
        return self.value.code

    @property
    def breaks(self) -> tuple[Break, ...]:
        """What breaks."""
        return self.value.breaks

    @property
    def consequence(self) -> str:
        """Whom it hits, and how."""
        return self.value.consequence
