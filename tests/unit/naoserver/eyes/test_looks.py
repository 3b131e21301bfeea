"""What eyes look for, in a file."""

import pytest

from naoserver.eyes.looks import EyesError, read_looks


def test_the_file_beside_it_is_read():
    assert "orange" in read_looks().balls


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("orange = 0.05", "orange = -1", r"own.toml:\d+: balls.orange = -1: write m above 0"),
        ("orange = 0.05", "pink = 0.05", r"own.toml: there is no color pink: write it in \[colors\]"),
        ("size = 0.15", "seize = 0.15", r"own.toml:\d+: tags.seize: there is no such key; there is size"),
    ],
)
def test_what_is_wrong_in_a_file_is_said_with_its_place(tmp_path, old, new, said):
    from importlib import resources

    text = (resources.files("naoserver.eyes") / "eyes.toml").read_text(encoding="utf-8")
    assert old in text
    file = tmp_path / "own.toml"
    file.write_text(text.replace(old, new))
    with pytest.raises(EyesError, match=said):
        read_looks(file)
