"""Run a behavior many times in virtual time, and say how often it succeeds, and what that depends on.

A plan says what varies from trial to trial (`visualhfsm.trials`); `_series.py` runs its trials, in processes
of this computer or on a cluster, and `_summary.py` has what they say. See docs/how-to/trials.md.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from zenoh_ice.lazy import import_on_use

if TYPE_CHECKING:
    from ._cluster import Cluster as Cluster
    from ._series import run_trials as run_trials
    from ._summary import Summary as Summary

# The command line is read before any of them is needed.
__getattr__, __dir__ = import_on_use(__name__)
