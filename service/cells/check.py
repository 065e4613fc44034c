"""Connection test: talk to each device of a cell once, move nothing."""

from contextlib import closing

from drivers.errors import DriverError
from drivers.registry import open_robot, open_tracker
from robocal.robots.library import load_robot
from service.cells.models import CellCheck, DeviceCheck, NewCell


def check(cell: NewCell) -> CellCheck:
    """Connect to robot and tracker; a device that does not answer is a result, not an error."""
    robot, tracker = _robot(cell), _tracker(cell)
    return CellCheck(cell=cell.name, ok=robot.ok and tracker.ok, robot=robot, tracker=tracker)


def _robot(cell: NewCell) -> DeviceCheck:
    n_joints = load_robot(cell.robot.model).n_joints
    try:
        with closing(open_robot(cell.robot.driver, cell.robot.address, n_joints)) as robot:
            robot.connect()
            state = robot.state()
    except DriverError as error:
        return DeviceCheck(ok=False, detail=str(error))
    sentence = f"{len(state.joints)} joints, safety state {state.safety}"
    return DeviceCheck(ok=True, detail=f"{sentence}; {state.advice}" if state.advice else sentence)


def _tracker(cell: NewCell) -> DeviceCheck:
    try:
        with closing(open_tracker(cell.tracker.driver, cell.tracker.address)) as tracker:
            tracker.connect()
    except DriverError as error:
        return DeviceCheck(ok=False, detail=str(error))
    return DeviceCheck(ok=True, detail="ready")
