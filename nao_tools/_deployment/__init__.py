"""Start a stack of processes from one file, watch over it, and end it without leaving a process behind."""
