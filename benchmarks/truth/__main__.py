"""How near pictures are to the set that they show: hits, losses, the unit sphere, steps, noise.

    python -m benchmarks.truth [--part hits|losses|sphere|steps|noise ...] [--formula NAME ...] [--all]
        [--set KEY=VALUE ...] [-o FILE.json]

Pictures are rendered as any others, and judged by the formula alone, in float64: brute force that knows nothing of the
march. Exit status 1 if a target is missed; the last lines say which.
"""

from __future__ import annotations

import argparse
import sys
import time
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.truth import hits, losses, noise, sphere, steps
from benchmarks.truth.picture import see
from benchmarks.truth.report import Report
from benchmarks.truth.solid import Solid
from benchmarks.truth.subjects import SIDE, subjects
from clfractal.engine.engine import Engine
from clfractal.errors import ClfractalError
from clfractal.files.atomic import check_output

LEGEND = f"""\
Hits, distances in widths of a pixel: the share with an inside point within 1, 1.5 and 3 ({hits.PLACES} random places), how
far the nearest is (median), the share without any within 6 (stray); the share that has one within 1 by a way down the
gradient too (reached), and how much of the ball of 1 around the nearest is inside (fill, median). A set is thin if that
is hardly anything at more than {100 - 100 * hits.SHARE:.0f} % of the hits.
Losses: rays that miss {losses.THICK:g} widths of inside, or hit over {losses.LATE:g} widths behind its start.
To reach: {100 * hits.SHARE:.0f} % within 1, or of a thin set reached; nothing lost.
"""
PARTS = ("hits", "losses", "sphere", "steps", "noise")


def formulas(report: Report, engine: Engine, options: argparse.Namespace) -> None:
    """Hits and losses of every formula, from one picture each."""
    both = [part for part in ("hits", "losses") if part in options.part]
    report.say(LEGEND)
    head = f"{'formula':22} {'scene':22} {'hits':>5} {'<=1':>6} {'<=1.5':>6} {'<=3':>6} {'median':>6} {'stray':>6}"
    report.say(
        f"{head} {'reached':>7} {'fill':>6} {'set':>4} {'steps':>6} {'ratio':>5} {'rays':>6} {'lost':>4} {'s':>5}"
    )
    for subject in subjects(options.formula, side=options.size, overrides=options.set):
        start = time.perf_counter()
        seed = zlib.crc32(subject.name.encode())
        seen = see(subject.scene, engine, precision=options.precision)
        solid = Solid(subject.scene.chain, subject.scene.formula.iterations, engine.device)
        taken = float(seen.framebuffer.stats["steps_per_ray"])
        before = steps.record()["formulas"].get(subject.name)
        cells = [f"{subject.name:22} {subject.source:22}"]
        named = {"formula": subject.name, "scene": subject.source, "steps": taken}
        if "hits" in both:
            near = hits.measure_hits(
                seen, solid, 2000 if options.all else options.hits, np.random.default_rng(seed)
            )
            report.keep("hits", near, **named, fat=near.fat)
            shares = " ".join(f"{100 * share:5.1f}%" for share in near.within)
            cells.append(
                f"{near.tested:5} {shares} {near.nearest:6.2f} {100 * near.stray:5.1f}%"
                f" {100 * near.reached:6.1f}% {100 * near.fill:5.1f}%"
            )
            cells.append(" fat" if near.fat else "thin")
            if not near.met:
                share = near.within[0] if near.fat else near.reached
                report.missed.append(
                    f"hits: {subject.name}: {100 * share:.1f} % have an inside point within a pixel's width,"
                    f" not {100 * hits.SHARE:.0f} %"
                )
        else:
            cells.append(" " * 61)
        cells.append(f"{taken:6.2f} " + (f"{taken / before:5.2f}" if before else "    -"))
        if "losses" in both:
            gone = losses.measure_losses(
                seen, solid, 10_000 if options.all else options.rays, np.random.default_rng(seed)
            )
            report.keep("losses", gone, **named)
            cells.append(f"{gone.tried:6} {len(gone.lost):4}")
            if not gone.met:
                places = ", ".join(f"({one.x}, {one.y})" for one in gone.lost[:4])
                report.missed.append(
                    f"losses: {subject.name}: {len(gone.lost)} of {gone.tried} rays, at {places}"
                )
        else:
            cells.append(" " * 11)
        report.say(" ".join([*cells, f"{time.perf_counter() - start:5.1f}"]))


