"""Published figures of the H25 that are not in its description: places at the angle 0 of all joints, in m and kg.

From the documentation of NAOqi and the models of the robot that its sources name.
"""

from typing import Final

TOTAL_MASS: Final = 5.35975
CENTER_OF_MASS: Final = (0.02122, 0.00018, 0.30028)
TORSO_HEIGHT: Final = 0.33309
"""Above the soles, as all heights."""
HIP_HEIGHT: Final = 0.24809
NECK_HEIGHT: Final = 0.45959
TOP_CAMERA_HEIGHT: Final = 0.52323
BOTTOM_CAMERA_HEIGHT: Final = 0.47733
