"""The table of sounds."""

import pytest

from naoserver.protocol.expression import HIGHEST_TONE, LONGEST_TONE, LOWEST_TONE, SOUNDS, single_tone


@pytest.mark.parametrize("sound", SOUNDS.values(), ids=SOUNDS)
def test_a_sound_is_short_described_and_can_be_heard(sound):
    assert sound.description
    assert 0.1 <= sound.duration <= 3.0
    assert all(tone.seconds > 0.0 for tone in sound.tones)
    assert all(tone.frequency == 0 or LOWEST_TONE <= tone.frequency <= HIGHEST_TONE for tone in sound.tones)
    assert sound.tones[0].frequency > 0


def test_a_single_tone_is_a_sound_that_no_other_has_the_name_of():
    assert single_tone(440.0, LONGEST_TONE).duration == LONGEST_TONE
    assert single_tone(440.0, 1.0).name not in SOUNDS
