"""ALPhotoCapture over a fake robot, in virtual time."""

import pytest

pytest.importorskip("qi")

from PIL import Image

from naoserver.errors import InvalidCommand
from visualhfsm_naoqi.programs._photos import MOST_PHOTOS, ALPhotoCapture

FOLDER = "/home/nao/recordings/cameras/"


@pytest.fixture
def disk(rig, tmp_path):
    rig.access.disk = tmp_path / "disk"
    rig.access.disk.mkdir()
    return rig.access.disk


@pytest.fixture
def photos(rig, disk):
    return rig.access.service(ALPhotoCapture)


def take(rig, operation, *arguments):
    call = rig.begin(operation, *arguments)
    while not call.ended:
        rig.advance(0.1)
    call.join()
    if call.error is not None:
        raise call.error
    return call.result


@pytest.mark.parametrize(("end", "kind"), [("jpg", "JPEG"), ("png", "PNG"), ("bmp", "BMP"), ("tif", "TIFF")])
def test_a_photo_is_a_file_on_the_robots_disk(rig, disk, photos, end, kind):
    photos.setPictureFormat(end)
    photos.setResolution(1)
    assert take(rig, photos.takePicture, FOLDER, "image") == [f"{FOLDER}image.{end}"]
    with Image.open(disk / f"home/nao/recordings/cameras/image.{end}") as image:
        assert (image.size, image.format) == ((320, 240), kind)


def test_several_photos_are_numbered_and_apart_in_time(rig, disk, photos):
    photos.setCaptureInterval(500)
    start = rig.clock.now()
    files = take(rig, photos.takePictures, 3, FOLDER, "image")
    assert files == [[f"{FOLDER}image_{i}.jpg" for i in range(3)]]
    assert rig.clock.now() - start == pytest.approx(1.0, abs=0.25)
    assert all((disk / file[1:]).is_file() for file in files[0])


def test_a_file_is_kept_if_it_is_not_to_be_overwritten(rig, disk, photos):
    (disk / "a.jpg").write_text("mine")
    with pytest.raises(InvalidCommand, match=r"a\.jpg exists already"):
        take(rig, photos.takePicture, "/", "a", False)
    assert (disk / "a.jpg").read_text() == "mine"
    take(rig, photos.takePicture, "/", "a")
    assert (disk / "a.jpg").stat().st_size > 100


@pytest.mark.parametrize("folder", ["/../..", "home/../../..", "/link", "a/" * 30, "/\0"])
def test_no_photo_leaves_the_disk(rig, disk, photos, tmp_path, folder):
    (disk / "link").symlink_to(tmp_path)
    before = set(tmp_path.rglob("*"))
    with pytest.raises(InvalidCommand, match="file"):
        take(rig, photos.takePicture, folder, "a")
    assert set(tmp_path.rglob("*")) == before


@pytest.mark.slow
def test_photos_are_few(rig, photos):
    photos.setResolution(8)
    photos.setCaptureInterval(0)
    take(rig, photos.takePictures, MOST_PHOTOS, "/", "a")
    take(rig, photos.takePictures, MOST_PHOTOS, "/", "a")
    with pytest.raises(InvalidCommand, match=f"{MOST_PHOTOS} photos are taken already"):
        take(rig, photos.takePicture, "/", "b")
    with pytest.raises(InvalidCommand, match="number of photos is 101"):
        take(rig, photos.takePictures, MOST_PHOTOS + 1, "/", "a")


def test_settings_that_no_camera_has(rig, photos):
    with pytest.raises(InvalidCommand, match="no format, which is the end of the files' names 'gif'"):
        photos.setPictureFormat("gif")
    photos.setCameraID(1)
    rig.robot.cameras = rig.robot.cameras[:1]
    with pytest.raises(InvalidCommand, match="no camera with a resolution of 640x480"):
        take(rig, photos.takePicture, "/", "a")
    assert (photos.getResolution(), photos.getCameraID(), photos.getPictureFormat()) == (2, 1, "jpg")
