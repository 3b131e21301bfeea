"""Settings of a component: defaults, overlaid by a TOML file, then by the environment, then by flags.

The types say what each setting may be; `toml_file.convert` checks it.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Final, Literal, get_origin, get_type_hints

from msgspec import Meta, Struct

from .endpoints import check_endpoint
from .exceptions import ConfigurationException
from .toml_file import convert, read_toml, shown

__all__ = [
    "DEFAULT_ENDPOINT",
    "ENVIRONMENT_PREFIX",
    "EVERYBODY",
    "Role",
    "Security",
    "Settings",
    "load_settings",
]

DEFAULT_ENDPOINT: Final = "tcp/127.0.0.1:7447"
"""Where a robot server listens and where everybody else connects to, unless told otherwise."""

ENVIRONMENT_PREFIX: Final = "VISUALHFSM_"
"""`VISUALHFSM_REALM` sets `realm`, and so on for every setting."""

CONFIG_VARIABLE: Final = "VISUALHFSM_CONFIG"
"""The environment variable that names the TOML file when no flag does."""

LONGEST_TIMEOUT: Final = 60.0
"""The highest limit of calls, in s: Zenoh keeps a kilobyte for each until it has passed, answered or not."""

EVERYBODY: Final = "*"
"""The user that stands for everybody who is let in at all."""

PATHS: Final = ("authority", "certificate", "key", "passwords")
"""The settings of `[security]` that name files."""

_OWN: Final = ("authority", "certificate", "key", "user", "password")
_DEFAULT_ORIGIN: Final = "default"
_CODE_ORIGIN: Final = "the program"
_WORDS: Final = {"yes": "true", "on": "true", "no": "false", "off": "false"}  # of the environment

_GLOB: Final = r"[A-Za-z0-9_.\-*]{1,128}"
_STAR: Final = r"(?!.+\*\*|\*\*.)"  # before a pattern in which `**` stands alone

# A realm is a chunk of a Zenoh key: no separator, no wildcard; '@' splits identity and realm in "Head@red".
_A_REALM: Final = "a realm is 1 to 64 letters, digits, '_', '-' or '.', without '/', '*' or '@'"
_AN_OPERATION: Final = "write IDENTITY.OPERATION, such as Head.getPose, Camera*.* or ** alone"
_AN_IDENTITY: Final = "write an identity, such as Head, Hfsm.* or ** alone"
_REALMS: Final = "write a realm: letters, digits, '_', '-', '.' and '*'"

Realm = Annotated[str, Meta(pattern=r"^[A-Za-z0-9_.\-]{1,64}\Z", description=_A_REALM)]
Endpoints = Annotated[tuple[str, ...], Meta(description="write a list of endpoints, as text")]
Timeout = Annotated[float, Meta(ge=0.001, le=LONGEST_TIMEOUT, description="write seconds from 0.001 to 60")]
Lease = Annotated[float, Meta(ge=0.1, le=LONGEST_TIMEOUT, description="write seconds from 0.1 to 60")]
Size = Annotated[int, Meta(ge=1, le=1 << 30, description="write a whole number from 1 to 1073741824")]
Threads = Annotated[int, Meta(ge=1, le=256, description="write a whole number from 1 to 256")]
Text = Annotated[str, Meta(pattern=r"^[^\0]*\Z", description="write text")]
Name = Annotated[str, Meta(pattern=r"^[^\x00-\x1f\x7f-\x9f]{1,64}\Z", description="write 1 to 64 characters")]
Operation = Annotated[
    str,
    Meta(pattern=rf"^{_STAR}(\*\*|{_GLOB}\.[A-Za-z0-9_*]{{1,128}})\Z", description=_AN_OPERATION),
]
IdentityPattern = Annotated[str, Meta(pattern=rf"^{_STAR}(\*\*|{_GLOB})\Z", description=_AN_IDENTITY)]
RealmPattern = Annotated[
    str, Meta(pattern=rf"^{_STAR}(?!\*\*)[A-Za-z0-9_.\-*]{{1,64}}\Z", description=_REALMS)
]
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Security:
    """The settings of `[security]`; all of them are empty where everybody may do everything.

    They are checked as part of `Settings`, and `network.security.check_security` looks at them together.
    """

    authority: Text = ""
    """File (PEM) of the certificate of the authority that vouches for everybody else."""
    certificate: Text = ""
    """File (PEM) of the component's own certificate, which it shows to others."""
    key: Text = ""
    """File (PEM) of the key of the certificate."""
    user: Text = ""
    """Name under which the component logs in, where whoever listens asks for one."""
    password: str = field(default="", repr=False)
    """Password of that user."""
    passwords: Text = ""
    """File of the users who may connect: a line `NAME:PASSWORD` for each."""
    mutual: bool = True
    """Whether those that connect by TLS must show a certificate of the authority."""
    roles: dict[Name, Role] = field(default_factory=dict, hash=False)
    """What may be done through this component, by the name of the role; without any, everything."""
    users: dict[Name, str] = field(default_factory=dict, hash=False)
    """The role of each certificate, by its common name, and of each user; `*` is everybody who is let in."""

    @property
    def has_tls(self) -> bool:
        """Whether the component can tell by TLS whom it talks to."""
        return bool(self.authority)


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """What a component needs to know to talk to the others.

    Every setting is checked when the object is made; a bad one raises ConfigurationException, which names the
    setting and where its value came from.
    """

    realm: Realm = "nao"
    """The robot or stack that this component belongs to: the first chunk of every key."""
    connect: Endpoints = (DEFAULT_ENDPOINT,)
    """Zenoh endpoints to connect to; lost ones are tried again for ever."""
    listen: Endpoints = ("tcp/127.0.0.1:0",)
    """Zenoh endpoints to listen on; port 0 lets the system pick one."""
    mode: Literal["peer", "client", "router"] = "peer"
    """`peer` talks to every other peer directly; `client` through the router, or the server, that it connects
    to; `router` passes on what others say to one another."""
    clock: Literal["auto", "wall", "sim"] = "auto"
    """`wall`, `sim`, or `auto`: the robot's time if the robot is simulated, otherwise the wall's."""
    timeout: Timeout = 2.0
    """Longest duration of a call in s, and of sending one message: a link that takes longer is closed."""
    lease: Lease = 2.0
    """Silence in s after which a peer that hangs counts as lost; one that dies is noticed at once."""
    shared_memory: bool = True
    """Whether large payloads travel through shared memory on one machine."""
    log_level: Literal["debug", "info", "warning", "error", "critical"] = "warning"
    """Least severe messages to log."""
    max_message_size: Size = 1 << 20
    """Largest payload that is decoded, in bytes, of an operation without byte sequences."""
    max_bulk_size: Size = 32 << 20
    """Largest payload that is decoded, in bytes, of an operation with byte sequences, such as images."""
    dispatch_threads: Threads = 8
    """Threads that run callbacks and the calls within the process."""
    security: Security = field(default_factory=Security)
    """Certificates, passwords, and what others may do through this component: `[security]` of a file."""
    origins: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)
    """Where each setting came from, by name; a setting that is missing here has its default."""

    def __post_init__(self) -> None:
        checked = {name: self._checked(name, self._value(name)) for name in _TYPES}
        for name in _TABLES[""]:
            object.__setattr__(self, name, checked[name])
        pieces = {name: checked[f"security.{name}"] for name in _TABLES["security"]}
        object.__setattr__(self, "security", Security(**pieces))
        for user, role in self.security.users.items():
            if role not in self.security.roles:
                origin, known = self._origin("security.users"), ", ".join(self.security.roles) or "none"
                raise ConfigurationException(
                    f"{origin}: security.users.{user}: there is no role {shown(role)}; there is {known}"
                )

    def override(self, **changes: object) -> Settings:
        """Return a copy with some settings changed by the program; `security` takes a table of its settings.

        Raises ConfigurationException for an unknown setting or a bad value.
        """
        flat = _flat(changes)
        return self._overlaid(flat, dict.fromkeys(flat, _CODE_ORIGIN))

    def size_limit(self, *, holds_bytes: bool) -> int:
        """Return how many bytes a payload may have: more where its type holds byte sequences."""
        return self.max_bulk_size if holds_bytes else self.max_message_size

    def describe(self) -> str:
        """Return a table of the settings, passwords hidden: their names, values and where these came from.

        Of `[security]` it has what differs from the default.
        """
        rows = []
        for name in _TYPES:
            value = self._value(name)
            if "." in name and value == getattr(_NO_SECURITY, name.partition(".")[2]):
                continue
            text = shown(value)
            if name == "security.password":
                text = "(hidden)"
            elif name == "security.roles":
                text = ", ".join(self.security.roles)
            rows.append((name, text, self.origins.get(name, _DEFAULT_ORIGIN)))
        widths = [max(len(row[column]) for row in rows) for column in range(2)]
        return "\n".join(f"{key:<{widths[0]}}  {value:<{widths[1]}}  {origin}" for key, value, origin in rows)

    @property
    def reached_at(self) -> tuple[str, ...]:
        """Where others reach the component: where it listens or, of a client, what it connects to."""
        return self.connect if self.mode == "client" else self.listen

    def environment(self) -> dict[str, str]:
        """Return the variables by which another process belongs to the same realm, as the same user."""
        variables = {"realm": self.realm, "connect": ",".join(self.connect), "mode": self.mode}
        own = {name: getattr(self.security, name) for name in _OWN}
        variables |= {f"security_{name}": text for name, text in own.items() if text}
        return {f"{ENVIRONMENT_PREFIX}{name.upper()}": text for name, text in variables.items()}

    def _value(self, name: str) -> object:
        table, _, key = name.rpartition(".")
        return getattr(getattr(self, table) if table else self, key)

    def _origin(self, name: str) -> str:
        return self.origins.get(name, _CODE_ORIGIN)

    def _checked(self, name: str, value: Any) -> Any:  # noqa: ANN401 - of any setting's type
        origin, kind = self._origin(name), _TYPES[name]
        if get_origin(kind) is Literal and isinstance(value, str):
            value = value.lower()
        if name == "security.password" and not isinstance(value, str):
            raise ConfigurationException(f"{origin}: {name}: write text")  # without the value
        is_variable = origin.startswith(ENVIRONMENT_PREFIX)
        value = convert(value, kind, origin, ConfigurationException, path=[name], strict=not is_variable)
        try:
            if name in ("connect", "listen"):
                for endpoint in value:
                    check_endpoint(endpoint, any_port=name == "listen")
            elif name.removeprefix("security.") in PATHS and value:
                # Another process that is told of the file may run in another directory.
                value = str(Path(value).expanduser().absolute())
        except (OSError, RuntimeError, ValueError) as error:
            raise ConfigurationException(f"{origin}: {name} = {shown(value)}: {error}") from None
        return value

    def _overlaid(self, changes: Mapping[str, Any], origins: Mapping[str, str]) -> Settings:
        tables: dict[str, dict[str, Any]] = {"": {}, "security": {}}
        for name, value in changes.items():
            if name == "security":
                raise ConfigurationException(f"{origins[name]}: security: write a table, such as [security]")
            if name not in _TYPES:
                known = ", ".join(_TYPES)
                raise ConfigurationException(
                    f"{origins[name]}: there is no setting {shown(name)}; the settings are {known}"
                )
            table, _, key = name.rpartition(".")
            tables[table][key] = value
        security = replace(self.security, **tables["security"])
        return replace(self, **tables[""], security=security, origins={**self.origins, **origins})


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
    values = _flat(defaults or {})
    settings = Settings()._overlaid(values, dict.fromkeys(values, _DEFAULT_ORIGIN))
    if toml_path := toml_path or environment.get(CONFIG_VARIABLE):
        path = Path(toml_path)
        values = _flat(read_toml(path, dict[str, Any], ConfigurationException), path.parent)
        settings = settings._overlaid(values, dict.fromkeys(values, str(path)))
    settings = settings._overlaid(*_read_environment(environment))
    given = {name: value for name, value in (flags or {}).items() if value is not None}
    names = {name: f"security.{name}" if name in PATHS else name for name in given}
    return settings._overlaid(
        {names[name]: value for name, value in given.items()},
        {names[name]: f"--{name.replace('_', '-')}" for name in given},
    )


