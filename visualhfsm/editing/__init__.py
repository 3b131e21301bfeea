"""Edit documents of automata, without a browser: commands, undo, files, merging and checking."""
