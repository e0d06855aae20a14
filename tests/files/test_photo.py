"""JPEG and WebP files, read back with Pillow."""

from __future__ import annotations

import io
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image, ImageCms

from clfractal.errors import FileError
from clfractal.files import embedded, photo
from clfractal.files.photo import MOST_PIXELS, Format, read_scene_text, read_texts, write_photo
from clfractal.files.srgb import codes, encode, encode8

SCENE = 'version: 1\nformula: {name: hast}  # <a> & "b" ]]>\n# Grüße, 分形 🌀\n\ttab\n'
TEXTS = {"Software": "clfractal 0.1.0", "clfractal": SCENE, "clfractalDevice": "PoCL", "clfractalTone": "agx"}
FORMATS: tuple[Format, ...] = ("JPEG", "WEBP")

Floats = npt.NDArray[np.float32]


def smooth(height: int, width: int) -> Floats:
    """Colours as pictures have them: slow changes, and an edge."""
    down, across = np.mgrid[:height, :width] / max(height, width)
    found = np.stack([across, down, 0.5 + 0.4 * np.sin(7 * across)], axis=-1)
    found[height // 2 :, : width // 3] = [0.9, 0.2, 0.05]
    return found.astype(np.float32)


def write(
    path: Path,
    pixels: Floats,
    format: Format,
    quality: int = 90,
    texts: dict[str, str] | None = None,
    origin: tuple[int, int] = (0, 0),
) -> Path:
    height, width, components = pixels.shape
    write_photo(
        path,
        (pixels[first : first + 32] for first in range(0, height, 32)),
        format=format,
        width=width,
        height=height,
        quality=quality,
        alpha=components == 4,
        texts=texts,
        origin=origin,
    )
    return path


def read(path: Path) -> npt.NDArray[np.uint8]:
    with Image.open(path) as image:
        return np.asarray(image)


@pytest.mark.parametrize("format", FORMATS)
def test_the_picture_is_there(tmp_path: Path, format: Format) -> None:
    pixels = smooth(70, 93)
    path = write(tmp_path / "a", pixels, format)
    with Image.open(path) as image:
        assert (image.format, image.mode, image.size) == (format, "RGB", (93, 70))
        if format == "JPEG":  # colours at full resolution: each component one block a cell
            assert [layer[1:3] for layer in getattr(image, "layer", ())] == [(1, 1)] * 3
    wanted = encode(pixels.astype(np.float64)) * 255
    assert np.abs(read(path) - wanted).mean() < (1.5 if format == "JPEG" else 2.5)


@pytest.mark.parametrize("alpha", [False, True])
def test_a_lossless_webp_holds_the_codes_of_a_png(tmp_path: Path, alpha: bool) -> None:
    pixels = np.random.default_rng(1).random((41, 67, 4 if alpha else 3), dtype=np.float32)
    if alpha:
        pixels[:9, :, 3] = 0
    path = write(tmp_path / "a.webp", pixels, "WEBP", photo.LOSSLESS, origin=(5, 3))
    np.testing.assert_array_equal(read(path), codes(pixels, 8, alpha=alpha, origin=(5, 3)))
    if not alpha:
        np.testing.assert_array_equal(read(path), encode8(pixels, origin=(5, 3)))


def test_a_lossy_webp_has_coverage(tmp_path: Path) -> None:
    pixels = np.concatenate([smooth(64, 64), np.full((64, 64, 1), 0.5, np.float32)], axis=-1)
    pixels[:, :32, 3] = 0
    found = read(write(tmp_path / "a.webp", pixels, "WEBP"))
    assert found.shape == (64, 64, 4)
    np.testing.assert_array_equal(found[..., 3], codes(pixels, 8, alpha=True)[..., 3])


@pytest.mark.parametrize("format", FORMATS)
def test_quality(tmp_path: Path, format: Format) -> None:
    """More of it: a larger file that is nearer to the picture."""
    pixels = np.clip(smooth(96, 96) + np.random.default_rng(2).normal(0, 0.05, (96, 96, 3)), 0, 1).astype(
        np.float32
    )
    wanted = encode8(pixels).astype(float)
    paths = [write(tmp_path / str(quality), pixels, format, quality) for quality in (10, 50, 90, 99)]
    sizes = [path.stat().st_size for path in paths]
    wrong = [np.abs(read(path) - wanted).mean() for path in paths]
    assert sizes == sorted(sizes)
    assert wrong == sorted(wrong, reverse=True)
    assert sizes[-1] > 3 * sizes[0]


@pytest.mark.parametrize("format", FORMATS)
def test_it_is_tagged_as_srgb_and_the_same_every_time(tmp_path: Path, format: Format) -> None:
    path = write(tmp_path / "a", smooth(40, 40), format, texts=TEXTS)
    with Image.open(path) as image:
        profile = ImageCms.ImageCmsProfile(io.BytesIO(image.info["icc_profile"]))
    assert "sRGB" in (profile.profile.profile_description or "")
    photo._profile.cache_clear()
    again = write(tmp_path / "b", smooth(40, 40), format, texts=TEXTS)
    assert path.read_bytes() == again.read_bytes()


@pytest.mark.parametrize("format", FORMATS)
def test_texts_come_back(tmp_path: Path, format: Format) -> None:
    path = write(tmp_path / "a", smooth(40, 40), format, texts=TEXTS)
    assert read_texts(path) == TEXTS
    assert read_scene_text(path) == embedded.read_scene_text(path) == SCENE
    assert embedded.is_picture(path)
    assert read_scene_text(write(tmp_path / "b", smooth(8, 8), format)) is None


@pytest.mark.parametrize("format", FORMATS)
def test_other_readers_of_xmp_find_it(tmp_path: Path, format: Format) -> None:
    """Pillow's, which knows nothing of this program."""
    path = write(tmp_path / "a", smooth(40, 40), format, texts=TEXTS)
    with Image.open(path) as image:
        packet = image.info["xmp"]
    (described,) = ElementTree.fromstring(packet)[0]
    found = {element.tag.partition("}")[2]: element.text for element in described}
    assert found == {"CreatorTool": "clfractal 0.1.0", "scene": SCENE, "device": "PoCL", "tone": "agx"}


@pytest.mark.parametrize("format", FORMATS)
@pytest.mark.parametrize("size", [65_300, 65_600, 300_000])
def test_a_long_scene(tmp_path: Path, format: Format, size: int) -> None:
    """Longer than a segment of a JPEG: in an extended packet."""
    scene = "".join(f"# {number:06} ü\n" for number in range(size // 12))
    path = write(tmp_path / "a", smooth(16, 16), format, texts={**TEXTS, "clfractal": scene})
    assert read_texts(path) == {**TEXTS, "clfractal": scene}
    with Image.open(path) as image:
        image.load()
    if format == "JPEG":
        data = bytearray(path.read_bytes())
        place = data.find(b"# 005", 30_000)
        data[place + 2] ^= 1
        path.write_bytes(data)
        if size > 100_000:
            with pytest.raises(FileError, match="is damaged: wrong check sum of its scene"):
                read_texts(path)


@pytest.mark.parametrize("format", FORMATS)
def test_the_longest_side(tmp_path: Path, format: Format) -> None:
    most = MOST_PIXELS[format]
    path = write(tmp_path / "a", np.zeros((1, most, 3), np.float32), format)
    with Image.open(path) as image:
        assert image.size == (most, 1)
    with pytest.raises(FileError, match="b: cannot be written: "):
        write(tmp_path / "b", np.zeros((most + 1, 1, 3), np.float32), format)
    assert [entry.name for entry in tmp_path.iterdir()] == ["a"]


def test_another_programs_packet(tmp_path: Path) -> None:
    """Properties as attributes, other namespaces, and a packet that is no XML."""
    space = photo._SPACES["clfractal"]
    packet = (
        f'<x:xmpmeta xmlns:x="adobe:ns:meta/"><r:RDF xmlns:r="{photo._SPACES["rdf"]}"><r:Description r:about=""'
        f' xmlns:c="{space}" c:scene="version: 1&#xA;a: &lt;b&gt;&#xA;" xmlns:d="http://purl.org/dc/elements/1.1/">'
        "<d:title>x</d:title></r:Description></r:RDF></x:xmpmeta>"
    )
    for name, data in (("a", packet), ("b", "<no xml"), ("c", '<!DOCTYPE a [<!ENTITY e "e">]>' + packet)):
        Image.new("RGB", (4, 4)).save(tmp_path / f"{name}.webp", xmp=data.encode())
    assert read_texts(tmp_path / "a.webp") == {"clfractal": "version: 1\na: <b>\n"}
    assert read_texts(tmp_path / "b.webp") == read_texts(tmp_path / "c.webp") == {}


def test_what_is_no_such_file(tmp_path: Path) -> None:
    (tmp_path / "a.jpg").write_bytes(b"version: 1\n" * 9)
    with pytest.raises(FileError, match=r"a\.jpg: is neither a JPEG nor a WebP file"):
        read_texts(tmp_path / "a.jpg")
    assert not embedded.is_picture(tmp_path / "a.jpg")
    with pytest.raises(FileError, match="cannot be read"):
        read_texts(tmp_path / "gone.jpg")
