"""Access control: what the patterns of a role grant, by keys of Zenoh, and which roles are refused."""

from __future__ import annotations

import fnmatch
import re

import pytest
import zenoh
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs

from tests.support.any_text import any_text, matching
from tests.support.roles import allows, parse_role, rules
from zenoh_ice.data.exceptions import ConfigurationException
from zenoh_ice.settings import Role, Security
from zenoh_ice.settings.security import access_control

names = st.text("ab.-_", min_size=1, max_size=3)
globs = st.text("ab.*", min_size=1, max_size=3).filter(lambda text: "**" not in text)
operations = st.text("ab", min_size=1, max_size=3)


def matches(glob: str, name: str) -> bool:
    return re.fullmatch(fnmatch.translate(glob), name) is not None


@given(
    glob=globs,
    name=names,
    operation_glob=st.text("ab*", min_size=1, max_size=2).filter("**".__ne__),
    operation=operations,
)
def test_a_pattern_grants_the_operations_that_it_matches(
    glob: str, name: str, operation_glob: str, operation: str
) -> None:
    granted = matches(glob, name) and matches(operation_glob, operation)
    role = parse_role({"call": [f"{glob}.{operation_glob}"]})
    assert allows(role, "query", "ingress", f"nao/{name}/{operation}") == granted
    assert not allows(role, "query", "ingress", f"other/{name}/{operation}")
    assert not allows(role, "put", "ingress", f"nao/{name}/{operation}")


@pytest.mark.parametrize(
    ("pattern", "granted", "denied"),
    [
        ("*.get*", "nao/Ball/getPose", "nao/Ball/kick"),
        ("*Ball.*", "nao/RedBall/kick", "nao/RedBalls/kick"),
        ("*.*", "nao/Ball/kick", "nao/soccer/Ball/kick"),
        ("Hfsm.*.getSnapshot", "nao/Hfsm.dance/getSnapshot", "nao/Hfsm.dance/step"),
        ("**", "nao/Ball/kick", "other/Head/getPose"),
    ],
)
def test_patterns(pattern: str, granted: str, denied: str) -> None:
    role = parse_role({"call": [pattern]})
    assert allows(role, "query", "ingress", granted)
    assert not allows(role, "query", "ingress", denied)


def test_reading_everything_calls_nothing_but_what_a_servant_says_of_itself() -> None:
    role = parse_role({"read": ["**"]})
    assert allows(role, "declare_subscriber", "ingress", "nao/Head/getPose")
    assert allows(role, "put", "egress", "nao/Head/getPose")
    assert allows(role, "query", "ingress", "nao/Head/ice_describe")
    assert not allows(role, "query", "ingress", "nao/Head/getPose")
    assert not allows(role, "put", "ingress", "nao/Head/getPose")


def test_only_who_serves_answers_publishes_and_reports_servants() -> None:
    token = "@servant/nao/Hfsm.dance/::hfsm::HfsmMonitor/0/1/2"
    server, client = parse_role({"serve": ["Hfsm.*"]}), parse_role({"call": ["**"], "read": ["**"]})
    for message, key in [
        ("declare_queryable", "nao/Hfsm.dance/*"),
        ("reply", "nao/Hfsm.dance/step"),
        ("put", "nao/Hfsm.dance/getSnapshot"),
        ("liveliness_token", token),
        ("declare_queryable", "@process/nao/12/status"),
    ]:
        assert allows(server, message, "ingress", key)
        assert not allows(client, message, "ingress", key)
    assert not allows(server, "declare_queryable", "ingress", "nao/Head/*")
    assert not allows(server, "liveliness_token", "ingress", token.replace("Hfsm.dance", "Head"))
    assert allows(client, "liveliness_token", "egress", token)


def test_a_role_without_liveliness_holds_no_tokens_and_sees_those_of_others() -> None:
    mute, other = parse_role({"read": ["**"], "liveliness": False}), parse_role({"read": ["**"]})
    token = "@client/nao/c0ffee"
    assert allows(other, "liveliness_token", "ingress", token)
    assert not allows(mute, "liveliness_token", "ingress", token)
    assert allows(mute, "liveliness_token", "egress", token)
    assert allows(mute, "declare_liveliness_subscriber", "ingress", "@servant/nao/**")


def test_realms_of_a_role_take_the_place_of_that_of_the_settings() -> None:
    role = parse_role({"call": ["Head.*"], "realms": ["red*"]})
    assert allows(role, "query", "ingress", "red1/Head/getPose")
    assert not allows(role, "query", "ingress", "nao/Head/getPose")


def test_subjects_are_those_that_can_be_distinguished() -> None:
    role = Role(read=("**",))
    secured = Security(roles={"r": role, "guest": role}, users={"ann": "r", "*": "guest"})

    def subjects(**files: object) -> list[dict[str, object]]:
        compiled = access_control(structs.replace(secured, **files), "nao")
        return compiled["subjects"]  # type: ignore[no-any-return]

    everybody = {"id": "guest is everybody"}
    by_certificate = {"id": "r by certificate", "cert_common_names": ["ann"]}
    by_password = {"id": "r by password", "usernames": ["ann"]}
    assert subjects(authority="ca.pem") == [by_certificate, everybody]
    assert subjects(passwords="users.txt") == [by_password, everybody]
    assert subjects(authority="ca.pem", mutual=False, passwords="users.txt") == [by_password, everybody]


def test_roles_without_users_grant_nothing() -> None:
    compiled = access_control(Security(roles={"r": Role(call=("**",))}, authority="ca.pem"), "nao")
    assert compiled == {
        "enabled": True, "default_permission": "deny", "rules": None, "subjects": None, "policies": None
    }  # fmt: skip


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"calls": []}, r"roles\.r\.calls: there is no such key; there is call, read"),
        ({"call": "Head.*"}, r"roles\.r\.call = 'Head\.\*': write a list"),
        ({"call": ["Head"]}, r"call\[0\] = 'Head': write IDENTITY\.OPERATION"),
        ({"call": ["a/b.c"]}, "IDENTITY.OPERATION"),
        ({"call": ["Head.**"]}, r"'Head\.\*\*': write .*\*\* alone"),
        ({"call": ["nao/$*.x"]}, "IDENTITY.OPERATION"),
        ({"call": ["@servant/x.y"]}, "IDENTITY.OPERATION"),
        ({"serve": ["Head+debug"]}, r"serve\[0\] = 'Head\+debug': write an identity"),
        ({"serve": ["Head\n"]}, "write an identity"),
        ({"realms": ["a/b"]}, r"realms\[0\] = 'a/b': write a realm"),
        ({"realms": ["**"]}, "write a realm"),
        ({"liveliness": ["no"]}, "liveliness = .*: write true or false"),
        ({"call": ["a.b"] * 257}, "length <= 256"),
        ([], r"roles\.r = \[\]: write a table"),
    ],
)
def test_what_is_no_role_is_refused(table: object, message: str) -> None:
    with pytest.raises(ConfigurationException, match=message):
        parse_role(table)


@given(any_text(max_size=12) | matching(r"(/[ab*]{1,3}){1,4}"))
def test_whatever_is_accepted_makes_keys(pattern: str) -> None:
    rights = ("ros_call", "ros_serve") if pattern.startswith("/") else ("call", "read")
    try:
        role = parse_role({right: [pattern] for right in rights})
    except ConfigurationException:
        return
    for rule in rules(role):
        for key in rule["key_exprs"]:  # type: ignore[attr-defined]
            zenoh.KeyExpr(key)
