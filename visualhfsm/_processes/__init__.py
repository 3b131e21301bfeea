"""Components, robots and tests of documents as child processes, and what their output says."""
