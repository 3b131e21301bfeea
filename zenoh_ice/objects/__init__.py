"""Ice's objects on any transport: proxies, servants, adapters, streams, presence and the communicator.

A servant is present while its liveliness token exists. `checkedCast` looks up the token, and refuses a
servant whose IDL differs, naming the first member that does. The token's last part is the number of the
format of calls and samples (`zenoh_ice.data.keys`): a servant with another number, or whose token has another
form, is of another version of VisualHFSM, and the client says of which. A client is present while the token
that it first had exists. A servant runs one call at a time by default (docs/how-to/serving.md).
"""
