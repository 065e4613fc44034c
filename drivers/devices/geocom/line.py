"""The serial line to a station, safe against late replies."""

import re

from geocompy.communication import SerialConnection

REPLY = re.compile(r"^%R1P,(\d+),(\d+)(?:,\d+)?:(\d+)")
"""Communication code, transaction, return code."""


class TransactionLine(SerialConnection):
    """A serial line that passes over replies to requests given up before.

    Without this, `geocompy` takes each reply for the answer to the next request for ever after one
    late reply.
    """

    def exchange(self, cmd: str) -> str:
        """Send a request and return the reply that bears its transaction number.

        A communication error is passed on whatever its number: a station that could not read the
        request does not know its number either.
        """
        self.send(cmd)
        wanted = cmd.partition(":")[0].split(",")[2]
        while True:
            # Noise on the line must reach the parser as a reply that cannot be decoded.
            answer = self.receive_binary().decode("ascii", "replace")
            found = REPLY.match(answer)
            if found is None or found[1] != "0" or found[2] == wanted:
                return answer
