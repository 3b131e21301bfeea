"""Every row of docs/explanation/faults.md has a test."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from tools.lint.sources import ROOT, TESTS

PAGE: Final = ROOT / "docs" / "explanation/faults.md"

FAULTS, NETWORK, OVERLOAD, IDENTITIES, CLOCKS, THREADS, TOKENS = (
    f"test_zenoh_ice_{name}"
    for name in ("faults", "network", "overload", "identities", "clock_jumps", "thread_limit", "tokens")
)
SURROUNDINGS, HOSTILE = "test_local_surroundings", "test_local_hostile"
CARRIERS, BULK, BULK_STREAMS, FORKS = (
    f"test_zenoh_ice_{name}" for name in ("carriers", "bulk", "bulk_streams", "forks")
)
TESTED_BY: Final = {
    "no server": (FAULTS, "test_cast_names_the_endpoint_and_how_to_start_a_server"),
    "server killed": (FAULTS, "test_it_is_reported_at_once_and_proxies_and_streams_survive_the_restart"),
    "server away": (FAULTS, "test_it_is_reported_at_once_and_proxies_and_streams_survive_the_restart"),
    "server restarted": (FAULTS, "test_it_is_reported_at_once_and_proxies_and_streams_survive_the_restart"),
    "server killed during an idempotent call": (
        FAULTS,
        "test_idempotent_call_is_sent_once_more_and_no_other",
    ),
    "server frozen": (FAULTS, "test_call_ends_within_its_timeout_and_the_loss_is_noticed"),
    "server continues": (FAULTS, "test_what_was_given_up_meanwhile_is_not_executed_when_it_goes_on"),
    "connection cut": (NETWORK, "test_a_cut_is_reported_at_once_and_calls_go_on_after_it"),
    "cut below a stream": (NETWORK, "test_a_stream_goes_on_after_a_cut"),
    "network silent": (NETWORK, "test_silence_is_a_loss_after_the_lease_at_both_ends"),
    "network silent for a moment": (FAULTS, "test_large_call_is_not_lost"),
    "slow line": (NETWORK, "test_a_slow_line_delays_calls_and_only_those_that_may_not_take_so_long_fail"),
    "garbled traffic": (NETWORK, "test_garbled_traffic_ends_calls_and_no_process"),
    "router gone, processes linked directly": (
        NETWORK,
        "test_direct_links_outlive_the_router_that_made_them_known",
    ),
    "router gone, all goes through it": (
        NETWORK,
        "test_what_goes_through_a_router_is_lost_with_it_and_comes_back_with_it",
    ),
    "a process ends while another begins to watch it": (
        TOKENS,
        "test_tokens_that_end_while_a_new_session_watches_them_count_no_more",
    ),
    "socket breaks, server lives": (CARRIERS, "test_call_is_lost_and_an_idempotent_one_is_made_again"),
    "server killed, its forked child lives": (
        FORKS,
        "test_the_end_of_a_parent_is_noticed_while_its_child_lives",
    ),
    "server frozen, called through the socket": (
        FAULTS,
        "test_call_ends_within_its_timeout_and_the_loss_is_noticed",
    ),
    "no folder for the socket, full disk": (
        SURROUNDINGS,
        "test_a_folder_that_cannot_be_written_is_warned_of_once_if_there_is_no_other",
    ),
    "other user, group or container": (
        SURROUNDINGS,
        "test_a_server_of_another_group_is_called_over_the_network",
    ),
    "client killed": (FAULTS, "test_server_is_notified_of_a_killed_client"),
    "client ends": (FAULTS, "test_server_is_notified_of_a_client_that_ends"),
    "client killed right after its first call": (
        FAULTS,
        "test_a_client_that_ended_before_its_token_came_is_lost",
    ),
    "client frozen": (FAULTS, "test_server_is_notified_of_a_frozen_client"),
    "identity served already": (FAULTS, "test_identity_of_another_process_is_refused"),
    "two servers that meet late": (
        IDENTITIES,
        "test_those_that_meet_late_each_log_an_error_that_names_the_other",
    ),
    "one of the two stopped": (IDENTITIES, "test_once_one_is_stopped_the_other_says_so_and_serves_on"),
    "other version at a cast or call": (IDENTITIES, "test_another_version_is_refused"),
    "other version after a restart": (
        IDENTITIES,
        "test_a_server_that_comes_back_with_another_version_is_refused_by_calls_and_streams",
    ),
    "too many calls": (OVERLOAD, "test_too_many_calls_are_refused_and_take_no_memory"),
    "no further thread": (
        THREADS,
        "test_a_robot_server_that_can_start_no_thread_answers_every_call_and_stops",
    ),
    "no thread takes calls": (THREADS, "test_a_server_that_executes_no_calls_is_not_announced_until_it_does"),
    "a blocked link": (FAULTS, "test_a_call_that_may_not_take_so_long_is_given_up"),
    "no shared memory": (BULK_STREAMS, "test_without_memory_they_come_over_the_network"),
    "shared memory full": (BULK, "test_answers_go_through_the_socket_while_it_is_full"),
    "image read too late": (
        BULK_STREAMS,
        "test_a_sample_whose_server_ended_before_it_was_read_is_skipped",
    ),
    "a client that takes no answers": (
        HOSTILE,
        "test_nobody_waits_for_those_who_read_late_and_they_get_all",
    ),
    "more local clients than half of the files that the server may open": (
        SURROUNDINGS,
        "test_a_thousand_clients_leave_a_server_files_and_cost_no_threads",
    ),
    "date jumps, samples": (CLOCKS, "test_a_sample_ages_whatever_becomes_of_the_date"),
    "date jumps, calls": (CLOCKS, "test_calls_that_wait_are_executed_whatever_becomes_of_the_date"),
    "robot's time jumps": (CLOCKS, "test_a_jump_of_the_robots_time_wakes_sleepers"),
    "robot's clock silent": (CLOCKS, "test_the_robots_time_goes_on_while_nothing_is_heard_of_it"),
}
"""The module and the function that test what a row says."""


def mistakes() -> Iterator[str]:
    """Yield rows without a test, tests without a row, and tests that are gone."""
    rows = re.findall(r"^\| (?!fault \||---)(.+?) \|", PAGE.read_text("utf-8"), re.MULTILINE)
    page = PAGE.relative_to(ROOT)
    for row in sorted(set(rows) ^ TESTED_BY.keys()):
        yield f"{page}: {row!r} is in the page or in tools/lint/faults.py alone"
    if rows != [*TESTED_BY] and set(rows) == TESTED_BY.keys():
        yield f"{page}: its rows have another order than tools/lint/faults.py"
    for module, function in sorted(set(TESTED_BY.values())):
        files = (
            path for folder in ("faults", "integration") for path in (TESTS / folder).glob(f"{module}.py")
        )
        if not any(re.search(rf"^ *def {function}\(", path.read_text("utf-8"), re.M) for path in files):
            yield f"tools/lint/faults.py: {module}.py has no {function}"
