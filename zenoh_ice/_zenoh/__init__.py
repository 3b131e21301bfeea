"""The transport over Zenoh: sessions, calls, streams and presence, and other routes on one machine."""
