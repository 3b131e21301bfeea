"""Settings of a component: defaults, overlaid by a TOML file, then by the environment, then by flags.

The types say what each setting may be; `zenoh_ice.application.cli` has the flags.
"""

from __future__ import annotations

import errno
import os
import re
import socket
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from msgspec import Meta, Struct, structs

from zenoh_ice.data.exceptions import ConfigurationException
from zenoh_ice.data.toml_file import convert, parse_toml, read_text, shown

DEFAULT_ENDPOINT: Final = "tcp/127.0.0.1:7447"
"""Default endpoint: robot servers listen on it, all others connect to it."""
LOOPBACK_6: Final = "tcp/[::1]:7447"
"""The same on a machine that has only IPv6."""
_ANY_PORT: Final = "tcp/127.0.0.1:0"
_ANY_PORT_6: Final = "tcp/[::1]:0"
ROUTER_DEFAULTS: Final[Mapping[str, object]] = {
    "mode": "router",
    "connect": (),
    "listen": (DEFAULT_ENDPOINT,),
    "log_level": "info",
}
"""Settings of a router where they differ from those of other components."""

ENVIRONMENT_PREFIX: Final = "VISUALHFSM_"  # `VISUALHFSM_REALM` sets `realm`, and so on
CONFIG_VARIABLE: Final = "VISUALHFSM_CONFIG"  # names the TOML file when no flag does
_fields: Final = cache(structs.fields)  # msgspec looks them up again each time
EVERYBODY: Final = "*"  # stands for every accepted user
PATHS: Final = ("authority", "certificate", "key", "passwords")  # settings of `[security]` that name files
PROTOCOLS: Final = ("tcp", "tls", "udp", "quic", "ws", "unixsock-stream")  # with host and port, but the last

# An endpoint is a protocol and an address; after `?` or `#` it may have options of Zenoh.
_HOST: Final = rf"(?:{'|'.join(PROTOCOLS[:-1])})/(\[[0-9A-Fa-f:.%]+\]|[A-Za-z0-9_.\-]+)"
_PORT: Final = r"[1-9][0-9]{0,3}|[1-5][0-9]{4}|6[0-4][0-9]{3}|65[0-4][0-9]{2}|655[0-2][0-9]|6553[0-5]"
_SOCKET: Final = rf"{PROTOCOLS[-1]}/[^?#\0]{{1,107}}"  # Linux takes no longer path
_AN_ENDPOINT: Final = (
    f"write PROTOCOL/ADDRESS, such as tcp/HOST:PORT with a port from %d to 65535, or {PROTOCOLS[-1]}/PATH "
    f"with a path of at most 107 characters; the protocols are {', '.join(PROTOCOLS)}"
)
_NO_ADDRESS: Final = (errno.EADDRNOTAVAIL, errno.EAFNOSUPPORT, errno.ENETUNREACH)
_GLOB: Final = r"[A-Za-z0-9_.\-*]{1,128}"
_STAR: Final = r"(?!.+\*\*|\*\*.)"  # before a pattern in which `**` stands alone


def _text(pattern: str, description: str) -> Meta:
    return Meta(pattern=rf"^{pattern}\Z", description=description)


# A realm is a chunk of a Zenoh key: no separator, no wildcard; '@' splits identity and realm in "Head@red".
_A_REALM: Final = "a realm is 1 to 64 letters, digits, '_', '-' or '.', without '/', '*' or '@'"
_OPERATIONS: Final = "write IDENTITY.OPERATION, such as Head.getPose, Camera*.* or ** alone"
_IDENTITIES: Final = "write an identity, such as Head, Hfsm.* or ** alone"
_ROS_NAMES: Final = "write a full name of ROS, such as /cmd_vel, /camera/**, /**/emergency_stop or ** alone"
_REALMS: Final = "write a realm: letters, digits, '_', '-', '.' and '*'"

