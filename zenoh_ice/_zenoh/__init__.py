"""The transport over Zenoh: sessions, calls, streams, presence, and their ways past it on one machine."""
