"""The rules of the house: how long a file may be, who uses which library. (`make lint` checks who imports whom.)"""

from __future__ import annotations

import re
import statistics
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
LONGEST_FILE = 500
LONGEST_MEDIAN = 200
LONGEST_KERNEL = 300
# One place each for what is heavy or has peculiar habits.
OWNERS = {
    "yaml": {"files/document.py", "files/marks.py"},
    "OpenEXR": {"files/exr.py"},
    "png": {"files/png.py"},
    "rich": {"commands/progress.py"},
    "typer": {
        f"commands/{name}.py"
        for name in (
            "app",
            "options",
            "list_facts",
            "list_grids",
            "list_pictures",
            "list_scenes",
            "list_window",
        )
    },
    "cmap": {"scene/palette.py"},
    "skimage": {"voxels/mesh.py"},
    "glfw": {"viewer/window.py", "commands/view.py"},
    "OpenGL": {"viewer/gl.py", "commands/view.py"},
    "ruamel": {"files/spans.py", "commands/view.py"},
}


def lines(path: Path) -> int:
    return path.read_text(encoding="utf-8").count("\n")


def imports(path: Path, module: str) -> bool:
    return (
        re.search(rf"^\s*(import|from) {module}\b", path.read_text(encoding="utf-8"), re.MULTILINE)
        is not None
    )


def test_python_files_are_short() -> None:
    length = {path: lines(path) for path in (ROOT / "clfractal").rglob("*.py")}
    assert len(length) > 40
    assert {path.name: count for path, count in length.items() if count > LONGEST_FILE} == {}
    assert statistics.median(length.values()) <= LONGEST_MEDIAN


def test_kernel_files_are_short() -> None:
    files = [path for path in (ROOT / "kernels").rglob("*") if path.is_file()]
    assert len(files) > 5
    assert {path.name: lines(path) for path in files if lines(path) > LONGEST_KERNEL} == {}


@pytest.mark.parametrize("module", OWNERS)
def test_a_library_is_used_in_one_place(module: str) -> None:
    package = ROOT / "clfractal"
    users = {str(path.relative_to(package)) for path in package.rglob("*.py") if imports(path, module)}
    assert users
    assert users <= OWNERS[module]


def test_checking_a_scene_needs_no_opencl() -> None:
    """And neither a bar nor a picture library: what is loaded for a command is what it needs."""
    code = (
        "import sys; from clfractal.cli import run; from clfractal.commands.shell import Shell\n"
        "import tempfile, pathlib; f = pathlib.Path(tempfile.mkdtemp()) / 's.yaml'\n"
        "f.write_text('version: 1\\nformula: {name: hast}\\ncamera: {}\\n')\n"
        "assert run(['check', str(f)], Shell(owns_process=False)) == 0\n"
        "print([m for m in ('pyopencl', 'OpenEXR', 'rich', 'PIL', 'cmap', 'mpmath') if m in sys.modules])"
    )
    ended = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert ended.stdout.splitlines()[-1] == "[]"


def test_importing_the_package_imports_nothing_else() -> None:
    heavy = "('numpy', 'pyopencl', 'yaml', 'pydantic')"
    code = f"import sys, clfractal; print([m for m in {heavy} if m in sys.modules])"
    ended = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert ended.stdout == "[]\n"
