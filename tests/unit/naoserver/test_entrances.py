import pytest

from naoserver.entrances import find_entrance
from naoserver.errors import RobotError
from naoserver.qi import serve_as_naoqi


def test_naoqi_is_an_entrance_of_an_installed_package():
    assert find_entrance("qi") is serve_as_naoqi


def test_an_entrance_that_no_package_provides():
    with pytest.raises(RobotError, match="no installed package serves robots as 'ros1'"):
        find_entrance("ros1")
