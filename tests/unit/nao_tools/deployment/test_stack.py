"""The stack file: its settings, and the errors about mistakes in it."""

import re
from pathlib import Path

import msgspec
import pytest
from hypothesis import given

from nao_tools._command import app
from nao_tools._deployment.launcher import free_endpoint
from nao_tools._deployment.stack import ProcessSpec, Restarts, StackError, load_stack, shipped, stack_path
from tests.support.any_text import any_text
from tests.support.commands import run_here
from tests.support.processes import REPOSITORY
from zenoh_ice import ConfigurationException

GOOD = """
name = "pair"
log_dir = "somewhere"
endpoint = "tcp/127.0.0.1:7447"

[variables]
speed = "1"

[[process]]
name = "server"
command = ["python", "-m", "server", "--listen", "{endpoint}", "--speed={speed}"]
ready = "serving \\\\w+"
ready_timeout = 5
environment = { MODE = "x{speed}" }

[[process]]
name = "view"
command = ["view"]
after = ["server"]
foreground = true
stop_timeout = 9.5
"""


def write(directory: Path, text: str) -> Path:
    path = directory / "stack.toml"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_stack_is_read_with_its_processes_in_order(tmp_path):
    stack = load_stack(write(tmp_path, GOOD))
    server, view = stack.processes
    assert (stack.name, stack.log_dir, stack.endpoint) == ("pair", "somewhere", "tcp/127.0.0.1:7447")
    assert re.search(server.ready, "now serving nao")
    assert (server.ready_timeout, server.stop_timeout, server.foreground) == (5.0, 3.0, False)
    assert (view.after, view.foreground, view.stop_timeout) == (("server",), True, 9.5)


def test_variables_are_filled_into_commands_and_environment(tmp_path):
    stack = load_stack(write(tmp_path, GOOD))
    server, _ = stack.with_variables({"speed": "5", "endpoint": "tcp/127.0.0.1:9"})
    assert server.command[3:] == ("--listen", "tcp/127.0.0.1:9", "--speed=5")
    assert server.environment == {"MODE": "x5"}


def test_all_processes_join_a_realm_that_do_not_name_one(tmp_path):
    stack = load_stack(write(tmp_path, GOOD + 'environment = { VISUALHFSM_REALM = "other" }\n')).in_realm(
        "mine"
    )
    server, view = stack.with_variables({})
    assert server.environment == {"VISUALHFSM_REALM": "mine", "MODE": "x1"}
    assert view.environment == {"VISUALHFSM_REALM": "other"}


def test_a_realm_of_a_stack_is_checked_first():
    done = run_here(app, "nao", "stack", "sim", "--realm", "mine/*", expected=(ConfigurationException,))
    assert done.returncode == 1
    assert "'mine/*' is not a valid realm" in done.stderr


def test_a_change_of_an_unknown_variable_names_the_known_ones(tmp_path):
    with pytest.raises(StackError, match="no variable sped; its variables: endpoint, speed"):
        load_stack(write(tmp_path, GOOD)).with_variables({"sped": "5"})


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name = "pair"', "name = 7", r"toml:2: name = 7: it names files"),
        (
            'name = "pair"',
            'nam = "pair"',
            "toml:2: nam: there is no such key; there is name, log_dir, endpoint, variables, process",
        ),
        ('name = "pair"', "name =", "not TOML"),
        ('name = "view"', 'name = "server"', "two processes are named server"),
        ('name = "view"', 'name = "a/b"', r"toml:17: process\[1\]\.name = 'a/b': it names files"),
        ('name = "view"', "", r"toml:16: process\[1\]: name is missing"),
        ('command = ["view"]', "", r"toml:16: process\[1\]: command is missing"),
        ('command = ["view"]', "command = [1]", r"toml:18: process\[1\]\.command\[0\] = 1: write text"),
        ('command = ["view"]', "command = []", r"process\[1\]\.command = \[\]: write a program"),
        ('command = ["view"]', 'command = ["{rate}"]', "process view: '{rate}' uses the variable rate"),
        ('after = ["server"]', 'after = ["sever"]', "after names sever, which is not a process"),
        ('after = ["server"]', 'after = ["view"]', "after names view, which stands below"),
        ('after = ["server"]', 'ready = "x"', "a foreground process writes to the terminal"),
        (
            "stop_timeout = 9.5",
            "stop_timeout = -1",
            r"toml:21: process\[1\]\.stop_timeout = -1: write seconds above 0",
        ),
        ("stop_timeout = 9.5", "stop_timeout = nan", "stop_timeout = nan: write seconds above 0"),
        ("stop_timeout = 9.5", "stop_timeout = true", "stop_timeout = true: write seconds above 0"),
        ("ready_timeout = 5", "foreground = true", "only one process can be foreground"),
        ("stop_timeout = 9.5", 'restart = "always"', r"toml:21: process\[1\]\.restart = 'always'"),
        ("stop_timeout = 9.5", 'restart = "on-failure"', "a foreground process ends the stack"),
        ("ready_timeout = 5", "restart_limit = 0", "restart_limit = 0: write a whole number from 1"),
        ('ready = "serving \\\\\\\\w+"', 'ready = "("', "ready is not a regular expression"),
        (
            'environment = { MODE = "x{speed}" }',
            "environment = { MODE = 1 }",
            r"toml:14: process\[0\]\.environment\.MODE = 1: write text",
        ),
    ],
)
def test_a_mistake_is_named_with_its_place(tmp_path, old, new, message):
    old = old.replace("\\\\\\\\", "\\\\")
    assert old in GOOD
    text = GOOD.replace(old, new)
    if "only one" in message:
        text = text.replace('ready = "serving \\\\w+"', "")
    with pytest.raises(StackError, match=message):
        load_stack(write(tmp_path, text))


