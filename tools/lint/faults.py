"""Every row of docs/explanation/faults.md has a test."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from tools.lint.sources import ROOT, TESTS

PAGE: Final = ROOT / "docs" / "explanation/faults.md"

TESTED_BY: Final = {
    "no server": "test_cast_names_the_endpoint_and_how_to_start_a_server",
    "server killed": "test_it_is_reported_at_once_and_proxies_and_streams_survive_the_restart",
    "server away": "test_it_is_reported_at_once_and_proxies_and_streams_survive_the_restart",
    "server restarted": "test_it_is_reported_at_once_and_proxies_and_streams_survive_the_restart",
    "server killed during an idempotent call": "test_idempotent_call_is_sent_once_more_and_no_other",
    "server frozen": "test_call_ends_within_its_timeout_and_the_loss_is_noticed",
    "server continues": "test_what_was_given_up_meanwhile_is_not_executed_when_it_goes_on",
    "connection cut": "test_a_cut_is_reported_at_once_and_calls_go_on_after_it",
    "cut below a stream": "test_a_stream_goes_on_after_a_cut",
    "network silent": "test_silence_is_a_loss_after_the_lease_at_both_ends",
    "network silent for a moment": "test_large_call_is_not_lost",
    "slow line": "test_a_slow_line_delays_calls_and_only_those_that_may_not_take_so_long_fail",
    "garbled traffic": "test_garbled_traffic_ends_calls_and_no_process",
    "router gone, processes linked directly": "test_direct_links_outlive_the_router_that_made_them_known",
    "router gone, all goes through it": "test_what_goes_through_a_router_is_lost_with_it_and_comes_back_with_it",
    "a process ends while another begins to watch it": "test_tokens_that_end_while_a_new_session_watches_them_count_no_more",
    "socket breaks, server lives": "test_call_is_lost_and_an_idempotent_one_is_made_again",
    "server killed, its forked child lives": "test_the_end_of_a_parent_is_noticed_while_its_child_lives",
    "server frozen, called through the socket": "test_call_ends_within_its_timeout_and_the_loss_is_noticed",
    "no folder for the socket, full disk": "test_a_folder_that_cannot_be_written_is_warned_of_once_if_there_is_no_other",
    "other user, group or container": "test_a_server_of_another_group_is_called_over_the_network",
    "client killed": "test_server_is_notified_of_a_killed_client",
    "client ends": "test_server_is_notified_of_a_client_that_ends",
    "client killed right after its first call": "test_a_client_that_ended_before_its_token_came_is_lost",
    "client frozen": "test_server_is_notified_of_a_frozen_client",
    "identity served already": "test_identity_is_served_once",
    "two servers that meet late": "test_those_that_meet_late_each_log_an_error_that_names_the_other",
    "one of the two stopped": "test_once_one_is_stopped_the_other_says_so_and_serves_on",
    "other version at a cast or call": "test_call_of_another_version_is_refused",
    "other version after a restart": "test_a_server_that_comes_back_with_another_version_is_refused_by_calls_and_streams",
    "too many calls": "test_too_many_calls_are_refused_and_take_no_memory",
    "no further thread": "test_a_robot_server_that_can_start_no_thread_answers_every_call_and_stops",
    "no thread takes calls": "test_a_server_that_executes_no_calls_is_not_announced_until_it_does",
    "a blocked link": "test_a_call_that_may_not_take_so_long_is_given_up",
    "no shared memory": "test_without_memory_they_come_over_the_network",
    "shared memory full": "test_answers_go_through_the_socket_while_there_is_no_memory",
    "image read too late": "test_a_sample_whose_server_ended_before_it_was_read_is_skipped",
    "a client that takes no answers": "test_nobody_waits_for_those_who_read_late_and_they_get_all",
    "more local clients than half of the files that the server may open": "test_a_thousand_clients_leave_a_server_files_and_cost_no_threads",
    "date jumps, samples": "test_a_sample_ages_whatever_becomes_of_the_date",
    "date jumps, calls": "test_calls_that_wait_are_executed_whatever_becomes_of_the_date",
    "robot's time jumps": "test_it_goes_on_while_the_robot_is_away_and_follows_the_next_one",
    "robot's clock silent": "test_it_goes_on_while_the_robot_is_away_and_follows_the_next_one",
}
"""The test of what a row says, in tests/faults or tests/integration."""


def mistakes() -> Iterator[str]:
    """Yield rows without a test, tests without a row, and tests that are gone."""
    text, _, _ = PAGE.read_text("utf-8").partition("\n## Parts of the robot\n")  # which was measured
    rows = re.findall(r"^\| (?!fault \||---)(.+?) \|", text, re.MULTILINE)
    page = PAGE.relative_to(ROOT)
    for row in sorted(set(rows) ^ TESTED_BY.keys()):
        yield f"{page}: {row!r} is in the page or in tools/lint/faults.py alone"
    if rows != [*TESTED_BY] and set(rows) == TESTED_BY.keys():
        yield f"{page}: its rows have another order than tools/lint/faults.py"
    there = {
        name
        for folder in ("faults", "integration")
        for path in (TESTS / folder).glob("test_*.py")
        for name in re.findall(r"^ *def (test_\w+)\(", path.read_text("utf-8"), re.MULTILINE)
    }
    for function in sorted({*TESTED_BY.values()} - there):
        yield f"tools/lint/faults.py: there is no test {function}"
