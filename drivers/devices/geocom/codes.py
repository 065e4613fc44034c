"""What GeoCOM's codes mean for whoever measures.

Source: Leica GeoCOM Reference Manual TPS1200/TS30/TM30 v1.50. The advice is ours.
"""

from geocompy.geo.gctypes import GeoComCode

LOST = frozenset({GeoComCode.COM_CANT_SEND, GeoComCode.COM_FAILED})
"""`geocompy` gives these when the serial port itself fails."""

SUSPECT = frozenset({
    GeoComCode.COM_TIMEDOUT,
    GeoComCode.COM_TR_ID_MISMATCH,
    GeoComCode.COM_CANT_DECODE,
    GeoComCode.COM_CLNT_RX_CHECKSUM_ERROR,
    GeoComCode.COM_SRVR_RX_CHECKSUM_ERROR,
})
"""After these a reply may still be on its way, or lie about in a buffer."""

ADVICE = {
    GeoComCode.IVPARAM: "the station does not take this parameter; check its model",
    GeoComCode.ABORT: "the measurement was aborted at the station; measure again",
    GeoComCode.SHUT_DOWN: "the station shuts down; switch it on and connect again",
    GeoComCode.BATT_EMPTY: "the station's battery is empty; replace it",
    GeoComCode.NA: "the station lacks the licence for GeoCOM robotics; enter its key",
    GeoComCode.TMC_NO_FULL_CORRECTION: (
        "measured without full correction; level the station and let its compensator settle"
    ),
    GeoComCode.TMC_ACCURACY_GUARANTEE: (
        "the accuracy is not guaranteed; check levelling, compensator and calibration"
    ),
    GeoComCode.TMC_ANGLE_OK: "angles only, no distance; check prism, line of sight and range",
    GeoComCode.TMC_ANGLE_NO_FULL_CORRECTION: (
        "angles only and not corrected; level the station and check the line of sight"
    ),
    GeoComCode.TMC_ANGLE_ACCURACY_GUARANTEE: (
        "angles only and their accuracy is not guaranteed; level the station"
    ),
    GeoComCode.TMC_ANGLE_ERROR: "no valid angle; level the station and set it still",
    GeoComCode.TMC_DIST_PPM: "the ppm settings are wrong; reset them at the station",
    GeoComCode.TMC_DIST_ERROR: "no distance; check prism, line of sight and distance mode",
    GeoComCode.TMC_BUSY: "another program of the station measures; end it there",
    GeoComCode.TMC_SIGNAL_ERROR: "no signal on the distance meter; clear the line of sight",
    GeoComCode.AUT_TIMEOUT: "the telescope did not reach the target in time; measure again",
    GeoComCode.AUT_DETENT_ERROR: "the telescope is blocked or at its end; free it",
    GeoComCode.AUT_NO_TARGET: "no target in the window; clear the line of sight, aim by hand once",
    GeoComCode.AUT_MULTIPLE_TARGETS: "several targets in the window; cover the others",
    GeoComCode.AUT_BAD_ENVIRONMENT: "too bright, hazy or hot for the camera; shade the target",
    GeoComCode.AUT_DETECTOR_ERROR: "the camera lost the target; keep it still and measure again",
    GeoComCode.AUT_NOT_ENABLED: "target recognition is off; connect again",
}
"""What to do about the codes that a person can do something about."""

ADVICE_BY_GROUP = {
    "AF_": "the camera does not focus; aim at the target by hand, clean the lens",
    "ANG_": "the angle reading failed; level the station, set it still, then have it serviced",
    "ATA_": "target recognition failed; clear the line of sight, shade and clean the target",
    "AUT_": "the telescope was not positioned; level the station, free it, check its supply",
    "BAP_": "the measuring program changed; set the station to plain distances",
    "BAS_": "an error of the station's own programs; switch it off and on",
    "BMM_": "an error of the station's display; switch it off and on",
    "CAM_": "the camera failed; clean it, switch the station off and on",
    "CNF_": "the station's configuration is wrong; load its default settings",
    "COD_": "the station's code list is wrong; load its default settings",
    "COM_": "the communication failed; check cable, interface settings and that it is GeoCOM",
    "DNA_": "a level's error: this is no total station",
    "DPL_": "an error of the station's job storage; free memory there",
    "EDM_": "the distance meter failed; check prism, line of sight, range and distance mode",
    "FIL_": "an error of the station's file storage; check its memory card",
    "FTR_": "a file transfer failed; check the station's memory card",
    "GM_": "an error of the station's own computations; set it to plain measuring",
    "IOS_": "the serial interface failed; check cable and interface settings",
    "KDM_": "the station's display is not available; switch it off and on",
    "LDR_": "an error of the station's program loader; switch it off and on",
    "MEM_": "the station's memory is full; switch it off and on",
    "MMI_": "an error of the station's display; switch it off and on",
    "MOT_": "the motors failed; free the telescope, switch the station off and on",
    "SAP_": "an error of the station's program; switch it off and on",
    "TMC_": "the measurement failed; level the station, clear the line of sight, end its programs",
    "TXT_": "a text of the station is missing; load its language",
    "WIR_": "the station's registration failed; free memory there",
}
"""By the name of the subsystem, which begins the name of its codes (manual, section on codes)."""

GENERAL = "an error of the station itself; switch it off and on, see its display, connect again"
"""For the general codes, which have no subsystem (below 256 in the manual)."""
FIRST_OF_SUBSYSTEMS = 0x100


def advice_on(code: GeoComCode) -> str:
    """Say what to do about a code of the manual; of others, that it is not in there."""
    if code in ADVICE:
        return ADVICE[code]
    for group, advice in ADVICE_BY_GROUP.items():
        if code.name.startswith(group):
            return advice
    if code is not GeoComCode.UNDEFINED and code < FIRST_OF_SUBSYSTEMS:
        return GENERAL
    return "look it up in the GeoCOM manual"
