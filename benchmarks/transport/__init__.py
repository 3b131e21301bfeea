"""The benchmark of calls and streams: a section a module, ours and Ice in processes of their own."""
