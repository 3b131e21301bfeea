"""Settings: their sources, their precedence, and which values are refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given

from tests.support.any_text import any_text
from zenoh_ice.application.cli import describe
from zenoh_ice.data.exceptions import ConfigurationException
from zenoh_ice.settings import Security, Settings, load_settings


def write(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize("name", Settings.__struct_fields__)
def test_every_setting_is_checked(name: str) -> None:
    with pytest.raises(ConfigurationException, match=f"the program: {name}"):
        Settings().override(**{name: object()})


@pytest.mark.parametrize("name", Security.__struct_fields__)
def test_every_setting_of_security_is_checked(name: str) -> None:
    with pytest.raises(ConfigurationException, match=rf"the program: security\.{name}(:| = )"):
        Settings().override(security={name: object()})


def test_later_sources_win_and_origins_are_remembered(tmp_path: Path) -> None:
    file = write(tmp_path / "robot.toml", 'realm = "file"\ntimeout = 3\nclock = "sim"\nlisten = []\n')
    settings = load_settings(
        file,
        {"timeout": 5.0, "connect": None},
        defaults={"log_level": "info", "realm": "command"},
        environment={"VISUALHFSM_CLOCK": "wall", "VISUALHFSM_TIMEOUT": "4", "HOME": "/"},
    )
    assert settings == Settings(realm="file", timeout=5.0, clock="wall", listen=(), log_level="info")
    assert settings.origins == {
        "realm": str(file),
        "listen": str(file),
        "clock": "VISUALHFSM_CLOCK",
        "timeout": "--timeout",
        "log_level": "default",
    }
    described = {line.split()[0]: line for line in describe(settings).splitlines()}
    assert described["realm"].endswith(f" {file}")
    assert described["clock"].endswith(" VISUALHFSM_CLOCK")
    assert described["connect"].endswith(" default")


def test_environment_parses_every_type() -> None:
    settings = load_settings(
        environment={
            "VISUALHFSM_CONNECT": "tcp/10.0.0.1:7447, tcp/[::1]:9",
            "VISUALHFSM_LISTEN": "",
            "VISUALHFSM_LOCAL_SOCKETS": "False",
            "VISUALHFSM_DISPATCH_THREADS": "3",
            "VISUALHFSM_LOG_LEVEL": "DEBUG",
        }
    )
    assert settings.connect == ("tcp/10.0.0.1:7447", "tcp/[::1]:9")
    assert settings.listen == ()
    assert settings.local_sockets is False
    assert settings.dispatch_threads == 3
    assert settings.log_level == "debug"


def test_environment_can_name_the_file(tmp_path: Path) -> None:
    file = write(tmp_path / "robot.toml", 'realm = "file"')
    assert load_settings(environment={"VISUALHFSM_CONFIG": str(file)}).realm == "file"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("reelm = 'x'", ["reelm", "realm"]),
        ("realm = 3", ["realm", "3"]),
        ("realm = 'a/b'", ["realm", "'a/b'"]),
        ("realm = '*'", ["realm"]),
        ("realm = 'nao@lab'", ["realm"]),
        ("connect = 'tcp/127.0.0.1:7447'", ["connect", "list"]),
        ("connect = ['127.0.0.1:7447']", ["127.0.0.1:7447", "PROTOCOL/ADDRESS"]),
        ("connect = ['http/127.0.0.1:7447']", ["'http/127.0.0.1:7447'", "PROTOCOL/ADDRESS"]),
        ("connect = ['tcp/127.0.0.1']", ["'tcp/127.0.0.1'", "tcp/HOST:PORT"]),
        ("connect = ['tcp/127.0.0.1:0']", ["'tcp/127.0.0.1:0'", "port from 1 to 65535"]),
        ("listen = ['tcp/127.0.0.1:70000']", ["'tcp/127.0.0.1:70000'", "port from 0 to 65535"]),
        ("listen = ['tcp/127.0.0.1:65536']", ["'tcp/127.0.0.1:65536'", "port from 0 to 65535"]),
        ("listen = ['unixsock-stream/']", ["'unixsock-stream/'", "unixsock-stream/PATH"]),
        (f"listen = ['unixsock-stream/{'x' * 108}']", ["at most 107 characters"]),
        ("listen = [7447]", ["listen"]),
        ("clock = 'sun'", ["clock", "auto, wall, sim"]),
        ("timeout = true", ["timeout"]),
        ("timeout = nan", ["timeout"]),
        ("timeout = 600", ["timeout", "60"]),
        ("local_sockets = 1", ["local_sockets", "true or false"]),
        ("log_level = 'loud'", ["log_level"]),
        ("dispatch_threads = 0", ["dispatch_threads"]),
        ("realm = \nclock = 1", ["TOML", "line 1"]),
        pytest.param(f"timeout = {'9' * 400}", ["timeout", "60"], id="longer than a float"),
        pytest.param(f"timeout = {'9' * 5000}", ["TOML", "4300 digits"], id="longer than Python reads"),
        pytest.param(f"timeout = 0x{'f' * 5000}", ["thousands of digits"], id="longer than Python writes"),
        pytest.param(f"realm = {{a = 0x{'f' * 5000}}}", ["thousands of digits"], id="long in a table"),
        pytest.param(f"realm = '{'x' * 9000}'", ["realm", "...: a realm is"], id="too long to show"),
        pytest.param(f"connect = {'[' * 5000}", ["TOML", "too deeply"], id="too deep"),
    ],
)
def test_a_bad_file_is_refused_with_its_name(tmp_path: Path, text: str, expected: list[str]) -> None:
    file = write(tmp_path / "robot.toml", text)
    with pytest.raises(ConfigurationException) as raised:
        load_settings(file, environment={})
    message = str(raised.value)
    assert message.startswith((f"{file}:1: ", f"{file}: not TOML: "))
    for part in expected:
        assert part in message


@pytest.mark.parametrize(
    "endpoint",
    [
        "tcp/127.0.0.1:0",
        "udp/nao.local:9",
        "tls/[fe80::1%2]:10000",
        "quic/h:65535?a=b",
        "unixsock-stream//tmp/nao",
    ],
)
def test_endpoints_are_accepted(endpoint: str) -> None:
    assert Settings(listen=[endpoint]).listen == (endpoint,)  # type: ignore[arg-type]


def test_a_missing_file_is_reported(tmp_path: Path) -> None:
    with pytest.raises(ConfigurationException, match=r"none\.toml: cannot be read: No such file"):
        load_settings(tmp_path / "none.toml", environment={})


def test_a_file_of_an_impossible_name_is_reported() -> None:
    with pytest.raises(ConfigurationException, match="null byte"):
        load_settings(environment={"VISUALHFSM_CONFIG": "a\0b"})


@pytest.mark.parametrize(
    ("variable", "text"),
    [
        ("VISUALHFSM_TIMEOUT", "soon"),
        ("VISUALHFSM_LOCAL_SOCKETS", "maybe"),
        ("VISUALHFSM_DISPATCH_THREADS", "2.5"),
        ("VISUALHFSM_REALM", ""),
        ("VISUALHFSM_REELM", "x"),
    ],
)
def test_a_bad_variable_is_refused_with_its_name(variable: str, text: str) -> None:
    with pytest.raises(ConfigurationException, match=f"^{variable}: "):
        load_settings(environment={variable: text})


def test_a_bad_flag_is_refused_with_its_name() -> None:
    with pytest.raises(
        ConfigurationException, match=r"^--log-level: log_level = 'loud': write one of debug, "
    ):
        load_settings(None, {"log_level": "loud"}, environment={})


def test_a_program_can_override_and_is_checked() -> None:
    settings = Settings().override(realm="lab", connect=["tcp/localhost:7447"])
    assert settings.realm == "lab"
    assert settings.connect == ("tcp/localhost:7447",)
    with pytest.raises(ConfigurationException, match="the program: realm"):
        Settings(realm="a b")
    with pytest.raises(
        ConfigurationException, match="the program: relm: there is no such key; there is realm, "
    ):
        Settings().override(relm="lab")


@given(any_text())
def test_no_realm_breaks_out_of_its_chunk(realm: str) -> None:
    try:
        accepted = Settings(realm=realm).realm
    except ConfigurationException:
        return
    assert accepted
    assert not set(accepted) & set("/*$#?@ \n")


@given(any_text(max_size=40))
def test_an_endpoint_is_accepted_or_refused_by_our_exception(endpoint: str) -> None:
    try:
        settings = Settings(listen=(endpoint,))
    except ConfigurationException:
        return
    assert "/" in settings.listen[0]
