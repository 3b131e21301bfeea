"""XML as a tree with lines, within limits."""

from pathlib import Path

import pytest

from naoserver.errors import RobotError
from visualhfsm_own_robots._tree import LARGEST_FILE, numbers, parse_tree, read_tree, write_tree

FILE = Path("robot.urdf")


def parsed(text):
    return parse_tree(text.encode() if isinstance(text, str) else text, FILE)


def test_elements_know_their_lines():
    root = parsed('<robot>\n  <link\n name="a"/>\n  <link name="b"><visual/></link></robot>')
    assert [(each.tag, each.name, each.at) for each in root.all()] == [
        ("robot", "", "robot.urdf:1"),
        ("link", "a", "robot.urdf:2"),
        ("link", "b", "robot.urdf:4"),
        ("visual", "", "robot.urdf:4"),
    ]
    assert [each.tag for each in root.within("link", "visual")] == ["visual"]


@pytest.mark.parametrize(
    "text",
    [
        "<!-- was <robot name='old'> -->\n<robot name='r>1'/>",
        "<?xml version='1.0'?>\n<robot name='r>1'/>",
        "\ufeff<robot name='r>1'/>",
        "<robot name='r>1'><!-- a -- b --></robot>",
        "<robot name='r>1'/></robot>",
        "<robot name='r>1'/>".encode("utf-16"),
        b"<?xml version='1.0' encoding='iso-8859-1'?><robot name='r&gt;1' note='\xe4'/>",
    ],
)
def test_what_stands_around_the_root_does_not_matter(text):
    assert parsed(text).name == "r>1"


def test_lines_after_a_comment_that_only_mujoco_takes_are_right():
    assert parsed("<robot><!-- a --\n b\n -->\n<link/></robot>").children[0].line == 4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("<robot>\n<link></robot>", r"robot\.urdf:2: not XML: mismatched tag"),
        ("", r"robot\.urdf:1: not XML: no element found"),
        ("<robot", r"robot\.urdf:1: not XML: unclosed token"),
        ("<?xml version='1.0' encoding='klingon'?><robot/>", r"robot\.urdf:1: not XML: unknown encoding"),
        ('<!DOCTYPE r [<!ENTITY a "b">]>\n<robot/>', r"robot\.urdf:1: it has a document type"),
        (
            "<robot>\n" + "<a>" * 300 + "</a>" * 300 + "</robot>",
            "2: more than 256 elements within each other",
        ),
        ("<robot>" + "<a/>" * 50_000 + "</robot>", "more than 50000 elements"),
        (
            "<robot " + " ".join(f"a{n}=''" for n in range(201)) + "/>",
            "1: <robot> has more than 200 attributes",
        ),
        ("<robot>" + " " * LARGEST_FILE + "</robot>", "larger than 10 MB"),
        ('<robot>\n<mass value="nan"/></robot>', r"urdf:2: value of <mass> is 'nan': it must be finite"),
        ('<o xyz="0 -INF 0"/>', "xyz of <o> is '0 -INF 0': it must be finite"),
        ('<o xyz="0 1e400 0"/>', "it must be finite"),
        ("<!" * 2000 + "<!---->" + "-->" * 2000, "not XML"),
    ],
)
def test_a_text_beyond_the_limits_is_refused_with_its_line(text, problem):
    with pytest.raises(RobotError, match=problem):
        parsed(text)


def test_a_pointer_of_git_lfs_is_no_model(tmp_path):
    (tmp_path / "r.urdf").write_text("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n")
    with pytest.raises(RobotError, match=r"r\.urdf: it is a pointer of Git LFS: run git lfs pull"):
        read_tree(tmp_path / "r.urdf")


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(RobotError, match=r"r\.urdf: cannot be read: No such file"):
        read_tree(tmp_path / "r.urdf")


@pytest.mark.slow
@pytest.mark.parametrize("value", ["nan-" * 100_000 + "x", "nan " * 100_000 + "x", "1 " * 1_000_000])
def test_whether_a_value_is_a_number_is_found_in_one_pass(value):
    assert parsed(f'<link note="{value}"/>').get("note") == value


def test_names_may_read_as_numbers():
    assert parsed('<joint name="nan"><parent link="inf"/></joint>').children[0].get("link") == "inf"


def test_each_line_that_is_written_is_an_element():
    root = parsed('<a x="1>2&quot;\'">\n\n<b>text</b><c><d/></c></a>')
    root.children[1].add("e", y="&<")
    text, order = write_tree(root)
    assert [line[1] for line in text.splitlines()] == [each.tag for each in order] == list("abcde")
    again = parsed(text)
    assert again.get("x") == "1>2\"'"
    assert again.children[1].children[1].get("y") == "&<"
    assert order[-1].line == 3


def test_unwanted_elements_are_removed_with_all_in_them():
    root = parsed("<a><b><c/></b><d><b/></d></a>")
    assert len(root.remove_where(lambda each: each.tag == "b")) == 2
    assert [each.tag for each in root.all()] == ["a", "d"]


@pytest.mark.parametrize(
    ("value", "problem"),
    [
        ("1,5", "velocity of <limit> is '1,5': write numbers, with a point before the decimals"),
        ("${max}", r"velocity of <limit> is '\$\{max\}': write numbers; this is xacro: run xacro first"),
        ("1_0", "is '1_0': write numbers"),
    ],
)
def test_what_is_no_number_is_refused_with_what_is_expected(value, problem):
    with pytest.raises(RobotError, match=problem):
        numbers(parsed(f'<limit velocity="{value}"/>'), "velocity")


def test_numbers_that_are_missing_have_a_default():
    assert numbers(parsed("<axis/>"), "xyz", "1 0 0") == [1.0, 0.0, 0.0]
    with pytest.raises(RobotError, match="xyz of <axis> is '': write numbers"):
        numbers(parsed("<axis/>"), "xyz")
