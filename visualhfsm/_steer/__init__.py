"""Steer a running component from the command line."""
