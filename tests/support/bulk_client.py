"""A process that reads the images of a camera: `python -m tests.support.bulk_client ENDPOINT COUNT`.

It prints the number of each; once it has had COUNT of them, it reads no more, but goes on listening.
"""

# ruff: noqa: T201 - what it prints is for the test that runs it
from __future__ import annotations

import sys
import threading

from interfaces.jderobot import ImageData, ImageProviderPrx
from tests.support.image_servant import image
from zenoh_ice import Sample, initialize


def main() -> None:
    """Read until SIGINT."""
    endpoint, count = sys.argv[1], int(sys.argv[2])
    full = threading.Semaphore(count)
    end = threading.Event()

    def take(sample: Sample[ImageData]) -> None:
        if full.acquire(blocking=False):
            number = sample.value.timeStamp.seconds
            whole = sample.value == image(number, sample.value.pixelData)
            print(f"image {number}" if whole else "torn", flush=True)
        else:
            end.wait()

    with initialize(clock="wall", connect=[endpoint]) as communicator:
        camera = ImageProviderPrx.checkedCast(communicator.stringToProxy("Camera"))
        with camera.getImageData.subscribe(take, queue=8):
            print("ready", flush=True)
            try:
                communicator.waitForShutdown()
            except KeyboardInterrupt:
                end.set()


if __name__ == "__main__":
    main()
