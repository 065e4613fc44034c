"""The devices of a cell while a campaign runs: connected together, let go of together."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from drivers.interfaces import Robot, Tracker, TurningTracker
from drivers.registry import open_robot, open_temperature_probe, open_tracker
from service.cells.models import NewCell
from service.procedures.job import Held
from service.procedures.temperature import PolledProbe


@dataclass(frozen=True)
class Devices:
    """All connected."""

    robot: Robot
    tracker: Tracker
    probe: PolledProbe | None

    def temperature_degc(self) -> float | None:
        """Return the latest temperature; None in a cell without a probe."""
        return None if self.probe is None else self.probe.degc()


@contextmanager
def connected(cell: NewCell, n_joints: int) -> Iterator[Devices]:
    """Connect; whatever happens, the robot is stopped and all are let go."""
    with ExitStack() as stack:
        tracker = open_tracker(cell.tracker.driver, cell.tracker.address)
        stack.callback(tracker.close)
        if cell.references is not None and not isinstance(tracker, TurningTracker):
            raise Held(
                f"Tracker driver {cell.tracker.driver} cannot turn to fixed nests; "
                "take the references out of the cell, then start anew."
            )
        tracker.connect()
        probe = None
        if cell.temperature_probe is not None:
            settings = cell.temperature_probe
            opened = open_temperature_probe(settings.driver, settings.address)
            probe = stack.enter_context(PolledProbe(opened))
        robot = open_robot(cell.robot.driver, cell.robot.address, n_joints)
        stack.callback(robot.close)
        robot.connect()
        stack.callback(robot.stop)
        yield Devices(robot, tracker, probe)
