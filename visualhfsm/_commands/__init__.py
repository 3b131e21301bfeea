"""The command `visualhfsm`: `app` has all of its verbs, and each longer one a module."""
