"""Run a component against a recording: as it ran then, or as an edited version would have run."""
