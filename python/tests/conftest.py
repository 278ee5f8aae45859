"""Drives that leadlag makes itself: the command of the same package writes them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest


def run(*words: str) -> str:
    """The command line of the package; returns what it prints."""
    done = subprocess.run(
        [sys.executable, "-m", "leadlag._program", "--quiet", *words], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="session")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with pair files of two synthetic platoons."""
    folder = tmp_path_factory.mktemp("drives")
    for seed in (1, 2):
        run("synth", "--out", str(folder / f"drive{seed}"), "--seed", str(seed), "--duration", "120", "--pairs")
    return folder


@pytest.fixture(scope="session")
def pair(folder: Path) -> Path:
    """One file of four columns."""
    return folder / "drive1" / "pair_follower1.csv"
