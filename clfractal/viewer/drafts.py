"""Cheap shading while a scene moves whose light goes along paths: what lies where, and its colours."""

from __future__ import annotations

from collections.abc import Callable

from clfractal.device.cancel import CancelToken
from clfractal.elements.lights.directional import DirectionalLight
from clfractal.engine.job import Job
from clfractal.engine.local_executor import LocalExecutor
from clfractal.errors import ClfractalError
from clfractal.scene.light_paths import DirectLighting, PathLighting
from clfractal.scene.lighting import MAX_ASKED
from clfractal.scene.model import Scene
from clfractal.scene.parts import PerspectiveCamera
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.preparing import differs_by_view, sharp

# In the place of the light of a sky: how bright a white surface that faces the eye is on the screen.
_HEADLIGHT = 0.7
# A lens that is open by so little blurs nothing.
_CLOSED = 1e6


def draft(scene: Scene) -> Scene:
    """The scene as a modelling program shades it: by its lights alone, without shadows, fog and blur.

    Where an environment lights it, or many lamps, a light at the eye takes their place: rays to a sky are noise in a coarse
    picture, and a ray to each lamp takes too long.
    Materials keep their colours; what mirrors, breaks or scatters light looks dull. Other scenes stay as they are.
    """
    if not isinstance(scene.lighting, PathLighting):
        return scene
    update: dict[str, object] = {"lighting": DirectLighting(), "fog": None, "glow": None, "mist": None}
    lights = tuple(light.model_copy(update={"shadow": False}) for light in scene.lights)
    camera, environment = scene.camera, scene.environment
    own = scene.materials.get(scene.material.name or "")
    color = own.base.color if own is not None else None
    if isinstance(color, tuple):
        update["material"] = scene.material.model_copy(update={"color": color})
        update["coloring"] = scene.coloring.model_copy(update={"by": "solid"})
    try:
        if environment is not None and environment.rays > 0:
            update["environment"] = environment.model_copy(update={"rays": 0})
            lights = (_headlight(scene), *lights)
        if len(lights) > MAX_ASKED:
            lights = (_headlight(scene),)
        if isinstance(camera, PerspectiveCamera) and camera.f_number is not None:
            update["camera"] = camera.model_copy(update={"f_number": _CLOSED})
        return scene.model_copy(update={**update, "lights": lights})
    except ClfractalError:
        return scene  # one of them does not go without paths


def _headlight(scene: Scene) -> DirectionalLight:
    """A light that shines where the camera looks, as bright as the exposure wants."""
    intensity = _HEADLIGHT * 2.0**-scene.output.stops
    return DirectionalLight.checked(
        {"direction": scene.camera.ahead, "intensity": intensity, "shadow": False}
    )


class Drafts:
    """Which pictures of a session are drafts, and how coarse these are.

    Args:
        pacing: of the other pictures; where those are never coarse, there are no drafts.
    """

    def __init__(self, pacing: Pacing) -> None:
        self._of_others, self._own = pacing, Pacing()
        self._foreseen: Scene | None = None

    def shaded(self, scene: Scene, moving: bool) -> Scene:
        """A scene as it is rendered."""
        return draft(scene) if moving and self._of_others.coarsest > 1 else scene

    def moving(self, scene: Scene, job: Job, prepared: Callable[[Scene], Job]) -> Job:
        """What is rendered while the camera of a scene moves whose picture is rendered by `job`."""
        shaded = self.shaded(scene, True)
        return job if shaded is scene else prepared(sharp(shaded))

    def pacing(self, drafted: bool) -> Pacing:
        """How coarse drafts are, or others: a draft takes a part of the time."""
        self._own.rate, self._own.coarsest = self._of_others.rate, self._of_others.coarsest
        return self._own if drafted else self._of_others

    def foreseen(self, scene: Scene, prepared: Callable[[Scene], Job]) -> DraftProgram | None:
        """The task that gets the program of a scene's drafts ready; None where there is none, or nothing new."""
        shaded, known = self.shaded(scene, True), self._foreseen
        if shaded is scene or (known is not None and differs_by_view(known, scene)):
            return None
        self._foreseen = scene
        return DraftProgram(shaded, prepared)


class DraftProgram:
    """Compiles the program of a scene's drafts in the background, so that the first move does not wait for it."""

    finished = False

    def __init__(self, shaded: Scene, prepared: Callable[[Scene], Job]) -> None:
        self._shaded, self._prepared = shaded, prepared

    def work(self, executor: LocalExecutor, token: CancelToken, tell: Callable[[str], None]) -> None:
        """See `Task`."""
        executor.make_ready(self._prepared(sharp(self._shaded)).coarse(2), token)
        self.finished = True

    def failed(self, error: ClfractalError) -> None:
        """The first move tells it."""
        self.finished = True
