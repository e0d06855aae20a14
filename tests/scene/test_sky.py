"""The physical sky against optics: what air lets through, its symmetry, its colours, and the energy of map and sun."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from clfractal.errors import SceneError
from clfractal.scene import atmosphere
from clfractal.scene.atmosphere import EARTH, TOP, WAVELENGTHS, Atmosphere, Doubles, rayleigh_depth
from clfractal.scene.lighting import Environment, Sky
from clfractal.scene.load import load_scene
from clfractal.scene.sky import HEIGHT, WIDTH, bake, pixel_areas, to_rgb
from clfractal.scene.sun import LIMB, Sun, sun_of
from tests.variants import one_of

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])
ROWS = np.pi / 2 - (np.arange(HEIGHT) + 0.5) * np.pi / HEIGHT
EYE = EARTH + 0.05  # of the map
RADIUS = np.radians(0.2665)  # of the sun
SUN_SOLID_ANGLE = 2 * np.pi * (1 - np.cos(RADIUS))


def light(elevation: float, *, turbidity: float = 3.0, azimuth: float = 0.0) -> Doubles:
    sky = Sky(sun_elevation=elevation, sun_azimuth=azimuth, turbidity=turbidity)
    return np.asarray(bake(sky), np.float64)


def sun_at(elevation: float, azimuth: float = 0.0, turbidity: float = 3.0) -> Sun:
    found = sun_of(Sky(sun_elevation=elevation, sun_azimuth=azimuth, turbidity=turbidity))
    assert found is not None
    return found


def row_at(degrees: float) -> int:
    return int(np.abs(ROWS - np.radians(degrees)).argmin())


# --- the air ---


@pytest.mark.parametrize("phase", [atmosphere.rayleigh_phase, atmosphere.aerosol_phase])
def test_scattering_loses_nothing(phase: object) -> None:
    nodes, weights = np.polynomial.legendre.leggauss(200)
    assert callable(phase)
    assert 2 * np.pi * (phase(nodes) @ weights) == pytest.approx(1, rel=1e-9)


@pytest.mark.parametrize("turbidity", [1.0, 3.0, 8.0])
def test_the_zenith_lets_through_what_beer_and_lambert_say(turbidity: float) -> None:
    """Densities are parts of the whole column, so that the exponent is the sum of the optical depths."""
    air = Atmosphere(turbidity)
    found = air.transmittance(np.array(EARTH), np.array(1.0))
    np.testing.assert_allclose(found, np.exp(-air.depths.sum(axis=0)), rtol=1e-3)
    middle = int(np.abs(WAVELENGTHS - 555).argmin())
    whole = air.depths[:2, middle].sum() / rayleigh_depth(WAVELENGTHS[middle] / 1000)
    assert whole == pytest.approx(turbidity, rel=0.04)  # defined at 550 nm


@pytest.mark.parametrize("degrees", [0, 1, 5, 20, 60])
def test_slant_columns_against_adaptive_quadrature(degrees: int) -> None:
    mu = mpmath.sin(mpmath.radians(degrees))
    end = -EARTH * mu + mpmath.sqrt(TOP**2 - EARTH**2 * (1 - mu**2))

    def molecules(along: mpmath.mpf) -> mpmath.mpf:
        height = mpmath.sqrt(EARTH**2 + along**2 + 2 * EARTH * along * mu) - EARTH
        return mpmath.exp(-height / 8)

    expected = mpmath.quad(molecules, mpmath.linspace(0, end, 20)) / (
        8 * (1 - mpmath.exp(-(TOP - EARTH) / 8))
    )
    found = atmosphere.columns(np.array(EARTH), np.array(float(mu)))
    assert found[0] == pytest.approx(float(expected), rel=1e-4)


def test_the_air_mass_of_kasten_and_young() -> None:
    """Applied Optics 28 (1989): 38 at the horizon, 10.3 at 5 degrees, for molecules in the standard atmosphere."""
    for degrees, expected, tolerance in (
        (0, 38.0, 0.08),
        (5, 10.31, 0.02),
        (20, 2.904, 0.01),
        (60, 1.154, 0.01),
    ):
        found = atmosphere.columns(np.array(EARTH), np.array(np.sin(np.radians(degrees))))[0]
        assert found == pytest.approx(expected, rel=tolerance)


# --- the map ---


@pytest.mark.parametrize(
    ("elevation", "turbidity"), one_of((0.0, 10.0), (-4.0, 1.0), (30.0, 10.0), (90.0, 1.0))
)
def test_light_is_finite_and_none_is_negative(elevation: float, turbidity: float) -> None:
    found = light(elevation, turbidity=turbidity)
    assert found.shape == (HEIGHT, WIDTH, 3)
    assert np.isfinite(found).all()
    assert found.min() >= 0
    assert (found[: HEIGHT // 2].max(axis=-1) > 0).all()
    disc = sun_at(elevation, turbidity=turbidity)
    numbers = np.array([disc.light, disc.fade, disc.bend, disc.irradiance])
    assert np.isfinite(numbers).all()
    assert (numbers[[0, 3]] >= 0).all()


@pytest.mark.parametrize("elevation", one_of(45.0, 10.0))
def test_both_sides_of_the_suns_meridian_are_alike(elevation: float) -> None:
    found = light(elevation)
    np.testing.assert_allclose(found, found[:, ::-1], rtol=2e-4, atol=1e-6)


def test_the_azimuth_turns_the_sky() -> None:
    """90 degrees are towards +x: a quarter of the map to the right of its middle."""
    turned = light(30.0, azimuth=90.0)
    np.testing.assert_allclose(turned, np.roll(light(30.0), WIDTH // 4, axis=1), rtol=1e-3, atol=1e-6)
    column = int((turned @ LUMINANCE).argmax()) % WIDTH
    assert abs(column + 0.5 - 0.75 * WIDTH) < 2
    np.testing.assert_allclose(sun_at(30.0, azimuth=90.0).toward, (np.sqrt(0.75), 0, 0.5), atol=1e-12)


@pytest.mark.parametrize(
    ("elevation", "turbidity"), one_of((45.0, 3.0), (20.0, 2.0), (20.0, 4.0), (45.0, 4.0))
)
def test_the_zenith_is_bluer_than_the_horizon(turbidity: float, elevation: float) -> None:
    found = light(elevation, turbidity=turbidity)
    away = found[row_at(1), 0]  # opposite to the sun
    assert found[0, 0, 2] / found[0, 0, 0] > 1.3 * away[2] / away[0]
    red, green, blue = found[0, 0]
    assert blue > green > red


def test_haze_whitens_the_sky() -> None:
    ratios = [light(45.0, turbidity=each)[0, 0] for each in (1.0, 3.0, 8.0)]
    blues = [each[2] / each[0] for each in ratios]
    assert blues == sorted(blues, reverse=True)


def test_a_low_sun_is_red() -> None:
    suns = [
        to_rgb(Atmosphere(3.0).transmittance(np.array(EARTH), np.sin(np.radians(each))))
        for each in (2, 10, 60)
    ]
    reds = [each[0] / each[1] for each in suns]
    assert reds[0] > 1.5 * reds[1] > 1.5 * reds[2]


# --- the sun ---


def around(sun: Sun, count: int = 400) -> tuple[Doubles, Doubles]:
    """Directions evenly spread over a cap of twice the sun's radius about it, and what each stands for, steradians."""
    cap = 1 - np.cos(2 * RADIUS)
    turns, drops = np.meshgrid(
        (np.arange(count) + 0.5) * 2 * np.pi / count, (np.arange(count) + 0.5) / count * cap
    )
    toward = np.array(sun.toward)
    side = np.cross(toward, np.eye(3)[np.abs(toward).argmin()])
    side /= np.linalg.norm(side)
    reach = np.sqrt(drops * (2 - drops))
    axes = np.stack([side, np.cross(toward, side), toward])
    places = np.stack([reach * np.cos(turns), reach * np.sin(turns), 1 - drops], axis=-1)
    return places @ axes, np.full(drops.shape, 2 * np.pi * cap / drops.size)


