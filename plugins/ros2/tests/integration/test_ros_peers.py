"""What is recorded of genuine ROS in plugins/ros2/tests/data/ros2 is what it still says."""

from __future__ import annotations

import json
import subprocess

import pytest

from plugins.ros2.tests.support.ros_peers import PROGRAMS, peers_python, recorded_types
from tests.support.limits import FOREVER

PUBLISHED = {
    "action_msgs/srv/CancelGoal": "573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a",
    "diagnostic_msgs/msg/DiagnosticArray": "5a8a36efb05fb25070fa0fb3810290c0e6cd4862b54a8fb975a1ee8dc55a333e",
    "example_interfaces/action/Fibonacci_SendGoal": "d1a57fb2a4afe8c21e34fb10db206f16ce6729b28531141472df92277c55b557",
    "example_interfaces/srv/AddTwoInts": "e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a",
    "rosgraph_msgs/msg/Clock": "692f7a66e93a3c83e71765d033b60349ba68023a8c689a79e48078bcb5c58564",
    "sensor_msgs/msg/CameraInfo": "b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275",
    "sensor_msgs/msg/Image": "d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47",
    "sensor_msgs/msg/Imu": "7d9a00ff131080897a5ec7e26e315954b8eae3353c3f995c55faf71574000b5b",
    "sensor_msgs/msg/JointState": "a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e",
    "std_msgs/msg/String": "df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18",
}
"""Hashes that others printed on a whole installation of Jazzy: those of the services and of String stand in the
design of rmw_zenoh, the others in a list of copper-rs (cu_ros2_payloads/all_rihs.md)."""


@pytest.mark.parametrize("name", PUBLISHED)
def test_recorded_hashes_are_the_published_ones(name: str) -> None:
    recorded = recorded_types()
    hashes = {**recorded["hashes"]}
    for definition in recorded["definitions"].values():
        hashes |= definition["hashes"]
    assert hashes[name] == f"RIHS01_{PUBLISHED[name]}"


@pytest.mark.slow
def test_recorded_types_are_what_genuine_ros_says() -> None:
    program = str(PROGRAMS / "record_types.py")
    run = subprocess.run(
        [peers_python(), program], capture_output=True, text=True, timeout=FOREVER, check=False
    )
    assert run.returncode == 0, run.stderr[-2000:]
    said = json.loads(run.stdout)
    recorded = recorded_types()
    assert said["hashes"] == recorded["hashes"]
    assert said["definitions"] == recorded["definitions"]
    assert said["cdr"] == recorded["cdr"], "after a change of record_types.py: make ros-recordings"
