"""Run one numeric operation in its own process, so that the worker's heartbeat never waits."""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

_POLL_S = 0.05
_NO_ANSWER = 2
# Several BLAS threads fight for the cores that the devices' threads need.
_ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}

Json = dict[str, Any]


class Waiting(Protocol):
    """Who waits for an answer, and may end the waiting."""

    def wait(self, seconds: float) -> None:
        """Let time pass; raises where the answer is no longer wanted."""
        ...


class NumericsFailed(Exception):
    """The computation ended without an answer; the message is its sentence."""


def compute(operation: str, files: dict[str, bytes], request: Json, watch: Waiting) -> Json:
    """Return the answer of one operation of `service.procedures.numerics`.

    Parameters
    ----------
    operation
        Its name.
    files
        What the operation finds in its folder.
    watch
        Ends the computation when the job is no longer wanted.

    Raises
    ------
    NumericsFailed
        With the sentence that the computation gave.
    Stopped
        When the watch says so.
    """
    with tempfile.TemporaryDirectory(prefix="robocal-") as name:
        folder = Path(name)
        for file, content in files.items():
            (folder / file).write_bytes(content)
        (folder / "request.json").write_text(json.dumps(request), encoding="utf-8")
        _run(operation, folder, watch)
        answer: Json = json.loads((folder / "answer.json").read_text(encoding="utf-8"))
        return answer


def _run(operation: str, folder: Path, watch: Waiting) -> None:
    words = folder / "stderr.txt"
    with words.open("wb") as stderr, _process(operation, folder, stderr.fileno()) as process:
        while process.poll() is None:
            watch.wait(_POLL_S)
    if process.returncode:
        lines = words.read_text(encoding="utf-8", errors="replace").strip().splitlines()
        sentence = lines[-1] if lines else f"ended with status {process.returncode}"
        if process.returncode == _NO_ANSWER:
            raise NumericsFailed(sentence)
        raise NumericsFailed(f"The computation '{operation}' broke off: {sentence}")


@contextmanager
def _process(operation: str, folder: Path, stderr: int) -> Iterator[subprocess.Popen[bytes]]:
    with subprocess.Popen(
        [sys.executable, "-m", "service.procedures.numerics", operation, str(folder)],
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=stderr,
        env=os.environ | _ONE_THREAD,
    ) as process:
        try:
            yield process
        finally:
            process.kill()
