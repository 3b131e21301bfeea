"""Interfaces, their lineage, and what differs between two versions."""

from __future__ import annotations

from zenoh_ice.calls.mismatch import first_difference
from zenoh_ice.generated import Interface, Operation, Struct


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


def test_difference_names_the_first_member_and_what_each_side_has() -> None:
    assert first_difference("a\nb: int\nc", "a\nb: long\nc") == (
        "the proxy has `b: int` where the servant has `b: long`"
    )
    assert first_difference("a\nb", "a") == "the servant lacks `b`"
    assert first_difference("a", "a\nb") == "the proxy lacks `b`"
    assert first_difference("a\nb", "b\na") == "the same members stand in another order"
    assert first_difference(
        "::m::L::get(): int\n::m::L::off(): void\ninterface ::m::L",
        "::m::L::get(int a): int\n::m::L::aaa: int\ninterface ::m::L",
    ) == ("the proxy lacks `::m::L::aaa: int`")
    assert first_difference("::m::L::get(): int", "::m::L::get(int a): int") == (
        "the proxy has `::m::L::get(): int` where the servant has `::m::L::get(int a): int`"
    )
    assert first_difference("class ::m::A extends ::m::B", "class ::m::A") == (
        "the proxy has `class ::m::A extends ::m::B` where the servant has `class ::m::A`"
    )
    assert first_difference("::m::C::red = 0\nenum ::m::C", "::m::C::red = 1\nenum ::m::C") == (
        "the proxy has `::m::C::red = 0` where the servant has `::m::C::red = 1`"
    )
