"""The file of a recorded run: its contents, and a reader with limits.

`messages` are what a recording holds, `reader` reads it, and `outcome` is what a replay of it reports. The
runtime writes and replays recordings, the editor shows them; neither imports the other.
"""
