"""Interfaces, their lineage, and what differs between two versions."""

from __future__ import annotations

from zenoh_ice.generated import Interface, Operation, Struct
from zenoh_ice.operation import first_difference


class Nothing(Struct):
    pass


def operation(name: str) -> Operation[[], None]:
    return Operation(name, arguments=Nothing, result=Nothing)


def test_lineage_has_each_interface_once_and_itself_first() -> None:
    root = Interface("::t::Root", operations=(operation("a"),))
    left = Interface("::t::Left", bases=(root,), operations=(operation("b"),))
    right = Interface("::t::Right", bases=(root,), operations=(operation("c"),))
    bottom = Interface("::t::Bottom", bases=(left, right))
    assert bottom.lineage == (bottom, left, root, right)
    assert bottom.type_ids == ("::Ice::Object", "::t::Bottom", "::t::Left", "::t::Right", "::t::Root")
    assert set(bottom.all_operations) == {"a", "b", "c"}


def test_difference_names_the_first_line_on_each_side() -> None:
    assert first_difference("a\nb: int\nc", "a\nb: long\nc") == (
        "the proxy has `b: int` where the servant has `b: long`"
    )
    assert first_difference("a\nb", "a") == "the servant lacks `b`"
    assert first_difference("a", "a\nb") == "the proxy lacks `b`"
    assert first_difference("a\nb", "b\na") == "the same members stand in another order"
