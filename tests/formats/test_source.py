import gzip
import hashlib

import pytest

from sicp_cam.errors import FormatError
from sicp_cam.limits import Limits
from sicp_formats.source import describe, plain_file, read_bytes

TEXT = b"1 2 3\n4 5 6\n"


def packed(tmp_path, content, name="scan.xyz.gz"):
    file = tmp_path / name
    file.write_bytes(content)
    return file


def test_a_gzip_file_is_unpacked_and_its_own_hash_recorded(tmp_path):
    file = packed(tmp_path, gzip.compress(TEXT, mtime=0))
    assert read_bytes(file, Limits()) == TEXT
    source = describe(file, TEXT, format="ASCII", unit="mm", unit_stated=True)
    assert source.sha256 == hashlib.sha256(file.read_bytes()).hexdigest()


def test_several_members_and_padding_are_read_as_one(tmp_path):
    content = gzip.compress(TEXT, mtime=0) + gzip.compress(b"7 8 9\n") + b"\0" * 16
    assert read_bytes(packed(tmp_path, content), Limits()) == TEXT + b"7 8 9\n"


def test_a_library_gets_a_plain_file(tmp_path):
    file = packed(tmp_path, gzip.compress(TEXT, mtime=0), "part.step.gz")
    with plain_file(file, TEXT) as plain:
        assert (plain.name, plain.read_bytes()) == ("part.step", TEXT)
    assert not plain.exists()
    with plain_file(plain := packed(tmp_path, TEXT, "part.step"), TEXT) as same:
        assert same == plain


@pytest.mark.parametrize(
    ("content", "name", "what"),
    [
        (gzip.compress(TEXT, mtime=0)[:-12], "a.ply.gz", "ends in the middle"),
        (gzip.compress(TEXT, mtime=0)[:12] + b"\xff" * 30, "a.ply.gz", "gzip"),
        (TEXT, "a.ply.gz", "is no gzip file"),
        (gzip.compress(TEXT, mtime=0) + b"rest", "a.ply.gz", "is no gzip file"),
        (gzip.compress(b"", mtime=0), "a.ply.gz", "has nothing in it"),
        (gzip.compress(TEXT, mtime=0), "a.ply", "is a gzip archive; name it .gz"),
        (gzip.compress(gzip.compress(TEXT, mtime=0), mtime=0), "a.ply.gz", "is a gzip archive"),
    ],
)
def test_what_is_wrong_with_an_archive_is_said(tmp_path, content, name, what):
    with pytest.raises(FormatError, match=what):
        read_bytes(packed(tmp_path, content, name), Limits())


def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path):
    bomb = packed(tmp_path, gzip.compress(b"\0" * 10_000_000), "bomb.ply.gz")
    with pytest.raises(FormatError, match="archive_ratio = 200"):
        read_bytes(bomb, Limits())
    assert len(read_bytes(bomb, Limits(archive_ratio=2000.0))) == 10_000_000
    with pytest.raises(FormatError, match="file_bytes = 20000"):
        read_bytes(bomb, Limits(archive_ratio=2000.0, file_bytes=20_000))
