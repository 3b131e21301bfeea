"""The transport over Zenoh: sessions, calls, streams, presence, and images through shared memory."""
