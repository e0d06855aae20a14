"""Small settings files and formulas of our own, in the formats of Mandelbulber 2."""

from __future__ import annotations

from pathlib import Path

from clfractal.errors import ClfractalError

HEAD = "# Mandelbulber settings file\n# version 2.20\n# only modified parameters\n"


def settings(main: str = "", fractal: str = "", more: str = "") -> str:
    """The text of a settings file; keys are separated by lines, as there."""
    return f"{HEAD}[main_parameters]\n{main}\n[fractal_1]\n{fractal}\n{more}\n"


def check_line(error: ClfractalError) -> None:
    """An error of the input is one line, which is not endless."""
    assert "\n" not in str(error)
    assert len(str(error)) < 1500
    assert error.status == 2


# A squaring that keeps the plane z = 0, folds that depend on the application, and what is never reached.
BULB = """/* A formula of this project's tests. */
REAL4 OwnIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)
{
	Q_UNUSED(fractal);
	REAL temp = z.x * z.x - z.y * z.y - z.z * z.z; // the real part
	if (aux->i >= fractal->transformCommon.startIterationsA && aux->i < fractal->transformCommon.stopIterationsA)
	{
		REAL temp = fabs(z.y);
		z.y = temp;
	}
	z.y = 2.0f * z.x * z.y;
	z.z = mad(2.0f * z.x, z.z, fractal->transformCommon.offset0);
	z.x = temp;
	if (fractal->transformCommon.functionEnabledFalse) z.x = sizeof(temp);
	aux->DE = aux->DE * 2.0f * aux->r;
	return z;
}
"""
# A fold with a choice, a loop over an array, a switch, a rotation and a vector.
FOLD = """REAL4 OwnFoldIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)
{
	REAL4 limit = fractal->transformCommon.additionConstant111;
	REAL shift[2] = {0.25f, 0.5f};
	for (int k = 0; k < 2; k++)
	{
		if (z.x > limit.x) z.x = 2.0f * limit.x - z.x;
		z.y += shift[k];
	}
	switch (fractal->combo4.combo4)
	{
		case multi_combo4Cl_type1:
		default: z.z = -z.z; break;
		case multi_combo4Cl_type2: z.z = z.z * 2.0f; break;
	}
	REAL rr = dot(z, z);
	z = (rr < 0.25f) ? z * 4.0f : (REAL4){z.x, z.y, z.z, z.w};
	z = Matrix33MulFloat4(fractal->transformCommon.rotationMatrix, z);
	return z * fractal->transformCommon.scale2;
}
"""
STATE = """REAL4 OwnStateIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)
{
	z *= aux->actualScale;
	aux->actualScale = fractal->mandelbox.scale + fractal->mandelboxVary4D.scaleVary * (fabs(aux->actualScale) - 1.0f);
	return z;
}
"""
ENUMS = (
    "typedef enum\n{\n\tmulti_combo4Cl_type1,\n\tmulti_combo4Cl_type2, // the second\n} enumMulti_combo4Cl;\n"
)


def program(folder: Path, **texts: str) -> Path:
    """A folder like that of the program, with texts under the names of formulas."""
    (folder / "formula" / "opencl").mkdir(parents=True)
    (folder / "opencl").mkdir()
    (folder / "opencl" / "fractal_cl.h").write_text(ENUMS, encoding="utf-8")
    for name, text in texts.items():
        (folder / "formula" / "opencl" / f"{name}.cl").write_text(text, encoding="utf-8")
    return folder
