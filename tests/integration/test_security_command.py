"""`nao security`: its files match, only their owner reads the keys, and zenohd understands its own."""

from __future__ import annotations

import stat
import time
from pathlib import Path

import pytest
import typer.testing
import zenoh
from cryptography import x509

from nao_tools._deployment.router import serve
from nao_tools._security.command import app
from nao_tools._security.folder import SecurityFilesError, hosts_of
from tests.support.limits import CALL_LIMIT, START_LIMIT
from tests.support.security import Keys
from tests.support.stranger import session_of
from zenoh_ice import initialize
from zenoh_ice.data.exceptions import ConfigurationException
from zenoh_ice.settings import ROUTER_DEFAULTS, load_settings
from zenoh_ice.settings.security import check_security


def security(*arguments: object) -> str:
    """Return what the command prints; its errors are raised."""
    result = typer.testing.CliRunner().invoke(app, [str(word) for word in arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.stdout


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    folder = tmp_path / "keys"
    security("init", folder, "--host", "robot.lab", "--host", "192.168.1.5", "--port", 7001, "--realm", "lab")
    return folder


def test_files_fit_together(folder: Path) -> None:
    router = load_settings(folder / "router.toml", environment={})
    assert (router.mode, router.realm, router.listen) == (
        "router",
        "lab",
        ("tls/0.0.0.0:7001", "tls/0.0.0.0:7002"),
    )
    assert router.security.users == {
        name: name for name in ("robot", "operator", "gateway", "student", "agent")
    }
    assert check_security(router) == []
    for name in router.security.users:
        settings = load_settings(folder / f"{name}.toml", environment={})
        port = 7001 if name in {"student", "agent"} else 7002
        connect = (f"tls/robot.lab:{port}",)
        assert (settings.mode, settings.realm, settings.connect) == ("client", "lab", connect)
        assert settings.listen == ()
        assert check_security(settings) == []


@pytest.mark.parametrize(
    ("hosts", "listens"),
    [
        (["127.0.0.1", "localhost"], "tls/127.0.0.1"),
        (["::1"], "tls/[::1]"),
        (["localhost", "robot.lab"], "tls/0.0.0.0"),
    ],
)
def test_the_router_of_one_machine_listens_there_alone(
    hosts: list[str], listens: str, tmp_path: Path
) -> None:
    security("init", tmp_path, *(word for host in hosts for word in ("--host", host)))
    router = load_settings(tmp_path / "router.toml", environment={})
    assert router.listen == (f"{listens}:7447", f"{listens}:7448")


def test_the_port_of_the_operator_can_be_chosen(tmp_path: Path) -> None:
    security("init", tmp_path, "--host", "robot.lab", "--port", 9000, "--operator-port", 8000)
    connects = {
        name: load_settings(tmp_path / f"{name}.toml", environment={}).connect
        for name in ("robot", "operator", "gateway", "student", "agent")
    }
    own, guests = ("tls/robot.lab:8000",), ("tls/robot.lab:9000",)
    assert connects == {
        "robot": own,
        "operator": own,
        "gateway": own,
        **dict.fromkeys(("student", "agent"), guests),
    }


def test_nobody_else_reads_keys(folder: Path) -> None:
    modes = {file.name: stat.S_IMODE(file.stat().st_mode) for file in folder.glob("*.key")}
    assert modes == dict.fromkeys(
        [f"{n}.key" for n in ("authority", "router", "robot", "operator", "gateway", "student", "agent")],
        0o600,
    )


def test_one_more_user(folder: Path) -> None:
    output = security("add", folder, "ann", "--role", "student")
    assert all(str(folder / name) in output for name in ("authority.pem", "ann.pem", "ann.key", "ann.toml"))
    assert load_settings(folder / "router.toml", environment={}).security.users["ann"] == "student"
    ann = load_settings(folder / "ann.toml", environment={})
    assert (ann.connect, check_security(ann)) == (("tls/robot.lab:7001",), [])
    security("add", folder, "bob", "--role", "operator")
    assert load_settings(folder / "bob.toml", environment={}).connect == ("tls/robot.lab:7002",)


def test_a_certificate_is_issued_again_for_the_same_names(folder: Path) -> None:
    before = x509.load_pem_x509_certificate((folder / "router.pem").read_bytes())
    security("renew", folder, "router", "--days", 3)
    after = x509.load_pem_x509_certificate((folder / "router.pem").read_bytes())
    assert after.not_valid_after_utc < before.not_valid_after_utc
    assert (after.subject, hosts_of(after)) == (before.subject, hosts_of(before))
    assert check_security(load_settings(folder / "router.toml", environment={})) == []
    assert stat.S_IMODE((folder / "router.key").stat().st_mode) == 0o600
    assert list(folder.glob("new.*")) == []


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["add", "FOLDER", "ann", "--role", "teacher"],
            "no role 'teacher'; there is robot, operator, gateway, student, agent",
        ),
        (["add", "FOLDER", "student", "--role", "student"], "'student' is a user already"),
        (["add", "FOLDER", "../ann", "--role", "student"], "'../ann' is not a valid name"),
        (["add", "FOLDER/absent", "ann", "--role", "student"], "router.toml: cannot be read"),
        (["init", "FOLDER"], "has an authority already: `nao security add` makes certificates of it"),
        (["init", "FOLDER/other", "--host", "a b"], "'a b' is neither the name nor the address"),
        (["init", "FOLDER/other", "--host", "robot.lab", "--host", "a b"], "'a b' is neither the name"),
        (["init", "FOLDER/other", "--realm", "a/b"], "a realm is"),
        (["renew", "FOLDER", "authority"], "an authority cannot be renewed"),
        (["renew", "FOLDER", "bob"], "bob.pem: cannot be read"),
        (["show", "FOLDER/absent.toml"], "absent.toml: cannot be read"),
        (["zenohd", "FOLDER/student.toml"], "student.toml: mode = 'client': not the settings of a router"),
    ],
)
def test_mistakes_change_nothing(folder: Path, arguments: list[str], message: str) -> None:
    before = {file: file.read_bytes() for file in folder.iterdir()}
    with pytest.raises((SecurityFilesError, ConfigurationException)) as caught:
        security(*(word.replace("FOLDER", str(folder)) for word in arguments))
    assert message in str(caught.value)
    assert {file: file.read_bytes() for file in folder.iterdir()} == before


