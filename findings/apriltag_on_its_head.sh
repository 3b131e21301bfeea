#!/bin/sh
# An AprilTag that OpenCV has drawn stands upright for OpenCV, and on its head for AprilTag's own detector.
#
# Setting: OpenCV draws tags of the family 36h11, of 200 pixels on a white picture, for several ids. OpenCV's detector
# and AprilTag's library (as pupil-apriltags) look for them in the same picture.
# Guess: both find the same ids with the same top; what differs is at most the order of the corners.
# Seen, with the versions below, from the Python Package Index:
#   both find each id. For OpenCV the tag is upright: its first corner is that in the upper left of the picture.
#   For AprilTag x points to the left and y up, where in an upright tag x points to the right and y down (wiki of
#   AprilRobotics/apriltag, "Pose estimation"): half a turn apart, for each id. Who docks at tags that OpenCV drew,
#   and reads them with AprilTag's library, so has x and y with the wrong sign.
# Fails if one of these changes. Needs Python 3.11 and some 40 s.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --no-compile opencv-python-headless==5.0.0.93 pupil-apriltags==1.0.4.post11 \
    numpy==2.4.6
cat >"$folder/tried.py" <<'PYTHON'
import sys

import cv2
import numpy as np
from pupil_apriltags import Detector

WAYS = {(1, 0): "right", (-1, 0): "left", (0, 1): "down", (0, -1): "up"}
CAMERA = np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]])
HALF = 0.05  # m: half the side of a tag
CORNERS = np.array([[-HALF, HALF, 0], [HALF, HALF, 0], [HALF, -HALF, 0], [-HALF, -HALF, 0]])
tags = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
opencv = cv2.aruco.ArucoDetector(tags)
apriltag = Detector(families="tag36h11")


def axes(rotation):
    x, y = (WAYS[tuple(int(part) for part in np.round(rotation[:2, column]))] for column in (0, 1))
    return f"x to the {x}, y {y}, z {'into' if rotation[2, 2] > 0 else 'out of'} the tag"


found = {}
for number in (0, 7, 42, 300):
    picture = np.full((480, 640), 255, np.uint8)
    picture[140:340, 220:420] = cv2.aruco.generateImageMarker(tags, number, 200)
    corners, ids, _ = opencv.detectMarkers(picture)
    _, turned, _ = cv2.solvePnP(CORNERS, corners[0][0], CAMERA, None, flags=cv2.SOLVEPNP_IPPE_SQUARE)
    found.setdefault(f"OpenCV: {axes(cv2.Rodrigues(turned)[0])}", []).append(int(ids.ravel()[0]))
    (tag,) = apriltag.detect(picture, True, (600, 600, 320, 240), 2 * HALF)
    found.setdefault(f"AprilTag: {axes(tag.pose_R)}", []).append(tag.tag_id)

with open(sys.argv[1] + "/seen", "w") as seen:
    for what, numbers in found.items():
        print(what, numbers, file=seen)
PYTHON
cat >"$folder/expected" <<'TEXT'
OpenCV: x to the right, y up, z out of the tag [0, 7, 42, 300]
AprilTag: x to the left, y up, z into the tag [0, 7, 42, 300]
TEXT
"$folder/venv/bin/python" "$folder/tried.py" "$folder"
cat "$folder/seen"
diff "$folder/expected" "$folder/seen"
echo "as found"
