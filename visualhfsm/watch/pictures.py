"""The report's pictures as PNG; needs Pillow, which comes with Matplotlib (the extra `demo`)."""

from __future__ import annotations

import io

from PIL import Image, ImageDraw

from visualhfsm.watch.album import Picture

__all__ = ["picture_png"]


def picture_png(picture: Picture) -> bytes:
    """Encode a picture, with a cross hair at its mark."""
    image = Image.frombytes("RGB", (picture.width, picture.height), picture.pixels)
    if picture.mark is not None:
        draw = ImageDraw.Draw(image)
        u, v = picture.mark
        arm = max(picture.width // 20, 6)
        for width, color in ((3, "black"), (1, "white")):
            draw.line([(u - arm, v), (u + arm, v)], fill=color, width=width)
            draw.line([(u, v - arm), (u, v + arm)], fill=color, width=width)
    buffer = io.BytesIO()
    image.save(buffer, "PNG", optimize=True)
    return buffer.getvalue()
