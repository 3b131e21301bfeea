"""Kinds of endpoints that a document may declare beside interfaces of servants; ROS is the first.

Documents with endpoints are read, edited and written as they are; a plug-in knows what endpoints mean: the
`Kind` in the module `documents` of the package that it adds to `visualhfsm.kinds`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol

from zenoh_ice import plugins

from ..messages import Message
from .codes import Code
from .document import Document, RosInterface
from .report import Report

if TYPE_CHECKING:
    from .analysis import Analysis

NOT_INSTALLED: Final = Message(
    "the types of ROS are not installed: `{command}`", command="pip install 'visualhfsm[ros2]'"
)


class Kind(Protocol):
    """The endpoints of documents in one directory, and the types that they may have there.

    What it does itself is for documents without the plug-in of their endpoints.
    """

    commands: Mapping[str, bool]
    """Whether operations of endpoints command something; what others do depends on the endpoint."""

    def check(self, document: Document, report: Report) -> None:
        """Report declarations that are wrong; the names of attributes are checked elsewhere."""
        for endpoint in document.ros[:1]:
            report.error(Code.UNKNOWN_ROS_TYPE, NOT_INSTALLED, endpoint)

    def check_uses(self, analysis: Analysis, report: Report) -> None:  # noqa: ARG002
        """Report uses in code that are wrong, and endpoints without any."""
        return

    def can_generate(self, endpoint: RosInterface) -> bool:  # noqa: ARG002
        """Return whether an endpoint can be generated, whatever its name is."""
        return False

    def type_texts(self, used: Sequence[str]) -> dict[str, str]:  # noqa: ARG002
        """Return the texts of the project's own types among those used, each after the types it needs."""
        return {}

    def options(self, endpoint: RosInterface) -> dict[str, object]:  # noqa: ARG002
        """Return the options of the declaration of an endpoint in the component, by name."""
        return {}

    def readable(self, component: str, endpoints: Sequence[RosInterface]) -> str:  # noqa: ARG002
        """Return a generated component in which code completion understands these endpoints."""
        return component


def find_kind(directories: Sequence[Path] = ()) -> Kind:
    """Return the kind of the endpoints of documents, with the types in some directories. Raises PluginError.

    Without its plug-in, a document with endpoints has one problem, which says what to install.
    """
    ros = plugins.find(plugins.KINDS, "ros", "documents")
    kind: Kind = _NotInstalled() if ros is None else ros.Kind(directories)
    return kind


class _NotInstalled(Kind):
    commands: Mapping[str, bool] = {}
