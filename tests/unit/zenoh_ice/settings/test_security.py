"""Settings of security: their sources, what cannot be combined, and warnings before listening."""

from __future__ import annotations

import logging
from datetime import timedelta
from pathlib import Path

import pytest

from nao_tools._security.folder import SecurityFolder
from zenoh_ice import initialize
from zenoh_ice.application.cli import describe
from zenoh_ice.carriers.zenoh.session import session_config
from zenoh_ice.data.exceptions import ConfigurationException
from zenoh_ice.settings import Settings, load_settings
from zenoh_ice.settings.security import check_security, exposure

ROLES = {"all": {"call": ["**"]}}


@pytest.fixture(scope="module")
def keys(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("keys")
    SecurityFolder(folder).create(realm="nao", hosts=["robot.lab"], port=7447, valid=timedelta(days=1))
    return folder


def secured(**security: object) -> Settings:
    return Settings().override(security=security)


class TestSources:
    def test_each_source_gives_its_piece(self, tmp_path: Path) -> None:
        file = tmp_path / "robot.toml"
        file.write_text('[security]\nauthority = "ca.pem"\nuser = "ann"\nmutual = true\n')
        settings = load_settings(
            file,
            {"certificate": str(tmp_path / "mine.pem"), "key": None},
            environment={"VISUALHFSM_SECURITY_PASSWORD": "secret", "VISUALHFSM_SECURITY_MUTUAL": "false"},
        )
        security = settings.security
        assert (security.user, security.password, security.mutual) == ("ann", "secret", False)
        assert security.authority == str(tmp_path / "ca.pem")  # as seen from the file
        described = {line.split()[0]: line.split(None, 1)[1] for line in describe(settings).splitlines()}
        assert described["security.authority"].endswith(str(file))
        assert described["security.certificate"].endswith("--certificate")
        assert described["security.password"].split() == ["(hidden)", "VISUALHFSM_SECURITY_PASSWORD"]
        assert "secret" not in describe(settings) + repr(settings)

    @pytest.mark.parametrize(
        ("text", "message"),
        [
            ("security = 3", ":1: security = 3: write a table"),
            (
                "[security]\ncertificat = 'x'",
                ":2: security.certificat: there is no such key; there is authority, ",
            ),
            ("[security]\nkey = 3", "security.key = 3: write text"),
            ("[security]\nmutual = 1", "security.mutual = 1: write true or false"),
            ("[security.roles]\nr = 3", "security.roles.r = 3: write a table"),
            ("[security.roles.r]\ncall = ['Head']", "roles.r.call[0] = 'Head': write IDENTITY.OPERATION"),
            ("[security.users]\nann = 'r'", "users.ann: there is no role 'r'; there is none"),
            ("[security.users]\n'' = 'r'", "security.users. = '': write 1 to 64 characters"),
            ("[security.users]\nann = ['r']", "security.users.ann = ['r']: write text"),
        ],
    )
    def test_what_is_wrong_is_reported_with_its_file(self, text: str, message: str, tmp_path: Path) -> None:
        file = tmp_path / "robot.toml"
        file.write_text(text)
        with pytest.raises(ConfigurationException) as caught:
            load_settings(file, environment={})
        assert message in str(caught.value)
        assert str(file) in str(caught.value)

    def test_a_bad_password_is_not_shown(self, tmp_path: Path) -> None:
        file = tmp_path / "robot.toml"
        file.write_text("[security]\nuser = 'ann'\npassword = 4711\n")
        with pytest.raises(ConfigurationException) as caught:
            load_settings(file, environment={})
        assert str(caught.value) == f"{file}: security.password: write text"

    def test_an_unknown_variable_is_reported(self) -> None:
        with pytest.raises(
            ConfigurationException, match=r"^VISUALHFSM_SECURITY_KEI: security\.kei: there is no such key"
        ):
            load_settings(environment={"VISUALHFSM_SECURITY_KEI": "x"})


def test_another_process_is_led_to_the_same_place_as_the_same_user(tmp_path: Path) -> None:
    security = {"authority": tmp_path / "ca.pem", "user": "ann", "password": "secret"}
    settings = Settings(realm="lab", mode="client", connect=("tls/a:1", "tls/b:2")).override(
        security=security
    )
    logging = {"VISUALHFSM_LOG_FILE": "ours.log", "VISUALHFSM_LOG_FORMAT": "json"}
    assert load_settings(environment=logging | settings.environment()) == settings


class TestTogether:
    @pytest.mark.parametrize(
        ("pieces", "message"),
        [
            ({"certificate": "router.pem"}, "security.certificate and security.key belong together"),
            ({"key": "router.key"}, "security.certificate and security.key belong together"),
            ({"certificate": "router.pem", "key": "router.key"}, "without security.authority"),
            ({"user": "ann"}, "security.user and security.password belong together"),
            ({"roles": ROLES}, "security.roles without security.authority or security.passwords"),
            ({"roles": ROLES, "authority": "authority.pem", "mutual": False}, "security.roles without"),
            ({"authority": "absent.pem"}, "absent.pem': cannot be read: No such file"),
            ({"authority": "~nobody-of-this-name/a.pem"}, "this-name/a.pem': cannot be read: No such file"),
            ({"authority": "router.key"}, "no certificate in PEM"),
            (
                {"authority": "authority.pem", "certificate": "router.pem", "key": "robot.key"},
                "security.key is not its key .KEY_VALUES_MISMATCH.",
            ),
            (
                {"authority": "authority.pem", "certificate": "router.toml", "key": "robot.key"},
                "router.toml': not in PEM",
            ),
        ],
    )
    def test_what_does_not_go_together(
        self, keys: Path, pieces: dict[str, object], message: str, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.chdir(keys)
        with pytest.raises(ConfigurationException, match=message):
            initialize(secured(**pieces))

    def test_a_key_that_others_can_read_is_dangerous(self, keys: Path, tmp_path: Path) -> None:
        passwords = tmp_path / "passwords.txt"
        passwords.write_text("ann:secret\n")
        passwords.chmod(0o644)
        assert check_security(secured(passwords=passwords)) == [
            f"{passwords} can be read by others on this machine: chmod 600 it"
        ]
        passwords.chmod(0o600)
        assert check_security(secured(passwords=passwords)) == []

    @pytest.mark.parametrize(
        ("content", "message"),
        [
            ("", "lists nobody, so everybody would be accepted"),
            ("\n \n", "lists nobody, so everybody would be accepted"),
            ("ann:secret\n\nbob hidden\n", "line 3 is not NAME:PASSWORD"),
            ("ann:\n", "line 1 is not NAME:PASSWORD"),
            (":hidden\n", "line 1 is not NAME:PASSWORD"),
        ],
    )
    def test_a_file_of_passwords_has_users(self, tmp_path: Path, content: str, message: str) -> None:
        passwords = tmp_path / "passwords.txt"
        passwords.write_text(content)
        with pytest.raises(ConfigurationException) as caught:
            initialize(secured(passwords=passwords))
        assert message in str(caught.value)
        assert str(passwords) in str(caught.value)
        assert "hidden" not in str(caught.value)

    @pytest.mark.parametrize(
        ("changes", "message"),
        [
            ({"connect": ["tls/robot.lab:7447"]}, "tls/robot.lab:7447 needs security.authority"),
            ({"listen": ["quic/127.0.0.1:0"]}, "quic/127.0.0.1:0 needs security.authority"),
            (
                {"listen": ["tls/127.0.0.1:0"], "security": {"authority": "a.pem"}},
                "to listen on tls/127.0.0.1:0 needs security.certificate",
            ),
            ({"mode": "client", "security": {"roles": ROLES}}, "security.roles in a client"),
        ],
    )
    def test_endpoints_need_what_they_need(self, changes: dict[str, object], message: str) -> None:
        with pytest.raises(ConfigurationException, match=message):
            check_security(Settings().override(**changes))


def test_a_client_listens_nowhere() -> None:
    values = session_config(Settings(mode="client", listen=("tls/0.0.0.0:7447",)))
    assert values["listen"]["endpoints"] == []


@pytest.mark.slow
def test_no_link_is_made_by_other_means_or_past_who_grants_access(keys: Path) -> None:
    values = session_config(load_settings(keys / "router.toml", environment={}))
    assert values["transport"]["link"]["protocols"] == ["tls"]
    assert values["scouting"]["gossip"]["enabled"] is False
    values = session_config(Settings())
    assert "protocols" not in values["transport"]["link"]
    assert values["scouting"]["gossip"]["enabled"] is True


class TestExposure:
    @pytest.mark.parametrize(
        "endpoint",
        ["tcp/127.0.0.1:0", "tcp/[::1]:7447", "ws/localhost:1", "tcp/127.8.0.1:7", "unixsock-stream//tmp/a"],
    )
    def test_of_ones_own_machine_nothing_is_said(self, endpoint: str) -> None:
        assert exposure(Settings(listen=(endpoint,))) == []

    @pytest.mark.parametrize(
        "endpoint", ["tcp/0.0.0.0:7447", "tcp/[::]:7447", "udp/192.168.1.5:1", "ws/lab:1"]
    )
    def test_beyond_it_without_tls(self, endpoint: str) -> None:
        (reported,) = exposure(Settings(listen=(endpoint,)))
        assert reported.startswith(
            f"listening on {endpoint} without TLS: anyone on that network can see through"
        )
        assert exposure(Settings(listen=(endpoint,), mode="client")) == []

    def test_with_tls_it_depends_on_who_is_let_in(self) -> None:
        beyond = Settings(listen=("tls/0.0.0.0:7447",))
        (reported,) = exposure(beyond)
        assert "every accepted user may do everything" in reported
        (reported,) = exposure(beyond.override(security={"mutual": False}))
        assert "anyone on that network can see" in reported
        assert exposure(beyond.override(security={"roles": ROLES})) == []

    @pytest.mark.slow
    def test_it_is_logged_before_a_session_listens(self, caplog: pytest.LogCaptureFixture) -> None:
        with (
            caplog.at_level(logging.WARNING, "zenoh_ice.carriers.zenoh.session"),
            pytest.raises(ConfigurationException),  # nobody is to listen there in a test
        ):
            initialize(listen=["tcp/192.0.2.1:7447"], connect=[])
        assert "listening on tcp/192.0.2.1:7447 without TLS" in caplog.text
