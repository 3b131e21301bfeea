"""Ways to carry calls, samples and tokens, side by side: in the process, over local sockets, over Zenoh."""
