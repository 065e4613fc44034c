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
