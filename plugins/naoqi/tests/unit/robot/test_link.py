"""Addresses of a robot's NAOqi as users type them."""

import pytest
from hypothesis import given

from tests.support.any_text import any_text
from visualhfsm_naoqi.robot._link import AddressError, RobotAddress


@pytest.mark.parametrize(
    ("text", "url"),
    [
        ("tcp://nao.local", "tcp://nao.local:9559"),
        ("tcp://10.0.0.7:1234", "tcp://10.0.0.7:1234"),
        ("nao.local", "tcp://nao.local:9559"),
        ("nao.local:9560/", "tcp://nao.local:9560"),
        ("tcp://[::1]:9559", "tcp://[::1]:9559"),
    ],
)
def test_an_address_needs_no_port(text, url):
    assert RobotAddress.parse(text).url == url


def test_a_robot_that_wants_a_login_has_another_port():
    address = RobotAddress.parse("tcps://nao.local", "nao", "secret")
    assert (address.url, address.user, address.password) == ("tcps://nao.local:9503", "nao", "secret")


def test_nobody_reads_the_password_in_a_log():
    address = RobotAddress.parse("tcps://nao.local", "nao", "secret")
    assert "secret" not in f"{address} {address!r}"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("udp://nao.local", "tcp://"),
        ("tcp://", "no host"),
        ("tcp://:9559", "no host"),
        ("tcp://nao:0", "no port"),
        ("tcp://nao:99999", "no valid port"),
        ("tcp://nao:x", "no valid port"),
        ("tcp://nao/path", "after the port"),
        ("tcp://nao:secret@host", "must not contain a login"),
        ("tcps://nao.local", "requires a login"),
    ],
)
def test_what_is_no_address_is_refused_with_a_reason(text, reason):
    with pytest.raises(AddressError, match=reason):
        RobotAddress.parse(text)


@given(any_text())
def test_any_text_is_an_address_or_none(text):
    try:
        address = RobotAddress.parse(text)
    except AddressError:
        return
    assert 0 < address.port < 65536
    assert address.host
