"""The texts of the diagnosis in English."""

ENGLISH_DIAGNOSIS: dict[str, str] = {
    "diagnosis": "Diagnosis: what geometry does not explain",
    "error_by_geometry": "Position error, geometry alone",
    "error_with_causes": "With the causes below",
    "rows_that_chose_nothing": "RMS on rows that chose nothing",
    "less_with_interval": "{percent} % less (95 %: {low} to {high} %)",
    "more_with_interval": "{percent} % more (95 %: {low} to {high} %)",
    "noise_alone": "What noise alone leaves",
    "noise_alone_note": "From the instrument’s stated noise",
    "causes": "Causes",
    "no_cause": "Nothing of the catalogue stands out of the noise.",
    "cause_cost": "Costs {cost} mm RMS. Probability that this is the cause: {percent} %.",
    "cause_share": "{percent} % of what geometry does not explain",
    "cannot_exclude": "The data cannot exclude:",
    "in_sample_only": "Its gain is not proven on left-out blocks of rows.",
    "at_the_machine": "At the machine:",
    "more_causes": "{count} smaller causes are in diagnosis.json.",
    "evidence": "Residuals, row by row and over what was recorded",
    "evidence_before": "grey: geometry alone",
    "evidence_after": "blue: with the causes",
    "evidence_held": "orange: with the causes, rows that chose nothing",
    "remains_open": "What remains open",
    "remains_depends": "What is left depends on {names}.",
    "remains_nothing": "What is left depends on nothing that was recorded.",
    "cannot_tell": "These data cannot tell {one} from {other}.",
    "or_else": "Or else: {word}.",
    "measure_follow_up": "Measure the poses that tell them apart",
    "follow_up_warning": (
        "The robot drives the poses that the diagnosis asks for, in up to three rounds, until the "
        "cause is named at 95 %. Go and look at the cell first: nobody inside the fence, nothing "
        "in the way, the target fixed, an emergency stop within reach. This page is no safety "
        "device."
    ),
    "follow_up_confirm": "I have looked: arm the cell and start",
    "download_next_poses": "next_poses.csv",
    "download_diagnosis": "diagnosis.json",
    "not_to_be_seen": "Not to be seen in these readings:",
    "open_report": "Report for the plant engineer",
}
