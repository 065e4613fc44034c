"""What a result file may take the place of."""

import os
from pathlib import Path

import pytest

from robocal.errors import BadInput
from robocal.formats.whole_file import write_together, write_whole


def test_what_is_no_plain_file_is_never_replaced(tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    (tmp_path / "folder").mkdir()
    (tmp_path / "loop").symlink_to("loop")
    for place in (pipe, tmp_path / "folder", tmp_path / "loop", Path()):
        with pytest.raises(BadInput, match="cannot be written"):
            write_together({tmp_path / "first": "text", place: "text"})
    assert pipe.is_fifo()
    assert sorted(entry.name for entry in tmp_path.iterdir()) == ["folder", "loop", "pipe"]


def test_a_link_stays_and_its_file_gets_the_text(tmp_path):
    kept = tmp_path / "elsewhere" / "kept.json"
    kept.parent.mkdir()
    kept.write_text("old")
    link = tmp_path / "link.json"
    link.symlink_to(kept)
    write_whole(link, "new")
    assert link.is_symlink()
    assert kept.read_text() == "new"
