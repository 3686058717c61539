"""Checkpoints of work that is done, that another version did, and of several works in one."""

from __future__ import annotations

from pathlib import Path

import pytest

from chladni.drives import checkpoint as checkpoints
from chladni.drives.checkpoint import Checkpoint, remove_checkpoint

KEY = {"seed": 1}


def keep_one(path: Path) -> None:
    with Checkpoint(path, KEY) as checkpoint:
        checkpoint.put("a", {"value": 1.5})


def test_nothing_but_a_checkpoint_that_no_one_uses_is_removed(tmp_path: Path) -> None:
    path, link = tmp_path / "x.partial", tmp_path / "link"
    remove_checkpoint(None)
    remove_checkpoint(path)
    path.write_bytes(b"dear diary")
    remove_checkpoint(path)
    assert path.read_bytes() == b"dear diary"
    path.unlink()
    keep_one(path)
    link.symlink_to(path)
    remove_checkpoint(link)
    with Checkpoint(path, KEY):
        remove_checkpoint(path)
    assert path.exists()
    remove_checkpoint(path)
    assert not path.exists()


def test_what_another_version_kept_is_not_used(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "x.partial"
    keep_one(path)
    with Checkpoint(path, KEY) as checkpoint:
        assert checkpoint.get("a") == {"value": 1.5}
    monkeypatch.setattr(checkpoints, "version", lambda _: "0.0.1")
    with Checkpoint(path, KEY) as checkpoint:
        assert checkpoint.get("a") is None


def test_parts_of_a_checkpoint_have_their_own_names(tmp_path: Path) -> None:
    with Checkpoint(tmp_path / "x.partial", KEY) as checkpoint:
        checkpoint.part("one").put("a", {"value": 1.5})
        assert checkpoint.part("one").get("a") == {"value": 1.5}
        assert checkpoint.part("other").get("a") is None
