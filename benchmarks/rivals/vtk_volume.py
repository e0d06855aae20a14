"""VTK's CPU ray caster on the benchmark's grid: `hast2-volume512` by vtkFixedPointVolumeRayCastMapper.

The same grid (this engine fills it and hands it over), the same view and light, trilinear values, the same opacities,
gradient shading, and as many places along a ray. It draws without a window; what is timed is the mapper's own ray casting.
"""

from __future__ import annotations

import math
import time
from typing import Any

import numpy as np

from benchmarks.rivals.base import MissingError, Sample

FRAMES = 5


class VtkVolume:
    """VTK 9's fixed-point ray caster."""

    name = "VTK"

    def prepare(self) -> None:
        """Fills the grid and makes the scene.

        Raises:
            MissingError: VTK is not installed, or cannot draw here.
        """
        try:
            import vtk
            from vtk.util.numpy_support import numpy_to_vtk
        except ImportError as error:
            raise MissingError("VTK is not installed (pip install vtk)") from error
        from clfractal.bench import VOLUME
        from clfractal.device.select import choose
        from clfractal.job import prepare
        from clfractal.render.volume import settings_of
        from clfractal.scene.load import load_scene
        from clfractal.voxels.fill import fill_grid

        version = vtk.vtkVersion()
        job = prepare(load_scene(VOLUME), choose(), precision="float32")
        grid = fill_grid(
            job.scene, settings_of(job.scene), job.device, lanes=job.plan.lanes, precision="float32"
        )
        values = np.ascontiguousarray(grid.dense())
        image = vtk.vtkImageData()
        image.SetDimensions(*grid.shape)
        image.SetSpacing(*grid.spacing)
        image.SetOrigin(*(c + s / 2 for c, s in zip(grid.corner, grid.spacing, strict=True)))
        self._kept = numpy_to_vtk(values.reshape(-1), deep=False)
        self._values = values
        image.GetPointData().SetScalars(self._kept)
        mapper = vtk.vtkFixedPointVolumeRayCastMapper()
        mapper.SetInputData(image)
        mapper.SetAutoAdjustSampleDistances(False)
        mapper.SetImageSampleDistance(1.0)
        mapper.SetSampleDistance(0.5 * min(grid.spacing))
        opacity, color = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
        for at, value in ((0, 0.0), (0.2 * 255, 0.0), (0.8 * 255, 1.0), (255, 1.0)):
            opacity.AddPoint(at, value)
        color.AddRGBPoint(0, 0.8, 0.7, 0.6)
        shown = vtk.vtkVolumeProperty()
        shown.SetScalarOpacity(opacity)
        shown.SetScalarOpacityUnitDistance(min(grid.spacing))
        shown.SetColor(color)
        shown.SetInterpolationTypeToLinear()
        shown.ShadeOn()
        volume = vtk.vtkVolume()
        volume.SetMapper(mapper)
        volume.SetProperty(shown)
        renderer = vtk.vtkRenderer()
        renderer.AddVolume(volume)
        window = vtk.vtkRenderWindow()
        window.SetOffScreenRendering(True)
        window.SetSize(job.scene.image.width, job.scene.image.height)
        window.AddRenderer(renderer)
        camera, ours = renderer.GetActiveCamera(), job.scene.camera
        camera.SetPosition(*ours.position)
        camera.SetFocalPoint(*ours.target)
        camera.SetViewUp(*ours.up)
        camera.SetViewAngle(getattr(ours, "fov", 45.0))
        renderer.ResetCameraClippingRange()
        self.name = f"VTK {version.GetVTKVersion()}, CPU ray caster"
        self._window: Any = window
        self._mapper: Any = mapper
        window.Render()

    def measure(self) -> list[Sample]:
        """The median of some frames."""
        times = []
        for _ in range(FRAMES):
            self._window.GetRenderers().GetFirstRenderer().GetActiveCamera().Modified()
            start = time.perf_counter()
            self._window.Render()
            times.append(1e3 * (time.perf_counter() - start))
        median = sorted(times)[FRAMES // 2]
        if not math.isfinite(median):
            raise MissingError("VTK gave no time")
        return [Sample("hast2-volume512", median)]

    def save(self, path: str) -> None:
        """The last frame as a PNG, to look at."""
        import vtk

        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(self._window)
        writer = vtk.vtkPNGWriter()
        writer.SetInputConnection(grab.GetOutputPort())
        writer.SetFileName(path)
        writer.Write()
