"""The transport over Zenoh: sessions, calls, streams, presence, and what goes through local sockets instead."""
