"""clfractal: an OpenCL render engine for 3D fractals.

    import clfractal
    framebuffer = clfractal.render(clfractal.load_scene("scene.yaml"))
    framebuffer["R"]            # float32, shape (height, width)
    framebuffer.save("out.exr")

Everything public is imported when it is first used, so that `import clfractal` costs nothing.
"""

from __future__ import annotations

import warnings
from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from clfractal.api import distances as distances
    from clfractal.api import escape as escape
    from clfractal.api import load_scene as load_scene
    from clfractal.api import mesh as mesh
    from clfractal.api import probe as probe
    from clfractal.api import render as render
    from clfractal.api import render_pair as render_pair
    from clfractal.api import voxelize as voxelize
    from clfractal.cluster.cluster import Cluster as Cluster
    from clfractal.device.cancel import CancelToken as CancelToken
    from clfractal.device.select import devices as devices
    from clfractal.engine.engine import Engine as Engine
    from clfractal.engine.finding import find as find
    from clfractal.engine.found import FoundView as FoundView
    from clfractal.engine.frames import at_frame as at_frame
    from clfractal.engine.frames import frames as frames
    from clfractal.engine.run import Progress as Progress
    from clfractal.engine.variations import variations as variations
    from clfractal.errors import ClfractalError as ClfractalError
    from clfractal.errors import DeviceError as DeviceError
    from clfractal.errors import FileError as FileError
    from clfractal.errors import FormulaError as FormulaError
    from clfractal.errors import KernelBuildError as KernelBuildError
    from clfractal.errors import SceneError as SceneError
    from clfractal.errors import Stopped as Stopped
    from clfractal.files.mesh import Mesh as Mesh
    from clfractal.files.resources import __version__ as __version__
    from clfractal.files.volume_file import Volume as Volume
    from clfractal.images.framebuffer import Framebuffer as Framebuffer
    from clfractal.images.probe import Probe as Probe
    from clfractal.integrators.points import Distances as Distances
    from clfractal.scene.load import dump_scene as dump_scene
    from clfractal.scene.model import Scene as Scene

    Film = Framebuffer  # the former name

_HOMES = {
    "distances": "clfractal.api",
    "escape": "clfractal.api",
    "load_scene": "clfractal.api",
    "mesh": "clfractal.api",
    "probe": "clfractal.api",
    "render": "clfractal.api",
    "render_pair": "clfractal.api",
    "voxelize": "clfractal.api",
    "Cluster": "clfractal.cluster.cluster",
    "CancelToken": "clfractal.device.cancel",
    "devices": "clfractal.device.select",
    "ClfractalError": "clfractal.errors",
    "DeviceError": "clfractal.errors",
    "FileError": "clfractal.errors",
    "FormulaError": "clfractal.errors",
    "KernelBuildError": "clfractal.errors",
    "SceneError": "clfractal.errors",
    "Stopped": "clfractal.errors",
    "Mesh": "clfractal.files.mesh",
    "Volume": "clfractal.files.volume_file",
    "Framebuffer": "clfractal.images.framebuffer",
    "Probe": "clfractal.images.probe",
    "Distances": "clfractal.integrators.points",
    "__version__": "clfractal.files.resources",
    "dump_scene": "clfractal.scene.load",
    "Scene": "clfractal.scene.model",
    "Engine": "clfractal.engine.engine",
    "FoundView": "clfractal.engine.found",
    "find": "clfractal.engine.finding",
    "at_frame": "clfractal.engine.frames",
    "frames": "clfractal.engine.frames",
    "Progress": "clfractal.engine.run",
    "variations": "clfractal.engine.variations",
}

_FORMER = {"Film": "Framebuffer"}
"""Names of before; each warns for one release."""

__all__ = [*_HOMES]


if not TYPE_CHECKING:  # for a type checker every name would exist

    def __getattr__(name: str) -> Any:
        if name in _HOMES:
            found = getattr(import_module(_HOMES[name]), name)
            globals()[name] = found  # the next time it is an attribute as any other
            return found
        if name in _FORMER:
            warnings.warn(f"clfractal.{name} is clfractal.{_FORMER[name]}", DeprecationWarning, stacklevel=2)
            return __getattr__(_FORMER[name])
        raise AttributeError(f"module 'clfractal' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted(__all__)
