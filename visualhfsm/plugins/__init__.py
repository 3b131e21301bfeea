"""What plug-ins use, besides `visualhfsm`, `visualhfsm.simulation`, `.testing` and `.trials`.

ARCHITECTURE.md lists the seams to which they add something.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from visualhfsm._base.csv_file import csv_text as csv_text
    from visualhfsm._base.csv_file import write_csv as write_csv
    from visualhfsm._base.environment import child_environment as child_environment
    from visualhfsm._base.errors import MissingPackageError as MissingPackageError
    from visualhfsm._base.html_file import check_place as check_place
    from visualhfsm._base.html_file import html_file as html_file
    from visualhfsm._base.html_file import write_html as write_html
    from visualhfsm._base.languages import decode_message as decode_message
    from visualhfsm._base.languages import encode_message as encode_message
    from visualhfsm._base.languages import in_all_languages as in_all_languages
    from visualhfsm._base.languages import known_language as known_language
    from visualhfsm._base.languages import said as said
    from visualhfsm._base.languages import system_languages as system_languages
    from visualhfsm._base.line_process import KilledError as KilledError
    from visualhfsm._base.line_process import NoAnswerError as NoAnswerError
    from visualhfsm._base.line_process import NotReadyError as NotReadyError
    from visualhfsm._base.line_process import TooSlowError as TooSlowError
    from visualhfsm._base.line_process import explain_signal as explain_signal
    from visualhfsm._base.line_process import kill_group as kill_group
    from visualhfsm._base.options import examples as examples
    from visualhfsm._base.rates import CONFIDENCE as CONFIDENCE
    from visualhfsm._base.rates import Rate as Rate
    from visualhfsm._base.rates import percent as percent
    from visualhfsm._base.rates import plain_number as plain_number
    from visualhfsm._base.rates import success_rate as success_rate
    from visualhfsm._base.reporting_process import ReportingProcess as ReportingProcess
    from visualhfsm._base.task_processes import EndedError as EndedError
    from visualhfsm._base.task_processes import TaskProcesses as TaskProcesses
    from visualhfsm._base.task_processes import answer_tasks as answer_tasks
    from visualhfsm._base.work import PerDocument as PerDocument
    from visualhfsm._document.reasons import summary as summary
    from visualhfsm._document.serialization import written as written
    from visualhfsm._editor.views import TabEdit as TabEdit
    from visualhfsm._editor.views import TabRequest as TabRequest
    from visualhfsm._editor.views import TabStop as TabStop
    from visualhfsm._editor.views import View as View
    from visualhfsm._editor.views import ViewedDocument as ViewedDocument
    from visualhfsm._editor.views import ViewPush as ViewPush
    from visualhfsm._editor.views import WorkingView as WorkingView
    from visualhfsm._monitor.messages import Source as Source
    from visualhfsm._monitor.realm.automata import Automata as Automata
    from visualhfsm._monitor.realm.description import describe as describe
    from visualhfsm._monitor.realm.realm import MONITOR_PREFIX as MONITOR_PREFIX
    from visualhfsm._monitor.recordings import recorded_run as recorded_run
    from visualhfsm._monitor.run_page import run_page as run_page
    from visualhfsm._processes.bodies import body_option as body_option
    from visualhfsm._processes.bodies import require_body as require_body
    from visualhfsm.project._root import Root as Root
    from visualhfsm.project._root import find_documents as find_documents
    from visualhfsm.project._verdict import digest_of as digest_of
    from visualhfsm.simulation._medium import VirtualMedium as VirtualMedium
    from visualhfsm.simulation._turns import Turns as Turns
    from visualhfsm.simulation._turns import catch_up as catch_up

__getattr__, __dir__ = import_on_use(__name__)
