"""The localization of a robot on a soccer field: `Localizer` estimates its pose from pictures.

It needs OpenCV.
"""

from visualhfsm_match.localization._localizer import FloorPoint, Image, Localizer
from visualhfsm_match.localization._panorama import Pose

__all__ = ["FloorPoint", "Image", "Localizer", "Pose"]