def spheres(report: Report, engine: Engine, options: argparse.Namespace) -> None:
    """The unit sphere."""
    report.say(f"\n{'unit sphere':22} {'area':>9} {'depth 99%':>10} {'normals 99%':>12}")
    for one in sphere.measure_spheres(engine, options.set):
        report.keep("sphere", one)
        report.say(f"{one.name:22} {100 * one.area:+8.3f}% {one.depth:7.3f} px {one.normal:8.4f} deg")
        if not one.met:
            report.missed.append(
                f"sphere: {one.name}: area {100 * one.area:+.3f} %, depth {one.depth:.3f} pixels,"
                f" normals {one.normal:.4f} degrees; to reach: {100 * sphere.MOST_AREA:g} %,"
                f" {sphere.MOST_DEPTH:g} and {sphere.MOST_NORMAL:g}"
            )


def rows(report: Report, engine: Engine, options: argparse.Namespace) -> None:
    """Steps of the speed table's rows."""
    report.say(
        f"\n{'steps per ray':22} {'now':>8} {'before':>8} {'ratio':>6} {'bad/1000':>8} {'iter/ray':>9}"
    )
    for one in steps.measure_steps(engine, steps.record().get("steps", {}), options.set):
        report.keep("steps", one)
        before = "-" if one.before is None else f"{one.before:.2f}"
        ratio = "-" if one.before is None else f"{one.steps / one.before:.2f}"
        report.say(
            f"{one.row:22} {one.steps:8.2f} {before:>8} {ratio:>6} {one.bad:8.2f} {one.iterations:9.1f}"
        )
        if not one.met:
            report.missed.append(f"steps: {one.row}: {ratio} of those before, not {steps.SHARE:g}")


def flicker(report: Report, engine: Engine, options: argparse.Namespace) -> None:
    """Noise and flicker of six scenes."""
    titles = " ".join(f"{title:>8} {'before':>8}" for title in ("noise", "flicker", "within", "shown"))
    report.say(f"\n{'one sample, codes':22} {titles}")
    for one in noise.measure_noise(engine, steps.record().get("noise", {}), options.set):
        report.keep("noise", one)
        before = ("-",) * 4 if one.before is None else tuple(f"{figure:.2f}" for figure in one.before)
        cells = " ".join(f"{a:8.2f} {b:>8}" for a, b in zip(one.figures, before, strict=True))
        report.say(f"{one.scene:22} {cells}")
        if not one.met:
            report.missed.append(
                f"noise: {one.scene}: noise {one.noise:.2f}, flicker {one.flicker:.2f} and shown {one.shown:.2f},"
                f" before {before[0]}, {before[1]} and {before[3]}"
            )


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point; exit status 1 if a target is missed, 2 for wrong arguments, 3 if the device failed."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks.truth", description=(__doc__ or "").split("\n")[0]
    )
    parser.add_argument("--part", action="append", choices=PARTS, help="only this part; repeat it for more")
    parser.add_argument(
        "--formula", action="append", default=[], help="only this formula; repeat it for more"
    )
    parser.add_argument("--hits", type=int, default=200, help="hits of each formula that are looked at")
    parser.add_argument("--rays", type=int, default=1000, help="rays of each formula that are tried")
    parser.add_argument("--all", action="store_true", help="2000 hits and 10,000 rays of each formula")
    parser.add_argument("--size", type=int, default=SIDE, help="width and height of the formulas' pictures")
    parser.add_argument("--precision", choices=("float32", "float64"), help="number type of the pictures")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="changes every scene; as of `render`"
    )
    parser.add_argument("--device", help="which device, as of `clfractal render`")
    parser.add_argument(
        "-o", dest="output", type=Path, help="also write everything that was measured to a JSON file"
    )
    options = parser.parse_args(arguments)
    options.part = options.part or (["hits", "losses"] if options.formula else list(PARTS))
    for name in ("hits", "rays", "size"):
        if getattr(options, name) < 1:
            parser.error(f"--{name}: must be at least 1")
    report = Report()
    try:
        if options.output:
            check_output(options.output, (".json",))
        with Engine(options.device) as engine:
            if {"hits", "losses"} & set(options.part):
                formulas(report, engine, options)
            if "sphere" in options.part:
                spheres(report, engine, options)
            if "steps" in options.part:
                rows(report, engine, options)
            if "noise" in options.part:
                flicker(report, engine, options)
        if options.output:
            report.write(options.output)
    except ClfractalError as error:
        print(error, file=sys.stderr)
        return error.status
    report.say()
    for line in report.missed:
        report.say(f"missed: {line}")
    report.say("all targets are met" if not report.missed else f"{len(report.missed)} targets are missed")
    return 1 if report.missed else 0


if __name__ == "__main__":
    sys.exit(main())
