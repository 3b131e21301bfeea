"""Values that are decoded differently than by msgspec alone: classes, proxies, default values."""

from __future__ import annotations

import builtins
import sys
from contextlib import suppress
from types import ModuleType
from typing import Any

import msgpack
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.support.any_text import any_text
from tests.support.examples import examples
from tests.support.wire_values import Desk, pack
from zenoh_ice import MarshalException, ObjectPrx
from zenoh_ice.data.codec import Codec
from zenoh_ice.data.values import StructType, WireTypes
from zenoh_ice.generated import Int, Struct, Value

DESK: Any = Desk()


class Animal(Value, tag="::zoo::Animal"):
    name: str
    friend: Animal | None


class Dog(Animal, tag="::zoo::Dog", kw_only=True):
    tricks: Int | None = None
    legs: Int = 4


class Nothing(Value, tag="::zoo::Nothing"):
    pass


class Settled(Struct):
    limit: Int = 5


class HoldsAnimal(Struct):
    animal: Animal | None


class HoldsAnything(Struct):
    anything: Value | None


class HoldsBoth(Struct):
    anything: Value | None
    animal: Animal | None


class HoldsProxy(Struct):
    proxy: ObjectPrx | None


class Plain(Struct):
    limit: Int
    name: str | None = None


class HoldsReserved(Struct):
    _class: Animal | None


class HoldsMany(Struct):
    settled: list[Settled]
    nothing: list[Nothing | None]


ANIMAL = Codec(HoldsAnimal)


def animal(**members: Any) -> bytes:
    value = {"@type": "::zoo::Animal", "name": "a", "friend": None, **members}
    return bytes(msgpack.packb({"animal": value}))


def test_a_value_arrives_as_the_class_that_it_was() -> None:
    value = Dog("Rex", Animal("Tom", Dog("Bello", None, tricks=3)), legs=3)
    assert ANIMAL.unpack(pack(ANIMAL, (value,), "x"), "x").animal == value
    anything = Codec(HoldsAnything)
    assert anything.unpack(pack(anything, (value,), "x"), "x").anything == value


def test_a_class_arrives_as_a_member_whose_name_python_reserves() -> None:
    payload = msgpack.packb({"class": {"@type": "::zoo::Animal", "name": "a", "friend": None}})
    assert Codec(HoldsReserved).unpack(payload, "x") == HoldsReserved(Animal("a", None))


def test_what_msgspec_decodes_alone_is_decoded_as_it_is() -> None:
    assert WireTypes(Plain).root is Plain


def test_classes_made_later_arrive_too() -> None:
    codec = Codec(HoldsAnimal)

    class Cat(Animal, tag="::zoo::Cat"):
        lives: Int

    assert codec.unpack(animal(), "x").animal == Animal("a", None)
    value = Cat("Tom", None, 9)
    assert codec.unpack(pack(codec, (value,), "x"), "x").animal == value


def test_what_is_decoded_adds_no_class_that_others_would_look_for() -> None:
    before = StructType.known
    ANIMAL.unpack(animal(), "x")
    Codec(HoldsAnything)
    assert StructType.known is before


def test_what_decodes_is_built_again_only_when_there_are_new_classes(monkeypatch: pytest.MonkeyPatch) -> None:
    built: list[type] = []

    class Counted(WireTypes):
        def __init__(self, struct: type[Any]) -> None:
            built.append(struct)
            super().__init__(struct)

    monkeypatch.setattr("zenoh_ice.data.codec.WireTypes", Counted)
    codec = Codec(HoldsAnimal)
    for _ in range(3):
        codec.unpack(animal(), "x")
    assert len(built) == 1

    class Hamster(Animal, tag="::zoo::Hamster"):
        pass

    for _ in range(3):
        codec.unpack(animal(), "x")
    assert len(built) == 2


def test_classes_of_a_module_that_was_unloaded_do_not_arrive(monkeypatch: pytest.MonkeyPatch) -> None:
    module = ModuleType("farm")
    monkeypatch.setitem(sys.modules, "farm", module)
    source = "class Cow(Animal, tag='::zoo::Cow'):\n    milk: 'builtins.int'\n"
    vars(module).update(Animal=Animal, builtins=builtins)
    exec(source, vars(module))
    assert (
        type(ANIMAL.unpack(animal(), "x").animal) is Animal
    )  # the classes were looked up while it was there
    monkeypatch.delitem(sys.modules, "farm")
    vars(module).clear()
    anything = Codec(HoldsAnything)
    assert anything.unpack(pack(anything, (Animal("Tom", None),), "x"), "x").anything == Animal("Tom", None)


