"""A scene: frozen, strict, its attribute names the keys of a scene file.

Right-handed space, z up, scene units; angles in degrees; colours linear Rec. 709. Every key but `version`,
`formula` and `camera` has a default.
"""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Self, TypeVar, cast

from pydantic import BaseModel, ConfigDict, Field, PrivateAttr, ValidationInfo, model_validator

from clfractal.errors import ClfractalError, SceneError, Where
from clfractal.errors.arguments import plain
from clfractal.files.inputs import noting
from clfractal.scene.animation import Animation
from clfractal.scene.bookmarks import Bookmark, Bookmarks, bookmark, view_of
from clfractal.scene.coloring import Coloring
from clfractal.scene.cut_plane import CutPlaneRenderer, CutPlanes
from clfractal.scene.deep import Deep, check_frames
from clfractal.scene.formula import Formula
from clfractal.scene.glow import Glow
from clfractal.scene.layout import Layout, Place
from clfractal.scene.light_paths import Lighting, PathLighting
from clfractal.scene.lighting import Environment, Fog, Lights
from clfractal.scene.materials import Materials
from clfractal.scene.mist import Mist
from clfractal.scene.moved_cameras import with_words
from clfractal.scene.named_files import grid_files, light_files, texture_files
from clfractal.scene.objects import FormulaObject, Objects, ball_around
from clfractal.scene.parts import AnyCamera, Background, Camera, Image, Material, Output
from clfractal.scene.reads import Reads, is_data, is_table, section_of
from clfractal.scene.renderer import Renderer
from clfractal.scene.set_ball import ball_of_grid, ball_of_set
from clfractal.scene.stance import Extent, Framed
from clfractal.scene.stereo import Stereo
from clfractal.scene.surface import SurfaceRenderer
from clfractal.scene.volume import VolumeRenderer
from clfractal.schema.base import Section, Vector, own_errors
from clfractal.schema.shape import Joined

if TYPE_CHECKING:
    from clfractal.formulas.language import Chain
    from clfractal.scene.environment import EnvironmentMap
    from clfractal.scene.given import GivenGrid
    from clfractal.scene.light_tables import LightTable
    from clfractal.scene.named_files import Key
    from clfractal.scene.textures import Texture


T = TypeVar("T")
# The files that data were read from, by the names of the data.
_NAMED: Mapping[str, Callable[[Any], Mapping[Any, str]]] = {
    "textures": texture_files,
    "light_tables": light_files,
    "grids": grid_files,
}
# In a validator's context: sections are replaced one by one, and cameras get their places when all have been.
_PART = "part"


