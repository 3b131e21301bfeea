"""The operations of ALMotion that list what moves joints, and break it off."""

from __future__ import annotations

from naoserver.qi_service.access import Access
from naoserver.qi_service.chains import joints_of
from naoserver.qi_service.joint_motion import JointMotion
from naoserver.qi_service.walking import Walking

__all__ = ["TaskOperations"]


class TaskOperations:
    """List what moves joints, and break it off."""

    def __init__(self, access: Access, motion: JointMotion, walking: Walking) -> None:
        self._body = access.body
        self._motion = motion
        self._walking = walking

    def getTaskList(self) -> list[list[object]]:
        """Return name, number, broker and joints of each task that moves joints."""
        return [[task.name, task.number, "", sorted(task.joints)] for task in self._motion.tasks()]

    def areResourcesAvailable(self, resourceNames: object) -> bool:
        """Return whether no task moves any of some joints."""
        joints = joints_of(resourceNames)
        return all(task.joints.isdisjoint(joints) for task in self._motion.tasks())

    def killTask(self, motionTaskID: object) -> bool:
        """Break a task off; returns whether there was one."""
        tasks = [task for task in self._motion.tasks() if task.number == motionTaskID]
        self._motion.stop(tasks)
        return bool(tasks)

    def killTasksUsingResources(self, resourceNames: object) -> None:
        """Break off the tasks that move any of some joints."""
        joints = joints_of(resourceNames)
        self._motion.stop(task for task in self._motion.tasks() if not task.joints.isdisjoint(joints))

    def killAll(self) -> None:
        """Break every task off, end the walk, and hold every joint where it is."""
        self._walking.stop()
        self._motion.stop(self._motion.tasks())
        self._body.hold()
