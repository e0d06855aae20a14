"""A job: all decisions about a picture, made before a device is used, as plain data that can be sent.

A job is a list of views and one composition that makes one picture of them. Its scene contains everything that determines
the pixels (including the number types and samples in use), so that rendering the scene in a picture's header gives the same
pixels again.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

from clfractal.camera.views import scene_view, seen_by
from clfractal.device.select import DeviceInfo
from clfractal.files import resources
from clfractal.files.channels import CHANNELS
from clfractal.files.document import write_document
from clfractal.images.compose import APART, Composed, Side
from clfractal.images.denoise import NAME
from clfractal.images.framebuffer import Framebuffer
from clfractal.images.paste import Pasted
from clfractal.images.provenance import lines_of
from clfractal.images.store import JournalFramebuffer
from clfractal.images.tiled import Picture
from clfractal.images.tiles import Region, TileGrid
from clfractal.integrators.plan import PlannedView
from clfractal.scene.layout import Place
from clfractal.scene.model import Scene
from clfractal.scene.standing import standing_alone
from clfractal.scene.stereo import Stereo
from clfractal.shading.cryptomatte import attributes

# Settings for showing a pair, which do not change either eye's picture.
_SHOWN = ("mode", "swap", "method", "glasses", "colors")
# What an unfinished picture says of its devices if they are of several kinds.
_MIXED = {"device": "several kinds", "driver": "several kinds", "lanes": 0}


@dataclass(frozen=True, slots=True)
class Identity:
    """One view is the whole picture; `view` is its number in the job."""

    view: int


@dataclass(frozen=True, slots=True)
class Paste:
    """Several views put into their places of one picture.

    Attributes:
        views: their numbers in the job, in the order in which they are put.
        places: where each stands in the picture.
        size: width and height of the whole picture, pixels.
        region: the part of it that is made.
        background: of what no view covers, linear Rec. 709.
    """

    views: tuple[int, ...]
    places: tuple[Place, ...]
    size: tuple[int, int]
    region: Region
    background: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class StereoPair:
    """Two eyes' pictures, combined as a stereo section says.

    Attributes:
        stereo: the scene's section.
        eyes: how each eye's picture is made; an eye whose picture is not needed is not there.
        image: width and height of the scene's image, pixels.
        region: the part of the finished picture that is made.
    """

    stereo: Stereo
    eyes: Mapping[Side, Identity | Paste]
    image: tuple[int, int]
    region: Region


Composition: TypeAlias = Identity | Paste | StereoPair


@dataclass(frozen=True, slots=True)
class Kind:
    """Devices of another kind (another `DeviceInfo.key`) that do a part of a job: one of them, and each view's lanes."""

    device: DeviceInfo
    lanes: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Job:
    """A picture to be made.

    Attributes:
        scene: what is shown; of a stereo scene with the screen's place and the eyes' separation decided.
        views: what is rendered, each by itself.
        composition: how one picture is made of them.
        channels: those of the finished picture; views also have what denoising needs.
        device: the device for which the decisions were made.
        remark: a line for the user, or empty.
        others: devices of other kinds that help. What they make may differ in the last bits from what `device` makes.
    """

    scene: Scene
    views: tuple[PlannedView, ...]
    composition: Composition
    channels: tuple[str, ...]
    device: DeviceInfo
    remark: str
    others: tuple[Kind, ...] = ()

    def on(self, device: DeviceInfo) -> Job | None:
        """The job as a device does it, with the lanes of its kind; None if it has no part in it."""
        if device.key == self.device.key:
            return self
        for kind in self.others:
            if kind.device.key == device.key:
                pairs = zip(self.views, kind.lanes, strict=True)
                views = tuple(replace(view, plan=replace(view.plan, lanes=lanes)) for view, lanes in pairs)
                return replace(self, views=views, device=device, others=())
        return None

    def coarse(self, divider: int) -> Job:
        """The same job with fewer pixels, each with one sample; see `PlannedView.coarse`."""
        return replace(self, views=tuple(view.coarse(divider) for view in self.views))

    @property
    def denoises(self) -> bool:
        """Whether the views' pictures are denoised when their rays are done."""
        return self.scene.output.denoise and {"R", "G", "B"} <= set(self.channels)

    @property
    def region(self) -> Region:
        """The part of the finished picture that is made, pixels."""
        made = self.composition
        return self.views[made.view].plan.region if isinstance(made, Identity) else made.region

    @property
    def tiles(self) -> int:
        """Tiles of all views together."""
        return sum(TileGrid(view.plan.region).count for view in self.views)

    @property
    def precision(self) -> str:
        """The views' number types."""
        return ", ".join(sorted({view.plan.precision for view in self.views}))

    @property
    def lanes(self) -> int:
        """The views' lanes; the most of them, where they differ."""
        return max((view.plan.lanes for view in self.views), default=1)

    @property
    def samples(self) -> int:
        """Samples of a pixel, at most; the most of any view."""
        return max((view.plan.samples for view in self.views), default=1)

    @property
    def sides(self) -> tuple[Side | None, ...]:
        """The eye of each view; None in a picture without stereo."""
        made = self.composition
        if not isinstance(made, StereoPair):
            return (None,) * len(self.views)
        found = {
            view: side
            for side, part in made.eyes.items()
            for view in ((part.view,) if isinstance(part, Identity) else part.views)
        }
        return tuple(found[number] for number in range(len(self.views)))

    def resolved(self) -> dict[str, Any]:
        """The scene as plain data, with the decisions in place of `auto` and null."""
        plain = self.scene.resolved()
        if self.scene.layout is None:
            plain["renderer"] = _decided(plain["renderer"], self.views[0])
        else:
            first_eye = [
                view for view, side in zip(self.views, self.sides, strict=True) if side == self.sides[0]
            ]
            for view in first_eye:
                own = plain["layout"]["views"][view.number]
                own["renderer"] = _decided(view.scene.renderer.model_dump(mode="json"), view)
        plain["output"]["channels"] = list(self.channels)
        alone = standing_alone(self.scene)
        plain["animation"] = None if alone is None else alone.model_dump(mode="json")
        return plain

    def header(self) -> dict[str, Any]:
        """The header of the whole picture's files (see `Framebuffer`); `seconds` is added when it is known."""
        scene = self.scene
        camera = scene_view(scene)
        devices = [self.device, *(kind.device for kind in self.others)]
        return {
            "scene": write_document(self.resolved()),
            "version": resources.__version__,
            "device": "; ".join(dict.fromkeys(device.name for device in devices)),
            "platform": "; ".join(dict.fromkeys(f"{each.platform}, {each.version}" for each in devices)),
            "precision": self.precision,
            "exposure": scene.output.stops,
            "tone": scene.output.tone,
            "transparent": scene.background == "transparent",
            **({"denoised": NAME} if self.denoises else {}),
            **attributes(scene, self.channels),
            "worldToCamera": camera.world_to_camera(),
            "worldToNDC": camera.world_to_ndc(),
        }

    def view_header(self, number: int, whole: Mapping[str, Any]) -> dict[str, Any]:
        """The same of one view's picture, from what `header` told: in an eye's picture, that eye's camera."""
        side = self.sides[number]
        if side is None:
            return dict(whole)
        camera = scene_view(*seen_by(self.scene, side))
        cameras = {"worldToCamera": camera.world_to_camera(), "worldToNDC": camera.world_to_ndc()}
        return {**whole, **cameras, "view": side}

    def identity(self, number: int) -> dict[str, Any]:
        """The values that must be equal for a tile of one view to have the same bits; stored with unfinished work.

        Bookmarks, movement, and settings for writing files and for showing a pair may change; the journal compares the
        channels. With devices of several kinds bits are not promised, so any of them may continue the work.
        """
        return {**self._identity(number), **(_MIXED if self.others else {})}

    def also_continues(self, number: int) -> list[dict[str, Any]]:
        """Identities of other unfinished work that this job may continue.

        Work of several kinds of devices is continued by any of them. Who names several kinds takes their differences,
        and may continue what one of them began.
        """
        found = self._identity(number)
        if not self.others:
            return [{**found, **_MIXED}]
        kinds = [Kind(self.device, tuple(view.plan.lanes for view in self.views)), *self.others]
        return [
            {**found, "device": kind.device.name, "driver": kind.device.key, "lanes": kind.lanes[number]}
            for kind in kinds
        ]

    def _identity(self, number: int) -> dict[str, Any]:
        """See `identity`; of the device that the decisions were made for."""
        view, side = self.views[number], self.sides[number]
        scene = self.resolved()
        del scene["output"], scene["bookmarks"], scene["animation"]
        found: dict[str, Any] = {}
        if view.shutter is not None:
            found["shutter"] = view.shutter.told()
        if side is not None:
            scene["stereo"] = {key: value for key, value in scene["stereo"].items() if key not in _SHOWN}
            scene["image"] = view.scene.image.model_dump()
            found["eye"] = side
        if self.scene.layout is not None:
            found["view"] = view.number
        surroundings, given = view.scene.surroundings, view.scene.given
        grids = {file: grid.digest for file, grid in view.scene.grids.items()}
        textures = {file: texture.digest for file, texture in view.scene.textures.items()}
        lights = {" ".join(key): table.digest for key, table in view.scene.light_tables.items()}
        return {
            **found,
            "scene": scene,
            # The scene only names its map and its grid, and these files may have changed.
            "environment": surroundings.digest if surroundings is not None else None,
            "grid": given.digest if given is not None else None,
            # Only where there are some: work in progress of older versions stays valid.
            **({"textures": textures} if textures else {}),
            **({"grids": grids} if grids else {}),
            **({"lights": lights} if lights else {}),
            "version": resources.__version__,
            "device": self.device.name,
            "driver": self.device.key,
            "lanes": view.plan.lanes,
        }

    def picture(self, stores: Sequence[Picture], header: Mapping[str, Any] | None = None) -> Picture:
        """The finished picture of the views' ones, read as it is needed.

        Args:
            stores: of each view.
            header: added to what the views' headers agree in.

        Raises:
            ValueError: nothing is composed of a pair that stays apart.
        """
        made = self.composition
        if not isinstance(made, StereoPair):
            return self._part(made, stores, header)
        eyes = self.eyes(stores)
        alone = made.stereo.mode in ("left", "right")
        seconds = sum(store.header.get("seconds", 0.0) for store in stores)
        # A composed picture has no camera, and its time is that of both pictures.
        common = {key: value for key, value in (header or {}).items() if not key.startswith("worldTo")}
        added = None if alone else {**common, **_provenance_of(stores), "seconds": seconds}
        return Composed(made.stereo, made.image, eyes.get("left"), eyes.get("right"), made.region, added)

    def eyes(self, stores: Sequence[Picture]) -> dict[Side, Picture]:
        """Each eye's whole picture, of a stereo job."""
        made = self.composition
        assert isinstance(made, StereoPair)
        return {side: self._part(part, stores) for side, part in made.eyes.items()}

    @property
    def stays_apart(self) -> bool:
        """Whether both eyes' pictures are kept apart instead of composed into one."""
        made = self.composition
        return isinstance(made, StereoPair) and made.stereo.mode in APART

    def _part(
        self, made: Identity | Paste, stores: Sequence[Picture], header: Mapping[str, Any] | None = None
    ) -> Picture:
        if isinstance(made, Identity):
            return stores[made.view]
        fill = {"A": 1.0, **dict(zip("RGB", made.background, strict=True))}
        return Pasted(
            [stores[number] for number in made.views],
            made.places,
            made.size,
            made.region,
            {name: fill.get(name, CHANNELS[name].fill) for name in self.channels},
            {**(header or {}), **_provenance_of([stores[number] for number in made.views])},
        )


def _provenance_of(stores: Sequence[Picture]) -> dict[str, str]:
    """A header's entry for the devices that made the views of a picture, if several did."""
    tiled = [store for store in stores if isinstance(store, (Framebuffer, JournalFramebuffer))]
    lines = lines_of(store.provenance.counts(store.done) for store in tiled)
    return {"devices": lines} if lines else {}


def _decided(renderer: dict[str, Any], view: PlannedView) -> dict[str, Any]:
    """A renderer's settings with the chosen samples and number type."""
    found = {**renderer, "samples": view.plan.samples, "precision": view.plan.precision}
    if found["min_samples"] is not None:
        found["min_samples"] = min(found["min_samples"], view.plan.samples)
    if (found["min_samples"] or 0) < 4:
        found["min_samples"] = None  # null has the same effect, and is valid in a scene
    return found
