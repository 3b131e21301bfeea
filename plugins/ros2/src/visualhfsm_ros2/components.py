"""The topics, services and actions of components: what `hfsm_runtime.kinds.Kind` asks for."""

from ._ends import stop
from ._node import opened
from ._recording import recorded, replayed
from ._virtual import FakeRos

__all__ = ["imitated", "opened", "recorded", "replayed", "stop"]

imitated = FakeRos
