"""Settings of a component: defaults, overlaid by a TOML file, then by the environment, then by flags."""

from __future__ import annotations

import os
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from .exceptions import ConfigurationException
from .network.security import PATHS, Security, resolved
from .setting_checks import CHECKS, PARSERS
from .wire.text import cut

__all__ = ["DEFAULT_ENDPOINT", "ENVIRONMENT_PREFIX", "Settings", "load_settings"]

DEFAULT_ENDPOINT: Final = "tcp/127.0.0.1:7447"
"""Where a robot server listens and where everybody else connects to, unless told otherwise."""

ENVIRONMENT_PREFIX: Final = "VISUALHFSM_"
"""`VISUALHFSM_REALM` sets `realm`, and so on for every setting."""

CONFIG_VARIABLE: Final = "VISUALHFSM_CONFIG"
"""The environment variable that names the TOML file when no flag does."""

_DEFAULT_ORIGIN: Final = "default"
_CODE_ORIGIN: Final = "the program"
_LONGEST_SHOWN: Final = 1000  # characters of what is wrong, in an error


@dataclass(frozen=True, slots=True)
class Settings:
    """What a component needs to know to talk to the others.

    Every field is checked when the object is made; a bad one raises ConfigurationException, which names
    the field and where its value came from.
    """

    realm: str = "nao"
    """The robot or stack that this component belongs to: the first chunk of every key."""
    connect: tuple[str, ...] = (DEFAULT_ENDPOINT,)
    """Zenoh endpoints to connect to; lost ones are tried again for ever."""
    listen: tuple[str, ...] = ("tcp/127.0.0.1:0",)
    """Zenoh endpoints to listen on; port 0 lets the system pick one."""
    mode: str = "peer"
    """`peer` talks to every other peer directly; `client` through the router, or the server, that it connects
    to; `router` passes on what others say to one another."""
    clock: str = "auto"
    """`wall`, `sim`, or `auto`: the robot's time if the robot is simulated, otherwise the wall's."""
    timeout: float = 2.0
    """Longest duration of a call in s, and of sending one message: a link that takes longer is closed."""
    lease: float = 2.0
    """Silence in s after which a peer that hangs counts as lost; one that dies is noticed at once."""
    shared_memory: bool = True
    """Whether large payloads travel through shared memory on one machine."""
    log_level: str = "warning"
    """Least severe messages to log: debug, info, warning, error or critical."""
    max_message_size: int = 1 << 20
    """Largest payload that is decoded, in bytes, of an operation without byte sequences."""
    max_bulk_size: int = 32 << 20
    """Largest payload that is decoded, in bytes, of an operation with byte sequences, such as images."""
    dispatch_threads: int = 8
    """Threads that run callbacks and the calls within the process."""
    security: Security = field(default_factory=Security)
    """Certificates, passwords, and what others may do through this component: `[security]` of a file."""
    origins: Mapping[str, str] = field(default_factory=dict, compare=False, repr=False)
    """Where each setting came from, by name; a setting that is missing here has its default."""

    def __post_init__(self) -> None:
        for key, check in CHECKS.items():
            value = getattr(self, key)
            try:
                object.__setattr__(self, key, check(value))
            except ValueError as error:
                shown, why = cut(_shown(value), _LONGEST_SHOWN), cut(str(error), _LONGEST_SHOWN)
                raise ConfigurationException(f"{self._origin(key)}: {key} = {shown}: {why}") from None

    def override(self, **changes: object) -> Settings:
        """Return a copy with some fields changed by the program.

        Raises ConfigurationException for an unknown field or a bad value.
        """
        return self._overlaid(changes, dict.fromkeys(changes, _CODE_ORIGIN))

    def describe(self) -> str:
        """Return a table of every setting: its name, its value and where that came from."""
        rows = [
            (key, _shown(getattr(self, key)), self.origins.get(key, _DEFAULT_ORIGIN))
            for key in CHECKS
            if key != "security"
        ]
        rows += [
            (f"security.{key}", value, self.origins.get(f"security.{key}", self._origin("security")))
            for key, value in self.security.describe().items()
        ]
        widths = [max(len(row[column]) for row in rows) for column in range(2)]
        return "\n".join(f"{key:<{widths[0]}}  {value:<{widths[1]}}  {origin}" for key, value, origin in rows)

    @property
    def reached_at(self) -> tuple[str, ...]:
        """Where others reach the component: where it listens or, of a client, what it connects to."""
        return self.connect if self.mode == "client" else self.listen

    def environment(self) -> dict[str, str]:
        """Return the variables by which another process belongs to the same realm, as the same user."""
        variables = {"realm": self.realm, "connect": ",".join(self.connect), "mode": self.mode}
        variables |= {f"security_{name}": text for name, text in self.security.texts().items()}
        return {f"{ENVIRONMENT_PREFIX}{name.upper()}": text for name, text in variables.items()}

    def _origin(self, key: str) -> str:
        return self.origins.get(key, _CODE_ORIGIN)

    def _overlaid(self, changes: Mapping[str, Any], origins: Mapping[str, str]) -> Settings:
        changes, origins = dict(changes), dict(origins)
        for key in changes:
            if key not in CHECKS:
                raise ConfigurationException(
                    f"{origins[key]}: there is no setting {cut(key, _LONGEST_SHOWN)!r}; the settings are "
                    f"{', '.join(CHECKS)}"
                )
        if "security" in changes:
            # Piece by piece: a password may come from the environment, and the rest from a file.
            pieces = changes["security"]
            try:
                changes["security"] = self.security.merged(pieces)
            except ValueError as error:
                why = cut(str(error), _LONGEST_SHOWN)
                raise ConfigurationException(f"{origins['security']}: security: {why}") from None
            if isinstance(pieces, Mapping):
                origins = {**{f"security.{key}": origins["security"] for key in pieces}, **origins}
        return replace(self, **changes, origins={**self.origins, **origins})


