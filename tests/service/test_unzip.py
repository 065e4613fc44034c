"""Hostile archives, made with the standard library and by hand."""

import io
import stat
import struct
import zipfile

import pytest

from service.campaigns.unzip import UnpackLimits, unpack
from service.errors import Unusable

LIMITS = UnpackLimits(total_bytes=4_000_000, ratio=50, files=5)
GOOD = {"robot.yaml": b"name: r\n", "campaign.yaml": b"robot: robot.yaml\n"}
GOOD["measurements.csv"] = b"j1_deg\n1\n"
CENTRAL_OFFSET_IN_END = (b"PK\x05\x06", 16)
LOCAL_OFFSET_IN_CENTRAL = (b"PK\x01\x02", 42)


def archive(files: dict[str, bytes]) -> io.BytesIO:
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as packed:
        for name, content in files.items():
            packed.writestr(name, content)
    target.seek(0)
    return target


def test_a_good_archive_gives_its_files():
    assert unpack(archive(GOOD), LIMITS) == GOOD


def test_a_zipped_folder_gives_the_files_without_the_folder():
    inside = {f"my bundle/{name}": content for name, content in GOOD.items()}
    assert unpack(archive(inside), LIMITS) == GOOD


@pytest.mark.parametrize(
    "name",
    ["../campaign.yaml", "a/../../x", "/etc/passwd", "..\\x", "C:\\x", "c:x", "a\0b", "a\nb"],
)
def test_a_name_that_leads_outside_is_refused(name):
    with pytest.raises(Unusable, match="leads outside"):
        unpack(_with_raw_name(name), LIMITS)


def test_a_symbolic_link_is_refused():
    link = zipfile.ZipInfo("robot.yaml")
    link.create_system = 3
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w") as packed:
        packed.writestr(link, "/etc/passwd")
    with pytest.raises(Unusable, match="link or device"):
        unpack(target, LIMITS)


def test_a_bomb_is_refused_by_its_ratio():
    with pytest.raises(Unusable, match="50 times"):
        unpack(archive(GOOD | {"measurements.csv": bytes(3_000_000)}), LIMITS)


def test_an_archive_that_unpacks_to_too_much_is_refused():
    noise = bytes(range(256)) * 20_000
    stored = io.BytesIO()
    with zipfile.ZipFile(stored, "w", zipfile.ZIP_STORED) as packed:
        packed.writestr("measurements.csv", noise)
    with pytest.raises(Unusable, match="more than 4 MB"):
        unpack(stored, LIMITS)


def test_a_size_that_the_archive_lies_about_does_not_help():
    """The stated size is small; what comes out is not."""
    packed = bytearray(archive({"measurements.csv": bytes(8_000_000)}).getvalue())
    central = packed.rindex(b"PK\x01\x02")
    struct.pack_into("<I", packed, central + 24, 10)
    struct.pack_into("<I", packed, 22, 10)
    with pytest.raises(Unusable):
        unpack(io.BytesIO(packed), LIMITS)


def test_what_is_no_archive_is_refused():
    for content in (b"", b"hello", archive(GOOD).getvalue()[:-30]):
        with pytest.raises(Unusable, match=r"not a readable \.zip"):
            unpack(io.BytesIO(content), LIMITS)


def test_damaged_content_is_refused():
    packed = bytearray(archive({"measurements.csv": bytes(range(256)) * 40}).getvalue())
    packed[60] ^= 0xFF
    with pytest.raises(Unusable, match="not a readable"):
        unpack(io.BytesIO(packed), LIMITS)


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
@pytest.mark.parametrize("damage", [0, 0xFF])
def test_an_unusual_packing_is_refused_before_it_is_unpacked(method, damage):
    target = io.BytesIO()
    with zipfile.ZipFile(target, "w", method) as packed:
        packed.writestr("measurements.csv", bytes(range(256)) * 40)
    content = bytearray(target.getvalue())
    content[60] ^= damage
    with pytest.raises(Unusable, match="deflate"):
        unpack(io.BytesIO(content), LIMITS)


@pytest.mark.parametrize("offset", [0xFFFF_FFF0, 0x7FFF_FFFF, 1])
@pytest.mark.parametrize("field", [CENTRAL_OFFSET_IN_END, LOCAL_OFFSET_IN_CENTRAL])
@pytest.mark.parametrize("on_disk", [False, True])
def test_an_offset_that_leads_nowhere_is_refused(field, offset, on_disk, tmp_path):
    content = bytearray(archive(GOOD).getvalue())
    signature, place = field
    struct.pack_into("<I", content, content.rindex(signature) + place, offset)
    (tmp_path / "b.zip").write_bytes(content)
    with (
        (tmp_path / "b.zip").open("rb") if on_disk else io.BytesIO(content) as upload,
        pytest.raises(Unusable, match="not a readable"),
    ):
        unpack(upload, LIMITS)


@pytest.mark.parametrize("name", [".", "./.", "n" * 300, "é" * 150, "folder/" + "n" * 300])
def test_a_name_that_no_file_can_have_is_refused(name):
    with pytest.raises(Unusable, match="no file can be named"):
        unpack(archive(GOOD | {name: b"x"}), LIMITS)


def test_what_finder_adds_is_left_out():
    inside = {f"my bundle/{name}": content for name, content in GOOD.items()}
    added = {f"__MACOSX/my bundle/._{name}": b"x" for name in GOOD}
    assert unpack(archive(inside | added | {"my bundle/.DS_Store": b"x"}), LIMITS) == GOOD
    assert (
        unpack(archive(GOOD | {".DS_Store": b"x", "__MACOSX/._robot.yaml": b"x"}), LIMITS) == GOOD
    )


def test_missing_files_are_named():
    with pytest.raises(Unusable, match=r"lacks campaign\.yaml and measurements\.csv"):
        unpack(archive({"robot.yaml": b""}), LIMITS)


def test_too_many_files_and_a_file_twice_are_refused():
    with pytest.raises(Unusable, match="6 files"):
        unpack(archive({str(number): b"" for number in range(6)}), LIMITS)
    twice = io.BytesIO()
    with zipfile.ZipFile(twice, "w") as packed:
        packed.writestr("a", "1")
        with pytest.warns(UserWarning, match="Duplicate"):
            packed.writestr("a", "2")
    with pytest.raises(Unusable, match="twice"):
        unpack(twice, LIMITS)
    with pytest.raises(Unusable, match="twice"):
        unpack(archive({"a": b"1", "./a": b"2"}), LIMITS)


def _with_raw_name(name: str) -> io.BytesIO:
    """An archive whose entry has just these bytes as its name, which zipfile would mend."""
    placeholder = "N" * len(name.encode())
    packed = archive(GOOD | {placeholder: b"x"}).getvalue()
    return io.BytesIO(packed.replace(placeholder.encode(), name.encode()))
