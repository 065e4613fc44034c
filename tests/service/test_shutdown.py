"""A signal is heard wherever in a wait it comes."""

import signal
import subprocess
import sys

import pytest

PATIENCE_S = 120.0

# Sends the signal at one line of the standard library's wait after the other, in the main thread.
PROGRAM = """
import faulthandler, signal, sys, threading
from service.jobs.shutdown import shutdown_by_signal

number, patience_s = int(sys.argv[1]), float(sys.argv[2])
faulthandler.dump_traceback_later(patience_s, exit=True)
main, moment, sent = threading.main_thread(), 0, True
while sent:
    moment += 1
    lines, sent, shutdown = 0, False, shutdown_by_signal()

    def at_each_line(frame, event, _):
        global lines, sent
        if not frame.f_code.co_filename.endswith("threading.py"):
            return None
        if event == "line":
            lines += 1
            if lines == moment:
                sent = True
                signal.raise_signal(number)
        return at_each_line

    sys.settrace(at_each_line)
    shutdown.wait(0.001)
    sys.settrace(None)
    if sent:
        assert shutdown.wait(patience_s)
print(moment - 1)
"""


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_at_any_line_of_a_wait_sets_the_event(number):
    program = [sys.executable, "-c", PROGRAM, str(int(number)), str(PATIENCE_S / 2)]
    ran = subprocess.run(program, capture_output=True, text=True, timeout=PATIENCE_S)
    assert ran.returncode == 0, ran.stderr
    assert int(ran.stdout) >= 10
