"""What a person allows an agent: `agent.toml` in the folder of the project, which no tool writes."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Final

from msgspec import Meta, Struct

from codegen.messages import Message
from visualhfsm import VisualHfsmError
from zenoh_ice.data.toml_file import parse_toml, read_text

FILE: Final = "agent.toml"


class AgentError(VisualHfsmError):
    """Something that an agent may not do, or cannot."""


class Limits(Struct, frozen=True, forbid_unknown_fields=True):
    """The limits of a file; without one nothing runs on a robot, and everything else may be done."""

    realm: str = ""
    """The realm of the one robot that behaviors may drive."""
    interfaces: tuple[str, ...] = ()
    """Identities of the servants that they may call."""
    longest_run: Annotated[float, Meta(gt=0, le=3600, description="write seconds, at most 3600")] = 60.0
    """Wall time after which a run is stopped, in s."""
    most: dict[str, Annotated[float, Meta(ge=0, description="write a number, 0 or more")]] = {}
    """Largest absolute values of arguments, by IDENTITY.OPERATION.PARAMETER, such as Motors.setV.v in m/s."""
    undecided: bool = False
    """Whether a behavior may run of which the model checker could not decide all properties."""
    ask: bool = True
    """Whether a person must allow each run in the page."""

    def require(self, realm: str, identities: frozenset[str], undecided: int) -> None:
        """Raise AgentError unless a behavior may run that calls servants, and has undecided properties."""
        if not self.realm:
            raise AgentError.because(
                "no robot may be driven: a person writes realm = ... in {file}", file=FILE
            )
        if realm != self.realm:
            raise AgentError.because("this is not the realm that {file} names", file=FILE)
        if others := sorted(identities - {*self.interfaces}):
            raise AgentError.because(
                "{file} does not list these servants in interfaces: {others}",
                file=FILE,
                others=", ".join(others),
            )
        if undecided and not self.undecided:
            raise AgentError.because(
                "properties are undecided ({undecided}), and {file} does not say undecided = true",
                file=FILE,
                undecided=undecided,
            )


def read_limits(folder: Path) -> Limits:
    """Return the limits of a folder, read now. Raises AgentError with file, line and key."""
    path = folder / FILE
    if not path.exists():
        return Limits()

    def wrong(text: str) -> AgentError:
        return AgentError(Message.verbatim(text))

    return parse_toml(read_text(path, wrong), Limits, FILE, wrong)
