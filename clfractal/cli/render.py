"""`clfractal render`: from a scene file to finished pictures, resumable after any interruption."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from clfractal.cli.engines import drivers_ahead, engine_of, shares_of
from clfractal.cli.import_scene import tell_left
from clfractal.cli.order import Order as Order
from clfractal.cli.order import naming_options
from clfractal.cli.pipes import STREAM, is_stream, piped
from clfractal.cli.progress import Reporter
from clfractal.cli.shell import OUTPUT, Shell
from clfractal.errors import ClfractalError, FileError, SceneError, Where, speaking_of
from clfractal.files.atomic import check_output
from clfractal.files.inputs import refuse_overwriting
from clfractal.scene.load import SceneText, load_scene, read_scene, sized
from clfractal.scene.model import Scene
from clfractal.scene.surface import SurfaceRenderer

if TYPE_CHECKING:
    from clfractal.engine.any_engine import AnyEngine


def render_scene(order: Order, shell: Shell) -> None:
    """Renders a scene to all outputs of an order; `-` is standard input and output.

    Raises:
        ClfractalError: see `render_files`, and `pipes.piped`.
    """
    outputs = order.outputs
    if not outputs:
        if order.scene == STREAM:
            raise FileError("is needed where the scene comes from standard input", Where("-o"))
        outputs = (Path(Path(order.scene).with_suffix(".png").name),)
    if order.resume and all(map(is_stream, outputs)):
        raise FileError("needs an output file, beside which unfinished work is kept", Where("--resume"))
    stats = () if order.stats is None else ((order.stats, ".json"),)
    with piped(shell, order.scene, [*((path, ".png") for path in outputs), *stats]) as files:
        named = replace(
            order,
            scene=files.source,
            folder=files.folder,
            outputs=files.outputs[: len(outputs)],
            stats=files.outputs[-1] if stats else None,
            streamed=files.streamed,
        )
        render_files(named, shell)


def render_files(order: Order, shell: Shell) -> None:
    """Renders a scene to all outputs of an order, which are files.

    Raises:
        ClfractalError: anything wrong with the input, the files or the device. Finished work stays in
            the first output's `.partial` file, or in several such files if the picture has several views.
    """
    start = time.perf_counter()
    region = _region(order.region)
    scene = ordered_scene(order)
    drivers_ahead(order)
    check_outputs(order, scene, region)
    tell_reference(order, scene, shell)
    tell_left(order.scene, shell)
    with engine_of(order, shell) as engine:
        _render(order, shell, engine, scene, region, start)


def _render(
    order: Order,
    shell: Shell,
    engine: AnyEngine,
    scene: Scene,
    region: tuple[int, int, int, int] | None,
    start: float,
) -> None:
    """Renders a scene that was checked; `start` is when the command began, by `time.perf_counter`."""
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.cli.unfinished import Unfinished, continued
    from clfractal.engine import stats
    from clfractal.engine.finish import save_job
    from clfractal.engine.remarks import remarks_of
    from clfractal.engine.run import run
    from clfractal.images.outputs import output_files

    with speaking_of(order.scene), naming_options():
        job = engine.prepare(scene, region=region, samples=order.samples, precision=order.precision)
    if job.remark:
        shell.say(f"{order.scene}: {job.remark}")
    if order.resume:
        job = continued(job, _beside(order))
    header = job.header()
    with Unfinished(job, header, _beside(order), shell, resume=order.resume) as unfinished:
        reporter = Reporter(shell, job.tiles)
        if _beside(order) != order.streamed:  # of a temporary file nothing stays
            shell.state = unfinished.interrupted
        try:
            state = run(job, unfinished.framebuffers, engine.executor, progress=reporter)
        finally:
            reporter.close()
        rendered = time.perf_counter()
        save_job(job, unfinished.framebuffers, order.outputs, header)
        written = time.perf_counter()
        comfort = None
        if job.scene.stereo is not None:  # asked here, so that other scenes do not load what measures it
            from clfractal.engine.comfort import comfort_of_job

            comfort = comfort_of_job(job, unfinished.framebuffers, engine.preview)
        remarks = remarks_of(job, state, unfinished.framebuffers, comfort)
    shell.state = lambda: "clfractal: interrupted"
    values = stats.statistics(
        job,
        state,
        wall_ms=1e3 * (written - start),
        write_ms=1e3 * (written - rendered),
        previews_built_ms=engine.previews_built_ms,
        comfort=comfort,
        remarks=remarks,
    )
    shares = shares_of(engine)
    if shares is not None:
        values["workers"] = shares
    if order.stats is not None:
        stats.write_statistics(order.stats, values)
    files = [file for path in order.outputs for file in output_files(job.scene.stereo, path)]
    shell.say(f"{', '.join(map(str, files))}: {reporter.summary(state, written - start)}")
    for remark in remarks:
        if remark != job.remark:
            shell.say(f"{order.scene}: {remark}")
    if shell.verbose:
        shell.say(stats.sentence(values))
        if comfort is not None:
            shell.say(comfort.sentence())


def ordered_scene(order: Order) -> Scene:
    """The scene with the options folded in; errors name the option that was given."""
    given: dict[str, tuple[str, str]] = {}  # key -> option, value
    source: Path | SceneText = Path(order.scene)
    if order.size is not None:
        width, height = numbers_of("--size", order.size, "x", 2, "WIDTHxHEIGHT, such as 1920x1080")
        source = read_scene(Path(order.scene))
        values = sized(source, order.overrides, (width, height))
        given |= {key: ("--size", value) for key, value in values.items()}
    options = (
        ("renderer.samples", "--samples", order.samples),
        ("renderer.precision", "--precision", order.precision),
        ("output.denoise", "--denoise", order.denoise or None),
    )
    given |= {key: (option, json.dumps(value)) for key, option, value in options if value is not None}
    overrides = [*order.overrides, *(f"{key}={value}" for key, (_, value) in given.items())]
    try:
        scene = load_scene(source, overrides=overrides, folder=order.folder)
    except ClfractalError as error:
        where = error.where
        key = (where.file or "").removeprefix("--set ")
        if order.size is not None and where.path == "image":  # its pixels are too many together
            raise SceneError(error.message, Where("--size")) from error
        if key == where.file or key not in given:
            raise
        raise type(error)(error.message, replace(where, file=given[key][0])) from error
    if order.quality is None:
        return scene
    from clfractal.engine.quality import with_quality

    # What is said in so many words wins over the preset.
    kept = [text.partition("=")[0].strip() for text in overrides]
    with naming_options():
        return with_quality(scene, order.quality, kept=kept)


def tell_reference(order: Order, scene: Scene, shell: Shell) -> None:
    """Says that a height that was set is another picture's, where it is what colours and light are made for."""
    keys = {text.partition("=")[0].strip() for text in order.overrides}
    views = [scene] if scene.layout is None else [view for view, _ in scene.views]
    shows = any(isinstance(view.renderer, SurfaceRenderer) for view in views)
    if shows and scene.image.reference_height is None and keys & {"image", "image.height"}:
        shell.say(
            f"{order.scene}: image.height is also what the fineness of colours, normals and light is measured by;"
            " --size renders the same picture at another size"
        )


