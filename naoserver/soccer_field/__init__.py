"""A soccer field: its model, which worlds and behaviors share, and the localization of a robot on it.

`model` has its lengths, lines and goals; `localization` estimates the robot's pose from pictures, for which
it needs OpenCV, and `panorama` finds one that is lost.
"""
