"""A disk that is really full, under a service and a worker with a campaign on its way."""

import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

import pytest
from service_cell import emulated_world, installation, poses_about_start, wait_until

POSES = 25


@pytest.fixture
def small_disk(tmp_path) -> Iterator[Path]:
    """A disk of 3 MB."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=3m", "tmpfs", str(folder)]
    mounted = subprocess.run(command, capture_output=True, text=True, check=False)
    if mounted.returncode:
        pytest.skip(f"a disk to fill needs the right to mount one: {mounted.stderr.strip()}")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def fill(disk: Path) -> Path:
    filler = disk / "filler"
    with filler.open("wb", buffering=0) as file:
        for size in (65536, 4096, 512):
            with pytest.raises(OSError, match="No space left on device"):
                write_on(file, size)
    return filler


def write_on(file: BinaryIO, size: int) -> None:
    while file.write(bytes(size)):
        pass


def test_a_campaign_waits_for_room_on_the_disk_and_loses_nothing(tmp_path, small_disk):
    with (
        emulated_world(tmp_path, time_scale=30) as world,
        installation(small_disk, disk_free_min_mb=0.2) as site,
    ):
        site.make_cell(world)
        number = site.start_campaign(poses_about_start(POSES))
        site.await_done(number, 5)
        filler = fill(small_disk)
        refused = site.post(f"/campaigns/{number}/pause")
        assert refused.status_code == 507
        assert "is full and nothing was stored" in refused.json()["detail"]
        answer = site.client.get("../../readyz")
        assert answer.status_code == 503
        failed = {check["name"] for check in answer.json()["checks"] if not check["passed"]}
        assert {"disk", "database"} <= failed
        stored = site.rows("SELECT id, idx, position FROM reading ORDER BY id")
        filler.unlink()
        site.await_done(number, POSES)
        rows = site.rows("SELECT id, idx, position FROM reading ORDER BY id")
        assert rows[: len(stored)] == stored
        assert sorted(row[1] for row in rows) == list(range(POSES))
        wait_until(lambda: site.client.get("../../readyz").status_code == 200)
        assert site.rows("PRAGMA integrity_check") == [("ok",)]
