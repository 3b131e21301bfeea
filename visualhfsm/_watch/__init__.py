"""Watch a running component and its robot in the terminal, and write a report about the run."""
