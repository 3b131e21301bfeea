"""A guessed description as TOML: read again, it is the same body."""

import tomllib

import pytest

from naoserver.body import write_body
from tests.support.models import MODELS
from visualhfsm_own_robots import read_own_body, write_own_body
from visualhfsm_own_robots._toml_text import key, toml_text, torques_to_paste, value_text

pytestmark = pytest.mark.sim


@pytest.fixture
def write(tmp_path):
    """Write what a model alone is taken for; return the paths of both."""

    def written(model, name="robot.urdf"):
        source, target = tmp_path / name, tmp_path / "my_robot.toml"
        source.write_text(model)
        write_own_body(source, target)
        return source, target

    return written


@pytest.mark.parametrize("name", MODELS)
def test_what_is_written_is_the_body_that_was_guessed(write, name):
    source, target = write(MODELS[name])
    assert write_body(read_own_body(target)) == write_body(read_own_body(source))


def test_names_of_any_letters_are_read_again(write):
    source, target = write(MODELS["humanoid"].replace("l_knee", '$&quot;{ñ}.\\#"').replace('#"', "#"))
    assert write_body(read_own_body(target)) == write_body(read_own_body(source))


def test_a_model_below_the_folder_of_the_file_is_named_from_there(tmp_path):
    (tmp_path / "urdf").mkdir()
    (tmp_path / "urdf/robot.urdf").write_text(MODELS["carrier"])
    write_own_body(tmp_path / "urdf/robot.urdf", tmp_path / "my_robot.toml")
    assert tomllib.loads((tmp_path / "my_robot.toml").read_text())["model"] == "urdf/robot.urdf"
    assert read_own_body(tmp_path / "my_robot.toml").name == "robot"


def test_a_model_may_have_a_name_that_begins_with_points(write):
    _, target = write(MODELS["carrier"], "..robot.urdf")
    assert read_own_body(target).mass > 0.0


def test_each_guess_has_its_reason_beside_it(write):
    text = write(MODELS["gripper_arm"])[1].read_text()
    assert "mounted = true  # its base extends 0.058 m beyond its center of mass" in text
    assert (
        "lift_joint = { max_torque = 13.0, max_velocity = 3.0 }  # torque by the mass that it carries" in text
    )
    assert max(map(len, text.splitlines())) <= 110


TABLES = {
    "a": 1,
    "b": {"c": {"d": "x"}, "e": []},
    "f": [{"g": 1.5}, {"g": [[1, 2], [3, 4]]}],
    "joint": {"j k": {"l": 2}},
}


def test_any_document_is_read_again():
    reasons = {("a",): "why", ("b", "c"): "long " * 40, ("f", 1): "second", ("joint", "j k", "l"): "of it"}
    text = toml_text(TABLES, reasons, "Head\nof two lines")
    assert tomllib.loads(text) == TABLES
    assert text.startswith("# Head\n# of two lines\n")
    assert "a = 1  # why" in text
    assert "# second\n[[f]]" in text
    assert '"j k" = { l = 2 }  # of it' in text


def test_long_lists_are_broken():
    names = [f"joint number {number}" for number in range(30)]
    text = toml_text({"names": names}, {}, "")
    assert tomllib.loads(text) == {"names": names}
    assert 5 < len(text.splitlines()) < 15


@pytest.mark.parametrize(
    "name", ["a b", "${x}", "é", "", 'q"', "back\\slash", "tab\t", "del\x7f", "a.b", "-_9"]
)
def test_names_are_quoted_where_toml_wants_it(name):
    assert tomllib.loads(f"{key(name)} = {value_text(name)}") == {name: name}


def test_torques_can_be_pasted():
    torques = {"pan": 0.65, "${ns}wheel": 12.0}
    assert {
        name: table["max_torque"] for name, table in tomllib.loads(torques_to_paste(torques))["joint"].items()
    } == torques