class Scene(Section):
    """A picture to be made: a formula, a camera, a renderer and everything else that determines the pixels."""

    # Else pydantic would not check single values of a copy; setting them is refused by every section.
    model_config = ConfigDict(frozen=False)

    version: Literal[1] = Field(description="version of this schema")
    formula: Formula
    camera: Camera
    deep: Deep | None = Field(
        None, description="a place of the formula's space that is shown magnified; null: the space itself"
    )
    # Defaults are data, checked when used: an instance here would build its model on import.
    image: Image = Field(default_factory=dict, validate_default=True)
    renderer: Renderer = Field(default_factory=dict, validate_default=True)
    lighting: Lighting = Field(default_factory=dict, validate_default=True)
    lights: Lights = Field(default_factory=lambda: [{}], validate_default=True)
    materials: Materials = Field(
        {}, description="materials by name, for objects, and for the set with `lighting: {mode: path}`"
    )
    material: Material = Field(default_factory=dict, validate_default=True)
    coloring: Coloring = Field(default_factory=dict, validate_default=True)
    background: Background = Field(default_factory=dict, validate_default=True)
    environment: Environment | None = None
    fog: Fog | None = None
    glow: Glow | None = None
    mist: Mist | None = None
    objects: Objects = Field({}, description="shapes, water, formulas and volumes by name")
    cut_planes: CutPlanes = Field(
        (), description="planes that are shown in the picture or cut the object open"
    )
    layout: Layout | None = Field(None, description="several views in one picture; null: one view")
    stereo: Stereo | None = Field(None, description="a pair of pictures for two eyes; null: one picture")
    output: Output = Field(default_factory=dict, validate_default=True)
    animation: Animation | None = Field(
        None, description="values that change from frame to frame of a film; null: a still"
    )
    bookmarks: Bookmarks = Field(
        {},
        description="cameras kept under names, {camera, deep} in a place of any depth; they do not change the picture",
    )

    # Not fields: they are not part of the scene's values, and not compared.
    _folder: Path = PrivateAttr(default_factory=Path)
    _read: dict[str, Any] = PrivateAttr(default_factory=dict)
    _files: tuple[Path, ...] = PrivateAttr(default=())
    _derived: dict[Callable[..., Any], tuple[dict[str, Any], Any]] = PrivateAttr(default_factory=dict)

    def __eq__(self, other: object) -> bool:
        """Whether both have equal values, wherever they were loaded from."""
        fields = type(self).model_fields
        return type(other) is type(self) and all(getattr(self, key) == getattr(other, key) for key in fields)

    __hash__ = Section.__hash__  # which a class with an __eq__ of its own does not inherit

    @model_validator(mode="after")
    def _frame_cameras(self, info: ValidationInfo) -> Self:
        """Cameras with a `frame` get their places, those of views and bookmarks too.

        What is shown may stand in a file: the context tells where that is looked for.
        """
        if info.context is not None:
            self._folder = info.context.get("folder", self._folder)
        if _PART not in (info.context or ()):
            self._frame()
        return self

    def _frame(self) -> None:
        views = self.layout.views if self.layout is not None else ()
        own = [view.camera for view in views if view.camera is not None]
        marked = [view_of(each)[0] for each in self.bookmarks.values()]
        if all(camera.frame is None for camera in (self.camera, *own, *marked)):
            return
        check_frames(self)
        try:
            seen = [view for view, _ in self.views] if self.layout is not None else []
            self._settle(camera=self._framed(self.camera))
            self._settle(bookmarks={name: self._framed_mark(each) for name, each in self.bookmarks.items()})
        except ClfractalError:
            return  # told by the checks that follow
        finally:
            self._read.pop("views", None)
        if self.layout is not None:
            # A view's scene has framed its camera already, for its own size.
            placed = [
                view if view.camera is None else view.model_copy(update={"camera": scene.camera})
                for view, scene in zip(views, seen, strict=True)
            ]
            self._settle(layout=self.layout.model_copy(update={"views": placed}))

    def _framed_mark(self, mark: Bookmark) -> Bookmark:
        camera, deep = view_of(mark)
        if camera.frame is None:
            return mark
        there = self if deep == self.deep else self.model_copy(update={"deep": deep, "bookmarks": {}})
        return bookmark(there._framed(camera), deep)

    def _framed(self, camera: AnyCamera) -> AnyCamera:
        if camera.frame is None:
            return camera
        shown = self.extent if camera.frame == "all" else self._seen_from(camera)
        return camera.framed(shown, self.image.width / self.image.height)

    def _seen_from(self, camera: AnyCamera) -> Framed:
        """What `frame: seen` frames; of clouds and flat pictures all that they can show."""
        renderer = self.renderer
        if isinstance(renderer, VolumeRenderer) and (
            renderer.file is not None or renderer.transfer.opacity is not None
        ):
            return self.extent
        if renderer.is_flat:
            return self.extent
        # Here, because NumPy takes long to import.
        from clfractal.scene.seen import Seen

        # On which side of floors one is, the camera says that shows all: before it is framed it may stand anywhere.
        eye = camera.framed(self.extent, self.image.width / self.image.height).position
        return Seen(self, eye, self.extent)

    @property
    def has_set(self) -> bool:
        """Whether rays look for a set: `formula: none` has none, but for formulas among its objects."""
        return not self.chain.alone or any(isinstance(each, FormulaObject) for each in self.objects.values())

    @property
    def bounds(self) -> tuple[Vector, float]:
        """Centre and radius of the ball that is searched, scene units: the renderer's, or the formula's own."""
        own = self.renderer.bounds if isinstance(self.renderer, SurfaceRenderer) else None
        return (own.center, own.radius) if own is not None else self.formula_bounds

    @property
    def formula_bounds(self) -> tuple[Vector, float]:
        """Centre and radius of the ball that holds the set, as formulas and objects say, scene units.

        Of objects alone it is the ball around those that have an end.
        """
        if not self.has_set:
            return ball_around(self.objects.values(), lambda each: ball_of_grid(each, self.grids[each.file]))
        chain = self.chain
        own = (chain.center, chain.radius)
        if self.deep is not None:
            own = self.deep.searched(own, chain.own_radius)
        return ball_of_set(own, self.joined, self.joined_chains, alone=chain.alone)

    @property
    def joined(self) -> "Mapping[str, Joined]":
        """The objects that are parts of the set, in their order.

        Surfaces have those here that their rays march to: formulas, and what is not only beside the set. In volumes and
        on planes all are parts of it.
        """
        filled = not isinstance(self.renderer, SurfaceRenderer)
        return {
            name: each
            for name, each in self.objects.items()
            if isinstance(each, Joined)
            and (filled or each.join != "union" or isinstance(each, FormulaObject))
        }

    @property
    def extent(self) -> Extent:
        """All that a picture can show of the object: the bounds, or the box of a volume that has its own.

        Raises:
            FormulaError, FileError, SceneError: what it follows from is wrong; the path says where.
        """
        renderer = self.renderer
        if isinstance(renderer, VolumeRenderer):
            given = self.given
            if given is not None:
                return given.place.extent
            if renderer.box is not None:
                return Extent.box(renderer.box.center, renderer.box.sides)
        return Extent(*self.bounds) if self.deep is None else Extent((0.0, 0.0, 0.0), self.size)

    @property
    def folder(self) -> Path:
        """Where the environment's file is looked for: the folder that the scene was loaded from, or the current one."""
        return self._folder

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that have been read for the scene: its own, and those that it names. No output replaces them."""
        return self._files

    def note_files(self, files: Iterable[Path]) -> None:
        """Adds to `files`."""
        self._files = tuple(dict.fromkeys((*self._files, *files)))

    def placed(self, folder: Path) -> Self:
        """The same scene, as loaded from another folder."""
        copied = super().model_copy()
        copied._folder = folder
        copied._read = {name: self._read[name] for name in ("chain", "joined_chains") if name in self._read}
        copied._derived = {}
        return copied

    def model_copy(self, *, update: Mapping[str, Any] | None = None, deep: bool = False) -> Self:
        """As for every section; only what is in `update` is checked, and the copy keeps the scene's folder.

        Files of sections that are not replaced are not read again: the copy keeps the checked data.
        """
        update = plain(update or {})
        if not update.keys() <= type(self).model_fields.keys():
            return super().model_copy(update=update)  # which refuses it
        copied = BaseModel.model_copy(self, deep=deep)
        copied._derived = dict(self._derived)
        copied._read = {
            name: found
            for name, found in self._read.items()
            if is_data(name) and section_of(name) not in update
        }
        with own_errors(type(self)):
            for name in type(self).model_fields:
                if name in update:
                    self.__pydantic_validator__.validate_assignment(
                        copied, name, update[name], context={"folder": self._folder, _PART: True}
                    )
        copied._frame()
        # Other values of a section, as of each frame of a film, name the same files.
        for name, files in _NAMED.items():
            known = self._read.get(name)
            section = section_of(name)
            if (
                section in update
                and known is not None
                and files(getattr(copied, section)).keys() <= known.keys()
            ):
                copied._read[name] = known
        return copied

    def __getstate__(self) -> dict[Any, Any]:
        """A scene is sent with the data that were read for it, and without what follows from it."""
        state = super().__getstate__()
        private = dict(state["__pydantic_private__"] or {})
        private["_read"] = {name: found for name, found in self._read.items() if is_data(name)}
        private["_derived"] = {}
        return {**state, "__pydantic_private__": private}

    def once(self, name: str, read: Callable[[], T]) -> T:
        """The data kept under a name, which follow from the scene; they are made first if there are none."""
        if name not in self._read:
            with noting() as files:
                self._read[name] = read()
            self.note_files(files)
        return cast(T, self._read[name])

    def derived(self, make: "Callable[[Scene], T]") -> T:
        """What `make` gives, which looks at nothing but a scene: made anew only if a section has changed that it read.

        So a check that has passed passes in a copy, too, whose other sections have changed.
        """
        known, present = self._derived.get(make), self.__dict__
        if known is None or any(present[name] is not section for name, section in known[0].items()):
            read = _Reads(self)
            known = self._derived[make] = (read.sections, make(cast(Scene, read)))
        return cast(T, known[1])

    def read_by(self, make: "Callable[[Scene], Any]") -> Mapping[str, Any]:
        """The sections that `make` has read when it was `derived`."""
        return self._derived[make][0]

    def whole(self) -> Self:
        """The scene itself, for what may look at all of its sections."""
        return self

    def take_tables(self, other: Self) -> None:
        """Keeps the tables of another scene with the same tracks: their files need not be there."""
        self._read |= {name: found for name, found in other._read.items() if is_table(name)}

    @property
    def chain(self) -> "Chain":
        """The formula, ready to be evaluated or written as OpenCL.

        Raises:
            FormulaError: it is wrong; the path says where (a loaded scene's formula has been checked).
        """
        from clfractal.formulas import catalog

        where, deep = Where(path="formula"), self.deep
        chain = self.once("chain", lambda: catalog.resolve(self.formula.mapping(), None, where))
        return chain if deep is None else chain.placed(deep.place(self.formula.iterations))

    @property
    def size(self) -> float:
        """What lengths that nobody has said follow: the bounds' radius; of a place shown magnified the formula's own."""
        own = isinstance(self.renderer, SurfaceRenderer) and self.renderer.bounds is not None
        return self.bounds[1] if own or self.deep is None else self.chain.own_radius

    @property
    def carried(self) -> tuple[str, ...]:
        """The names of all numbers that the scene's formulas carry."""
        chains = (self.chain, *self.joined_chains.values())
        return tuple(dict.fromkeys(name for chain in chains for name in chain.carried))

    @property
    def joined_chains(self) -> "Mapping[str, Chain]":
        """The formulas of objects, by the objects' names.

        Raises:
            FormulaError: one is wrong; the path says where (a loaded scene's formulas have been checked).
        """
        from clfractal.formulas import catalog

        return self.once(
            "joined_chains",
            lambda: {
                name: catalog.resolve(each.formula.mapping(), None, Where(path=f"objects.{name}.formula"))
                for name, each in self.objects.items()
                if isinstance(each, FormulaObject)
            },
        )

    @property
    def surroundings(self) -> "EnvironmentMap | None":
        """The environment's map, or None; for a loaded scene the map's file has already been read and checked.

        Raises:
            SceneError, FileError: it is missing or wrong; the path says where.
        """
        environment = self.environment
        if environment is None:
            return None
        from clfractal.scene.environment import read_map

        return self.once("surroundings", lambda: read_map(environment, self.folder))

    @property
    def textures(self) -> "Mapping[str, Texture]":
        """The pictures that materials show, by the names of their files; in a loaded scene they have been read and checked.

        Raises:
            FileError: a file is missing or no picture; the path says where it is named.
        """
        if not self.materials:
            return {}
        from clfractal.scene.textures import read_textures

        return self.once("textures", lambda: read_textures(self.materials, self.folder))

    @property
    def light_tables(self) -> "Mapping[Key, LightTable]":
        """What lights have read of files, by their kinds and the files' names; in a loaded scene it has been checked.

        Raises:
            FileError: a file is missing or wrong; the path says where it is named.
        """
        if not any(light.reads for light in self.lights):
            return {}
        from clfractal.scene.light_tables import read_light_tables

        return self.once("light_tables", lambda: read_light_tables(self.lights, self.folder))

    @property
    def grids(self) -> "Mapping[str, GivenGrid]":
        """The grids of objects that are volumes, by the names of their files; in a loaded scene they have been checked.

        Raises:
            FileError: a file is missing or no grid; the path says where it is named.
            SceneError: they have too many values.
        """
        from clfractal.scene.object_grids import read_grids

        if not grid_files(self.objects):
            return {}
        return self.once("grids", lambda: read_grids(self.objects, self.folder))

    @property
    def given(self) -> "GivenGrid | None":
        """The grid that a volume scene shows instead of its formula; in a loaded scene it has been read and checked.

        Raises:
            FileError: its file is missing or wrong; the path says where.
            SceneError: the renderer's level is beyond its values.
        """
        renderer = self.renderer
        if not isinstance(renderer, VolumeRenderer) or renderer.file is None:
            return None
        from clfractal.scene.given import read_grid

        file, where = renderer.file, Where(path="renderer.file")
        given = self.once("given", lambda: read_grid(file, self.folder, where, renderer.box))
        renderer.check_level(given.low, given.high)
        return given

    @property
    def views(self) -> "list[tuple[Scene, Place]]":
        """The views of the layout, each a scene of its own, and their places in the picture.

        Raises:
            SceneError: a view does not fit into the picture.
        """
        return self.once("views", self._find_views)

    def _find_views(self) -> "list[tuple[Scene, Place]]":
        assert self.layout is not None
        found = []
        places = self.layout.places(self.image.width, self.image.height, self.image.reference)
        for number, (view, place) in enumerate(zip(self.layout.views, places, strict=True)):
            if place.width < 1 or place.height < 1:
                raise SceneError(
                    f"does not fit into a picture of {self.image.width} x {self.image.height} pixels",
                    Where(path=f"layout.views.{number}"),
                )
            own: dict[str, object] = {"image": self.image.part(place.width, place.height), "layout": None}
            if isinstance(view.renderer, CutPlaneRenderer):
                # The scene's planes belong to pictures of its set; a cut_plane renderer shows none. Nor has it water.
                objects = {name: each for name, each in self.objects.items() if isinstance(each, Joined)}
                own |= {"cut_planes": (), "objects": objects}
            found.append((self.model_copy(update={**own, **view.changes()}), place))
        return found

    @property
    def surface(self) -> SurfaceRenderer:
        """The surface renderer's settings; the scene must have this renderer."""
        assert isinstance(self.renderer, SurfaceRenderer)
        return self.renderer

    @property
    def hit_detail(self) -> float:
        """The distance that counts as a hit, in footprints of the reference; the scene must have the surface renderer."""
        along_paths = self.lighting.detail if isinstance(self.lighting, PathLighting) else 1.0
        return self.surface.detail * along_paths

    def resolved(self) -> dict[str, Any]:
        """Plain data (as for YAML or JSON) with every default filled in; it loads back to an equal scene."""
        plain: dict[str, Any] = self.model_dump(mode="json")
        plain["formula"] = self.formula.mapping()
        for name, each in self.objects.items():
            if isinstance(each, FormulaObject):
                plain["objects"][name]["formula"] = each.formula.mapping()
        if self.animation is not None:
            with_words(plain, self, self.animation.tracks)
        return plain


class _Reads(Reads):
    model_fields = Scene.model_fields
