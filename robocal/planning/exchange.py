"""Old place of `plan_poses`, until the service imports it from `robocal.planning.plan`."""

from robocal.planning.plan import plan_poses

__all__ = ["plan_poses"]
