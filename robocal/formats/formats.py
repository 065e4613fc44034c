"""The file formats of other programs, by the names that the command line uses."""

from collections.abc import Callable
from pathlib import Path

from robocal.calibrated import CalibratedRobot
from robocal.formats.figaroh import read_figaroh
from robocal.formats.mdh_table import mdh_csv_export, mdh_json_export
from robocal.formats.measured_table import MeasuredTable, MeasurementOptions
from robocal.formats.model_export import Export, ExportOptions
from robocal.formats.robodk import read_robodk, robodk_export
from robocal.formats.robot_import import ImportedRobot, RobotOptions
from robocal.formats.spatial_analyzer import read_spatial_analyzer
from robocal.formats.ur_calibration_conf import read_calibration_conf
from robocal.formats.ur_kinematics import read_ur_kinematics, ur_kinematics_export
from robocal.formats.urdf import import_urdf
from robocal.formats.urdf_export import urdf_export
from robocal.robots.robot import Robot

ROBOT_READERS: dict[str, Callable[[Path, RobotOptions], ImportedRobot]] = {
    "urdf": import_urdf,
    "ur-kinematics": read_ur_kinematics,
    "ur-calibration": read_calibration_conf,
}
MEASUREMENT_READERS: dict[str, Callable[[Path, Robot, MeasurementOptions], MeasuredTable]] = {
    "spatial-analyzer": read_spatial_analyzer,
    "robodk": read_robodk,
    "figaroh": read_figaroh,
}
WRITERS: dict[str, Callable[[CalibratedRobot, ExportOptions], Export]] = {
    "urdf": urdf_export,
    "ur-kinematics": ur_kinematics_export,
    "robodk": robodk_export,
    "mdh-json": mdh_json_export,
    "mdh-csv": mdh_csv_export,
}
