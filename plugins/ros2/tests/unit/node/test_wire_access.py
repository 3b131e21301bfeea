"""Access control: what the rights of a role in ROS grant, by the keys and tokens of nodes."""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.roles import allows, parse_role
from zenoh_ros2 import _wire as wire


def ros_key(name: str) -> str:
    return wire.key(0, name, "a/msg/B", "RIHS01_0")


def ros_token(kind: wire.EntityKind, name: str) -> str:
    return wire.Entity(kind, 0, "f00", 1, 2, "/own", "node", name, "a/msg/B", "RIHS01_0").token()


@given(
    pattern=st.lists(st.sampled_from(["a", "b", "**"]), min_size=1, max_size=4).filter(
        lambda parts: ("**", "**") not in pairwise(parts)
    ),
    name=st.lists(st.sampled_from(["a", "b", "ab"]), min_size=1, max_size=4),
)
def test_a_role_announces_in_ros_what_it_may_do(pattern: list[str], name: list[str]) -> None:
    granted, used = f"/{'/'.join(pattern)}", f"/{'/'.join(name)}"
    roles = {right: parse_role({right: [granted]}) for right in ("ros_call", "ros_read", "ros_serve")}
    expected = allows(roles["ros_read"], "declare_subscriber", "ingress", ros_key(used))
    for right, kind, may in [
        ("ros_call", "MP", pattern[-1] != "**"),
        ("ros_call", "MS", True),
        ("ros_call", "SC", True),
        ("ros_call", "SS", False),
        ("ros_read", "MP", False),
        ("ros_read", "MS", True),
        ("ros_read", "SC", False),
        ("ros_serve", "MP", True),
        ("ros_serve", "SS", True),
    ]:
        token = ros_token(kind, used)  # type: ignore[arg-type]
        assert allows(roles[right], "liveliness_token", "ingress", token) == (expected and may)


@pytest.mark.parametrize(
    ("pattern", "name", "publishes"),
    [
        ("/red/cmd_vel", "/red/cmd_vel", True),
        ("/**/cmd_vel", "/red/cmd_vel", True),
        ("/*/cmd_vel", "/red/cmd_vel", True),
        ("/red/*", "/red/joint_states", False),
        ("/red/joint*", "/red/joint_states", False),
        ("/red/**", "/red/joint_states", False),
        ("**", "/tf", False),
    ],
)
def test_a_role_publishes_what_it_calls_by_name(pattern: str, name: str, publishes: bool) -> None:
    role = parse_role({"ros_call": [pattern]})
    assert allows(role, "query", "ingress", ros_key(name))
    assert allows(role, "declare_subscriber", "ingress", ros_key(name))
    assert allows(role, "put", "ingress", ros_key(name)) == publishes
    assert allows(role, "put", "ingress", f"{ros_key(name)}/@adv/pub/f00") == publishes
    assert allows(parse_role({"ros_serve": [pattern]}), "put", "ingress", ros_key(name))


def test_a_node_is_announced_by_whoever_may_use_ros() -> None:
    node = wire.Entity("NN", 0, "f00", 1, 1, "/own", "node").token()
    assert allows(parse_role({"ros_read": ["/a"]}), "liveliness_token", "ingress", node)
    assert not allows(parse_role({"read": ["**"]}), "liveliness_token", "ingress", node)
