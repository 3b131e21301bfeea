"""Xacro is expanded, or recognised by name and line."""

import importlib.util
import os

import pytest

from naoserver.errors import RobotError
from plugins.own_robots.tests.support.robot_files import joint, link, urdf
from visualhfsm_own_robots._tree import read_tree
from visualhfsm_own_robots._xacro import expanded

pytestmark = pytest.mark.slow

MACRO = (
    '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
    '  <xacro:macro name="arm" params="side sign">\n'
    + link("${side}_arm")
    + joint("${side}_shoulder", "base", "${side}_arm").replace('"0 0 0.2"', '"0 ${sign * width / 2} 0"')
    + "  </xacro:macro>\n</robot>"
)
ROBOT = (
    '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
    '  <xacro:include filename="INCLUDED"/>\n'
    '  <xacro:property name="width" value="0.4"/>\n'
    + link("base")
    + '  <xacro:arm side="left" sign="1"/>\n  <xacro:arm side="right" sign="-1"/>\n</robot>'
)


@pytest.fixture
def expand(tmp_path):
    def written(text, name="r.urdf.xacro", **arguments):
        path = tmp_path / name
        path.write_text(text)
        return expanded(read_tree(path), path, {"arms": tmp_path}, arguments)

    return written


@pytest.mark.parametrize("name", ["arm.xacro", "$(find arms)/arm.xacro"])
def test_macros_properties_and_files_are_expanded(expand, tmp_path, name):
    (tmp_path / "arm.xacro").write_text(MACRO)
    root, notes = expand(ROBOT.replace("INCLUDED", name))
    places = [each.get("xyz") for each in root.within("joint", "origin")]
    assert [each.name for each in root.within("link")] == ["base", "left_arm", "right_arm"]
    assert places == ["0 0.2 0", "0 -0.2 0"]
    assert "r.urdf.xacro: xacro is expanded" in notes[0]


def test_a_plain_urdf_stays_as_it_is(expand):
    root, notes = expand(urdf(link("base")), "r.urdf")
    assert ([each.name for each in root.within("link")], notes) == (["base"], [])


def test_what_other_programs_read_does_not_matter(expand):
    plugin = '<gazebo><plugin file="$(find arms)/x"><path>$(find arms)/y.yaml</path></plugin></gazebo>'
    assert expand(urdf(link("base"), plugin), "r.urdf")[1] == []


def test_a_prefix_that_a_launch_file_would_set_is_empty(expand):
    root, notes = expand(
        urdf(link("${ns}base"), link("${ns}arm"), joint("${ns}j", "${ns}base", "${ns}arm")), "r.urdf"
    )
    assert [each.name for each in root.within("joint")] == ["j"]
    assert [each.get("link") for each in root.within("joint", "parent")] == ["base"]
    assert notes[0].endswith("r.urdf:2: ${ns} is defined nowhere: the names are read without it")


def test_a_prefix_that_a_launch_file_would_set_is_no_argument(expand):
    with pytest.raises(RobotError, match=r"r\.urdf:2: xacro cannot be expanded: name 'ns' is not defined"):
        expand(urdf(link("${ns}base")), "r.urdf", ns="left_")


def evaluating(expression):
    head = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
    return (
        head + f'  <xacro:property name="mass" value="${{{expression}}}"/>\n' + link("${mass}") + "</robot>"
    )


@pytest.mark.parametrize(
    ("expression", "problem"),
    [
        ("unknown * 2", r"r\.urdf\.xacro:2: xacro cannot be expanded: name 'unknown' is not defined"),
        ("().__class__.__base__", r"r\.urdf\.xacro:2: xacro cannot be expanded: Use of invalid name"),
        ("xacro.load_yaml('/etc/hostname')", "outside the folders of the model"),
        ("len(list(range(10 ** 10)))", r"r\.urdf\.xacro"),
    ],
)
def test_what_cannot_be_expanded_is_refused_with_its_line(expand, expression, problem):
    with pytest.raises(RobotError, match=problem):
        expand(evaluating(expression))


def test_what_is_wrong_in_a_macro_or_a_file_is_said_with_its_name(expand, tmp_path):
    (tmp_path / "arm.xacro").write_text(MACRO)
    with pytest.raises(
        RobotError, match=r"xacro: xacro cannot be expanded: Invalid parameter .sight., in the macro \w+$"
    ):
        expand(ROBOT.replace("INCLUDED", "arm.xacro").replace("side=", "sight="))
    (tmp_path / "arm.xacro").write_text(evaluating("unknown * 2"))
    both = evaluating("unknown * 2").replace("<xacro", '<xacro:include filename="arm.xacro"/><xacro')
    with pytest.raises(RobotError, match=r"r\.urdf\.xacro: xacro .*, in the file \S*arm\.xacro$"):
        expand(both)


