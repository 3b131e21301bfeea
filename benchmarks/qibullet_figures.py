"""Measure qiBullet, which is not part of this project, for docs/explanation/comparison.md.

It needs a separate environment:

    python -m venv qibullet-venv && qibullet-venv/bin/python -m pip install qibullet
    qibullet-venv/bin/python benchmarks/qibullet_figures.py

The meshes of its robots are not used: every user has to accept their license, and their installer supports
only Python up to 3.9. The robot is loaded from qiBullet's URDF with a box of 4 cm for each visible mesh, and
only a box for each sole can collide: physics and images cost less than with the meshes.
"""

from __future__ import annotations

import statistics
import sys
import tempfile
import time
from pathlib import Path
from xml.etree import ElementTree

import pybullet
import qibullet
from qibullet import NaoVirtual, SimulationManager
from qibullet.camera import Camera
from qibullet.robot_virtual import RobotVirtual

PHYSICS_RATE = 240.0  # steps per simulated second: the default of pybullet, which qiBullet uses
SEEN = "0.04 0.04 0.04"
SOLE = "0.16 0.088 0.016"
SOLE_PLACE = "0.025 0 -0.037"
ROUNDS = 5


class BareNao(NaoVirtual):  # type: ignore[misc]
    """qiBullet's Nao without its meshes, which its constructor would ask for."""

    def __init__(self, urdf: Path) -> None:
        RobotVirtual.__init__(self, str(urdf))
        self.camera_top = self.camera_bottom = None


def bare_urdf(folder: Path) -> Path:
    """Write qiBullet's description of a Nao with boxes for its meshes, and return its path."""
    description = ElementTree.parse(Path(qibullet.__file__).parent / "robot_data" / "nao.urdf")
    for link in description.getroot().iter("link"):
        for seen in link.iter("visual"):
            give_box(seen, SEEN)
        for solid in link.findall("collision"):
            if link.get("name") in ("l_ankle", "r_ankle"):
                give_box(solid, SOLE, SOLE_PLACE)
            else:
                link.remove(solid)
    path = folder / "nao.urdf"
    description.write(path)
    return path


def give_box(part: ElementTree.Element, size: str, place: str = "") -> None:
    """Make a box the shape of a part of a link."""
    geometry = part.find("geometry")
    if geometry is None:
        return
    geometry.clear()
    ElementTree.SubElement(geometry, "box", size=size)
    if place:
        for origin in part.findall("origin"):
            part.remove(origin)
        ElementTree.SubElement(part, "origin", xyz=place, rpy="0 0 0")


def best(measure: list[float]) -> str:
    """Return the best of some rates, and the median."""
    return f"{max(measure):.0f} (median {statistics.median(measure):.0f})"


def main() -> None:
    """Print the figures."""
    manager = SimulationManager()
    client = manager.launchSimulation(gui=False, auto_step=False)
    with tempfile.TemporaryDirectory() as folder:
        nao = BareNao(bare_urdf(Path(folder)))
        nao.loadRobot([0, 0, 0], [0, 0, 0, 1], physicsClientId=client)
    manager._spawnGroundPlane(client)
    for _ in range(480):
        manager.stepSimulation(client)
    height = pybullet.getBasePositionAndOrientation(nao.getRobotModel(), physicsClientId=client)[0][2]
    print(f"the torso is at {height:.3f} m after 2 s")
    print(f"Python {sys.version.split()[0]}, pybullet API {pybullet.getAPIVersion()}")

    rates = []
    for _ in range(ROUNDS):
        begin = time.thread_time()
        for _ in range(2000):
            manager.stepSimulation(client)
        rates.append(2000 / (time.thread_time() - begin))
    print(f"steps per second of processor time: {best(rates)}, {max(rates) / PHYSICS_RATE:.0f} x real time")

    joints = [name for name in nao.joint_dict if "Finger" not in name and "Thumb" not in name]
    rates = []
    for _ in range(ROUNDS):
        begin = time.thread_time()
        for _ in range(50):
            for _ in range(5):  # about 50 Hz
                manager.stepSimulation(client)
            nao.setAngles("HeadYaw", 0.1, 0.5)
            nao.getAnglesPosition(joints)
            nao.getAnglesVelocity(joints)
        rates.append(250 / (time.thread_time() - begin))
    text = f"{best(rates)}, {max(rates) / PHYSICS_RATE:.0f} x real time"
    print(f"the same, joints read and one commanded at 48 Hz: {text}")

    for name, size in (("320x240", Camera.K_QVGA), ("640x480", Camera.K_VGA)):
        handle = nao.subscribeCamera(NaoVirtual.ID_CAMERA_TOP, resolution=size, fps=1000)
        camera = nao.getCamera(handle)
        rates = []
        for _ in range(ROUNDS):
            used, frames, seen = time.process_time(), 0, None
            begin = time.monotonic()
            while time.monotonic() - begin < 1.0:
                if camera.frame is not seen:
                    seen, frames = camera.frame, frames + 1
                time.sleep(0.0005)
            rates.append(frames / (time.process_time() - used))
        nao.unsubscribeCamera(handle)
        print(f"images of {name} per second of processor time: {best(rates)}")

    manager.stopSimulation(client)


if __name__ == "__main__":
    main()