Realm = Annotated[str, _text(r"[A-Za-z0-9_.\-]{1,64}", _A_REALM)]
Connect = Annotated[str, _text(rf"({_HOST}:({_PORT})|{_SOCKET})([?#].*)?", _AN_ENDPOINT % 1)]
Listen = Annotated[str, _text(rf"({_HOST}:(0|{_PORT})|{_SOCKET})([?#].*)?", _AN_ENDPOINT % 0)]
# Zenoh keeps a kilobyte for each call until its limit has passed, answered or not.
Timeout = Annotated[float, Meta(ge=0.001, le=60.0, description="write seconds from 0.001 to 60")]
Lease = Annotated[float, Meta(ge=0.1, le=60.0, description="write seconds from 0.1 to 60")]
Threads = Annotated[int, Meta(ge=1, le=256, description="write a whole number from 1 to 256")]
Text = Annotated[str, _text(r"[^\0]*", "write text")]
Name = Annotated[str, _text(r"[^\x00-\x1f\x7f-\x9f]{1,64}", "write 1 to 64 characters")]
Operation = Annotated[str, _text(rf"{_STAR}(\*\*|{_GLOB}\.[A-Za-z0-9_*]{{1,128}})", _OPERATIONS)]
IdentityPattern = Annotated[str, _text(rf"{_STAR}(\*\*|{_GLOB})", _IDENTITIES)]
RealmPattern = Annotated[str, _text(rf"{_STAR}(?!\*\*)[A-Za-z0-9_.\-*]{{1,64}}", _REALMS)]
_UNCLEAR: Final = r"(?!.*([^/]\*\*|\*\*[^/]|\*\*/\*\*?(/|\Z)))"
"""No `**` beside other characters, and no `*` or `**` as the part after it: Zenoh refuses such keys."""
RosName = Annotated[str, _text(rf"(\*\*|{_UNCLEAR}(/(\*\*|[A-Za-z0-9_*]{{1,128}})){{1,16}})", _ROS_NAMES)]
RosDomain = Annotated[int, Meta(ge=0, le=232, description="write a whole number from 0 to 232")]
_Most = Meta(max_length=256)


