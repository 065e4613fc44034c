"""The texts in English: language and colours, the arm, comparison, the life of parameters."""

ENGLISH_VIEWS: dict[str, str] = {
    # Every page
    "language_name": "English",
    "language": "Language",
    "theme": "Colours",
    "theme_system": "As the system",
    "theme_light": "Light",
    "theme_dark": "Dark",
    # The form of a campaign
    "plan_preview": "Plan of the new campaign",
    "plan_working": "Planning the poses…",
    "plan_picture": "The arm at the planned poses. Arrow keys turn it, plus and minus zoom.",
    "plan_play": "Play",
    "plan_stop": "Stop",
    "plan_pose": "Pose {pose} ({number} of {total})",
    "plan_note": (
        "These poses, in this order, are what the robot will drive. Drag or use the arrow keys to "
        "turn the picture; grey poses are done, blue ones come."
    ),
    "check_not_armed": "“{cell}” is disarmed; arm it before you start.",
    "check_busy": "Campaign {campaign} uses this cell; the new one waits for its end.",
    "check_too_few": "Too few for the {robot}: it takes {least}, better {sensible}.",
    "check_few": "Just enough for the {robot}; {sensible} give a margin.",
    "check_enough": "Enough for the {robot}.",
    "check_nothing_to_verify": "“{cell}” has no parameters to verify; calibrate it first.",
    "check_verifies": "Verifies version {version} of the parameters.",
    "check_health": "Checks version {version}; 8 poses are sensible.",
    "check_nothing_released": "“{cell}” has no released parameters to check against.",
    # Maps of a result
    "residual_map": "Where the error is left",
    "residual_map_note": (
        "After identification, at the measured places, seen from their middle; larger points were "
        "held out."
    ),
    "residual_map_picture": "Residuals over the workspace. Arrow keys turn it.",
    "residual_map_legend": "Residual [mm]",
    "map_residual": "Pose {pose}: {mm} mm",
    "uncertainty_map": "How sure the tool is",
    "uncertainty_map_note": "Expanded uncertainty U₉₅ of the tool’s position, over the workspace.",
    "uncertainty_map_picture": "Uncertainty over the workspace. Arrow keys turn it.",
    "uncertainty_map_legend": "U₉₅ [mm]",
    "map_uncertainty": "mean {mm} mm, largest {most} mm",
    "intervals_note": "Change from the nominal value with its 95 % interval.",
    "axis_change_mm": "Change [mm]",
    "axis_change_deg": "Change [°]",
    # Two calibrations
    "compare": "Compare two calibrations",
    "compare_first": "First",
    "compare_second": "Second",
    "compare_do": "Compare",
    "compare_needs_two": "It takes two finished calibrations.",
    "compare_other_robot": "These are two different robot models; compare with care.",
    "compare_errors": "Errors",
    "compare_condition": "Condition number",
    "compare_ratio": "In std. uncertainties",
    "compare_note": (
        "Second minus first, and its standard uncertainty with the two taken as independent. "
        "Differences of more than {limit} standard uncertainties are marked: something moved, or a "
        "model misses something."
    ),
    # A cell: parameters and health
    "to_cell": "Parameters and health",
    "cell_title": "Cell {cell}",
    "versions": "Parameters",
    "versions_note": "The MES reads the released version only. A person releases it.",
    "no_versions": "No parameters yet; a finished calibration makes a candidate.",
    "column_version": "Version",
    "column_released": "Released",
    "column_reason": "Reason",
    "version_candidate": "Candidate",
    "version_verified": "Verified",
    "version_released": "Released",
    "version_superseded": "Superseded",
    "release": "Release",
    "rollback": "Roll back",
    "release_reason": "Reason",
    "release_reason_hint": "Required for a version that no verification has passed.",
    "release_question": "Release version {version} of cell “{cell}”?",
    "release_warning": "From now on the MES drives with these parameters.",
    "rollback_question": "Go back to version {version} of cell “{cell}”?",
    "rollback_warning": "From now on the MES drives with this older version again.",
    "history": "History",
    "by_campaign": "the campaign itself",
    "step_computed": "Computed",
    "step_verified": "Verified",
    "step_verification_failed": "Verification not passed",
    "step_released": "Released",
    "step_rolled_back": "Rolled back to",
    "step_superseded": "Superseded",
    "health_trend": "Health",
    "health_none": "No health check yet.",
    "health_trend_note": (
        "Each check’s chi-square as a share of its control limit: above the dashed line something "
        "moved."
    ),
    "health_alarm": "Alarm: the cell is not as it was calibrated.",
    "health_drifts": "The trend drifts.",
    "health_good": "The cell is as it was calibrated. Nothing to do.",
    "axis_health": "Share of the limit",
    "error_now": "Position error now",
    "health_targets_note": "RMS against the released parameters",
    "health_statistic": "Chi-square",
    "health_limit": "control limit {limit}",
    "to_health_trend": "Trend of this cell",
    # Watching
    "live": "Live",
    "live_picture": "The arm as it moves. Arrow keys turn it, plus and minus zoom.",
    "live_position": "Tracker",
    "live_joints": "Joints",
    "live_sensors": "Sensors",
    "live_spread": "Scatter of {shots} shots: {spread} mm, allowed {allowed} mm",
    "live_temperature": "Temperature {temperature} °C",
    "live_one_shot": "One shot a reading: no scatter to judge by",
    "live_first_try": "Every reading at the first try",
    "live_tried_again": "Visits that were repeated: {count}",
    "live_tip": "Pose {pose}",
    "live_residuals": "Residuals so far",
    "live_residuals_nominal": (
        "Distance between the tracker’s reading and the nominal robot, base and tool fitted to the "
        "readings so far: the error that calibration will remove."
    ),
    "live_residuals_identified": (
        "Distance between the tracker’s reading and the identified robot, base and tool fitted to "
        "the readings so far: what calibration leaves."
    ),
    "live_residuals_wait": "Shown from reading {enough} on.",
    "live_nothing": "Nothing was read yet.",
}
