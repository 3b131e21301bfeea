"""The localization of a robot on a soccer field: `Localizer` estimates its pose from what `Sight` shows."""

from visualhfsm_match.localization._localizer import Localizer
from visualhfsm_match.localization._view import Pose, Seen

__all__ = ["Localizer", "Pose", "Seen"]