def test_classes_whose_packages_are_still_being_imported_do_not_arrive(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    module, package = ModuleType("garden"), ModuleType("shed")
    monkeypatch.setitem(sys.modules, "garden", module)
    vars(module).update(Animal=Animal, shed=package, __name__="garden")
    exec("class Mole(Animal, tag='::zoo::Mole'):\n    tool: 'shed.Spade | None'\n", vars(module))
    anything = Codec(HoldsAnything)
    assert anything.unpack(pack(anything, (Animal("Tom", None),), "x"), "x").anything == Animal("Tom", None)
    vars(package)["Spade"] = Animal
    mole = vars(module)["Mole"]("Max", None, Animal("Tim", None))

    class Another(Animal, tag="::zoo::Another"):
        pass

    anything = Codec(HoldsAnything)
    assert anything.unpack(pack(anything, (mole,), "x"), "x").anything == mole


def test_classes_of_two_modules_that_have_the_same_type_id_are_not_mixed_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    module = ModuleType("elsewhere")
    monkeypatch.setitem(sys.modules, "elsewhere", module)
    vars(module).update(Value=Value, builtins=builtins)
    exec("class Animal(Value, tag='::zoo::Animal'):\n    cage: 'builtins.int'\n", vars(module))
    both = Codec(HoldsBoth)
    animal = Animal("Tom", Dog("Rex", None))
    assert both.unpack(pack(both, (None, animal), "x"), "x").animal == animal


@pytest.mark.parametrize(
    ("type_id", "reason"),
    [
        ("::other::Thing", "no class that fits is known as .::other::Thing"),
        ("::zoo::Nothing", "::zoo::Nothing"),
        (5, "Expected `str`"),
        (None, "Expected `str`"),
    ],
)
def test_a_class_that_does_not_fit_is_refused_with_its_place(type_id: object, reason: str) -> None:
    with pytest.raises(MarshalException, match=reason) as caught:
        ANIMAL.unpack(animal(friend={"@type": type_id, "name": "b", "friend": None}), "x")
    assert caught.value.path == "$.animal.friend.@type"


@pytest.mark.parametrize("never", [{}, {"never": ""}, {"never": "x"}])
def test_a_class_without_a_name_is_refused(never: dict[str, str]) -> None:
    with pytest.raises(MarshalException) as caught:
        ANIMAL.unpack(animal(friend={"@type": "", "name": "b", "friend": None, **never}), "x")
    assert caught.value.path.startswith("$.animal.friend.")


def test_a_value_without_its_class_is_refused() -> None:
    with pytest.raises(MarshalException, match="missing required field `@type`"):
        ANIMAL.unpack(msgpack.packb({"animal": {"name": "a", "friend": None}}), "x")


def test_a_value_that_holds_itself_is_refused_with_the_reason() -> None:
    value = Animal("a", None)
    value.friend = Animal("b", value)
    with pytest.raises(MarshalException, match="in a cycle"):
        pack(ANIMAL, (value,), "x")


def test_values_in_each_other_too_deeply_are_refused() -> None:
    shallow: Animal | None = None
    for _ in range(100):
        shallow = Animal("a", shallow)
    assert ANIMAL.unpack(pack(ANIMAL, (shallow,), "x"), "x").animal == shallow
    head = b"\x83\xa5@type" + msgpack.packb("::zoo::Animal") + b"\xa4name\xa0\xa6friend"
    with pytest.raises(MarshalException, match="nested too deeply"):
        ANIMAL.unpack(b"\x81\xa6animal" + head * 20_000 + b"\xc0", "x")


def test_an_optional_member_may_be_missing_and_one_with_a_default_value_may_not() -> None:
    dog = {"@type": "::zoo::Dog", "name": "b", "friend": None}
    assert ANIMAL.unpack(msgpack.packb({"animal": {**dog, "legs": 2}}), "x").animal == Dog("b", None, legs=2)
    with pytest.raises(MarshalException, match="missing required field `legs`"):
        ANIMAL.unpack(msgpack.packb({"animal": dog}), "x")


@pytest.mark.parametrize("member", ["settled", "nothing"])
def test_payloads_of_empty_maps_do_not_grow(member: str) -> None:
    sound: dict[str, list[object]] = {"settled": [], "nothing": []}
    codec = Codec(HoldsMany)
    codec.unpack(msgpack.packb(sound), "x")
    with pytest.raises(MarshalException, match="missing required field") as caught:
        codec.unpack(msgpack.packb({**sound, member: [{}] * 1000}), "x")
    assert caught.value.path.startswith(f"$.{member}[0].")


def test_a_proxy_arrives_as_one_of_the_communicator() -> None:
    codec = Codec(HoldsProxy)
    proxy = DESK.stringToProxy("Head")
    payload = pack(codec, (proxy,), "x")
    assert msgpack.unpackb(payload) == {"proxy": "Head@nao"}
    assert codec.unpack(payload, "x", DESK.stringToProxy) == HoldsProxy(proxy)
    assert codec.unpack(pack(codec, (None,), "x"), "x", DESK.stringToProxy) == HoldsProxy(None)
    with pytest.raises(MarshalException, match="needs a communicator"):
        codec.unpack(payload, "x")


def test_a_result_that_is_a_proxy_arrives_as_one_of_the_communicator() -> None:
    codec = Codec(HoldsProxy)
    proxy = DESK.stringToProxy("Head")
    assert codec.unpack_result(pack(codec, (proxy,), "x"), "x", DESK.stringToProxy) == proxy


def test_what_is_no_proxy_is_refused_with_what_it_is() -> None:
    with pytest.raises(MarshalException, match=r"^x: Expected a proxy, got 'a/b/c' at \$\.proxy$"):
        Codec(HoldsProxy).unpack(msgpack.packb({"proxy": "a/b/c"}), "x", DESK.stringToProxy)


@pytest.mark.parametrize(
    "text", ["", "a/b/c", "*", "Head@", "@nao", "Head\n", "a@b@c", "x" * 200, 5, {}, ["Head"]]
)
def test_what_is_no_proxy_is_refused_with_its_place(text: object) -> None:
    with pytest.raises(MarshalException) as caught:
        Codec(HoldsProxy).unpack(msgpack.packb({"proxy": text}), "x", DESK.stringToProxy)
    assert caught.value.path == "$.proxy"


def hostile(children: st.SearchStrategy[Any]) -> st.SearchStrategy[Any]:
    keys = st.sampled_from(["@type", "name", "friend", "legs", "tricks", "animal", "proxy"]) | any_text(
        max_size=2
    )
    return st.lists(children, max_size=3) | st.dictionaries(keys, children, max_size=5)


HOSTILE = st.recursive(
    st.none()
    | st.integers(-5, 5)
    | st.binary(max_size=3)
    | st.sampled_from(["", "a", "::zoo::Animal", "::zoo::Dog", "::new::X", "Head"]),
    hostile,
    max_leaves=12,
)


@settings(max_examples=examples(40), deadline=None)  # the first example builds the decoders
@given(HOSTILE, st.binary(max_size=6), st.integers(0, 60))
def test_whatever_arrives_is_taken_or_refused_with_our_exception(value: Any, noise: bytes, at: int) -> None:
    sound = {"@type": "::zoo::Dog", "name": "a", "legs": 4}
    for struct, member in ((HoldsAnimal, "animal"), (HoldsAnything, "anything"), (HoldsProxy, "proxy")):
        codec: Codec[Any] = Codec(struct)
        for inner in (value, {**sound, "friend": value}):
            payload = bytes(msgpack.packb({member: inner}))
            for sent in (payload, payload[:at] + noise + payload[at + len(noise) :]):
                with suppress(MarshalException):
                    assert isinstance(codec.unpack(sent, "x", DESK.stringToProxy), struct)


def test_what_an_error_quotes_of_a_payload_is_cut_and_made_printable() -> None:
    name = "\x1b]0;owned\x07\x1b[2J\nERROR forged" + "x" * 100_000
    with pytest.raises(MarshalException, match="no class that fits is known as") as caught:
        ANIMAL.unpack(animal(friend={"@type": name, "name": "b", "friend": None}), "x")
    assert str(caught.value).isprintable()
    assert len(str(caught.value)) < 5000
