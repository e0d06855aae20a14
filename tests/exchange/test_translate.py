"""Formulas that are made of texts: what they do to z is what the text says, in NumPy and by hand."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from clfractal.errors import FileError
from clfractal.exchange.c_text import read_formula
from clfractal.exchange.counterparts import counterpart
from clfractal.exchange.defaults import default_of
from clfractal.exchange.parameters import Parameters, rotation
from clfractal.exchange.plan import Slot
from clfractal.exchange.sequence import turns
from clfractal.exchange.settings import parse_settings
from clfractal.exchange.symbols import Symbols, written
from clfractal.formulas.backends import NumpyBackend
from clfractal.formulas.catalog import resolve
from clfractal.formulas.reference import apply as apply_formula
from tests.exchange.files import BULB, FOLD, STATE, program, settings
from tests.exchange.maps import POINTS, formula_of, mapped


class TestMaps:
    def test_conditions_on_the_application_make_members(self, tmp_path: Path) -> None:
        # Formula 11 is no formula of our library, and the point is added after it.
        folder = program(tmp_path, xenodreambuie=BULB)
        section = formula_of(folder, "transf_stop_iterations_A 2;\ntransf_offset_0 0.25;", "formula_1 11;")
        chain = section["inline"]["chain"]
        assert section["iterations"] == 10
        assert [(each["count"], each["start"], each.get("stop")) for each in chain] == [
            (1, 0, 1),
            (2, 1, 3),
            (1, 3, None),
        ]
        x, y, z = POINTS
        real = x * x - y * y - z * z
        for member, imaginary in ((chain[1], abs(y)), (chain[2], y)):
            assert member["inline"]["add"] == "point"
            found = mapped(member["inline"], POINTS, 0 * POINTS)
            np.testing.assert_allclose(found, [real, 2 * x * imaginary, 2 * x * z + 0.25], rtol=1e-12)
        np.testing.assert_array_equal(mapped(chain[0]["inline"], POINTS, POINTS), POINTS)
        assert [member["inline"]["degree"] for member in chain] == [1, 2, 2]

    @pytest.mark.parametrize("choice", ["0", "type2", "1"])
    def test_folds_loops_choices_and_matrices(self, tmp_path: Path, choice: str) -> None:
        folder = program(tmp_path, menger_mod1=FOLD)
        angles = (10.0, 20.0, 30.0)
        fractal = f"combo4 {choice};\ntransf_rotation 10 20 30;\ntransf_addition_constant_111 0.5 1 1;"
        formula = formula_of(folder, fractal, "formula_1 61;")["inline"]
        x, y, z = POINTS
        for _ in range(2):
            x = np.where(x > 0.5, 1 - x, x)
        y = y + 0.75
        z = -z if choice == "0" else 2 * z
        found = np.array([x, y, z])
        found = np.where((found**2).sum(axis=0) < 0.25, 4 * found, found)
        expected = 2 * np.array(rotation((*angles, 0.0))) @ found
        np.testing.assert_allclose(mapped(formula, POINTS, 0 * POINTS), expected, rtol=1e-9, atol=1e-12)
        assert formula["add"] == "none"
        assert formula["degree"] == 1

    def test_pointers_to_numbers_of_a_vector(self, tmp_path: Path) -> None:
        text = """REAL4 AIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)
{
	REAL4 turned;
	REAL *all = (REAL *)&turned;
	for (int k = 0; k < 3; k++)
	{
		REAL *one = (k == 0) ? &all[0] : ((k == 1) ? &all[1] : &all[2]);
		turned = z * 2.0f;
		if (*one > 1.0f)
		{
			*one = 2.0f - *one;
			z = turned;
		}
	}
	return z;
}
"""
        formula = formula_of(program(tmp_path, menger_mod1=text), "", "formula_1 61;")["inline"]
        expected = POINTS.copy()
        for k in range(3):
            folded = 2 * expected
            folded[k] = 2 - folded[k]
            expected = np.where(2 * expected[k] > 1, folded, expected)
        np.testing.assert_allclose(mapped(formula, POINTS, 0 * POINTS), expected, rtol=1e-12)

    def test_what_a_formula_keeps(self, tmp_path: Path) -> None:
        folder = program(tmp_path, menger_mod1=STATE)
        fractal = "mandelbox_scale 3;\nmandelbox_vary_scale_vary 0.5;"
        chain = formula_of(folder, fractal, "formula_1 61;\nN 3;".replace("N 9;", ""))["inline"]["chain"]
        scale, scales = 3.0, []
        for _ in range(9):
            scales.append(scale)
            scale = 3 + 0.5 * (abs(scale) - 1)
        for member, expected in zip(chain[:3], scales, strict=False):
            found = mapped(member["inline"], POINTS, 0 * POINTS)
            np.testing.assert_allclose(found, expected * POINTS, rtol=1e-12)

    def test_a_julia_set_adds_its_constant_and_swaps_where_theirs_does(self, tmp_path: Path) -> None:
        folder = program(tmp_path, xenodreambuie=BULB, abox_mod1=BULB)
        main = "julia_mode true;\njulia_c 0.1 0.2 0.3;\nfractal_constant_factor 1 2 1;"
        x, y, z = POINTS
        square = np.array([x * x - y * y - z * z, 2 * x * abs(y), 2 * x * z])
        for number, added in ((11, (0.1, 0.4, 0.3)), (64, (0.4, 0.1, 0.3))):
            formula = formula_of(folder, "", f"formula_1 {number};\n{main}")["inline"]
            expected = square + np.array(added)[:, None]
            np.testing.assert_allclose(mapped(formula, POINTS, 0 * POINTS), expected, rtol=1e-12)

    def test_factors_of_the_point(self, tmp_path: Path) -> None:
        folder = program(tmp_path, xenodreambuie=BULB)
        section = formula_of(folder, "", "formula_1 11;\nfractal_constant_factor 1 0 -2;")
        formula = section["inline"]["chain"][1]["inline"]
        x, y, z = POINTS
        point = POINTS[::-1]
        expected = np.array([x * x - y * y - z * z + point[0], 2 * x * abs(y), 2 * x * z - 2 * point[2]])
        np.testing.assert_allclose(mapped(formula, POINTS, point), expected, rtol=1e-9, atol=1e-12)

    def test_folds_before_every_application(self, tmp_path: Path) -> None:
        head = "REAL4 AIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)"
        text = f"{head}\n{{ z.x += aux->r; return z; }}"
        folds = (
            "box_folding true;\nbox_folding_limit 0.5;\nbox_folding_value 1;\nspherical_folding true;\n"
            "spherical_folding_inner 0.4;\nspherical_folding_outer 0.8;"
        )
        formula = formula_of(program(tmp_path, menger_mod1=text), "", f"formula_1 61;\n{folds}")["inline"]
        z = 2 * np.clip(POINTS, -0.5, 0.5) - POINTS
        square = (z**2).sum(axis=0)
        z = z * np.where(square < 0.16, 4, np.where(square < 0.64, 0.64 / square, 1))
        expected = z + np.array([np.sqrt((z**2).sum(axis=0)), 0 * z[0], 0 * z[0]])
        np.testing.assert_allclose(mapped(formula, POINTS, 0 * POINTS), expected, rtol=1e-9, atol=1e-12)

    def test_what_depends_on_z_is_carried(self, tmp_path: Path) -> None:
        text = """REAL4 AIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)
{
	z.y = z.y + aux->cw;
	if (z.x > 0.0f) aux->cw = 2.0f * z.x;
	return z;
}
"""
        formula = formula_of(program(tmp_path, menger_mod1=text), "", "formula_1 61;")["inline"]
        assert [*formula["state"]] == ["kept_cw"]
        assert formula["state"]["kept_cw"]["start"] == 0
        bound = resolve({"inline": formula}).links[0].bound
        x, y, z = POINTS
        before = np.random.default_rng(8).normal(size=500)
        found = apply_formula(bound, [x, y, z, before], [0 * x] * 3, NumpyBackend())
        expected = [x, y + before, z, np.where(x > 0, 2 * x, before)]
        for part, value in zip(found, expected, strict=True):
            np.testing.assert_allclose(np.broadcast_to(part, 500), value, rtol=1e-12)

    def test_shapes_in_space_are_distances(self, tmp_path: Path) -> None:
        # Balls of radius 0.25 at the corners of a cube, half as large and half as far away in each application.
        text = """REAL4 AIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)
{
	z = fabs(z) * 2.0f - (REAL4){1.0f, 1.0f, 1.0f, 0.0f};
	aux->DE *= 2.0f;
	aux->dist = min(aux->dist, (length(z) - 0.25f) / aux->DE);
	return z;
}
"""
        section = formula_of(
            program(tmp_path, menger_mod1=text), "", "formula_1 61;\nN 3;".replace("N 9;", "")
        )
        formula = section["inline"]
        assert formula["distance"] == "kept_dist"
        chain = resolve(section)
        state = [*POINTS, *([np.full(500, start) for start in (1000.0, 1.0)])]
        z, nearest, scale = POINTS, np.full(500, 1000.0), 1.0
        for _ in range(3):
            state = [
                np.broadcast_to(part, 500)
                for part in apply_formula(chain.links[0].bound, state, [0 * z[0]] * 3, NumpyBackend())
            ]
            z, scale = 2 * abs(z) - 1, 2 * scale
            nearest = np.minimum(nearest, (np.sqrt((z**2).sum(axis=0)) - 0.25) / scale)
        np.testing.assert_allclose(state[3], nearest, rtol=1e-9, atol=1e-12)

    def test_the_number_of_the_application_as_a_number(self, tmp_path: Path) -> None:
        text = """REAL4 AIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)
{
	int n = aux->i;
	if (n == 2) z.y = -z.y;
	z.x = z.x + n;
	return z;
}
"""
        folder = program(tmp_path, menger_mod1=text)
        chain = formula_of(folder, "", "formula_1 61;")["inline"]["chain"]
        assert len(chain) == 9
        for number, member in enumerate(chain):
            x, y, z = POINTS
            expected = np.array([x + number, -y if number == 2 else y, z])
            np.testing.assert_allclose(mapped(member["inline"], POINTS, 0 * POINTS), expected, rtol=1e-12)

    def test_what_differs_in_many_applications_has_their_number(self, tmp_path: Path) -> None:
        text = STATE.replace(
            "z *= aux->actualScale;", "z *= aux->actualScale; z.x += aux->i; if (aux->i > 3) z.y = -z.y;"
        )
        section = formula_of(
            program(tmp_path, abox_mod1=text),
            "mandelbox_scale 1.5;\nmandelbox_vary_scale_vary 0.5;",
            "formula_1 64;\nN 90;\njulia_mode false;".replace("N 9;", ""),
        )
        standing, formula = (member["inline"] for member in section["inline"]["chain"])
        assert [*formula["state"]] == ["kept_actualscale"]
        assert formula["state"].keys() == standing["state"].keys()
        bound = resolve({"inline": formula}).links[0].bound
        scale = 1.5
        for application in range(6):
            found = apply_formula(
                bound, [*POINTS, np.full(500, scale)], list(POINTS), NumpyBackend(), number=application + 1
            )
            x, y, z = scale * POINTS
            expected = np.array([x + application, -y if application > 3 else y, z]) + POINTS[[1, 0, 2]]
            np.testing.assert_allclose(found[:3], expected, rtol=1e-9, atol=1e-12)
            scale = 1.5 + 0.5 * (abs(scale) - 1)
            np.testing.assert_allclose(np.broadcast_to(found[3], 500), scale)

    def test_the_fourth_number(self, tmp_path: Path) -> None:
        text = BULB.replace("z.x = temp;", "z.x = temp; z.w = z.w * z.w + z.z;")
        section = formula_of(program(tmp_path, xenodreambuie=text), "", "formula_1 11;\ninitial_waxis 0.5;")
        standing, square = section["inline"]["chain"]
        assert standing["inline"]["slice"] == {"w": 0.5}
        state = np.random.default_rng(4).normal(size=(4, 100))
        point = np.random.default_rng(5).normal(size=(4, 100))
        found = mapped(square["inline"], state, point)
        x, y, z, w = state
        expected = [x * x - y * y - z * z, 2 * x * abs(y), 2 * x * z, w * w + 2 * x * z]
        # Of the point only the first three numbers are added.
        np.testing.assert_allclose(found[:3], expected[:3] + point[:3], rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(found[3], expected[3], rtol=1e-9, atol=1e-12)

    def test_an_old_file_mirrors_space(self, tmp_path: Path) -> None:
        folder = program(tmp_path, menger_mod1=FOLD)
        plain, mirrored = (
            formula_of(folder, "transf_rotation 10 20 30;", f"formula_1 61;\nlegacy_coordinate_system {old};")
            for old in (0, 1)
        )
        flip = np.array([1.0, 1.0, -1.0])[:, None]
        np.testing.assert_allclose(
            mapped(mirrored["inline"], flip * POINTS, 0 * POINTS),
            flip * mapped(plain["inline"], POINTS, 0 * POINTS),
            rtol=1e-9,
            atol=1e-12,
        )


class TestRefusals:
    @pytest.mark.parametrize(
        ("line", "message"),
        [
            (
                "while (z.x > 0.0f) { z.x -= 1.0f; break; }",
                "has no counterpart: it leaves a loop, or ends, by a",
            ),
            ("while (1) z.x -= 1.0f;", "has no counterpart: "),
            ("sizeof(z);", "has no counterpart: UnaryOp is outside of the C that is read"),
            ("z.x = lgamma(z.y);", "has no counterpart: the function lgamma"),
            ("aux->c.x = z.x;", "has no counterpart: it keeps c, which depends on z"),
            (
                "if (aux->DE > 1.0f) z.x = 1.0f; z.y = dot(z, z);",
                "has no counterpart: z depends on distances or colours",
            ),
            ("z.x = aux->DE;", "has no counterpart: z depends on distances or colours"),
            (
                "z.x = fractal->genFoldBox.sides_ball;",
                "has no counterpart: the parameter genFoldBox.sides_ball",
            ),
            ("z.x = nowhere;", "has no counterpart: the name nowhere"),
            ("goto end; end: z.x = 1.0f;", "has no counterpart: Goto is outside of the C that is read"),
            (
                "if (z.x > 0.0f) return z;",
                "has no counterpart: it leaves a loop, or ends, by a condition on z",
            ),
            ("z.q = 1.0f;", "has no counterpart: the field q"),
        ],
    )
    def test_what_has_no_counterpart_is_told_with_its_line(
        self, tmp_path: Path, line: str, message: str
    ) -> None:
        head = "REAL4 AIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)"
        text = f"{head}\n{{\n\n{line}\nreturn z;\n}}"
        folder = program(tmp_path, menger_mod1=text)
        with pytest.raises(FileError) as caught:
            formula_of(folder, "", "formula_1 61;")
        assert f"menger_mod1.cl:4: {message}" in str(caught.value)

    def test_texts_that_are_no_c(self) -> None:
        for text, message in (
            ("REAL4 AIteration(REAL4 z) { return z", "a.cl"),
            ("REAL4 A(REAL4 z) { return z; }", "a.cl: must have one function whose name ends in Iteration"),
            ("x" * 300_000, "a.cl: is too long"),
            ("REAL4 AIteration(REAL4 z) { return " + "(" * 20_000 + "z" + ")" * 20_000 + "; }", "a.cl"),
        ):
            with pytest.raises(FileError) as caught:
                read_formula(text, "a.cl")
            assert str(caught.value).startswith(message)

    def test_a_formula_that_is_nowhere(self, tmp_path: Path) -> None:
        folder = program(tmp_path)
        with pytest.raises(
            FileError, match=r"x.fract:7: formula_1: formula 119 has no counterpart: our library"
        ):
            formula_of(folder, "", "formula_1 119;")
        with pytest.raises(FileError, match="is no folder"):
            formula_of(tmp_path / "none")


class TestTurns:
    def test_by_hand(self) -> None:
        def slot(number: int, count: int = 1, start: int = 0, stop: int = 250) -> Slot:
            return Slot(number, number, True, count, start, stop)

        assert turns([slot(1, 2), slot(2)], 1, 7) == [1, 1, 2, 1, 1, 2, 1]
        assert turns([slot(1), slot(2), slot(3)], 2, 6) == [1, 2, 3, 2, 3, 2]
        assert turns([slot(1), slot(2, stop=2)], 1, 6) == [1, 2, 1, 1, 1, 1]
        assert turns([slot(1), slot(2, start=3)], 1, 6) == [1, 1, 1, 2, 1, 2]

    def test_a_chain_has_the_turns_of_its_file(self, tmp_path: Path) -> None:
        from itertools import islice

        folder = program(tmp_path, menger_mod1=FOLD, abox_mod1=BULB)
        main = (
            "formula_1 64;\nformula_2 61;\nformula_3 64;\nhybrid_fractal_enable true;\nformula_iterations_2 3;\n"
            "formula_stop_iteration_3 5;\nformula_start_iteration_2 1;\nrepeat_from 2;"
        )
        section = formula_of(folder, "", main)
        chain = resolve(section)
        formulas = [link.bound.formula for link in chain.links]
        slots = [Slot(1, 64, True, 1, 0, 250), Slot(2, 61, False, 3, 1, 250), Slot(3, 64, True, 1, 0, 5)]
        shown = []
        for application in range(40):
            span = next(each for each in chain.spans if each.end is None or application < each.end)
            place = span.place(application)
            index = 0
            while place >= chain.links[index].count:
                place -= chain.links[index].count
                index += 1
            shown.append(formulas[index].title)
        expected = [f"Formula {64 if slot != 2 else 61} of Mandelbulber" for slot in turns(slots, 2, 39)]
        assert list(islice(shown, 1, None)) == expected


def test_which_formulas_of_the_library_are_even() -> None:
    """Old files mirror space: then a formula of the library must be the same in the mirror, or it is said to be none."""
    flip = np.array([1.0, 1.0, -1.0])[:, None]
    for number, parameters in (
        *((2, f"power {power};") for power in (2, 3, 8)),
        *((each, "") for each in (3, 7, 8, 21, 50, 103)),
        (103, "transf_addition_constant 0 0 0.5;"),
    ):
        found = counterpart(number, parse_settings(settings("", parameters), "x").fractal(1))
        assert not isinstance(found, str)
        bound = resolve(found.source).links[0].bound
        plain, mirrored = (
            np.array(
                [
                    np.broadcast_to(part, 500)
                    for part in apply_formula(bound, list(z), list(0 * z), NumpyBackend())
                ]
            )
            for z in (POINTS, flip * POINTS)
        )
        same = np.allclose(flip * plain, mirrored, rtol=1e-9, atol=1e-12)
        # The Menger sponge folds both halves of space onto one.
        folded = np.allclose(plain, mirrored, rtol=1e-9, atol=1e-12)
        assert (same or folded) == found.even, number


def test_names_say_defaults() -> None:
    for key, value in {
        "transf_scale_3": 3.0,
        "transf_offset_111": (1.0, 1.0, 1.0),
        "transf_offset_05": 0.5,
        "transf_function_enabled_false": 0.0,
        "transf_function_enabledM": 1.0,
        "transf_stop_iterations_C": 250.0,
        "transf_stop_iterations_C1": 1.0,
        "transf_addition_constant_0777": (0.7, 0.7, 0.7),
        "transf_addition_constant": (0.0, 0.0, 0.0),
        "power": 9.0,
    }.items():
        assert default_of(key) == value, key


def test_fields_are_found_by_keys_of_other_spellings() -> None:
    text = settings(
        "",
        "transf_function_enabledX_false 1;\ntransf_offsetA_000 1 2 3;\nmandelbox_vary_minr 0.25;\nIFS_direction_1 0 3 4;",
    )
    parameters = Parameters(parse_settings(text, "x").fractal(1), {})
    assert parameters.value("transformCommon.functionEnabledXFalse") == 1
    assert parameters.value("transformCommon.functionEnabledxFalse") == 0
    assert parameters.value("transformCommon.offsetA000") == (1, 2, 3, 0)
    assert parameters.value("mandelboxVary4D.minR") == 0.25
    assert parameters.value("IFS.direction", (1,)) == pytest.approx((0, 0.6, 0.8, 0))
    assert parameters.value("mandelbox.mR2") == 0.25


def test_angles_of_matrices() -> None:
    """About x, y and z, and about z, y and x for kaleidoscopic sets, as depths of theirs show."""
    quarter = {
        "x": [[1, 0, 0], [0, 0, -1], [0, 1, 0]],
        "y": [[0, 0, 1], [0, 1, 0], [-1, 0, 0]],
        "z": [[0, -1, 0], [1, 0, 0], [0, 0, 1]],
    }
    about = {axis: np.array(matrix) for axis, matrix in quarter.items()}
    np.testing.assert_allclose(rotation((90.0,) * 4), about["z"] @ about["y"] @ about["x"], atol=1e-12)
    for place, (axis, of_ifs) in enumerate(zip("xyz", "zyx", strict=True)):
        one = tuple(90.0 if place == each else 0.0 for each in range(4))
        np.testing.assert_allclose(rotation(one), about[axis], atol=1e-12)
        text = settings("", "IFS_rotation {} {} {};".format(*one))
        turned = Parameters(parse_settings(text, "x").fractal(1), {}).value("IFS.mainRot")
        np.testing.assert_allclose(np.array(turned), about[of_ifs], atol=1e-12)


def test_symbols_are_written_with_as_few_brackets_as_they_need() -> None:
    symbols = Symbols()
    x, y = symbols.name("x"), symbols.name("y")
    call = symbols.call
    shared = call("sqrt", call("+", call("*", x, x), 1.0))
    _, (text,) = written([call("-", x, call("-", y, call("*", -2.0, x)))], "v")
    assert text == "x - (y - -2*x)"
    let, texts = written([call("*", shared, x), call("/", x, shared)], "v")
    assert (let, texts) == ({"v1": "sqrt(x*x + 1)"}, ["v1*x", "x/v1"])
    assert call("*", 0.0, x) == 0.0
    assert call("+", x, symbols.negative(y)) is call("-", x, y)
    assert call("/", 1.0, 0.0) == 1e30
    assert math.isclose(float(call("atan2", 1.0, 1.0)), math.pi / 4)  # type: ignore[arg-type]
