"""The operations of ALMotion that switch NAOqi's reflexes: remembered, and without effect here."""

from __future__ import annotations

import logging

from naoserver.qi_service.values import text

__all__ = ["ReflexOperations"]

_logger = logging.getLogger(__name__)


class ReflexOperations:
    """Remember how reflexes were switched, for programs that do so before anything else.

    What keeps the robot safe is the safety layer, which nobody can switch off over libqi.
    """

    def __init__(self) -> None:
        self._switches: dict[str, bool] = {}  # by name: the default is on, or off of breath and idle motion

    def setFallManagerEnabled(self, enable: object) -> None:
        """Remember whether falls are to be met."""
        self._switch("FallManager", enable)

    def getFallManagerEnabled(self) -> bool:
        """Return what setFallManagerEnabled was told."""
        return self._switches.get("FallManager", True)

    def setSmartStiffnessEnabled(self, enable: object) -> None:
        """Remember whether motors are to save current."""
        self._switch("SmartStiffness", enable)

    def getSmartStiffnessEnabled(self) -> bool:
        """Return what setSmartStiffnessEnabled was told."""
        return self._switches.get("SmartStiffness", True)

    def setDiagnosisEffectEnabled(self, enable: object) -> None:
        """Remember whether faults are to limit motors."""
        self._switch("DiagnosisEffect", enable)

    def getDiagnosisEffectEnabled(self) -> bool:
        """Return what setDiagnosisEffectEnabled was told."""
        return self._switches.get("DiagnosisEffect", True)

    def setPushRecoveryEnabled(self, enable: object) -> None:
        """Remember whether pushes are to be met."""
        self._switch("PushRecovery", enable)

    def getPushRecoveryEnabled(self) -> bool:
        """Return what setPushRecoveryEnabled was told."""
        return self._switches.get("PushRecovery", True)

    def setCollisionProtectionEnabled(self, chainName: object, enable: object) -> bool:
        """Remember whether a chain is to keep off the body."""
        return self._switch(f"CollisionProtection/{text(chainName, 'chainName')}", enable)

    def getCollisionProtectionEnabled(self, chainName: object) -> bool:
        """Return what setCollisionProtectionEnabled was told."""
        return self._switches.get(f"CollisionProtection/{text(chainName, 'chainName')}", True)

    def setExternalCollisionProtectionEnabled(self, name: object, enable: object) -> None:
        """Remember whether a part is to keep off things."""
        self._switch(f"ExternalCollisionProtection/{text(name, 'name')}", enable)

    def getExternalCollisionProtectionEnabled(self, name: object) -> bool:
        """Return what setExternalCollisionProtectionEnabled was told."""
        return self._switches.get(f"ExternalCollisionProtection/{text(name, 'name')}", True)

    def setMoveArmsEnabled(self, leftArm: object, rightArm: object) -> None:
        """Remember whether the arms are to swing; they do unless they are commanded."""
        self._switch("MoveArms/LArm", leftArm)
        self._switch("MoveArms/RArm", rightArm)

    def getMoveArmsEnabled(self, chainName: object) -> bool:
        """Return what setMoveArmsEnabled was told."""
        return self._switches.get(f"MoveArms/{text(chainName, 'chainName')}", True)

    def setBreathEnabled(self, chainName: object, enable: object) -> None:
        """Remember whether a chain is to move as if it breathed."""
        self._switch(f"Breath/{text(chainName, 'chainName')}", enable)

    def getBreathEnabled(self, chainName: object) -> bool:
        """Return what setBreathEnabled was told."""
        return self._switches.get(f"Breath/{text(chainName, 'chainName')}", False)

    def setIdlePostureEnabled(self, chainName: object, enable: object) -> None:
        """Remember whether a chain is to move when nothing else does."""
        self._switch(f"IdlePosture/{text(chainName, 'chainName')}", enable)

    def getIdlePostureEnabled(self, chainName: object) -> bool:
        """Return what setIdlePostureEnabled was told."""
        return self._switches.get(f"IdlePosture/{text(chainName, 'chainName')}", False)

    def _switch(self, name: str, enable: object) -> bool:
        if len(self._switches) < 200 or name in self._switches:
            self._switches[name] = bool(enable)
        _logger.info("%s is %s, which has no effect", name, "on" if enable else "off")
        return True
