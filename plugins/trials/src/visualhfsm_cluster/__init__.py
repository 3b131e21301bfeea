"""Trials on a cluster of Dask, and searches for parameters by Optuna."""

from __future__ import annotations

from visualhfsm_cluster._cluster import Cluster
from visualhfsm_cluster._tuning import Tuning

__all__ = ["Cluster", "Tuning"]