def _flat(values: Mapping[str, Any], folder: Path | None = None) -> dict[str, Any]:
    """Return settings by their names, such as `security.key`; files are named as seen from `folder`."""
    flat = {name: value for name, value in values.items() if name != "security"}
    pieces = values.get("security", {})
    if not isinstance(pieces, Mapping):
        return {**flat, "security": pieces}
    return flat | {f"security.{name}": _seen_from(folder, name, value) for name, value in pieces.items()}


def _seen_from(folder: Path | None, name: str, value: object) -> object:
    if name not in PATHS or not isinstance(value, (str, os.PathLike)):
        return value
    path = os.fspath(value)
    # A folder with a file of settings and what that names can be moved.
    return str(folder / path) if folder and path and not path.startswith("~") else path


def _read_environment(environment: Mapping[str, str]) -> tuple[dict[str, Any], dict[str, str]]:
    values: dict[str, Any] = {}
    origins: dict[str, str] = {}
    for variable in sorted(environment):
        if not variable.startswith(ENVIRONMENT_PREFIX) or variable == CONFIG_VARIABLE:
            continue
        name = variable.removeprefix(ENVIRONMENT_PREFIX).lower()
        if name.startswith("security_"):
            name = name.replace("_", ".", 1)
        text: Any = environment[variable]
        if name in ("connect", "listen"):
            text = [item.strip() for item in text.split(",") if item.strip()]
        elif _TYPES.get(name) is bool:
            text = _WORDS.get(text.strip().lower(), text.strip())
        values[name], origins[name] = text, variable
    return values, origins


def _types(kind: type, skipped: Iterable[str] = ()) -> dict[str, Any]:
    hints = get_type_hints(kind, include_extras=True)
    return {name: hint for name, hint in hints.items() if name not in skipped}


_NO_SECURITY: Final = Security()
_TABLES: Final = {"": _types(Settings, ("security", "origins")), "security": _types(Security)}
_TYPES: Final = _TABLES[""] | {f"security.{name}": kind for name, kind in _TABLES["security"].items()}
"""The type of each setting by its name, such as `security.key`."""
