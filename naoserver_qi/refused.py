"""The services that this robot cannot offer: each call of one fails with a sentence that says why.

A program may look such a service up, and fails only when it uses it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from naoserver.errors import HardwareFailure

_DETECTOR: Final = "subscribe unsubscribe setParameter getParameter "
_NO_EARS: Final = "this robot hears nothing"
_NO_EYES: Final = "this robot does not look for people"

REFUSED: Final[Mapping[str, tuple[str, str]]] = {
    "ALAnimationPlayer": (
        "this robot has none of Choregraphe's animations; ALBehaviorManager runs its motions",
        "run runTag reset declarePathForTags",
    ),
    "ALAutonomousMoves": ("nothing moves by itself", "setBackgroundStrategy setExpressiveListeningEnabled"),
    "ALBasicAwareness": (
        _NO_EYES,
        (
            "startAwareness stopAwareness setEnabled isEnabled isAwarenessRunning pauseAwareness "
            "resumeAwareness setEngagementMode setTrackingMode setStimulusDetectionEnabled setParameter"
        ),
    ),
    "ALDialog": (
        _NO_EARS,
        _DETECTOR + "loadTopic loadTopicContent unloadTopic activateTopic deactivateTopic runDialog "
        "stopDialog setLanguage setFocus forceInput forceOutput gotoTag setConcept",
    ),
    "ALMovementDetection": (_NO_EYES, _DETECTOR + "setSensitivity setDepthSensitivity"),
    "ALNavigation": (
        "this robot makes no maps and avoids no obstacles; ALMotion.moveTo walks",
        (
            "navigateTo navigateToInMap moveAlong setSecurityDistance explore startLocalization "
            "stopLocalization getRobotPositionInMap loadExploration saveExploration"
        ),
    ),
    "ALPeoplePerception": (_NO_EYES, _DETECTOR + "resetPopulation setMaximumDetectionRange"),
    "ALPhotoCapture": (
        "this robot keeps no photos; ALVideoDevice gives pictures",
        (
            "takePicture takePictures setResolution setPictureFormat setCameraID setColorSpace "
            "setCaptureInterval setHalfPressEnabled"
        ),
    ),
    "ALSoundDetection": (_NO_EARS, _DETECTOR),
    "ALSoundLocalization": (_NO_EARS, _DETECTOR),
    "ALSpeechRecognition": (
        _NO_EARS,
        _DETECTOR + "setVocabulary setWordListAsVocabulary setLanguage getAvailableLanguages pause "
        "setVisualExpression setAudioExpression loadVocabulary removeAllContext",
    ),
    "ALTabletService": (
        "a Nao has no tablet",
        "showWebview hideWebview loadUrl showImage hideImage executeJS loadApplication",
    ),
    "ALVideoRecorder": (
        "this robot records no video; a behavior can be recorded",
        "startRecording stopRecording setResolution setFrameRate setVideoFormat setCameraID",
    ),
    "ALVisionRecognition": (_NO_EYES, _DETECTOR + "load learnFromFile changeDatabase"),
    "DCM": (
        "joints are commanded through ALMotion, which protects the robot",
        "set setAlias createAlias getTime",
    ),
}
"""Why each service is refused, and the operations that programs call."""


def refused_service(name: str) -> object:
    """Return a service each of whose operations raises HardwareFailure."""
    reason, operations = REFUSED[name]

    def refuse(_self: object, *_arguments: object) -> None:
        raise HardwareFailure(f"{name} is not offered: {reason}")

    service: object = type(name, (), dict.fromkeys(operations.split(), refuse))()
    return service
