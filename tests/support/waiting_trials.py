"""A document that waits as long as its parameter says, and a plan of trials in which that varies."""

from __future__ import annotations

from tests.support.documents import document, state, sub, transition

PLAN = """robot = "none"
runs = 12
limit = 1
[parameters]
patience = { from = 2, to = 6 }
[success]
state = "done"
"""
WAITS = document(
    sub(
        1,
        0,
        state(1, "waiting", "self.waited += 0.5", initial=True),
        state(2, "done"),
        transition(1, 1, 2, "self.waited > self.patience", name="enough"),
        variables="self.waited = 0.0",
    ),
    head="<parameters><parameter><name>patience</name><type>float</type><default>3</default></parameter></parameters>",
)