def test_an_expression_is_not_found_in_a_name(expand):
    with pytest.raises(RobotError, match=r"r\.urdf\.xacro:3: xacro cannot be expanded: name 'r' is not"):
        expand(
            SIZED.replace(
                'default="left"', 'default="left"/>\n<xacro:property name="q" value="${r}"'
            ).replace("$(arg dof)", "${q}")
        )


def test_an_expansion_that_does_not_end_is_ended(expand, monkeypatch):
    monkeypatch.setattr("visualhfsm_own_robots._xacro._LONGEST", 1)
    with pytest.raises(
        RobotError, match=r"r\.urdf\.xacro: xacro is not expanded within 1 s of the processor"
    ):
        expand(evaluating("9 ** 9 ** 9"))


def test_one_that_waits_is_ended_too(expand, tmp_path, monkeypatch):
    monkeypatch.setattr("visualhfsm_own_robots._xacro._WALL", 0.5)
    os.mkfifo(tmp_path / "arm.xacro")
    with pytest.raises(RobotError, match=r"r\.urdf\.xacro: xacro is not expanded within 0\.5 s"):
        expand(ROBOT.replace("INCLUDED", "arm.xacro"))


SIZED = (
    '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n<xacro:arg name="side" default="left"/>\n'
    + link("$(arg side)_$(arg dof)")
    + "</robot>"
)


def test_arguments_are_those_that_are_given(expand):
    text = SIZED.replace(
        "</robot>",
        '<xacro:if value="$(arg two)">' + link("$(arg size)") + link("$(arg two)") + "</xacro:if></robot>",
    )
    root, _ = expand(text, dof=7, side="b; c", two=True, size=0.5)
    assert [each.name for each in root.within("link")] == ["b; c_7", "0.5", "true"]


def test_arguments_that_are_missing_are_said_with_how_to_give_them(expand):
    given = (
        r"Undefined substitution argument dof; an argument is given by --xacro dof:=VALUE, or in \[xacro\]"
    )
    with pytest.raises(RobotError, match=given):
        expand(SIZED)


def test_of_a_file_that_its_arguments_name_they_are_said(expand):
    text = SIZED.replace("<link", '<xacro:include filename="$(arg side)/none.xacro"/><link')
    with pytest.raises(
        RobotError, match=r"No such file.*left/none\.xacro'; an argument is given by --xacro side:="
    ):
        expand(text)


def test_a_file_without_xacro_takes_no_arguments(expand):
    with pytest.raises(RobotError, match=r"r\.urdf: it has no xacro, so that it takes no arguments"):
        expand(urdf(link("base")), "r.urdf", dof="7")


def test_a_pointer_of_git_lfs_is_no_macro(expand, tmp_path):
    (tmp_path / "arm.xacro").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n")
    with pytest.raises(RobotError, match=r"arm\.xacro is a pointer of Git LFS: run git lfs pull"):
        expand(ROBOT.replace("INCLUDED", "arm.xacro"))


def test_files_elsewhere_are_not_read(expand, tmp_path):
    secret = tmp_path.parent / "secret.xacro"
    secret.write_text(MACRO)
    with pytest.raises(RobotError, match=r"secret\.xacro.*outside the folders of the model"):
        expand(ROBOT.replace("INCLUDED", str(secret)))


def test_variables_of_the_users_environment_are_not_read(expand, monkeypatch):
    monkeypatch.setitem(os.environ, "SECRET", "s")
    with pytest.raises(RobotError, match="SECRET"):
        expand(ROBOT.replace('"INCLUDED"', '"$(env SECRET)"'))


def including(*files):
    head = '<robot name="r" xmlns:xacro="http://www.ros.org/wiki/xacro">\n'
    return head + "".join(f'<xacro:include filename="{each}"/>\n' for each in files) + "</robot>"


def test_all_missing_packages_are_named_with_what_helps(expand, tmp_path):
    (tmp_path / "arm.xacro").write_text(including("$(find wheels)/w.xacro", "$(find eyes)/e.xacro"))
    (tmp_path / "legs.xacro").write_text(
        including(f"../{tmp_path.name}/legs.xacro", "$(find feet)/f.xacro", "none.xacro")
    )
    with pytest.raises(
        RobotError,
        match=r"the ROS packages hands, wheels, eyes, feet are missing: put their folders beside "
        + tmp_path.name,
    ):
        expand(including("$(find hands)/h.xacro", "arm.xacro", "$(find arms)/legs.xacro"))


def test_a_model_outside_of_any_package_needs_one(tmp_path):
    path = tmp_path / "r.urdf.xacro"
    path.write_text(including("$(find hands)/h.xacro"))
    said = r"the ROS package hands is missing: put its folder beside that of the model, which needs a package\.xml"
    with pytest.raises(RobotError, match=said):
        expanded(read_tree(path), path, {}, {})


def test_without_the_library_it_is_said_what_to_install(expand, monkeypatch):
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(RobotError, match=r"r\.urdf\.xacro:2: <xacro:include>: this is xacro; pip install"):
        expand(ROBOT)
