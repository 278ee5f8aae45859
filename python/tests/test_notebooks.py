"""The notebooks of the examples and the page of the book run as they are written."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.ipynb"))
PAGE = ROOT.parent / "docs" / "PYTHON.md"

#: Packages of a notebook beside pandas and matplotlib.
NEEDS = {"your_optimiser": ("numba", "scipy", "pymoo", "optuna", "cmaes")}


@pytest.fixture
def command(monkeypatch: pytest.MonkeyPatch) -> None:
    """The command `leadlag` of this package, and no message of the graphics driver without a desktop session."""
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    monkeypatch.setenv("NODEVICE_SELECT", "1")
    monkeypatch.setenv("MPLBACKEND", "Agg")


def test_there_are_notebooks() -> None:
    assert len(EXAMPLES) == 6


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_a_notebook_runs(path: Path, command: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nbformat = pytest.importorskip("nbformat")
    nbclient = pytest.importorskip("nbclient")
    for module in ("ipykernel", "pandas", "matplotlib", *NEEDS.get(path.stem, ())):
        pytest.importorskip(module)
    # Figures go to the notebook.
    monkeypatch.delenv("MPLBACKEND")
    book = nbformat.read(path, as_version=4)
    # A cell that fails raises, with its text.
    nbclient.NotebookClient(
        book, timeout=600, kernel_name="python3", resources={"metadata": {"path": str(tmp_path)}}
    ).execute()
    # The visible output has no warning. That of tqdm without ipywidgets depends on the environment.
    texts = [output.get("text", "") for cell in book.cells for output in cell.get("outputs", [])]
    told = [text for text in texts if "Warning" in text and "IProgress" not in text]
    assert not told


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_a_notebook_is_stored_as_it_ran(path: Path) -> None:
    nbformat = pytest.importorskip("nbformat")
    assert path.stat().st_size < 400_000
    book = nbformat.read(path, as_version=4)
    code = [cell for cell in book.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in code] == list(range(1, len(code) + 1))
    text = path.read_text(encoding="utf-8")
    assert not re.search(r"/tmp/|/home/|/root/|/work/|C:\\\\", text), "an absolute path"


@pytest.mark.skipif(not PAGE.exists(), reason="only in a checkout")
def test_the_page_of_the_book_runs(command: None, tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    pytest.importorskip("scipy")
    text = PAGE.read_text(encoding="utf-8")
    blocks = re.findall(r"^```(python|sh)([^\n]*)\n(.*?)^```", text, flags=re.M | re.S)
    for words in (block for language, marks, block in blocks if language == "sh" and "not-run" not in marks):
        subprocess.run(["sh", "-ec", words], cwd=tmp_path, check=True, capture_output=True)
    script = tmp_path / "page.py"
    script.write_text("\n".join(block for language, _, block in blocks if language == "python"), encoding="utf-8")
    done = subprocess.run([sys.executable, script.name], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
