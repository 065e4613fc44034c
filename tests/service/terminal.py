"""The command line at a terminal of its own: standard error is one, standard output a pipe."""

import os
import pty
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
ENTRY = "from service.cli import main; main()"
LONGEST_S = 120.0


def obey_ctrl_c() -> None:
    """Whoever starts the tests in the background makes their programs ignore it."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


class AtTerminal:
    """A running command, and what the person before it has seen."""

    def __init__(self, *arguments: object) -> None:
        person, program = pty.openpty()
        self._person = person
        self._seen: list[str] = []
        self.process = subprocess.Popen(
            [sys.executable, "-c", ENTRY, *map(str, arguments)],
            stdout=subprocess.PIPE,
            stderr=program,
            text=True,
            cwd=ROOT,
            env=os.environ | {"TERM": "xterm", "COLUMNS": "100"},
            start_new_session=True,
            preexec_fn=obey_ctrl_c,
        )
        os.close(program)
        self._reader = threading.Thread(target=self._read)
        self._reader.start()

    def _read(self) -> None:
        while True:
            try:
                some = os.read(self._person, 4096)
            except OSError:
                # Linux says so when the last program has left the terminal.
                break
            if not some:
                break
            self._seen.append(some.decode())

    @property
    def seen(self) -> str:
        return "".join(self._seen)

    def until_seen(self, word: str) -> None:
        ends = time.monotonic() + LONGEST_S
        while word not in self.seen:
            if time.monotonic() > ends or self.process.poll() is not None:
                self.process.kill()
                raise AssertionError(self.seen)
            time.sleep(0.01)

    def end(self) -> tuple[int, str]:
        """Exit status and standard output; what was seen is whole afterwards."""
        try:
            printed, _ = self.process.communicate(timeout=LONGEST_S)
        finally:
            self.process.kill()
        self._reader.join()
        os.close(self._person)
        return self.process.returncode, printed
