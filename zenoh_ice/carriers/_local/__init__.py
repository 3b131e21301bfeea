"""Calls and streams between processes of one user on one machine, over Unix sockets."""
