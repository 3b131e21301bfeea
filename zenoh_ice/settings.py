"""Settings of a component: defaults, overlaid by a TOML file, then by the environment, then by flags.

The types say what each setting may be, and `FLAGS` which of them have a flag.
"""

from __future__ import annotations

import ipaddress
import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from msgspec import Meta, Struct, structs

from .exceptions import ConfigurationException
from .toml_file import convert, parse_toml, read_text, shown

__all__ = ["DEFAULT_ENDPOINT", "PROTOCOLS", "Role", "Security", "Settings", "host_and_port", "load_settings"]

DEFAULT_ENDPOINT: Final = "tcp/127.0.0.1:7447"
"""Where a robot server listens and where everybody else connects to, unless told otherwise."""

ENVIRONMENT_PREFIX: Final = "VISUALHFSM_"
"""`VISUALHFSM_REALM` sets `realm`, and so on for every setting."""

CONFIG_VARIABLE: Final = "VISUALHFSM_CONFIG"
"""The environment variable that names the TOML file when no flag does."""

EVERYBODY: Final = "*"
"""The user that stands for everybody who is let in at all."""

PATHS: Final = ("authority", "certificate", "key", "passwords")
"""The settings of `[security]` that name files."""

PROTOCOLS: Final = ("tcp", "tls", "udp", "quic", "ws", "unixsock-stream")
"""What an endpoint may begin with: all but the last go on with a host and a port."""

# An endpoint is a protocol and an address; after `?` or `#` it may have options of Zenoh.
_HOST: Final = rf"(?:{'|'.join(PROTOCOLS[:-1])})/(\[[0-9A-Fa-f:.%]+\]|[A-Za-z0-9_.\-]+)"
_PORT: Final = r"[1-9][0-9]{0,3}|[1-5][0-9]{4}|6[0-4][0-9]{3}|65[0-4][0-9]{2}|655[0-2][0-9]|6553[0-5]"
_SOCKET: Final = rf"{PROTOCOLS[-1]}/[^?#\0]{{1,107}}"  # Linux takes no longer path
_AN_ENDPOINT: Final = (
    f"write PROTOCOL/ADDRESS, such as tcp/HOST:PORT with a port from %d to 65535, or {PROTOCOLS[-1]}/PATH "
    f"with a path of at most 107 characters; the protocols are {', '.join(PROTOCOLS)}"
)
_GLOB: Final = r"[A-Za-z0-9_.\-*]{1,128}"
_STAR: Final = r"(?!.+\*\*|\*\*.)"  # before a pattern in which `**` stands alone


def _text(pattern: str, description: str) -> Meta:
    return Meta(pattern=rf"^{pattern}\Z", description=description)


# A realm is a chunk of a Zenoh key: no separator, no wildcard; '@' splits identity and realm in "Head@red".
_A_REALM: Final = "a realm is 1 to 64 letters, digits, '_', '-' or '.', without '/', '*' or '@'"
_OPERATIONS: Final = "write IDENTITY.OPERATION, such as Head.getPose, Camera*.* or ** alone"
_IDENTITIES: Final = "write an identity, such as Head, Hfsm.* or ** alone"
_REALMS: Final = "write a realm: letters, digits, '_', '-', '.' and '*'"

Realm = Annotated[str, _text(r"[A-Za-z0-9_.\-]{1,64}", _A_REALM)]
Connect = Annotated[str, _text(rf"({_HOST}:({_PORT})|{_SOCKET})([?#].*)?", _AN_ENDPOINT % 1)]
Listen = Annotated[str, _text(rf"({_HOST}:(0|{_PORT})|{_SOCKET})([?#].*)?", _AN_ENDPOINT % 0)]
# Zenoh keeps a kilobyte for each call until its limit has passed, answered or not.
Timeout = Annotated[float, Meta(ge=0.001, le=60.0, description="write seconds from 0.001 to 60")]
Lease = Annotated[float, Meta(ge=0.1, le=60.0, description="write seconds from 0.1 to 60")]
Size = Annotated[int, Meta(ge=1, le=1 << 30, description="write a whole number from 1 to 1073741824")]
Threads = Annotated[int, Meta(ge=1, le=256, description="write a whole number from 1 to 256")]
Text = Annotated[str, _text(r"[^\0]*", "write text")]
Name = Annotated[str, _text(r"[^\x00-\x1f\x7f-\x9f]{1,64}", "write 1 to 64 characters")]
Operation = Annotated[str, _text(rf"{_STAR}(\*\*|{_GLOB}\.[A-Za-z0-9_*]{{1,128}})", _OPERATIONS)]
IdentityPattern = Annotated[str, _text(rf"{_STAR}(\*\*|{_GLOB})", _IDENTITIES)]
RealmPattern = Annotated[str, _text(rf"{_STAR}(?!\*\*)[A-Za-z0-9_.\-*]{{1,64}}", _REALMS)]
_Most = Meta(max_length=256)