def shown(elevation: float) -> Doubles:
    """What its disc brings to a surface that faces it, by quadrature over the directions."""
    sun = sun_at(elevation)
    directions, areas = around(sun)
    found: Doubles = np.einsum("rc,rck->k", areas, sun.radiance(directions))
    return found


def sunlight(elevation: float) -> Doubles:
    """By Beer and Lambert's law, at the middle of the disc."""
    mu = np.array(np.sin(np.radians(elevation)))
    return np.maximum(to_rgb(Atmosphere(3.0).transmittance(np.array(EYE), mu)), 0)


@pytest.mark.parametrize("elevation", [3.0, 45.0, 89.9, 90.0])
def test_the_disc_brings_what_the_air_leaves_of_sunlight(elevation: float) -> None:
    np.testing.assert_allclose(shown(elevation), sunlight(elevation), rtol=0.012, atol=1e-4)
    np.testing.assert_allclose(sun_at(elevation).irradiance, sunlight(elevation), rtol=0.012, atol=1e-4)


@pytest.mark.parametrize("elevation", [-0.2, 0.0, 0.7, 3.0, 12.0])
def test_what_it_shows_is_what_it_brings(elevation: float) -> None:
    """Where the air's light differs from rim to rim, too, and where the ground hides a part."""
    np.testing.assert_allclose(shown(elevation), sun_at(elevation).irradiance, rtol=0.01, atol=1e-12)


def test_a_sun_that_rises() -> None:
    """Its lower rim is below the horizon, and all of it is darker than its upper rim."""
    assert 0 < shown(0.1)[0] < sunlight(0.1 + 0.2665)[0]
    assert (shown(-1.0) == 0).all()
    assert sun_at(-1.0).irradiance == (0, 0, 0)


