"""Carry a ball of the simulated world along waypoints in space."""