def test_a_stack_without_processes_is_refused(tmp_path):
    with pytest.raises(StackError, match=r"no \[\[process\]\]"):
        load_stack(write(tmp_path, 'name = "empty"'))


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(StackError, match=r"nowhere\.toml: cannot be read: No such file"):
        load_stack(tmp_path / "nowhere.toml")


@given(any_text(max_size=200))
def test_any_text_is_read_or_refused_with_the_file_named(tmp_path_factory, text):
    path = tmp_path_factory.getbasetemp() / "any.toml"
    path.write_bytes(text.encode("utf-8", errors="surrogatepass"))
    # No TOML document of this length names a process and its command by chance.
    with pytest.raises(StackError, match=re.escape(str(path))):
        load_stack(path)


@pytest.mark.parametrize("endpoint", ["7447", "udp/127.0.0.1:1", "tcp/127.0.0.1", "tcp/127.0.0.1:x"])
def test_an_endpoint_of_another_form_is_refused(endpoint):
    with pytest.raises(StackError, match="not of the form"):
        free_endpoint(endpoint)


def restarting(**keys: object) -> Restarts:
    return Restarts(msgspec.convert({"name": "p", "command": ["p"], **keys}, ProcessSpec))


def test_a_process_is_restarted_after_failures_in_a_row_up_to_its_limit():
    restarts = restarting(restart="on-failure", restart_limit=3, restart_pause=0.5)
    assert [restarts.pause_after(1, ran) for ran in (5.0, 0.0, 59.9, 0.0)] == [0.5, 0.5, 0.5, None]


def test_a_minute_without_failure_starts_the_count_again():
    restarts = restarting(restart="on-failure", restart_limit=2, restart_pause=1.0)
    assert [restarts.pause_after(-9, ran) for ran in (0.1, 0.1, 60.0, 0.1, 0.1)] == [1.0, 1.0, 1.0, 1.0, None]


@pytest.mark.parametrize("code", [0, 130, 143, -2, -15, 2, 127])
def test_no_process_is_restarted_after_an_orderly_end_or_wrong_usage(code):
    assert restarting(restart="on-failure").pause_after(code, 1.0) is None


def test_without_a_policy_nothing_is_restarted():
    assert restarting().pause_after(1, 1.0) is None


MACHINES = """
[[process]]
name = "robot"
machines = ["robot"]
command = ["robot"]
[[process]]
name = "both"
after = ["robot"]
command = ["both"]
[[process]]
name = "stop"
machines = ["operator"]
after = ["robot", "both"]
command = ["stop"]
foreground = true
"""


def test_each_machine_runs_its_part_and_does_not_wait_for_others(tmp_path):
    stack = load_stack(write(tmp_path, MACHINES))
    parts = {machine: stack.on_machine(machine).processes for machine in stack.machines}
    assert {machine: [each.name for each in part] for machine, part in parts.items()} == {
        "robot": ["robot", "both"],
        "operator": ["both", "stop"],
    }
    assert [each.after for each in parts["operator"]] == [(), ("both",)]


@pytest.mark.parametrize(
    ("machine", "message"),
    [
        ("", "^stack: write --machine robot or operator$"),
        ("moon", "no machine moon: write --machine robot or"),
    ],
)
def test_a_stack_for_several_machines_wants_one_of_them(tmp_path, machine, message):
    with pytest.raises(StackError, match=message):
        load_stack(write(tmp_path, MACHINES)).on_machine(machine)


def test_a_stack_without_machines_has_no_parts(tmp_path):
    stack = load_stack(write(tmp_path, GOOD))
    assert stack.on_machine("") == stack
    with pytest.raises(StackError, match="no machine moon: it has no machines"):
        stack.on_machine("moon")


def test_each_machine_has_one_terminal(tmp_path):
    two = MACHINES.replace('machines = ["robot"]', 'machines = ["operator"]\nforeground = true')
    with pytest.raises(StackError, match="only one process can be foreground, not robot, stop"):
        load_stack(write(tmp_path, two))


def test_a_stack_is_given_by_name_or_by_file():
    assert stack_path("sim") == REPOSITORY / "deploy" / "sim.toml"
    assert [str(stack_path(name)) for name in ("sim.toml", "./sim", "a/b.toml")] == [
        "sim.toml",
        "sim",
        "a/b.toml",
    ]
    with pytest.raises(StackError, match=r"no stack soccer; there is demo, lab, nao, ros, sim, or a file"):
        stack_path("soccer")


def test_the_help_names_every_stack():
    names = sorted(path.stem for path in (REPOSITORY / "deploy").glob("*.toml"))
    assert f"{', '.join(names)}, or a stack file" in run_here(app, "nao", "stack", "--help").stdout


def test_in_a_checkout_they_are_at_its_top() -> None:
    assert shipped("behaviors") == REPOSITORY / "behaviors"
    assert (shipped("deploy") / "demo.toml").is_file()


def test_in_the_wheel_they_are_below_the_package(tmp_path: Path) -> None:
    inside = tmp_path / "visualhfsm" / "_shipped" / "behaviors"
    inside.mkdir(parents=True)
    (tmp_path / "behaviors").mkdir()
    assert shipped("behaviors", tmp_path / "visualhfsm") == inside