def test_its_upper_rim_is_less_red() -> None:
    """Each place of the disc by the law at its own height, where the surface is seen from straight above."""
    low = sun_at(2.0)
    heights = np.linspace(-0.8, 0.8, 9)
    angles = np.radians(2.0) + heights * RADIUS
    found = low.radiance(np.stack([0 * angles, np.cos(angles), np.sin(angles)], axis=-1))
    left = np.stack([sunlight(each) for each in np.degrees(angles)])
    limb = (1 - heights[:, None] ** 2) ** (np.array(LIMB) / 2) * (1 + np.array(LIMB) / 2)
    expected = left * limb / SUN_SOLID_ANGLE
    np.testing.assert_allclose(found[:, :2], expected[:, :2], rtol=0.02)
    assert (np.diff(found[:, 1] / found[:, 0]) > 0).all()


def test_the_sun_is_as_large_as_it_is() -> None:
    """A circle of 0.533 degrees, by the law of limb darkening at 550 nm (0.40 of the middle's light at 0.98 radii)."""
    sun = sun_at(45.0)
    directions, areas = around(sun)
    luminance = sun.radiance(directions) @ LUMINANCE
    assert areas[luminance > 0].sum() == pytest.approx(SUN_SOLID_ANGLE, rel=0.01)
    angle = np.arccos(np.clip(directions @ np.array(sun.toward), -1, 1))
    assert angle[luminance > 0].max() == pytest.approx(RADIUS, rel=0.01)
    near = np.abs(angle / RADIUS - 0.98) < 0.005
    assert luminance[near].mean() / luminance.max() == pytest.approx(0.44, abs=0.03)


def test_the_scale() -> None:
    """A white level surface in the default sky has a luminance of 1."""
    assert level_light(45.0) / np.pi == pytest.approx(1, rel=0.01)


def level_light(elevation: float, turbidity: float = 3.0, *, of_sun: bool = True) -> float:
    """The luminance times pi that a white level surface has."""
    weights = pixel_areas() * np.maximum(np.sin(ROWS), 0)
    found = float((light(elevation, turbidity=turbidity) @ LUMINANCE).sum(axis=1) @ weights)
    if of_sun:
        sun = sun_at(elevation, turbidity=turbidity)
        found += max(sun.toward[2], 0.0) * float(LUMINANCE @ sun.irradiance)
    return found


def test_the_suns_and_the_skys_parts() -> None:
    """CIE S 011 and measurements: at 60 degrees a clear sky gives some 10 to 20 % of the light on level ground."""
    assert 0.1 < level_light(60.0, 2.0, of_sun=False) / level_light(60.0, 2.0) < 0.2


def test_the_ground_has_its_colour() -> None:
    """Straight below there are only 50 m of air: Lambert's law under the irradiance of sun and sky."""
    sky = Sky(ground_color=(0.5, 0.1, 0.2))
    found = np.asarray(bake(sky), np.float64)
    weights = pixel_areas() * np.maximum(np.sin(ROWS), 0)
    sun = sun_of(sky)
    assert sun is not None
    irradiance = np.einsum("rck,r->k", found, weights) + sun.toward[2] * np.array(sun.irradiance)
    np.testing.assert_allclose(
        found[-1, 0], np.array(sky.ground_color) * irradiance / np.pi, rtol=0.1, atol=0.01
    )
    assert (bake(Sky(ground_color=(0, 0, 0)))[-1, 0] < 0.1 * found[-1, 0].max()).all()


def test_no_bands() -> None:
    """Neighbouring pixels up the sky differ little, and their steps change little."""
    column = np.log(light(5.0)[: row_at(0.5), 0] @ LUMINANCE)
    assert np.abs(np.diff(column)).max() < 0.1
    assert np.abs(np.diff(column, 2)).max() < 0.02


# --- in a scene ---


def test_one_map_for_equal_skies() -> None:
    assert bake(Sky(turbidity=5)) is bake(Sky(turbidity=5.0))
    assert not bake(Sky(turbidity=5)).flags.writeable


def test_a_scene_has_it() -> None:
    scene = load_scene(
        "{version: 1, formula: {name: hast}, camera: {}, environment: {sky: {sun_elevation: 30}}}"
    )
    assert scene.surroundings is not None
    assert scene.surroundings.pixels is bake(Sky(sun_elevation=30))
    assert scene.surroundings.sun == sun_of(Sky(sun_elevation=30))
    assert sun_of(Sky(sun=False)) is None
    assert scene.resolved()["environment"]["sky"]["turbidity"] == 3


def test_the_sun_moves_in_films() -> None:
    scene = load_scene(
        "{version: 1, formula: {name: hast}, camera: {}, environment: {sky: {}}, animation: {frames: 3,"
        " tracks: {environment.sky.sun_elevation: {keys: [{frame: 0, value: 10}, {frame: 2, value: 30}]}}}}"
    )
    from clfractal.scene.movement import movement_of

    environment = movement_of(scene).still(1.0).environment
    assert environment is not None
    assert environment.sky is not None
    assert environment.sky.sun_elevation == pytest.approx(20)


def test_one_source_only() -> None:
    with pytest.raises(SceneError, match="cannot be combined with name"):
        Environment(name="dusk", sky=Sky())
