"""Run a component as a child process of the editor."""
