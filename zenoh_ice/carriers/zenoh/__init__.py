"""Calls, samples and tokens over Zenoh."""
