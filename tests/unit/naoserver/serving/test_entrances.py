import pytest

from naoserver.errors import RobotError
from naoserver.serving.server import find_entrance


def test_an_entrance_that_no_package_provides():
    with pytest.raises(RobotError, match="no installed package serves robots as 'ros1'"):
        find_entrance("ros1")
