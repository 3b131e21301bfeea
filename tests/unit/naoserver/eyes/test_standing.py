"""What stands on a field and hides it."""

import numpy as np

from naoserver.eyes._standing import find_standing

HEIGHT, FOCAL = 0.5, 272.0
TO_FLOOR = np.array(
    ((0.0, 0.0, HEIGHT), (-HEIGHT / FOCAL, 0.0, HEIGHT * 159.5 / FOCAL), (0.0, 1.0 / FOCAL, -60.0 / FOCAL))
)
"""Of a camera that looks straight ahead, with the horizon in row 60."""


def test_what_is_tall_has_feet_where_it_meets_the_grass():
    grass = np.zeros((240, 320), bool)
    grass[60:] = True
    grass[:150, 100:140] = False
    feet = find_standing(grass, np.zeros_like(grass), TO_FLOOR, HEIGHT).feet
    assert len(feet) == 10
    assert np.allclose(feet[:, 0], HEIGHT * FOCAL / (150 - 60), rtol=0.02)
