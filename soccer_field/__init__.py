"""A soccer field: its model, which worlds and behaviors share, and the localization of a robot on it.

`soccer_field.model` has its lengths, lines and goals; `soccer_field.localization` estimates the robot's pose
from pictures, for which it needs OpenCV, and `soccer_field.panorama` finds one that is lost.
"""
