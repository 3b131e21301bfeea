"""Trials on a cluster of Dask, and searches for parameters by Optuna."""
