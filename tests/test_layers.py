"""The rules of the house: how long a file may be, who uses which library. (`make lint` checks who imports whom.)"""

from __future__ import annotations

import re
import statistics
from pathlib import Path

import pytest

from tests.shell import python, works

ROOT = Path(__file__).resolve().parents[1]
LONGEST_FILE = 500
LONGEST_MEDIAN = 200
LONGEST_KERNEL = 300
# One place each for what is heavy or has peculiar habits.
OWNERS = {
    "yaml": {"files/document.py", "files/spans.py"},
    "OpenEXR": {"files/exr.py"},
    "png": {"files/png.py"},
    "rich": {"cli/progress.py"},
    "typer": {
        f"cli/{name}.py"
        for name in (
            "program",
            "options",
            "list_facts",
            "list_grids",
            "list_pictures",
            "list_proposals",
            "list_scenes",
            "list_window",
        )
    },
    "cmap": {"scene/palette.py"},
    "pycparser": {"exchange/c_text.py"},
    "skimage": {"voxels/isosurface.py"},
    "glfw": {"viewer/window.py", "cli/view.py"},
    "OpenGL": {"viewer/gl.py", "cli/view.py"},
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
        "import sys; from clfractal.cli import run; from clfractal.cli.shell import Shell\n"
        "import tempfile, pathlib; f = pathlib.Path(tempfile.mkdtemp()) / 's.yaml'\n"
        "f.write_text('version: 1\\nformula: {name: hast}\\ncamera: {}\\n')\n"
        "assert run(['check', str(f)], Shell(owns_process=False)) == 0\n"
        "heavy = ('numpy', 'pyopencl', 'OpenEXR', 'rich', 'PIL', 'cmap', 'mpmath')\n"
        "print([m for m in heavy if m in sys.modules])"
    )
    assert works(python(code)).out.splitlines()[-1] == "[]"


def test_rendering_a_surface_loads_nothing_of_other_pictures(tmp_path: Path) -> None:
    """Loading modules is most of the time of a small picture from the shell."""
    scene = tmp_path / "scene.yaml"
    scene.write_text("version: 1\nformula: {name: hast}\ncamera: {}\n", encoding="utf-8")
    code = (
        "import sys; from clfractal.cli import run; from clfractal.cli.shell import Shell\n"
        f"order = ['render', {str(scene)!r}, '--size', '16x16', '-o', {str(tmp_path / 'picture.png')!r}]\n"
        "assert run(order, Shell(owns_process=False)) == 0\n"
        "print(*sys.modules)\n"
        "from clfractal.scene.materials import PbrMaterial; print(PbrMaterial.__pydantic_complete__)"
    )
    *_, modules, has_validators_of_paths = works(python(code)).out.splitlines()
    assert has_validators_of_paths == "False"
    loaded = set(modules.split())
    assert "clfractal.integrators.surface" in loaded
    own = {
        *("clfractal.device.buildlog", "clfractal.images.anaglyph", "clfractal.images.probe"),
        *("clfractal.integrators.volume", "clfractal.integrators.cut_plane", "clfractal.voxels"),
        *("clfractal.exchange.look", "clfractal.formulas.deep", "clfractal.scene.deeper"),
        *("clfractal.schema.error_texts", "clfractal.scene.palette", "clfractal.stereo.eyes"),
        *(
            "clfractal.engine.comfort",
            "clfractal.engine.job_framebuffers",
            "clfractal.engine.probing",
            "clfractal.engine.refine",
        ),
    }
    foreign = {"OpenEXR", "PIL", "cmap", "mpmath", "rich", "ssl", "xml", "http"}
    assert loaded & (own | foreign) == set()


def test_only_sections_that_a_scene_has_get_validators() -> None:
    """Making those of all takes longer than all else about reading a scene."""
    code = (
        "from clfractal.scene.load import load_scene\n"
        "from clfractal.scene.animation import Animation; from clfractal.scene.volume import VolumeRenderer\n"
        "from clfractal.scene.lighting import Fog; from clfractal.scene.surface import SurfaceRenderer\n"
        "load_scene({'version': 1, 'formula': {'name': 'hast'}, 'camera': {}, 'fog': {}})\n"
        "sections = (Animation, VolumeRenderer, Fog, SurfaceRenderer)\n"
        "print(*(section.__pydantic_complete__ for section in sections))"
    )
    assert works(python(code)).out.split() == ["False", "False", "True", "True"]


