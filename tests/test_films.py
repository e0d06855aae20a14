"""Films: what was written is decoded again, by FFmpeg's decoders and the inverse of BT.709 as it is defined."""

from __future__ import annotations

import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

import clfractal
from clfractal.files.film_kinds import CODECS, CONTAINERS, DEFAULTS, Recipe
from clfractal.files.moving import plan_film, write_film, ycbcr
from clfractal.files.png import read_form, write_png
from tests.calls import failure, raising
from tests.shell import InProcess, works

SIZE = (128, 96)
COLORS = [
    (255, 255, 255),
    (191, 191, 0),
    (0, 191, 191),
    (0, 191, 0),
    (191, 0, 191),
    (191, 0, 0),
    (0, 0, 191),
    (13, 13, 13),
]
SCENE = """version: 1
formula: {name: mandelbulb, iterations: 6}
image: {width: 64, height: 48}
camera: {position: [0, -3, 0]}
animation: {fps: 12, frames: 4, tracks: {camera.fov: {keys: [{frame: 0, value: 60}, {frame: 3, value: 30}]}}}
"""
FORMATS = [(name, bits, chroma) for name, codec in CODECS.items() for bits, chroma in codec.formats]


def bars() -> npt.NDArray[np.uint8]:
    picture = np.zeros((SIZE[1], SIZE[0], 3), np.uint8)
    for index, color in enumerate(COLORS):
        picture[:, 16 * index : 16 * (index + 1)] = color
    return picture


@pytest.fixture
def pictures(tmp_path: Path) -> list[Path]:
    found = [tmp_path / f"{number}.png" for number in range(6)]
    for path in found:
        Image.fromarray(bars()).save(path)
    return found


def decoded(path: Path) -> tuple[list[Any], Any, Fraction]:
    with av.open(str(path)) as file:
        stream = file.streams.video[0]
        frames = list(file.decode(stream))
        return frames, stream.codec_context, stream.average_rate or Fraction(0)


def plane(frame: Any, index: int) -> npt.NDArray[np.float64]:
    """A plane's numbers."""
    wide = frame.format.components[0].bits > 8
    part = frame.planes[index]
    rows = np.frombuffer(bytes(part), np.uint8).reshape(part.height, part.line_size)
    return rows.view("<u2" if wide else "u1")[:, : part.width].astype(np.float64)


