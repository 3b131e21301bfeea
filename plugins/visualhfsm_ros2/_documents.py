"""The topics, services and actions of documents: what `codegen.hfsm.kinds` asks a kind of endpoints for."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from codegen.hfsm.analysis import Analysis
from codegen.hfsm.document import Document, RosInterface
from codegen.hfsm.report import Report

from ._checks import check_ros, check_ros_uses
from ._code_help import readable
from ._types import FOLDERS, RosTypes, parse_qos, stops


class RosOfDocuments(RosTypes):
    """What documents use of ROS, with the types in some directories."""

    commands: Mapping[str, bool] = {
        **dict.fromkeys(("publish", "send"), True),
        **dict.fromkeys(("latest", "next", "value", "wait"), False),
    }

    def check(self, document: Document, report: Report) -> None:
        """Report declarations that are wrong."""
        check_ros(document, self, report)

    def check_uses(self, analysis: Analysis, report: Report) -> None:
        """Report uses in code that are wrong, and interfaces without any."""
        check_ros_uses(analysis, self, report)

    def can_generate(self, endpoint: RosInterface) -> bool:
        """Return whether an interface has a kind and a type that exist."""
        return endpoint.kind in FOLDERS and not self.problem(endpoint.type.strip(), endpoint.kind)

    def options(self, endpoint: RosInterface) -> dict[str, object]:
        """Return the quality of service of an interface, and whether its default message stops something."""
        options = parse_qos(endpoint.qos.text)
        if stops(endpoint.kind, endpoint.type.strip(), endpoint.stop.text.strip()):
            options["stop"] = True
        return options

    def readable(self, component: str, endpoints: Sequence[RosInterface]) -> str:
        """Return a generated component with classes in place of the declarations of interfaces."""
        return readable(component, endpoints, self)
