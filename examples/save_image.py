"""Save what a camera of a Nao sees as a PPM image.

Start a robot first, `naoserver-sim`, then `python examples/save_image.py Camera nao.ppm`. CameraBottom works
as well and, in simulation, CameraOutside.
"""

from __future__ import annotations

import sys
from pathlib import Path

from interfaces.jderobot import CameraPrx
from zenoh_ice import ZenohIceError, initialize


def main(identity: str = "Camera", file: str = "nao.ppm") -> None:
    """Ask for one image and write it."""
    with initialize() as communicator:
        camera = CameraPrx.checkedCast(communicator.stringToProxy(identity))
        image = camera.getImageData("RGB8")
    shape = image.description
    header = f"P6 {shape.width} {shape.height} 255\n".encode()
    Path(file).write_bytes(header + image.pixelData)
    seconds = image.timeStamp.seconds + image.timeStamp.useconds / 1e6
    print(f"{file}: {shape.width}x{shape.height}, taken at {seconds:.3f} s of the robot's time")


if __name__ == "__main__":
    try:
        main(*sys.argv[1:])
    except ZenohIceError as error:  # it says what is missing and what to do
        sys.exit(str(error))