def test_a_render_with_known_programs_starts_no_process(tmp_path: Path) -> None:
    """A compiler in a process of its own takes longer to start than all else; nor is one asked within this process."""
    scene = tmp_path / "scene.yaml"
    scene.write_text("version: 1\nformula: {name: hast}\ncamera: {}\n", encoding="utf-8")
    order = ["render", str(scene), "--size", "16x16", "-o", str(tmp_path / "picture.png")]
    code = (
        "import sys; from clfractal.cli import run; from clfractal.cli.shell import Shell\n"
        "starts = ('subprocess.', 'os.fork', 'os.posix_spawn', 'os.exec', 'os.spawn', 'os.system')\n"
        "sys.addaudithook(lambda event, _: print(event) if event.startswith(starts) else None)\n"
        f"assert run({order!r}, Shell(owns_process=False)) == 0\n"
        "print(sys.modules['clfractal.device.children'].__name__)"
    )
    works(python(code))  # what is compiled and measured once
    assert works(python(code)).out.split() == ["clfractal.device.children"]


def test_the_program_starts_without_what_it_does_not_need(monkeypatch: pytest.MonkeyPatch) -> None:
    """The user's own settings of the libraries stay."""
    code = (
        "import gc, os, sys; from clfractal import cli\n"
        "cli.run = lambda *_: print(gc.isenabled(), os.environ['OPENBLAS_NUM_THREADS']) or 0\n"
        "os._exit = sys.exit; cli.main()"
    )
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    for given, used in (({}, "1"), ({"OPENBLAS_NUM_THREADS": "3"}, "3")):
        assert python(code, extra=given).out.split() == ["False", used]


def test_garbage_is_collected_again_once_a_command_has_loaded_what_it_needs() -> None:
    code = (
        "import gc, time; gc.disable()\n"
        "from clfractal.cli import check, program; from clfractal.cli.shell import Shell\n"
        "def work(*_, **__):\n"
        "    print(gc.isenabled(), gc.get_freeze_count() > 0)\n"
        "    while not gc.isenabled(): time.sleep(0.01)\n"
        "check.check_scene, program.LOADED_AFTER_SECONDS = work, 0.5\n"
        "program.call(['check', 'scene.yaml'], Shell(owns_process=False))"
    )
    assert works(python(code)).out.split() == ["False", "True"]


def test_importing_the_package_imports_nothing_else() -> None:
    heavy = "('numpy', 'pyopencl', 'yaml', 'pydantic')"
    code = f"import sys, clfractal; print([m for m in {heavy} if m in sys.modules])"
    assert works(python(code)).out == "[]\n"


# --- no test module is imported by another ---


TESTS = Path(__file__).parent
_OF_A_MODULE = re.compile(r"\b(?:from|import)\s+(?:tests(?:\.\w+)*|\.+(?:\w+\.)*)\.?test_\w+")
_OF_A_FOLDER = re.compile(
    r"\bfrom\s+(?:tests(?:\.\w+)*|\.[.\w]*)\s+import\s+(?:\([^)]*?|[^\n(]*?)\b(test_\w+)"
)


def imported_tests(text: str) -> list[str]:
    """What a file imports of test modules; also in the texts of programs that it starts."""
    found = [match[0] for pattern in (_OF_A_MODULE, _OF_A_FOLDER) for match in pattern.finditer(text)]
    return [" ".join(each.split()) for each in found]


def test_no_file_imports_a_test_module() -> None:
    files = sorted(TESTS.rglob("*.py"))
    assert len(files) > 400
    wrong = {
        str(path.relative_to(TESTS)): found
        for path in files
        if path != Path(__file__) and (found := imported_tests(path.read_text(encoding="utf-8")))
    }
    assert wrong == {}


@pytest.mark.parametrize(
    "text",
    [
        "from tests.files.test_png import head",
        "from tests.test_api import BULB",
        "import tests.render.test_paths as paths",
        "from tests.render import shots, test_paths",
        "from tests.render import (\n    shots,\n    test_paths,\n)",
        "from .test_paths import path",
        "from . import test_paths",
        'CHILD = """\nfrom tests.files.test_journal import content\n"""',
    ],
)
def test_imports_of_every_form_are_seen(text: str) -> None:
    assert len(imported_tests(text)) == 1


@pytest.mark.parametrize(
    "text",
    [
        "from tests.render.paths import seen\n\n\ndef test_it() -> None: ...",
        "from tests.render import (\n    shots,\n)\nx = (test_y,)",
        "import tests\ntest_x = 1",
    ],
)
def test_other_imports_are_not(text: str) -> None:
    assert imported_tests(text) == []
