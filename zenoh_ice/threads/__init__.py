"""Threads, the clocks by which they wait, and the limits of their waits."""
