"""Run a component against a recording: the same way again, or as an edited one would have run."""
