"""The command `replay`: run a document against a recording, in a process of its own, and compare."""