class Role(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What users of a role may do; each list holds patterns.

    `*` stands for any characters of an identity or an operation; `**` alone for everything.
    """

    call: Annotated[tuple[Operation, ...], _Most] = ()
    """operations to call, and streams to read"""
    read: Annotated[tuple[Operation, ...], _Most] = ()
    """streams to read, and nothing else: `["**"]` sees everything and moves nothing"""
    serve: Annotated[tuple[IdentityPattern, ...], _Most] = ()
    """identities to serve, with their streams and the status of their process"""
    realms: Annotated[tuple[RealmPattern, ...], _Most] = ()
    """realms in which the role applies; by default the realm of the component that grants it"""
    liveliness: bool = True
    """whether its processes may hold a liveliness token, by whose end robots notice that they are gone;
    thousands of tokens delay everybody, so set false for users that move nothing"""
    ros_call: Annotated[tuple[RosName, ...], _Most] = ()
    """topics of ROS to hear, and services to call; an action is `/NAME/**`. Topics whose last part is written
    without `*`, such as `/cmd_vel` or `/**/cmd_vel`, it may publish, too"""
    ros_read: Annotated[tuple[RosName, ...], _Most] = ()
    """topics of ROS to hear"""
    ros_serve: Annotated[tuple[RosName, ...], _Most] = ()
    """topics, services and actions of ROS that its nodes offer, as `naoserver-ros2` does"""
    ros_domains: Annotated[tuple[RosDomain, ...], _Most] = (0,)
    """domains of ROS in which the role applies"""


class Security(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The settings of `[security]`, which `check_security` checks together; empty, they allow everything."""

    authority: Text = ""
    """file (PEM) of the certificate of the authority that vouches for everybody else; required for TLS"""
    certificate: Text = ""
    """file (PEM) of the component's own certificate, which it shows to others"""
    key: Text = ""
    """file (PEM) of its private key"""
    user: Text = ""
    """name to log in with, if the listener asks for one"""
    password: str = ""
    """password of `user`; prefer the environment to a file"""
    passwords: Text = ""
    """file of the users who may connect: a line `NAME:PASSWORD` for each"""
    mutual: bool = True
    """whether clients that connect by TLS must show a certificate of the authority"""
    roles: dict[Name, Role] = {}
    """what each role may do; without any, everybody may do everything"""
    users: dict[Name, str] = {}
    """the role of each common name of a certificate, and of each user"""

    def __post_init__(self) -> None:
        for user, role in self.users.items():
            if role not in self.roles:
                known = ", ".join(self.roles) or "none"
                raise ValueError(f"users.{user}: there is no role {shown(role)}; there is {known}")

    def __repr__(self) -> str:
        return "Security(...)"  # it holds a password


class Settings(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, dict=True):
    """Settings for the communication of a component; docs/reference/settings.md explains each.

    A bad one raises ConfigurationException, which names the setting and where its value came from.
    """

    realm: Realm = "nao"
    """the robot or stack that the component belongs to: the first chunk of every key"""
    connect: tuple[Connect, ...] = (DEFAULT_ENDPOINT,)
    """endpoints to connect to; lost connections are retried forever"""
    listen: tuple[Listen, ...] = (_ANY_PORT,)
    """endpoints to listen on; port 0 picks a free port"""
    mode: Literal["peer", "client", "router"] = "peer"
    """`peer` talks to every other peer directly, `client` only through the router or server at `connect`; a
    `router` forwards messages of others"""
    clock: Literal["auto", "wall", "sim"] = "auto"
    """`wall`, `sim`, or `auto`: the robot's time if it is simulated"""
    timeout: Timeout = 2.0
    """longest duration of a call, and of sending one message, in s: a link that takes longer is closed"""
    lease: Lease = 2.0
    """silence, in s, after which a hung process counts as lost; the end of a process is noticed at once"""
    local_sockets: bool = True
    """whether processes of one user on one machine call each other, and exchange images and other large data,
    through sockets and memory of that machine instead of the network"""
    log_level: Literal["debug", "info", "warning", "error", "critical"] = "warning"
    """lowest level of logged messages"""
    log_file: Text = ""
    """file to log to, instead of stderr; at 10 MB it is renamed to FILE.1, and five such are kept. Each
    process needs its own: `{program}` and `{pid}` stand for its name and number"""
    log_format: Literal["text", "json"] = "text"
    """lines of text with the machine's date and time, or a JSON object on each line, with the time in UTC"""
    dispatch_threads: Threads = 8
    """threads that run callbacks and calls within the process"""
    security: Security = Security()

    def __post_init__(self) -> None:
        for field in _fields(Settings):  # msgspec checks what it converts, but not what a program passes
            name, value = field.name, getattr(self, field.name)
            value = convert(value, field.type, "the program", ConfigurationException, path=(name,))
            structs.force_setattr(self, name, value)

    @property
    def origins(self) -> Mapping[str, str]:
        """Origins of settings by their names, such as `security.key`; others have their defaults."""
        found: Mapping[str, str] = self.__dict__.get("origins", {})
        return found  # no field: files cannot set it, and comparisons ignore it

    def override(self, **changes: object) -> Settings:
        """Return a copy with changes, `security` as a table; raises ConfigurationException for bad ones."""
        return _overlay(self, changes, "the program")

    @property
    def reached_at(self) -> tuple[str, ...]:
        """Endpoints of the component: those it listens on or, of a client, connects to."""
        return self.connect if self.mode == "client" else self.listen

    def environment(self) -> dict[str, str]:
        """Return the variables with which another process joins the same realm as the same user.

        It logs text to its stderr, for the program that started it.
        """
        variables = {"realm": self.realm, "connect": ",".join(self.connect), "mode": self.mode}
        variables |= {"log_file": "", "log_format": "text"}
        own = ("authority", "certificate", "key", "user", "password")
        variables |= {f"security_{name}": text for name in own if (text := getattr(self.security, name))}
        return {f"{ENVIRONMENT_PREFIX}{name.upper()}": text for name, text in variables.items()}


def load_settings(
    toml_path: str | os.PathLike[str] | None = None,
    flags: Mapping[str, Any] | None = None,
    *,
    defaults: Mapping[str, Any] | None = None,
    environment: Mapping[str, str] | None = None,
) -> Settings:
    """Return the settings from their four sources; a later one wins.

    They are `defaults` over those of `Settings`; the TOML file, or else that of VISUALHFSM_CONFIG; variables
    of the environment, such as VISUALHFSM_REALM or VISUALHFSM_SECURITY_KEY, with commas in lists; and `flags`
    that are not None. Raises ConfigurationException, naming the source, for a file that cannot be read, an
    unknown key or a bad value.
    """
    environment = os.environ if environment is None else environment
    settings = _overlay(Settings(), defaults or {}, "default")
    if toml_path := toml_path or environment.get(CONFIG_VARIABLE):
        text, file = read_text(Path(toml_path), ConfigurationException), str(Path(toml_path))
        table = parse_toml(text, dict[str, Any], file, ConfigurationException)
        settings = _overlay(settings, table, file, text=text)
    given: list[tuple[str, str, Any]] = [
        (variable, variable.removeprefix(ENVIRONMENT_PREFIX).lower(), text)
        for variable, text in sorted(environment.items())
        if variable.startswith(ENVIRONMENT_PREFIX) and variable != CONFIG_VARIABLE
    ]
    for name, value in (flags or {}).items():
        if value is not None:
            given.append(
                (f"--{name.replace('_', '-')}", f"security_{name}" if name in PATHS else name, value)
            )
    for origin, name, value in given:
        parsed = value.lower() if name in ("mode", "clock", "log_level", "log_format") else value
        if name in ("connect", "listen") and isinstance(value, str):
            parsed = [item.strip() for item in value.split(",") if item.strip()]
        key = name.removeprefix("security_")
        change = {name: parsed} if key == name else {"security": {key: parsed}}
        settings = _overlay(settings, change, origin, strict=False)
    return settings


def _overlay(
    settings: Settings, values: Mapping[str, Any], origin: str, *, text: str = "", strict: bool = True
) -> Settings:
    """Return settings with some values changed; raises ConfigurationException that names `origin`.

    If that is a file, its `text` is given: errors name the line, and paths in it are relative to its folder.
    """
    table = {**structs.asdict(settings), **values}
    names = {name: origin for name in values if name != "security"}
    if isinstance(given := values.get("security"), Mapping):
        if not isinstance(given.get("password", ""), str):
            raise ConfigurationException(f"{origin}: security.password: write text")  # without the value
        folder = Path(origin).parent if text else Path()
        pieces = {**structs.asdict(settings.security), **given}
        for name in PATHS:
            if given.get(name) and isinstance(given[name], str | os.PathLike):
                path = Path(os.path.expanduser(given[name]))  # noqa: PTH111 - this one never fails
                # Absolute: another process that gets the path may run in another directory.
                pieces[name] = str((folder / path).absolute())
        table["security"] = pieces
        names |= {f"security.{name}": origin for name in given}
    changed = convert(table, Settings, origin, ConfigurationException, text=text, strict=strict)
    changed.__dict__["origins"] = {**settings.origins, **names}
    return changed


def host_and_port(endpoint: str) -> tuple[str, int] | None:
    """Return where an endpoint leads to; None for a file."""
    match = re.match(rf"{_HOST}:([0-9]+)", endpoint)
    return (match[1].strip("[]"), int(match[2])) if match else None


def has_address(host: str) -> bool:
    """Return whether this machine has an address, so that a server can listen there and be reached."""
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        with socket.socket(family, socket.SOCK_DGRAM) as probe:
            probe.bind((host, 0))
            probe.connect(probe.getsockname())
    except OSError as error:
        return error.errno not in _NO_ADDRESS
    return True


def has_only_ipv6() -> bool:
    """Return whether programs of this machine reach one another by IPv6 alone."""
    return not has_address("127.0.0.1") and has_address("::1")


def bound_endpoint(endpoint: str) -> str:
    """Return an endpoint to listen on: any port of 127.0.0.1 is one of ::1 on a machine without IPv4."""
    return _ANY_PORT_6 if endpoint == _ANY_PORT and has_only_ipv6() else endpoint


def is_loopback(endpoint: str) -> bool:
    """Return whether an endpoint is reached from its own machine alone."""
    place = host_and_port(endpoint)
    return place is None or bool(re.fullmatch(r"127(\.[0-9]{1,3}){3}|::1|localhost", place[0].lower()))


def uses_tls(endpoint: str) -> bool:
    """Return whether both sides of an endpoint can authenticate each other, and nobody else can listen."""
    return endpoint.startswith(("tls/", "quic/"))
