"""ALMotion's whole body control, which has no effect here, and facts about masses."""

from __future__ import annotations

import logging
from typing import Final

from naoserver.kinematics import center_of_mass
from naoserver_qi.access import Access
from naoserver_qi.arguments import chosen, listed, number, text

_logger = logging.getLogger(__name__)

_STATES: Final = ("Fixed", "Plane", "Free")
_SUPPORTS: Final = ("Legs", "LLeg", "RLeg")
_EFFECTORS: Final = ("Head", "LArm", "RArm")


class WholeBody:
    """Take the commands of NAOqi's balance: the gains of the joints keep the robot upright, nothing else."""

    def __init__(self, access: Access) -> None:
        self._access = access

    def wbEnable(self, isEnabled: object) -> None:
        """Do nothing: whole body balance has no effect."""
        _logger.info("whole body balance is %s, which has no effect", "on" if isEnabled else "off")

    def wbFootState(self, stateName: object, supportLeg: object) -> None:
        """Do nothing but check the names: each foot is free."""
        chosen(stateName, "state of a foot", _STATES)
        chosen(supportLeg, "leg", _SUPPORTS)

    def wbEnableBalanceConstraint(self, _isEnable: object, supportLeg: object) -> None:
        """Do nothing but check the name: whole body balance has no effect."""
        chosen(supportLeg, "leg", _SUPPORTS)

    def wbGoToBalance(self, supportLeg: object, duration: object) -> bool:
        """Do nothing but check the name; return False, since the weight stays on both feet."""
        chosen(supportLeg, "leg", _SUPPORTS)
        number(duration, "duration")
        return False

    def wbEnableEffectorControl(self, effectorName: object, _isEnabled: object) -> None:
        """Do nothing but check the name: whole body control has no effect."""
        chosen(effectorName, "effector", _EFFECTORS)

    def wbSetEffectorControl(self, effectorName: object, targetCoordinate: object) -> None:
        """Do nothing but check the names and numbers: whole body control has no effect."""
        chosen(effectorName, "effector", _EFFECTORS)
        for part in listed(targetCoordinate, "targetCoordinate"):
            number(part, "targetCoordinate")

    def wbEnableEffectorOptimization(self, effectorName: object, _isActive: object) -> None:
        """Do nothing but check the name: whole body control has no effect."""
        chosen(effectorName, "effector", _EFFECTORS)

    def getMass(self, name: object) -> float:
        """Return the mass in kg of a joint with its link, of a chain or of the `Body`."""
        return center_of_mass(text(name, "name"), self._access.angles(measured=False))[0]

    def getCOM(self, name: object, frame: object, useSensorValues: object) -> list[float]:
        """Return the center of mass in m of a joint with its link, of a chain or of the `Body`."""
        measured = bool(useSensorValues)
        _, center = center_of_mass(text(name, "name"), self._access.angles(measured=measured))
        place = self._access.place("Torso", frame, measured=measured)
        return [float(part) for part in (place @ [*center, 1.0])[:3]]

    def setMotionConfig(self, config: object) -> None:
        """Do nothing but check that it is a list of names and values: the parameters have no effect."""
        for entry in listed(config, "config"):
            text(listed(entry, "an entry of the configuration", 2)[0], "name")
