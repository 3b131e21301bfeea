"""Names that mean something else in Python, in the generated module, or in its base classes."""

from __future__ import annotations

import pickle
from pathlib import Path

import msgpack
import msgspec

from tests.support.slice_compiler import AWKWARD, imported


def test_awkward_names_keep_their_spelling_on_the_wire(tmp_path: Path) -> None:
    with imported(tmp_path, "awkward_out", AWKWARD) as package:
        module = __import__(f"{package.__name__}.awkward", fromlist=["list"])
        payload = msgspec.msgpack.encode(module.list(1, "a", 2))
        assert msgpack.unpackb(payload) == {"from": 1, "lambda": "a", "self": 2}
        worse = module.Worse("a", 1, "n", module.Time(1), module.Color._None)
        assert msgpack.unpackb(msgspec.msgpack.encode(worse.ice_members())) == {
            "args": "a",
            "with_traceback": 1,
            "None": "n",
            "when": {"x": 1},
            "color": 1,
        }
        assert pickle.loads(pickle.dumps(worse)).args == worse.args
        operations = module.propertyPrx.ice_interface.all_operations
        assert {"from", "lambda", "checkedCast"} <= set(operations)
        assert module.greeting == "say \"hi\" 'there' \n \\ \t"
        assert [base.type_id for base in module.Diamond.ice_interface.lineage] == [
            "::awkward::Diamond",
            "::awkward::Deeper",
            "::awkward::Object2",
        ]


def test_classes_may_be_null_and_refer_to_themselves(tmp_path: Path) -> None:
    with imported(tmp_path, "nodes_out", AWKWARD) as package:
        module = __import__(f"{package.__name__}.awkward", fromlist=["Node"])
        tree = module.Node([module.Node([], None), None], None)
        decoder = msgspec.msgpack.Decoder(module.Node)
        assert decoder.decode(msgspec.msgpack.encode(tree)) == tree