def colors_of(frame: Any) -> npt.NDArray[np.float64]:
    """The colours in the middles of the bars, as codes of 8 bits."""
    name = frame.format.name
    if name.startswith(("bgr0", "gbrp")):
        rgb = frame.to_ndarray(format="rgb24")
        return np.array([rgb[48, 16 * i + 8] for i in range(8)], np.float64)
    scale = 2.0 ** (frame.format.components[0].bits - 8)
    luma, blue, red = (plane(frame, index) / scale for index in range(3))
    found = []
    for index in range(8):
        row, column = 48, 16 * index + 8
        ratio = (blue.shape[0] * row // SIZE[1], blue.shape[1] * column // SIZE[0])
        y = (luma[row, column] - 16) / 219
        cb, cr = (blue[ratio] - 128) / 224, (red[ratio] - 128) / 224
        r, b = y + 1.5748 * cr, y + 1.8556 * cb
        found.append((r, (y - 0.2126 * r - 0.0722 * b) / 0.7152, b))
    return 255 * np.array(found)


@pytest.mark.parametrize(("name", "bits", "chroma"), FORMATS)
def test_colour_bars_come_back(
    name: str, bits: int, chroma: str, pictures: list[Path], tmp_path: Path
) -> None:
    for suffix in CODECS[name].containers:
        path = tmp_path / f"film{suffix}"
        write_film(plan_film(path, Recipe(name, bits, chroma), SIZE, 25), pictures)
        frames, context, rate = decoded(path)
        assert len(frames) == 6
        assert rate == 25
        assert (frames[0].width, frames[0].height) == SIZE
        tags = (context.color_primaries, context.color_trc, context.colorspace, context.color_range)
        assert tags == ((1, 13, 0, 2) if chroma == "rgb" else (1, 13, 1, 1))
        for frame in (frames[0], frames[3], frames[-1]):
            worst = np.abs(colors_of(frame) - np.array(COLORS)).max()
            assert worst <= (0 if chroma == "rgb" and bits == 8 else 2), (suffix, worst)


@pytest.mark.parametrize("suffix", DEFAULTS)
def test_what_is_chosen_by_the_name(suffix: str, tmp_path: Path) -> None:
    plan = plan_film(tmp_path / f"a{suffix}", Recipe(), SIZE, 24000 / 1001)
    assert plan.codec is CODECS[DEFAULTS[suffix]]
    assert (plan.bits, plan.chroma) == next(iter(plan.codec.formats))
    assert plan.fps == Fraction(24000, 1001)
    assert suffix in plan.codec.containers
    assert set(DEFAULTS) == set(CONTAINERS)


@pytest.mark.parametrize(("bits", "chroma"), [(8, "444"), (10, "444"), (10, "420"), (8, "422")])
def test_greys_have_no_colour_and_white_and_black_are_at_the_ends(bits: int, chroma: str) -> None:
    ramp = np.linspace(0, 65535, 64).astype(np.uint16)
    grey = np.repeat(np.repeat(ramp[None, :, None], 8, 0), 3, 2)
    luma, blue, red = ycbcr(grey, bits, chroma)
    scale = 2 ** (bits - 8)
    assert (blue == 128 * scale).all()
    assert (red == 128 * scale).all()
    assert luma.min() == 16 * scale
    assert luma.max() == 235 * scale
    assert (np.diff(luma[0].astype(int)) >= 0).all()


def test_chroma_lies_at_the_left_pixel() -> None:
    """A vertical edge between two bars, at an even and at an odd column."""
    picture = np.zeros((4, 16, 3), np.uint16)
    picture[:, 8:, 2] = 65535
    blue = ycbcr(picture, 8, "420")[1][0].astype(int)
    assert list(blue) == [128, 128, 128, 128, 128 + round(112 * 0.75), 240, 240, 240]


def test_a_film_from_the_shell(clf: InProcess) -> None:
    ended = clf(
        "animate", "scene.yaml", "-o", "film.mkv", "-o", "f#.png", "-o", "film.mp4", "--chroma", "rgb"
    )
    assert ended.is_one_line(2, "--chroma: does not fit: h264 has 420 with 8 bits")
    ended = works(clf("animate", "scene.yaml", "-o", "film.mkv", "-o", "f#.png", "-o", "film.mp4"))
    assert ended.err.splitlines()[-1].startswith("f0.png to f3.png, film.mkv, film.mp4: 4 frames, ")
    assert sorted(path.name for path in Path().iterdir()) == [
        *(f"f{i}.png" for i in range(4)),
        "film.mkv",
        "film.mp4",
        "scene.yaml",
    ]
    frames, _, rate = decoded(Path("film.mkv"))
    assert rate == 12
    for number, frame in enumerate(frames):
        shown = dict(clfractal.frames(SCENE, numbers=[number]))[number].to_rgb8()
        np.testing.assert_array_equal(frame.to_ndarray(format="rgb24"), shown)
        np.testing.assert_array_equal(np.asarray(Image.open(f"f{number}.png")), shown)


def interrupted(clf: InProcess, *options: str) -> None:
    """All frames are made, and the film is not."""

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("clfractal.files.moving._frame", raising(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            clf("animate", "scene.yaml", *options)


def test_a_film_that_was_interrupted_goes_on(clf: InProcess) -> None:
    interrupted(clf, "-o", "film.mov")
    assert sorted(path.name for path in Path("film.mov.partial").iterdir()) == [
        f"00000{i}.png" for i in range(4)
    ]
    assert not Path("film.mov").exists()
    Path("film.mov.partial/000002.png").unlink()
    ended = clf("animate", "scene.yaml", "-o", "film.mov", "--resume")
    assert "film.mov: 1 frames, 3 were there already" in ended.err
    assert len(decoded(Path("film.mov"))[0]) == 4
    assert sorted(path.name for path in Path().iterdir()) == ["film.mov", "scene.yaml"]
    # Without --resume earlier frames are discarded, but nothing else that lies there.
    Path("film.mov.partial").mkdir()
    Path("film.mov.partial/000000.png").write_bytes(b"old")
    Path("film.mov.partial/mine.txt").write_bytes(b"")
    assert clf("animate", "scene.yaml", "-o", "film.mov").status == 2
    assert Path("film.mov.partial/000000.png").exists()
    Path("film.mov.partial/mine.txt").unlink()
    works(clf("animate", "scene.yaml", "-o", "film.mov"))
    assert not Path("film.mov.partial").exists()


def test_a_film_of_8_bits_is_the_same_beside_others(clf: InProcess) -> None:
    """Its frames are dithered, as a picture's 8 bits are: not rounded from the 16 that another film needs."""
    scene = """version: 1
formula: {name: mandelbulb, iterations: 4}
image: {width: 48, height: 32}
camera: {position: [0, -3, 0.5]}
animation: {frames: 2, tracks: {camera.position.0: {expression: u}}}
"""
    Path("dim.yaml").write_text(scene)
    works(clf("animate", "dim.yaml", "-o", "alone.mkv", "-o", "p_#.png"))
    for others in (["a.mov"], ["b.mov", "c.mp4"]):
        order = ["animate", "dim.yaml", *(part for name in ("beside.mkv", *others) for part in ("-o", name))]
        works(clf(*order))
        assert not Path("beside.mkv.partial").exists()
        pairs = zip(decoded(Path("alone.mkv"))[0], decoded(Path("beside.mkv"))[0], strict=True)
        for number, (one, other) in enumerate(pairs):
            shown = one.to_ndarray(format="rgb24")
            np.testing.assert_array_equal(shown, other.to_ndarray(format="rgb24"))
            np.testing.assert_array_equal(shown, np.asarray(Image.open(f"p_{number}.png")))
        Path("beside.mkv").unlink()
    # A film that is interrupted between its kinds of frames goes on.
    Path("beside.mkv.partial").mkdir()
    Path("beside.mkv.partial/000001.8.png").write_bytes(Path("p_1.png").read_bytes()[:100])
    works(clf("animate", "dim.yaml", "-o", "beside.mkv", "-o", "a.mov", "--resume"))


REFUSED: dict[tuple[str, Recipe, tuple[int, int]], str] = {
    ("a.mp4", Recipe(), (127, 96)): "needs an even width and height with chroma 420, got 127 x 96",
    ("a.mov", Recipe(), (127, 95)): "needs an even width with chroma 422, got 127 x 95",
    ("a.mp4", Recipe("ffv1"), SIZE): "cannot hold ffv1; it goes into .mkv",
    ("a.mp4", Recipe("vp9"), SIZE): "must be h264, h265, av1, ffv1, prores, got 'vp9'",
    ("a.mp4", Recipe(bits=12), SIZE): "does not fit: h264 has 420 with 8 bits, 422 with 8 bits",
    ("a.mov", Recipe(chroma="420"), SIZE): "does not fit: prores has 422 with 10 bits, 444 with 10 bits",
    ("a.webm", Recipe(), SIZE): "unknown extension '.webm'",
    ("a.mp4", Recipe(quality=60), SIZE): "must be from 0 to 51 for h264, got 60",
    ("a.mkv", Recipe(quality=6), SIZE): "has no meaning for ffv1",
    ("a.gif", Recipe(), SIZE): "unknown extension '.gif'",
    ("none/a.mp4", Recipe(), SIZE): "there is no folder",
    ("a.mp4", Recipe(), (8, 8)): "cannot hold pictures of 8 x 8 pixels: 16 to 16,384",
    ("a.mp4", Recipe("h265"), (48, 48)): "cannot hold pictures of 48 x 48 pixels: 64 to 16,384",
}


@pytest.mark.parametrize("asked", REFUSED, ids=str)
def test_what_a_film_cannot_be(asked: tuple[str, Recipe, tuple[int, int]], tmp_path: Path) -> None:
    name, recipe, size = asked
    assert (
        REFUSED[asked]
        in failure(clfractal.ClfractalError, plan_film, tmp_path / name, recipe, size, 25).message
    )


def test_kept_frames_stay_where_an_order_is_wrong(clf: InProcess) -> None:
    Path("film.mp4.partial").mkdir()
    kept = Path("film.mp4.partial/000000.png")
    kept.write_bytes(b"hours of work")
    for wrong in (("--device", "nonsense"), ("-o", "none/f#.png"), ("-o", "film.mp4"), ("--crf", "99")):
        assert clf("animate", "scene.yaml", "-o", "film.mp4", *wrong).status in (2, 3)
        assert kept.read_bytes() == b"hours of work", wrong
    bad = SCENE.replace(
        "{frame: 0, value: 60}", "{frame: 0, value: 60}, {frame: 1, value: 500, interpolation: hold}"
    )
    Path("bad.yaml").write_text(bad)
    assert clf("animate", "bad.yaml", "-o", "film.mp4").status == 2
    assert kept.exists()


def test_a_film_leaves_other_pictures_as_they_are(clf: InProcess) -> None:
    Path("scene.yaml").write_text(SCENE + "output: {png_bits: 16}\n")
    works(clf("animate", "scene.yaml", "-o", "a#.png"))
    before = {path.name: path.read_bytes() for path in Path().glob("a*.png")}
    works(clf("animate", "scene.yaml", "-o", "a#.png", "-o", "film.mkv"))
    after = {path.name: path.read_bytes() for path in Path().glob("a*.png")}
    # All but the seconds in their headers.
    for name, data in after.items():
        assert abs(len(data) - len(before[name])) < 50
        assert data[24] == 16  # bits, in a PNG's first chunk
    assert clf("animate", "scene.yaml", "-o", "a#.png", "--resume").err.endswith("were there already\n")


def test_frames_of_another_part_stay(clf: InProcess) -> None:
    interrupted(clf, "-o", "film.mkv", "--frames", "0-1")
    works(clf("animate", "scene.yaml", "-o", "film.mkv", "--frames", "2-3", "--resume"))
    assert len(decoded(Path("film.mkv"))[0]) == 2
    assert sorted(path.name for path in Path("film.mkv.partial").iterdir()) == ["000000.png", "000001.png"]


@pytest.mark.parametrize("mode", ["pair", "multi_view"])
def test_two_pictures_are_no_film(mode: str, tmp_path: Path) -> None:
    with pytest.raises(clfractal.ClfractalError, match=r"choose another stereo\.mode, such as split"):
        plan_film(tmp_path / "a.mp4", Recipe(), SIZE, 25, stereo=mode)


def test_without_the_package_it_says_what_to_install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(
        clfractal.ClfractalError, match=r"needs the package av: pip install 'clfractal\[film\]'"
    ):
        plan_film(tmp_path / "a.mp4", Recipe(), SIZE, 25)


def test_a_picture_that_cannot_be_read_makes_no_film(pictures: list[Path], tmp_path: Path) -> None:
    pictures[2].write_bytes(b"nothing")
    path = tmp_path / "film.mp4"
    path.write_bytes(b"before")
    with pytest.raises(clfractal.ClfractalError, match=r"2\.png: cannot be read"):
        write_film(plan_film(path, Recipe(), SIZE, 25), pictures)
    Image.new("RGB", (64, 48)).save(pictures[2])
    with pytest.raises(clfractal.ClfractalError, match="is 64 x 48 pixels, and not as the film"):
        write_film(plan_film(path, Recipe(), SIZE, 25), pictures)
    assert path.read_bytes() == b"before"
    assert sorted(each.name for each in tmp_path.iterdir()) == [*(f"{i}.png" for i in range(6)), "film.mp4"]


# --- frames that are stored as the film needs them ---


def levels(path: Path) -> set[int]:
    """The codes of a film of 16 bits, in its first picture."""
    with av.open(str(path)) as file:
        frame = next(file.decode(video=0))
    assert frame.format.name == "gbrp16le"
    return set(np.frombuffer(bytes(frame.planes[0]), "<u2").tolist())


def test_frames_of_fewer_bits_are_made_again(clf: InProcess) -> None:
    interrupted(clf, "-o", "film.mkv")
    kept = sorted(Path("film.mkv.partial").iterdir())
    assert [read_form(path) for path in kept] == [(8, 3)] * 4
    ended = works(clf("animate", "scene.yaml", "-o", "film.mkv", "--bits", "16", "--resume"))
    assert "film.mkv: 4 frames, " in ended.err
    assert "there already" not in ended.err
    resumed = levels(Path("film.mkv"))
    assert any(code % 257 for code in resumed)  # more than 8 bits can tell
    Path("film.mkv").unlink()
    works(clf("animate", "scene.yaml", "-o", "film.mkv", "--bits", "16"))
    assert levels(Path("film.mkv")) == resumed


def test_frames_of_more_bits_too_and_those_that_fit_stay(clf: InProcess) -> None:
    """So a film has the same bits as one that was never interrupted: those of 8 bits are dithered."""
    interrupted(clf, "-o", "film.mkv", "--bits", "16")
    assert (
        "all 4 frames were there"
        in clf("animate", "scene.yaml", "-o", "film.mkv", "--bits", "16", "--resume").err
    )
    interrupted(clf, "-o", "film.mkv", "--bits", "16")
    ended = clf("animate", "scene.yaml", "-o", "film.mkv", "--resume")
    assert "there already" not in ended.err
    resumed = Path("film.mkv").read_bytes()
    Path("film.mkv").unlink()
    works(clf("animate", "scene.yaml", "-o", "film.mkv"))
    with av.open("film.mkv") as file:
        assert next(file.decode(video=0)).format.name == "bgr0"
    assert len(Path("film.mkv").read_bytes()) == len(resumed)


def test_a_numbered_picture_that_was_converted_is_made_again(clf: InProcess) -> None:
    works(clf("animate", "scene.yaml", "-o", "f#.png"))
    first = Path("f1.png")
    whole = first.read_bytes()
    with Image.open(first) as picture:
        scene = picture.text["clfractal"]  # type: ignore[attr-defined]
        light = (np.asarray(picture.convert("RGBA")) / np.float32(255)).astype(np.float32)
    write_png(first, [light], width=64, height=48, alpha=True, texts={"clfractal": scene})
    assert read_form(first) == (8, 4)
    ended = clf("animate", "scene.yaml", "-o", "f#.png", "--resume")
    assert "1 frames, 3 were there already" in ended.err
    assert read_form(first) == (8, 3)
    assert abs(len(first.read_bytes()) - len(whole)) < 50


def test_the_form_of_a_picture(tmp_path: Path) -> None:
    for mode, form in {"L": (8, 1), "LA": (8, 2), "RGB": (8, 3), "RGBA": (8, 4), "I;16": (16, 1)}.items():
        Image.new(mode, (3, 2)).save(tmp_path / "a.png")
        assert read_form(tmp_path / "a.png") == form
    (tmp_path / "b.png").write_bytes(b"\x89PNG\r\n\x1a\n")
    with pytest.raises(clfractal.FileError, match="is not a PNG file"):
        read_form(tmp_path / "b.png")
