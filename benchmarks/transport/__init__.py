"""The benchmark of calls and streams: one module per section, with separate processes for ours and Ice."""
