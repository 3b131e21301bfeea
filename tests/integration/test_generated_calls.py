"""Calls of a generated interface with all features of Slice, between two sessions over loopback."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support.carriers import everywhere
from tests.support.limits import EVENT_LIMIT
from tests.support.slice_compiler import imported
from tests.support.suite import Pair
from tests.support.waiting import listened
from zenoh_ice import Communicator, MarshalException
from zenoh_ice.data.reflection import describe_package

SOURCE = Path(__file__).parents[1] / "data" / "slice_output" / "everything" / "everything.idl"
ZOO = """
module zoo {
  class Animal { string name; };
  class Dog extends Animal { int tricks; };
  %s
  interface Shelter { Animal adopt(string name); };
};
"""


@pytest.fixture(scope="module")
def api(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    sources = {"everything.idl": SOURCE.read_text()}
    with imported(tmp_path_factory.mktemp("everything"), "everything_live", sources) as package:
        yield __import__(f"{package.__name__}.everything", fromlist=["Camera"])


def make_servant(api: Any) -> Any:
    class CameraI(api.Better):  # type: ignore[misc]
        def self(self, other, any, current):
            return other or (any and api.CameraPrx.uncheckedCast(any))

        def echo(self, n, current):
            return n, n, api.Empty() if n is None else n

        def root(self, o, current):
            return o

        def maybe(self, a, b, c, current):
            if b < 0:
                raise api.Rich("rich", None, None, labels={}, tail="")
            return (None if a is None else len(a)), (c and api.Node(str(c.x), [], None)), b

        def fail(self, how, current):
            node = api.Leaf("leaf", [], None, weight=how, last="end")
            camera = api.CameraPrx.uncheckedCast(current.communicator.stringToProxy("Camera"))
            raise api.Rich("rich", node, camera, api.Point(1, 2), labels={api.Point(3, 4): "x"}, tail="t")

        def getLabels(self, labels, d, b, f, current):
            assert d == {api.Named("n", api.Color.blue, api.Point(0, 0)): api.Color.red}
            assert b == {api.Color.green: api.Point(5, 6)}
            assert f == {True: 1, False: 0}
            return labels

        def getMany(self, m, d, current):
            return [*m, api.AllDefaults(d.a, d.d)]

        def getViews(self, h, current):
            return h

        def getCameras(self, m, current):
            return list(m.values())

        def getOptional(self, o, e, ns, current):
            return o

        getOptionals = getOptional

        def improve(self, how, key, current):
            return f"{how} of {key}"

    return CameraI()


@pytest.fixture
def servant(api: Any, pair: Pair) -> Any:
    servant = make_servant(api)
    pair.adapter.add(servant, "Camera")
    return servant


@pytest.fixture
def camera(api: Any, caller: Communicator, servant: Any) -> Any:
    return api.BetterPrx.checkedCast(caller.stringToProxy("Camera"))


@everywhere
def test_proxies_are_values_and_can_be_called_where_they_arrive(api: Any, camera: Any) -> None:
    returned = camera.self(camera, None)
    assert type(returned) is api.CameraPrx
    assert returned == camera
    assert returned.ice_getCommunicator() is camera.ice_getCommunicator()
    assert returned.root(None) is None
    assert camera.self(None, camera) == camera
    assert camera.self(None, None) is None
    assert camera.getCameras({"one": camera, "none": None}) == [camera, None]


@everywhere
def test_a_proxy_of_another_realm_keeps_it(camera: Any) -> None:
    other = camera.ice_getCommunicator().stringToProxy("Camera@elsewhere")
    assert camera.self(None, other).ice_toString() == "Camera@elsewhere"


@everywhere
def test_classes_arrive_as_what_they_are(api: Any, camera: Any) -> None:
    leaf = api.Leaf("leaf", [None, api.Node("child", [], None)], None, extra=1, last="end")
    tree = api.Node("root", [leaf], leaf)
    assert camera.echo(tree) == (tree, tree, tree)
    assert camera.echo(None) == (None, None, api.Empty())
    assert camera.root(leaf) == leaf
    assert camera.echo.begin(leaf).result(EVENT_LIMIT)[0] == leaf


@everywhere
def test_a_value_that_holds_itself_is_refused(api: Any, camera: Any) -> None:
    node = api.Node("root", [], None)
    node.next = node
    with pytest.raises(MarshalException, match="in a cycle"):
        camera.root(node)


@everywhere
def test_optional_parameters_and_results_may_be_absent(api: Any, camera: Any) -> None:
    assert camera.maybe(None, 1) == (None, None, 1)
    assert camera.maybe("abc", 2, api.Point(7, 8)) == (3, api.Node("7", [], None), 2)
    empty = api.Optional(b=None)
    assert camera.getOptionals(empty, api.Empty()) == empty
    assert camera.getOptionals(api.Optional(5), None, [None]) == api.Optional(5, "x")


@everywhere
def test_an_operation_that_is_marked_amd_is_served_like_any_other(camera: Any) -> None:
    assert camera.improve("more", "light") == "more of light"
    assert camera.improve.begin("less", "sound").result(EVENT_LIMIT) == "less of sound"


@everywhere
def test_exceptions_carry_anything(api: Any, camera: Any) -> None:
    with pytest.raises(api.Rich) as caught:
        camera.fail(7)
    error = caught.value
    assert (error.what, error.at, error.code, error.tail) == ("rich", api.Point(1, 2), 4, "t")
    assert error.node == api.Leaf("leaf", [], None, weight=7, last="end")
    assert error.labels == {api.Point(3, 4): "x"}
    assert type(error.camera) is api.CameraPrx
    assert error.camera.root(None) is None
    with pytest.raises(api.Bad, match="rich"):
        camera.maybe(None, -1)


def test_exceptions_with_default_values_can_be_copied_and_pickled(api: Any) -> None:
    error = api.Rich("rich", api.Node("n", [], None), None, labels={}, tail="t")
    for same in (copy.copy(error), pickle.loads(pickle.dumps(error))):
        assert type(same) is api.Rich
        assert same.ice_members() == error.ice_members()
        assert same.args == error.args


@everywhere
def test_structs_and_enumerations_are_keys(api: Any, camera: Any) -> None:
    labels = {api.Point(1, 2): "a", api.Point(2, 1): "b"}
    deep = {api.Named("n", api.Color.blue, api.Point(0, 0)): api.Color.red}
    assert camera.getLabels(labels, deep, {api.Color.green: api.Point(5, 6)}, {True: 1, False: 0}) == labels


@everywhere
def test_default_values_are_those_of_constructors(api: Any, camera: Any) -> None:
    defaults = api.Defaults(h=1)
    assert (defaults.a, defaults.b, defaults.c, defaults.f) == (5, "text", api.Color.green, 7)
    assert camera.getMany([api.AllDefaults()], defaults) == [api.AllDefaults(1, 2.5), api.AllDefaults(5, 3.0)]


@everywhere
def test_streams_bring_proxies_and_classes(api: Any, camera: Any, servant: Any) -> None:
    views = api.Views(camera, None, api.Leaf("leaf", [], None, last=""), api.Defaults(h=2))
    assert camera.getViews.latest() is None
    assert listened(servant.getViewsPublisher, EVENT_LIMIT)
    servant.getViewsPublisher.publish(views)
    arrived = camera.getViews.wait(timeout=EVENT_LIMIT).value
    assert arrived == views
    assert arrived.camera.ice_getCommunicator() is camera.ice_getCommunicator()


def test_a_class_that_the_client_does_not_know_is_refused(tmp_path: Path, pair: Pair) -> None:
    newer = ZOO % "class Puppy extends Dog { Animal mother; };"
    with (
        imported(tmp_path / "old", "zoo_old", {"zoo.idl": ZOO % ""}) as old,
        imported(tmp_path / "new", "zoo_new", {"zoo.idl": newer}) as new,
    ):
        ours = __import__(f"{old.__name__}.zoo", fromlist=["Dog"])
        theirs: Any = __import__(f"{new.__name__}.zoo", fromlist=["Dog"])

        class ShelterI(theirs.Shelter):  # type: ignore[misc]
            def adopt(self, name, current):
                return theirs.Puppy(name, 3, theirs.Animal("Bella"))

        pair.adapter.add(ShelterI(), "Shelter")
        shelter = ours.ShelterPrx.checkedCast(pair.client.stringToProxy("Shelter"))
        with pytest.raises(MarshalException, match="no class that fits is known as '::zoo::Puppy'"):
            shelter.adopt("Rex")


def test_operations_can_have_names_that_python_keeps_for_itself(tmp_path: Path, pair: Pair) -> None:
    text = """module kept { interface Names {
      int lambda(int self, int current);
      void checkedCast();
      ["stream"] idempotent int from();
    }; };"""
    with imported(tmp_path, "kept_names", {"names.idl": text}) as package:
        api: Any = __import__(f"{package.__name__}.kept", fromlist=["Names"])

        class NamesI(api.Names):  # type: ignore[misc]
            def _lambda(self, _self, current, current_):
                return _self - current

            def _checkedCast(self, current):
                pass

            def _from(self, current):
                return 7

        pair.adapter.add(servant := NamesI(), "Names")
        names = api.NamesPrx.checkedCast(pair.client.stringToProxy("Names"))
        assert names._lambda(5, 2) == names._lambda.begin(5, 2).result(EVENT_LIMIT) == 3
        names._checkedCast()
        assert names._from() == 7
        names._from.latest()
        assert listened(servant.fromPublisher, EVENT_LIMIT)
        servant.fromPublisher.publish(8)
        assert names._from.wait(timeout=EVENT_LIMIT).value == 8


def test_generated_packages_describe_what_they_define(api: Any) -> None:
    definitions = describe_package(api.__package__)
    leaf = definitions["::everything::Leaf"]
    assert (leaf.kind, leaf.bases) == ("class", ("::everything::Node",))
    assert [(member.name, member.optional, member.default) for member in leaf.members] == [
        ("weight", False, 3),
        ("extra", True, None),
        ("other", True, None),
        ("last", False, None),
    ]
    assert definitions["::everything::Node"].doc == "A node of a tree."
    assert definitions[make_servant(api).ice_interface.type_id].name == "Better"
    camera = definitions[api.CameraPrx.ice_interface.type_id]
    (maybe,) = (operation for operation in camera.operations if operation.name == "maybe")
    assert [(member.name, member.type, member.optional) for member in maybe.parameters] == [
        ("a", "string", True),
        ("b", "int", False),
        ("c", "::everything::Point", True),
    ]
    assert list(maybe.exceptions) == ["::everything::Rich"]
