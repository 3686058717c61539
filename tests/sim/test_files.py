"""Files: read within bounds and from regular files alone, written whole or not at all."""

from __future__ import annotations

import errno
import io
import os
import socket
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from chladni.sim.errors import InputError
from chladni.sim.files import (
    read_arrays,
    read_text,
    read_whole,
    write_arrays,
    write_new,
    write_whole,
)

MOST = 1000


def make_socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as own:
        own.bind(str(path))


MAKERS: dict[str, Callable[[Path], None]] = {
    "a pipe": os.mkfifo,
    "a folder": Path.mkdir,
    "a socket": make_socket,
    "a device": lambda path: path.symlink_to("/dev/zero"),
}


@pytest.mark.parametrize("kind", MAKERS)
def test_only_regular_files_are_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    monkeypatch.chdir(tmp_path)  # a socket's name has 107 characters at most
    path = Path("x")
    MAKERS[kind](path)
    with pytest.raises(InputError, match=f"x, --key: expected a regular file .* got '{kind}'"):
        read_whole(path, "--key", MOST)


def test_a_file_is_read_up_to_its_bound_and_not_beyond(tmp_path: Path) -> None:
    path = tmp_path / "x"
    path.write_bytes(b"1" * MOST)
    assert read_whole(path, "--key", MOST) == b"1" * MOST
    path.write_bytes(b"1" * (MOST + 1))
    with pytest.raises(InputError, match=r"--key: .* at most 1,000 bytes, got '1,001 bytes"):
        read_whole(path, "--key", MOST)


def test_a_file_that_does_not_say_its_size_is_bounded_too() -> None:
    """Files of /proc are regular and say 0 bytes, whatever is in them."""
    path = Path("/proc/self/maps")
    assert path.stat().st_size == 0
    with pytest.raises(InputError, match="at most 1,000 bytes"):
        read_whole(path, "--key", MOST)


def test_links_are_followed_unless_told_otherwise(tmp_path: Path) -> None:
    path, link = tmp_path / "x", tmp_path / "link"
    path.write_bytes(b"1")
    link.symlink_to(path)
    assert read_whole(link, "--key", MOST) == b"1"
    with pytest.raises(InputError, match="got 'a link'"):
        read_whole(link, "--key", MOST, follow=False)


def test_names_that_no_file_has_are_wrong_input(tmp_path: Path) -> None:
    for name in ("none", "zero\0byte", "x" * 300, "none/of/it"):
        with pytest.raises(InputError):
            read_whole(tmp_path / name, "--key", MOST)
    (tmp_path / "x").write_bytes(b"\xff\xfe")
    with pytest.raises(InputError, match="UTF-8"):
        read_text(tmp_path / "x", "--key", MOST)


def npz(**members: bytes) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(f"{name}.npy", data)
    return buffer.getvalue()


def npy(array: object) -> bytes:
    buffer = io.BytesIO()
    np.save(buffer, np.array(array), allow_pickle=True)
    return buffer.getvalue()


def test_arrays_come_back_as_they_were_written(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    arrays: dict[str, Any] = {
        "numbers": np.arange(6.0).reshape(2, 3),
        "turned": np.asfortranarray(np.eye(2, 3)),
        "one": np.array(2.5),
        "text": np.array("µ"),
        "none": np.zeros((0, 3)),
    }
    write_arrays(path, **arrays)
    found = read_arrays(path, "--trace", 100_000)
    assert found.keys() == arrays.keys()
    for name, array in arrays.items():
        assert np.array_equal(found[name], array)
        assert (found[name].dtype, found[name].shape) == (array.dtype, array.shape)


def test_an_archive_is_bounded_once_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "x.npz"
    path.write_bytes(npz(a=npy(np.zeros(10_000))))
    assert path.stat().st_size < 1000
    with pytest.raises(InputError, match="80,128 bytes"):
        read_arrays(path, "--trace", 80_000)


def test_an_array_that_promises_what_is_not_there_takes_no_memory(tmp_path: Path) -> None:
    path, good = tmp_path / "x.npz", npy(np.zeros(10))
    huge = good.replace(b"(10,), }" + 10 * b" ", b"(1" + 11 * b"0" + b",), }")
    assert huge != good
    assert len(huge) == len(good)
    for member in (huge, good[:-1], npy([object()]), b"", b"\x93NUMPY\x09\x00"):
        path.write_bytes(npz(a=member))
        with pytest.raises(ValueError, match=r"."):
            read_arrays(path, "--trace", 100_000)


class FullDisk:
    """os.fsync, and writing, on a disk that has no room."""

    def __call__(self, *_: object) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def test_a_full_disk_leaves_the_old_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "x"
    path.write_bytes(b"old")
    monkeypatch.setattr(os, "fsync", FullDisk())
    with pytest.raises(OSError, match="No space left") as caught:
        write_whole(path, b"new")
    assert caught.value.filename == str(path)
    with pytest.raises(OSError, match="No space left"):
        write_new(tmp_path / "other", b"new", 0o600)
    assert [own.name for own in tmp_path.iterdir()] == ["x"]
    assert path.read_bytes() == b"old"


def test_a_file_with_the_longest_name_is_written(tmp_path: Path) -> None:
    path = tmp_path / ("x" * 255)
    write_whole(path, b"new")
    assert [own.name for own in tmp_path.iterdir()] == [path.name]
    assert path.stat().st_mode & 0o777 == 0o666 & ~umask()


def umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def test_a_new_file_never_replaces_another(tmp_path: Path) -> None:
    path, link = tmp_path / "x", tmp_path / "link"
    write_new(path, b"one", 0o600)
    link.symlink_to(tmp_path / "elsewhere")
    for there in (path, link):
        with pytest.raises(FileExistsError):
            write_new(there, b"two", 0o600)
    assert path.read_bytes() == b"one"
    assert path.stat().st_mode & 0o777 == 0o600
    assert sorted(own.name for own in tmp_path.iterdir()) == ["link", "x"]
