"""The command `nao`: look at a running robot and everything around it, and call whatever it serves."""