def load_settings(
    toml_path: str | os.PathLike[str] | None = None,
    flags: Mapping[str, Any] | None = None,
    *,
    defaults: Mapping[str, Any] | None = None,
    environment: Mapping[str, str] | None = None,
) -> Settings:
    """Return the settings from their four sources; a later one wins.

    1. the defaults, with those of the component over those of `Settings`;
    2. the top-level keys of the TOML file (without one, of the file that VISUALHFSM_CONFIG names);
    3. the environment: VISUALHFSM_REALM, VISUALHFSM_CONNECT, ... (lists are separated by commas), and
       VISUALHFSM_SECURITY_AUTHORITY, ... for the texts of `[security]`;
    4. the flags; a flag that is None was not given.

    Raises ConfigurationException, naming the source, for a file that cannot be read, an unknown key or a bad
    value.
    """
    settings = Settings()
    if defaults:
        settings = settings._overlaid(defaults, dict.fromkeys(defaults, _DEFAULT_ORIGIN))
    if environment is None:
        environment = os.environ
    toml_path = toml_path or environment.get(CONFIG_VARIABLE)
    if toml_path:
        path = Path(toml_path)
        values = _read_toml(path)
        settings = settings._overlaid(values, dict.fromkeys(values, str(path)))
    values, origins = _read_environment(environment)
    settings = settings._overlaid(values, origins)
    given = {key: value for key, value in (flags or {}).items() if value is not None}
    origins = {key: f"--{key.replace('_', '-')}" for key in given}
    return settings._overlaid(*_with_security({key: key for key in PATHS}, given, origins))


def _read_toml(path: Path) -> dict[str, Any]:
    try:
        with path.open("rb") as file:
            values = tomllib.load(file)
    except OSError as error:
        raise ConfigurationException(f"{path}: cannot read the settings: {error.strerror}") from error
    except RecursionError as error:
        raise ConfigurationException(f"{path}: not TOML: nested too deeply") from error
    except ValueError as error:  # of a path with a null byte, of bytes, of syntax, or of a number's length
        raise ConfigurationException(f"{path}: not TOML: {error}") from error
    if isinstance(values.get("security"), dict):
        # Files are named as seen from the file that names them, so that a folder of them can be moved.
        values["security"] = resolved(values["security"], path.parent)
    return values


def _read_environment(environment: Mapping[str, str]) -> tuple[dict[str, Any], dict[str, str]]:
    values: dict[str, Any] = {}
    origins: dict[str, str] = {}
    for variable in sorted(environment):
        if not variable.startswith(ENVIRONMENT_PREFIX) or variable == CONFIG_VARIABLE:
            continue
        key = variable.removeprefix(ENVIRONMENT_PREFIX).lower()
        try:
            values[key] = PARSERS.get(key, str)(environment[variable])
        except ValueError as error:
            raise ConfigurationException(f"{variable}: {environment[variable]!r}: {error}") from None
        origins[key] = variable
    pieces = {key: key.removeprefix("security_") for key in values if key.startswith("security_")}
    return _with_security(pieces, values, origins)


def _with_security(
    pieces: Mapping[str, str], values: dict[str, Any], origins: dict[str, str]
) -> tuple[dict[str, Any], dict[str, str]]:
    """Move what is given under names of its own into the table `security`: `pieces` tells the names in it."""
    given = [key for key in pieces if key in values]
    if given:
        values["security"] = {pieces[key]: values.pop(key) for key in given}
        origins["security"] = ", ".join(origins[key] for key in given)
        origins |= {f"security.{pieces[key]}": origins.pop(key) for key in given}
    return values, origins


def _shown(value: object) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(_shown(item) for item in value) + "]"
    try:
        return repr(value) if isinstance(value, str) else str(value)
    except ValueError:  # Python refuses to write the longest numbers
        return "a number of thousands of digits"
