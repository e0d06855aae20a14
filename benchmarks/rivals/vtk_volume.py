"""VTK's CPU ray caster on the benchmark's grid: `hast2-volume512` by vtkFixedPointVolumeRayCastMapper.

The same grid (this engine fills it and hands it over), the same view and light, trilinear values, the same opacities,
gradient shading, and as many places along a ray, on two threads. VTK wants a display even where its window is none: run it
under `xvfb-run -a` where there is no screen. Timed is the mapper's own ray casting, without bringing the picture to the
window; the first frame, which computes the gradients of all voxels, is not.
"""

from __future__ import annotations

import os
import sys
from typing import Any

import numpy as np

from benchmarks.rivals.base import MissingError, Sample

THREADS = 2
LIGHT = (-0.4, -0.5, -0.77)  # as in the row's scene


class VtkVolume:
    """VTK 9's fixed-point ray caster."""

    name = "VTK"
    rows = ("hast2-volume512",)

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
        # Without one it ends the process.
        if sys.platform == "linux" and not os.environ.get("DISPLAY"):
            raise MissingError("VTK needs a display (xvfb-run -a)")
        from clfractal.cli.bench import VOLUME
        from clfractal.device.select import choose
        from clfractal.engine.prepare import prepare
        from clfractal.integrators.volume import settings_of
        from clfractal.scene.load import load_scene
        from clfractal.voxels.fill import fill_grid

        version = vtk.vtkVersion()
        device = choose()
        job = prepare(load_scene(VOLUME), device, precision="float32")
        grid = fill_grid(job.scene, settings_of(job.scene), device, lanes=job.lanes, precision="float32")
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
        mapper.SetNumberOfThreads(THREADS)
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
        material = job.scene.material
        shown.SetAmbient(material.ambient)
        shown.SetDiffuse(material.diffuse)
        shown.SetSpecular(material.specular)
        shown.SetSpecularPower(material.shininess)
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
        renderer.AutomaticLightCreationOff()
        light = vtk.vtkLight()
        light.SetLightTypeToSceneLight()
        light.SetPosition(*(-part for part in LIGHT))
        light.SetFocalPoint(0, 0, 0)
        renderer.AddLight(light)
        self.name = f"VTK {version.GetVTKVersion()}, CPU ray caster"
        self._window: Any = window
        self._mapper: Any = mapper
        window.Render()

    def measure(self) -> list[Sample]:
        """One frame."""
        self._window.GetRenderers().GetFirstRenderer().GetActiveCamera().Modified()
        self._window.Render()
        return [Sample("hast2-volume512", 1e3 * float(self._mapper.GetTimeToDraw()))]

    def save(self, path: str) -> None:
        """The last frame as a PNG, to look at."""
        import vtk

        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(self._window)
        writer = vtk.vtkPNGWriter()
        writer.SetInputConnection(grab.GetOutputPort())
        writer.SetFileName(path)
        writer.Write()