class Role(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What those who have the role may do; each list holds patterns.

    `*` stands for any characters of an identity or an operation; `**` alone for everything.
    """

    call: Annotated[tuple[Operation, ...], _Most] = ()
    """Operations to call and, of those that are streams, to read: `["Camera*.*", "*Encoders.*"]`."""
    read: Annotated[tuple[Operation, ...], _Most] = ()
    """Streams to read, without calling anything: `["**"]` sees all and moves nothing."""
    serve: Annotated[tuple[IdentityPattern, ...], _Most] = ()
    """Identities to serve, without operations: `["*"]` for a robot, `["Hfsm.*"]` for who runs behaviors."""
    realms: Annotated[tuple[RealmPattern, ...], _Most] = ()
    """The realms in which all of that is granted; without any, that of the component that grants it."""
    liveliness: bool = True
    """Whether its processes may hold a liveliness token, by whose end robots notice that they are gone.

    Thousands of tokens delay everybody, and Zenoh has no limit to their number: false for who moves nothing.
    """


class Security(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The settings of `[security]`; all of them are empty where everybody may do everything.

    `security.check_security` looks at them together.
    """

    authority: Text = ""
    """File (PEM) of the certificate of the authority that vouches for everybody else."""
    certificate: Text = ""
    """File (PEM) of the component's own certificate, which it shows to others."""
    key: Text = ""
    user: Text = ""
    """Name under which the component logs in, where whoever listens asks for one."""
    password: str = ""
    passwords: Text = ""
    """File of the users who may connect: a line `NAME:PASSWORD` for each."""
    mutual: bool = True
    """Whether those that connect by TLS must show a certificate of the authority."""
    roles: dict[Name, Role] = {}
    """What may be done through this component, by the name of the role; without any, everything."""
    users: dict[Name, str] = {}
    """The role of each certificate, by its common name, and of each user; `*` is everybody who is let in."""

    def __repr__(self) -> str:
        return "Security(...)"  # it holds a password


class Settings(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, dict=True):
    """What a component needs to know to talk to the others.

    Every setting is checked when the object is made; a bad one raises ConfigurationException, which names the
    setting and where its value came from.
    """

    realm: Realm = "nao"
    """The robot or stack that this component belongs to: the first chunk of every key."""
    connect: tuple[Connect, ...] = (DEFAULT_ENDPOINT,)
    """Zenoh endpoints to connect to; lost ones are tried again for ever."""
    listen: tuple[Listen, ...] = ("tcp/127.0.0.1:0",)
    mode: Literal["peer", "client", "router"] = "peer"
    """A `router` passes on what others say to one another; for the others see its flag."""
    clock: Literal["auto", "wall", "sim"] = "auto"
    timeout: Timeout = 2.0
    """Longest duration of a call in s, and of sending one message: a link that takes longer is closed."""
    lease: Lease = 2.0
    """Silence in s after which a peer that hangs counts as lost; one that dies is noticed at once."""
    shared_memory: bool = True
    """Whether large payloads travel through shared memory on one machine."""
    log_level: Literal["debug", "info", "warning", "error", "critical"] = "warning"
    max_message_size: Size = 1 << 20
    """Largest payload that is decoded, in bytes, of an operation without byte sequences."""
    max_bulk_size: Size = 32 << 20
    """Largest payload that is decoded, in bytes, of an operation with byte sequences, such as images."""
    dispatch_threads: Threads = 8
    """Threads that run callbacks and the calls within the process."""
    security: Security = Security()
    """Certificates, passwords, and what others may do through this component: `[security]` of a file."""

    def __post_init__(self) -> None:
        for name, kind in _TYPES.items():  # msgspec checks what it converts, but not what a program passes
            value = convert(getattr(self, name), kind, "the program", ConfigurationException, path=(name,))
            structs.force_setattr(self, name, value)

    @property
    def origins(self) -> Mapping[str, str]:
        """Where settings came from, by their names, such as `security.key`; others have their defaults."""
        found: Mapping[str, str] = self.__dict__.get("origins", {})
        return found  # no field: files cannot set it, and comparisons ignore it

    def override(self, **changes: object) -> Settings:
        """Return a copy with some settings changed by the program; `security` takes a table of its settings.

        Raises ConfigurationException for an unknown setting or a bad value.
        """
        return _overlay(self, changes, "the program")

    def size_limit(self, *, holds_bytes: bool) -> int:
        """Return how many bytes a payload may have: more where its type holds byte sequences."""
        return self.max_bulk_size if holds_bytes else self.max_message_size

    def describe(self) -> str:
        """Return a table of the settings, passwords hidden: their names, values and where these came from.

        Of `[security]` it has what was given.
        """
        rows = {name: shown(getattr(self, name)) for name in _TYPES if name != "security"}
        given = [name for name in structs.asdict(self.security) if f"security.{name}" in self.origins]
        rows |= {f"security.{name}": shown(getattr(self.security, name)) for name in given}
        hidden = {"security.password": "(hidden)", "security.roles": ", ".join(self.security.roles)}
        rows |= {name: text for name, text in hidden.items() if name in rows}
        widths = max(map(len, rows)), max(map(len, rows.values()))
        return "\n".join(
            f"{name:<{widths[0]}}  {text:<{widths[1]}}  {self.origins.get(name, 'default')}"
            for name, text in rows.items()
        )

    @property
    def reached_at(self) -> tuple[str, ...]:
        """Where others reach the component: where it listens or, of a client, what it connects to."""
        return self.connect if self.mode == "client" else self.listen

    def environment(self) -> dict[str, str]:
        """Return the variables by which another process belongs to the same realm, as the same user."""
        variables = {"realm": self.realm, "connect": ",".join(self.connect), "mode": self.mode}
        own = ("authority", "certificate", "key", "user", "password")
        variables |= {f"security_{name}": text for name in own if (text := getattr(self.security, name))}
        return {f"{ENVIRONMENT_PREFIX}{name.upper()}": text for name, text in variables.items()}


_TYPES: Final = {field.name: field.type for field in structs.fields(Settings)}
FLAGS: Final = {
    "realm": ("NAME", "Robot or stack to belong to."),
    "connect": ("ENDPOINT", f"Endpoint to connect to, such as {DEFAULT_ENDPOINT}; may be repeated."),
    "listen": ("ENDPOINT", "Endpoint to listen on; port 0 lets the system pick; may be repeated."),
    "mode": ("peer|client", "Talk to every peer directly, or through the router or server at --connect."),
    "clock": ("auto|wall|sim", "Time to go by: the wall's, or the robot's; auto: that if it is simulated."),
    "timeout": ("SECONDS", "Longest duration of a call."),
    "log_level": ("LEVEL", "Least severe messages to log: debug, info, warning, error or critical."),
    "authority": ("PEM", "Who vouches for others, for TLS."),
    "certificate": ("PEM", "What others know us by."),
    "key": ("PEM", "Key of the certificate."),
}
"""The settings that have a flag: what stands for the value in a command's help, and what it is."""


def load_settings(
    toml_path: str | os.PathLike[str] | None = None,
    flags: Mapping[str, Any] | None = None,
    *,
    defaults: Mapping[str, Any] | None = None,
    environment: Mapping[str, str] | None = None,
) -> Settings:
    """Return the settings from their four sources; a later one wins.

    1. the defaults, with those of the component over those of `Settings`;
    2. the keys of the TOML file (without one, of the file that VISUALHFSM_CONFIG names);
    3. the environment: VISUALHFSM_REALM, VISUALHFSM_CONNECT, ... (lists are separated by commas), and
       VISUALHFSM_SECURITY_AUTHORITY, ... for those of `[security]`;
    4. the flags; a flag that is None was not given.

    Raises ConfigurationException, naming the source, for a file that cannot be read, an unknown key or a bad
    value.
    """
    environment = os.environ if environment is None else environment
    settings = _overlay(Settings(), defaults or {}, "default")
    if toml_path := toml_path or environment.get(CONFIG_VARIABLE):
        text, file = read_text(Path(toml_path), ConfigurationException), str(Path(toml_path))
        table = parse_toml(text, dict[str, Any], file, ConfigurationException)
        settings = _overlay(settings, table, file, text=text)
    for variable in sorted(environment):
        if variable.startswith(ENVIRONMENT_PREFIX) and variable != CONFIG_VARIABLE:
            name = variable.removeprefix(ENVIRONMENT_PREFIX).lower()
            settings = _overlay_one(settings, name, environment[variable], variable)
    for name, value in (flags or {}).items():
        if value is not None:
            full_name = f"security_{name}" if name in PATHS else name
            settings = _overlay_one(settings, full_name, value, f"--{name.replace('_', '-')}")
    return settings


def _overlay(
    settings: Settings, values: Mapping[str, Any], origin: str, *, text: str = "", strict: bool = True
) -> Settings:
    """Return settings of which some are changed; raises ConfigurationException that names `origin`.

    If that is a file, its `text` is given: errors name the line, and paths in it are relative to its folder.
    """
    folder = Path(origin).parent if text else Path()
    given = values.get("security", {})
    if isinstance(given, Mapping):
        if not isinstance(given.get("password", ""), str):
            raise ConfigurationException(f"{origin}: security.password: write text")  # without the value
        given = {key: os.fspath(it) if isinstance(it, os.PathLike) else it for key, it in given.items()}
        values = {**values, "security": given}
    part = convert(values, Settings, origin, ConfigurationException, text=text, strict=strict)
    names = given if isinstance(given, Mapping) else Security.__struct_fields__
    pieces = {name: getattr(part.security, name) for name in names}
    for name in PATHS:
        if value := pieces.get(name):
            try:  # absolute: another process that is told of the file may run in another directory
                pieces[name] = str((folder / Path(value).expanduser()).absolute())
            except RuntimeError as error:
                raise ConfigurationException(f"{origin}: security.{name} = {value!r}: {error}") from None
    security = structs.replace(settings.security, **pieces)
    for user, role in security.users.items():
        if role not in security.roles:
            known = ", ".join(security.roles) or "none"
            raise ConfigurationException(
                f"{origin}: security.users.{user}: there is no role {shown(role)}; there is {known}"
            )
    changes = {name: getattr(part, name) for name in values if name != "security"}
    changed = structs.replace(settings, **changes, security=security)
    origins = dict.fromkeys((*changes, *(f"security.{name}" for name in pieces)), origin)
    changed.__dict__["origins"] = {**settings.origins, **origins}
    return changed


def _overlay_one(settings: Settings, name: str, value: Any, origin: str) -> Settings:  # noqa: ANN401
    """Return settings of which one, such as `security_key`, is changed by a variable or a flag."""
    if isinstance(value, str):
        if name in ("connect", "listen"):
            value = [item.strip() for item in value.split(",") if item.strip()]
        elif name in ("mode", "clock", "log_level"):
            value = value.lower()
    key = name.removeprefix("security_")
    values = {name: value} if key == name else {"security": {key: value}}
    return _overlay(settings, values, origin, strict=False)


def host_and_port(endpoint: str) -> tuple[str, int] | None:
    """Return where an endpoint leads to; None for a file."""
    match = re.match(rf"{_HOST}:([0-9]+)", endpoint)
    return (match[1].strip("[]"), int(match[2])) if match else None


def is_loopback(endpoint: str) -> bool:
    """Return whether an endpoint is reached from its own machine alone."""
    place = host_and_port(endpoint)
    if place is None:
        return True
    try:
        return ipaddress.ip_address(place[0].partition("%")[0]).is_loopback
    except ValueError:
        return place[0].lower() == "localhost"


def uses_tls(endpoint: str) -> bool:
    """Return whether both sides of an endpoint can know each other, and nobody else reads what they say."""
    return endpoint.startswith(("tls/", "quic/"))
