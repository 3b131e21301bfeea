"""The Zenoh session: links and their protection, and who is there at their other ends."""
