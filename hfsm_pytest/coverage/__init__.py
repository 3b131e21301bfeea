"""Coverage of automata: states entered, transitions fired, guards seen both true and false."""
