"""A CAM script in CadQuery: make a part and the path for its edge, and correct the path as the post-processing step.

    python examples/cam_script.py FOLDER

A real script would take the scan from the measuring cell; here the sheet is "measured" after it was bent over a
cylinder of 900 mm radius, so that the script runs anywhere and the true edge is known.
"""

from __future__ import annotations

import math
import sys
from pathlib import Path

import cadquery as cq
import numpy as np

import sicp_cam

WIDTH, HEIGHT, THICKNESS = 400.0, 300.0, 2.0  # mm
HOLE_LONG, HOLE_SHORT, HOLE_CORNER = 180.0, 110.0, 30.0
BEND_RADIUS = 900.0
SPACING, NOISE = 2.0, 0.05


def make_part() -> cq.Workplane:
    """Return a sheet with a rounded rectangular opening; its upper skin is the plane z = 0."""
    sheet = cq.Workplane("XY").box(WIDTH, HEIGHT, THICKNESS).translate((0, 0, -THICKNESS / 2))
    opening = cq.Workplane("XY").box(HOLE_LONG, HOLE_SHORT, 3 * THICKNESS).edges("|Z").fillet(HOLE_CORNER)
    return sheet.cut(opening)


def edge_path(part: cq.Workplane) -> list[str]:
    """Return APT lines of a trimming path along the opening's edge on the upper skin."""
    skin = part.faces(">Z").val()
    wire = skin.innerWires()[0]
    steps = round(wire.Length() / 2.0)
    points = [wire.positionAt(i / steps) for i in range(steps + 1)]
    above = points[0] + cq.Vector(0, 0, 40)
    lines = ["PARTNO OPENING", "UNITS/MM", "MULTAX", "SPINDL/18000,RPM,CLW", "RAPID", goto(above)]
    lines += ["FEDRAT/600,MMPM", goto(points[0]), "FEDRAT/1500,MMPM"]
    lines += [goto(point) for point in points[1:]]
    return [*lines, "FEDRAT/3000,MMPM", goto(above), "SPINDL/OFF", "FINI"]


def goto(point: cq.Vector) -> str:
    """Return one move with the tool square to the sheet."""
    return f"GOTO/{point.x:.4f},{point.y:.4f},{point.z:.4f},0,0,1"


def measure(part: cq.Workplane) -> np.ndarray:
    """Return scan points of the sheet around its opening after it was bent over a cylinder, (n, 3) mm."""
    rng = np.random.default_rng(7)
    x, y = np.meshgrid(np.arange(-150, 150, SPACING), np.arange(-115, 115, SPACING))
    flat = np.stack([x.ravel(), y.ravel()], axis=1) + rng.uniform(-0.4 * SPACING, 0.4 * SPACING, (x.size, 2))
    half = np.array([HOLE_LONG, HOLE_SHORT]) / 2 - HOLE_CORNER
    beyond = np.linalg.norm(np.maximum(np.abs(flat) - half, 0.0), axis=1)
    return bent(flat[beyond > HOLE_CORNER]) + rng.normal(0.0, NOISE, (int((beyond > HOLE_CORNER).sum()), 3))


def bent(flat: np.ndarray) -> np.ndarray:
    """Bend points of the flat sheet over the cylinder, without stretching them."""
    angle = flat[:, 0] / BEND_RADIUS
    return np.stack([BEND_RADIUS * np.sin(angle), flat[:, 1], BEND_RADIUS * (np.cos(angle) - 1)], axis=1)


def main(folder: Path) -> None:
    """Make the inputs, correct the path, and write the robot program."""
    folder.mkdir(parents=True, exist_ok=True)
    part = make_part()
    cq.exporters.export(part, str(folder / "sheet.step"))
    (folder / "opening.apt").write_text("\n".join(edge_path(part)) + "\n")
    np.savetxt(folder / "scan.asc", measure(part), fmt="%.4f")

    # The post-processing step: three files in, a corrected program out.
    result = sicp_cam.correct(
        cad=folder / "sheet.step",
        scan=folder / "scan.asc",
        path=folder / "opening.apt",
        align="given",  # the cell measures in the part's frame, give or take a few millimetres
        scan_units="mm",
    )
    for post in ("val3", "gcode", "csv"):
        result.write(post, folder / "program", force=True)

    tips = result.corrected.corrected.tips_mm
    cuts = np.array([status is not sicp_cam.Status.APPROACH for status in result.corrected.status])
    off = np.abs(np.hypot(tips[cuts, 0], tips[cuts, 2] + BEND_RADIUS) - BEND_RADIUS)
    rigid = result.corrected.rigid.tips_mm[cuts]
    rigid_off = np.abs(np.hypot(rigid[:, 0], rigid[:, 2] + BEND_RADIUS) - BEND_RADIUS)
    print(f"{cuts.sum()} cutting moves; sag of the sheet {HOLE_LONG**2 / 8 / BEND_RADIUS:.2f} mm")
    print(f"mean distance from the bent sheet: rigid {rigid_off.mean():.3f} mm, corrected {off.mean():.3f} mm")
    print(f"programs in {folder / 'program'}")
    if not off.mean() < 0.05 or math.isnan(off.mean()):
        sys.exit("the corrected path does not lie on the sheet")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "out/cam_script"))
