"""Dashboard server of the emulated controller, TCP port 29999: one line asked, one line answered.

Wording: Universal Robots, "Dashboard Server e-Series".
"""

import asyncio
from collections.abc import Awaitable, Callable

from .ur_controller_state import Controller
from .ur_safety import MODE_WORDS, SAFETY

PORT = 29999
GREETING = "Connected: Universal Robots Dashboard Server"
POLYSCOPE_VERSION = "URSoftware 5.11.1.108318 (Aug 28 2021)"
ROBOT_MODEL = "UR10"
SERIAL_NUMBER = "20215500001"


class Dashboard:
    """Answers of one controller's dashboard."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._answers: dict[str, Callable[[], Awaitable[str]]] = {
            "is in remote control": self._remote_control,
            "robotmode": self._robot_mode,
            "safetystatus": self._safety_status,
            "safetymode": self._safety_mode,
            "running": self._running,
            "stop": self._stop,
            "unlock protective stop": self._unlock,
            "power on": self._power_on,
            "power off": self._power_off,
            "brake release": self._brake_release,
        }
        self._constants = {
            "polyscopeversion": POLYSCOPE_VERSION,
            "get robot model": ROBOT_MODEL,
            "get serial number": SERIAL_NUMBER,
            "close safety popup": "closing safety popup",
            "close popup": "closing popup",
            "quit": "Disconnected",
        }

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Talk to one client until it goes."""
        try:
            if not self._controller.faults.silent:
                writer.write(f"{GREETING}\n".encode())
            while line := await reader.readline():
                if self._controller.faults.silent:
                    continue
                writer.write(f"{await self.answer(line.decode())}\n".encode())
                if line.strip() == b"quit":
                    return
        except ConnectionError:
            return
        finally:
            writer.close()

    async def answer(self, line: str) -> str:
        """Answer one command."""
        command = " ".join(line.split())
        if command.lower() in self._constants:
            return self._constants[command.lower()]
        if command.lower() not in self._answers:
            return f"could not understand: '{command}'"
        await self._controller.arm.look()
        return await self._answers[command.lower()]()

    async def _remote_control(self) -> str:
        return str(self._controller.remote_control).lower()

    async def _robot_mode(self) -> str:
        return f"Robotmode: {MODE_WORDS[self._controller.robot_mode]}"

    async def _safety_status(self) -> str:
        return f"Safetystatus: {SAFETY[self._controller.arm.state.safety].dashboard}"

    async def _safety_mode(self) -> str:
        return f"Safetymode: {SAFETY[self._controller.arm.state.safety].dashboard}"

    async def _running(self) -> str:
        return f"Program running: {str(self._controller.program.running).lower()}"

    async def _stop(self) -> str:
        await self._controller.program.end("dashboard stop")
        return "Stopped"

    async def _unlock(self) -> str:
        if self._controller.arm.state.safety == "protective_stop":
            await self._controller.arm.switch_safety("normal")
        return "Protective stop releasing"

    async def _power_on(self) -> str:
        self._controller.drives_on = True
        return "Powering on"

    async def _power_off(self) -> str:
        self._controller.drives_on = False
        await self._controller.arm.switch_safety("not_ready")
        return "Powering off"

    async def _brake_release(self) -> str:
        if self._controller.drives_on and self._controller.arm.state.safety == "not_ready":
            await self._controller.arm.switch_safety("normal")
        return "Brake releasing"