def _beside(order: Order) -> Path:
    """The output beside which unfinished work is kept: the first that is a file of the user's."""
    return next((path for path in order.outputs if path != order.streamed), order.outputs[0])


def _region(text: str | None) -> tuple[int, int, int, int] | None:
    if text is None:
        return None
    x, y, width, height = numbers_of("--region", text, ",", 4, "X,Y,WIDTH,HEIGHT, such as 0,0,640,480")
    return x, y, width, height


def numbers_of(option: str, text: str, separator: str, count: int, form: str) -> list[int]:
    """The whole numbers of an option's value.

    Raises:
        SceneError: it does not have this form.
    """
    parts = text.lower().split(separator)
    try:
        if len(parts) == count and len(text) <= 100:
            return [int(part) for part in parts]
    except ValueError:
        pass
    raise SceneError(f"must be {form}; got {text[:60]!r}", Where(option))


def check_outputs(order: Order, scene: Scene, region: tuple[int, int, int, int] | None = None) -> None:
    """Checks all files that will be written before anything is rendered.

    Raises:
        FileError: one cannot be written, or would replace a file that is read.
    """
    from clfractal.cli.unfinished import possible_paths
    from clfractal.images.formats import Content
    from clfractal.images.formats import check_output as check_picture
    from clfractal.images.outputs import output_files

    if order.streamed in order.outputs and len(output_files(scene.stereo, order.streamed)) > 1:
        raise FileError("takes one file, but a pair is two; name a file", Where(OUTPUT))
    files = [file for path in order.outputs for file in output_files(scene.stereo, path)]
    content = Content.of(scene, region)
    for file in files:
        check_picture(file, content)
    if order.stats is not None:
        check_output(order.stats, (order.stats.suffix.lower(),))
        files.append(order.stats)
    refuse_overwriting([*files, *possible_paths(scene, _beside(order))], scene.files)
