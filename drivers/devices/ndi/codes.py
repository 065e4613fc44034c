"""NDI's error codes and what to do about them.

Codes up to FF are the sensor's (Polaris API Guide revision 5), those above the library's own.
"""

WRONG_CRC = 0x100
TIMED_OUT, WRITE_FAILED, READ_FAILED = 0x103, 0x104, 0x105

ADVICE = {
    0x01: "invalid command: is this a Polaris, Vicra, Spectra or Vega?",
    0x02: "command too long: check the cable",
    0x03: "command too short: check the cable",
    0x04: "the sensor got a command with a wrong checksum: check the cable and its shield",
    0x05: "time-out in the sensor: switch it off and on",
    0x06: "it does not take this speed: leave it at 9600 baud",
    0x07: "wrong number of parameters: check the sensor's model",
    0x08: "invalid port handle: the tool was unplugged; plug it in and connect again",
    0x0C: "not possible in this mode: connect again",
    0x0D: "no tool at this handle: plug it in and connect again",
    0x0E: "the tool is not initialised: connect again",
    0x0F: "the tool is not enabled: connect again",
    0x10: "the sensor is not initialised: it was switched off; connect again",
    0x11: "tracking does not stop: switch the sensor off and on",
    0x12: "tracking does not start: let it warm up, check its status lights",
    0x13: "the tool does not initialise: check its plug, or its file",
    0x14: "invalid sensor parameters: it needs service",
    0x15: "the sensor does not initialise: switch it off and on",
    0x1A: "internal error of the sensor: switch it off and on, it may need service",
    0x22: "the sensor does not know the tool's wavelength: choose another tool",
    0x23: "parameter out of range: check the sensor's model",
    0x28: "too many tools: unplug those that are not needed",
    0x2A: "the sensor's memory is full: switch it off and on",
    0x2B: "the handle is not allocated: connect again",
    0x2C: "the handle is empty: load the tool's file again",
    0x2D: "all handles are taken: switch the sensor off and on",
    0x2E: "the parts' firmware versions do not fit: update the sensor",
}
