"""The page about several robots: what its roles may do in ROS, and natively."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from interfaces.nao import SafetyPrx
from plugins.ros2.tests.support.ros_lab import secured_lab
from tests.support.limits import CALL_LIMIT
from tests.support.pages import DOCS
from tests.support.security import Keys
from zenoh_ice import initialize


def test_the_roles_of_several_robots(tmp_path: Path) -> None:
    page = (DOCS / "how-to/several-robots.md").read_text("utf-8")
    block = re.search(r"```toml\n(.*?)```", page, re.S)
    assert block is not None
    keys = Keys(tmp_path)
    users = {name: name for name in ("robot", "operator", "gateway2")} | {"ann": "team2"}
    for name in ("gateway2", "ann"):
        keys.issue(name)
    security = {"roles": tomllib.loads(block[1])["security"]["roles"], "users": users}
    with secured_lab(keys, "/nao2", "gateway2", "nao2", security=security) as lab, lab.node("ann") as ann:
        assert lab.has_topic(ann, "sensor_msgs/msg/JointState", "/nao2/joint_states")
        assert lab.has_topic(ann, "tf2_msgs/msg/TFMessage", "/tf")
        stop = ann.create_client("std_srvs/srv/Trigger", "/nao2/nao/emergency_stop")
        assert stop.call(timeout=CALL_LIMIT).success
        safety = SafetyPrx.checkedCast(lab.nao.stringToProxy("Safety"))
        assert safety.getSafetyState().stopped
        with initialize(keys.settings("ann", realm="nao2")) as native:
            SafetyPrx.checkedCast(native.stringToProxy("Safety")).resetEmergencyStop()
        assert not safety.getSafetyState().stopped