def test_a_user_whose_files_are_partly_there_gets_none_of_the_others(folder: Path) -> None:
    (folder / "ann.toml").write_text("mine")
    with pytest.raises(SecurityFilesError, match=r"ann\.toml: cannot be written: File exists"):
        security("add", folder, "ann", "--role", "student")
    assert [file.name for file in folder.glob("ann.*")] == ["ann.toml"]
    assert (folder / "ann.toml").read_text() == "mine"
    (folder / "ann.toml").unlink()
    security("add", folder, "ann", "--role", "student")


def test_a_router_starts_with_its_own_settings_alone(folder: Path) -> None:
    student = load_settings(folder / "student.toml", defaults=ROUTER_DEFAULTS, environment={})
    with pytest.raises(ConfigurationException, match=r"student.toml: mode = 'client': not the settings"):
        serve(student, print)
    with pytest.raises(ConfigurationException, match=r"listen = \[\]: a router needs an endpoint"):
        serve(load_settings(environment={"VISUALHFSM_LISTEN": ""}, defaults=ROUTER_DEFAULTS), print)


def test_show_reports_who_may_do_what(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "120")
    output = security("show", folder / "router.toml")
    assert all(word in output for word in ("operator", "student", "*.get*", "Hfsm.*"))
    assert "known as router, until 2" in output
    output = security("show", folder / "student.toml")
    assert "known as student, until 2" in output
    assert "roles" not in output


def answer(query: zenoh.Query) -> None:
    with query:
        query.reply(query.key_expr, b"")


def test_zenohd_does_the_same_with_its_own_file(tmp_path: Path) -> None:
    keys = Keys(tmp_path / "keys")
    router = keys.folder / "router.toml"
    file = tmp_path / "router.json5"
    file.write_text(security("zenohd", router))
    # What zenohd does with it.
    with (
        zenoh.open(zenoh.Config.from_file(str(file))),
        initialize(keys.settings("robot")) as robot,
        initialize(keys.settings("student")) as student,
        session_of(robot).declare_queryable("nao/Head/*", answer),
    ):
        deadline = time.monotonic() + START_LIMIT  # for word of the queryable
        while not (replies := list(session_of(student).get("nao/Head/getPose", timeout=CALL_LIMIT))):
            assert time.monotonic() < deadline
        assert len(replies) == 1
        assert list(session_of(student).get("nao/Head/setPose", timeout=CALL_LIMIT)) == []
