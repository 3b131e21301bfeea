"""Sounds that play and are recorded, in virtual time, on a folder that stands for the robot's disk."""

import wave

import pytest

pytest.importorskip("qi")

from naoserver.errors import InvalidCommand
from visualhfsm_naoqi.programs._sound import UNKNOWN_LENGTH, ALAudioDevice, ALAudioPlayer, ALAudioRecorder

SONG = "/home/nao/song.wav"


@pytest.fixture(autouse=True)
def disk(rig, tmp_path):
    (tmp_path / "home/nao").mkdir(parents=True)
    with wave.open(str(tmp_path / SONG[1:]), "wb") as song:
        song.setparams((1, 2, 8000, 0, "NONE", ""))
        song.writeframes(bytes(2 * 8000 * 3))
    rig.access.disk = tmp_path


@pytest.fixture
def player(rig):
    return rig.access.service(ALAudioPlayer)


@pytest.fixture
def recorder(rig):
    return rig.access.service(ALAudioRecorder)


def test_a_file_plays_as_long_as_it_is(rig, player):
    assert rig.complete(player.playFile, SONG) == pytest.approx(3.0, abs=0.1)


def test_a_file_plays_from_a_position(rig, player):
    assert rig.complete(player.playFileFromPosition, SONG, 2.0) == pytest.approx(1.0, abs=0.1)


def test_a_file_that_is_not_there_plays_shortly(rig, player, caplog):
    assert rig.complete(player.playFile, "/home/nao/other.mp3") == pytest.approx(UNKNOWN_LENGTH, abs=0.1)
    assert "other.mp3" in caplog.text


@pytest.mark.parametrize("service", [ALAudioPlayer, ALAudioDevice])
def test_a_sine_is_a_tone_of_the_loudspeaker_for_its_time(rig, service):
    call = rig.begin(rig.access.service(service).playSine, 440, 25, 0, 2.0)
    rig.advance(1.0)
    heard = rig.robot.loudspeaker.playback()
    assert (heard.tones[0].frequency, heard.loudness, heard.playing) == (440.0, 0.25, True)
    assert not call.ended
    rig.advance(1.1)
    call.join()


def test_a_sine_ends_when_all_sounds_are_stopped(rig, player):
    call = rig.begin(player.playSine, 440, 25, 0, 5.0)
    rig.advance(1.0)
    player.stopAll()
    rig.advance(0.1)
    call.join()
    assert not rig.robot.loudspeaker.playback().playing


@pytest.mark.parametrize(
    "sine", [(20, 25, 0, 1.0), (440, 101, 0, 1.0), (440, 25, 2, 1.0), (440, 25, 0, 11.0)]
)
def test_a_sine_that_cannot_be_played_is_refused(rig, player, sine):
    with pytest.raises(InvalidCommand, match="must be from"):
        rig.complete(player.playSine, *sine)
    assert rig.robot.loudspeaker.playback().count == 0


def test_a_loop_ends_when_it_is_stopped(rig, player):
    sound = player.loadFile(SONG)
    call = rig.begin(player.playInLoop, sound)
    rig.advance(7.0)
    assert not call.ended
    assert player.getCurrentPosition(sound) == pytest.approx(1.0, abs=0.1)
    player.stopAll()
    rig.advance(0.1)
    call.join()
    assert player.getCurrentPosition(sound) == 0.0


def test_a_paused_sound_stands_still(rig, player):
    sound = player.loadFile(SONG)
    call = rig.begin(player.play, sound)
    rig.advance(1.0)
    player.pause(sound)
    rig.advance(10.0)
    assert player.getCurrentPosition(sound) == pytest.approx(1.0, abs=0.1)
    player.pause(sound)
    rig.advance(2.2)
    call.join()


def test_a_sound_plays_once_at_a_time(rig, player):
    sound = player.loadFile(SONG)
    call = rig.begin(player.play, sound)
    with pytest.raises(InvalidCommand, match="playing already"):
        player.play(call.call, sound)
    player.unloadAllFiles()
    rig.advance(0.1)
    call.join()
    with pytest.raises(InvalidCommand, match="no sound 1"):
        player.getFileLength(sound)


@pytest.mark.parametrize(
    "path", ["../secret.wav", "/home/../../secret.wav", "/", "", "a\0b", "/home/nao/link"]
)
def test_no_path_leads_out_of_the_disk(tmp_path, recorder, path):
    (tmp_path / "home/nao/link").symlink_to("/etc/hostname")
    with pytest.raises(InvalidCommand, match="no file on the robot's disk"):
        recorder.startMicrophonesRecording(path)


@pytest.mark.parametrize(("rate", "channels"), [(16000, (0, 0, 1, 0)), (48000, (1, 1, 1, 1))])
def test_a_recording_is_silent_and_as_long_as_it_took(rig, tmp_path, recorder, rate, channels):
    recorder.startMicrophonesRecording("/home/nao/new/note.wav", "wav", rate, channels)
    rig.advance(2.0)
    recorder.stopMicrophonesRecording()
    with wave.open(str(tmp_path / "home/nao/new/note.wav")) as note:
        assert note.getnchannels() == sum(channels)
        assert note.getnframes() / note.getframerate() == pytest.approx(2.0)
        assert not any(note.readframes(note.getnframes()))


def test_one_recording_at_a_time(rig, recorder):
    recorder.startMicrophonesRecording("/a.wav")
    with pytest.raises(InvalidCommand, match="recording already"):
        rig.access.service(ALAudioDevice).startMicrophonesRecording("/b.wav")
    recorder.stopMicrophonesRecording()
    recorder.startMicrophonesRecording("/b.wav")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("/a.ogg", "ogg"), "no type of file 'ogg'"),
        (("/a.wav", "wav", 8000), "must be 16000 or 48000"),
        (("/a.wav", "wav", 16000, (0, 0, 0, 0)), "no microphone is chosen"),
    ],
)
def test_recordings_that_are_refused(recorder, arguments, message):
    with pytest.raises(InvalidCommand, match=message):
        recorder.startMicrophonesRecording(*arguments)


def test_the_volume_is_kept(rig):
    device = rig.access.service(ALAudioDevice)
    device.setOutputVolume(40)
    device.muteAudioOut(True)
    assert (device.getOutputVolume(), device.isAudioOutMuted()) == (40, True)
    with pytest.raises(InvalidCommand, match="from 0 to 100"):
        device.setOutputVolume(140)
