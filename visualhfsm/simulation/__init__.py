"""Run behaviors in virtual time, with the fake or the simulated robot, in one process.

`simulate` makes a `Behavior` of a document, `simulate_team` a `Team` of several, with a robot each in one
world. Tests and trials stand on it; it knows no pytest.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from naoserver.errors import RobotError as RobotError
    from naoserver_sim.named_body import named_body as named_body

    from ._behavior import Behavior as Behavior
    from ._behavior import simulate as simulate
    from ._kinds import CameraKind as CameraKind
    from ._kinds import EyesKind as EyesKind
    from ._kinds import RobotKind as RobotKind
    from ._loading import DocumentInvalid as DocumentInvalid
    from ._loading import importable as importable
    from ._loading import load_component as load_component
    from ._robot import Ball as Ball
    from ._robot import RobotUnderTest as RobotUnderTest
    from ._robot import served_interfaces as served_interfaces
    from ._team import Team as Team
    from ._team import simulate_team as simulate_team

# The robot needs libraries that a behavior without one does not: names are imported on first use.
__getattr__, __dir__ = import_on_use(__name__)
