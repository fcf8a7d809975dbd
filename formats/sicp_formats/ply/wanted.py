"""What of a PLY file makes a surface: which properties to read of which elements, and what is left aside."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

from sicp_cam.errors import FormatError
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import Limits
from sicp_formats.ply.header import Element, Header
from sicp_formats.surfaces.checks import Code
from sicp_formats.surfaces.point_rows import OR_REPAIR, PointNames, point_names

__all__ = ["Wanted", "wanted"]

_CORNERS = ("vertex_indices", "vertex_index")


@dataclass(frozen=True, slots=True)
class Wanted:
    """What to read.

    Parameters
    ----------
    points
        Properties of element vertex.
    singles
        True if coordinates are stored as 32-bit floats.
    corners
        By element, face or tristrips, its list of vertex indices; only of those that have rows.
    findings
        What is left aside.
    """

    points: PointNames
    singles: bool
    corners: dict[str, str]
    findings: tuple[Finding, ...]

    def of(self, element: str) -> tuple[str, ...]:
        """Return the properties to read of an element."""
        if element == "vertex":
            names = (*self.points.xyz, *self.points.normal, *self.points.further)
            return tuple(name for name in names if name is not None)
        return (self.corners[element],) if element in self.corners else ()


def wanted(path: Path, header: Header, file_bytes: int, limits: Limits, *, recover: bool = False) -> Wanted:
    """Choose what to read, after checking that the header offers it and asks for no more than the limits.

    Raises
    ------
    FormatError
        With the line: no vertices, a coordinate is missing, normals in part (they are ignored to recover), faces
        without one list of vertex indices, or more rows than `limits` allow.
    """
    elements = {element.name: element for element in header.elements}
    if "vertex" not in elements:
        raise FormatError(path, "the header has no element vertex, hence no points", line=header.body_line - 1)
    vertex = elements["vertex"]
    points = point_names([each.name for each in vertex.properties if each.count_code is None])
    missing = [axis for axis, name in zip("xyz", points.xyz, strict=True) if name is None]
    if missing:
        raise FormatError(path, f"no {' and no '.join(missing)} among the vertex properties", line=vertex.line)
    if vertex.count == 0:
        raise FormatError(path, "no points: element vertex has 0 rows; export the scan again", line=vertex.line)
    points, findings = _whole_normals(path, points, vertex, recover=recover)
    surfaces = [elements[name] for name in ("face", "tristrips") if name in elements and elements[name].count]
    corners = {element.name: _corner_list(path, element) for element in surfaces}
    for element, limit, key in (
        (vertex, limits.points, "points"),
        *((each, limits.faces, "faces") for each in surfaces),
    ):
        # A row takes a byte at least: a count beyond the file is refused below, with the bytes that are there.
        if limit < element.count <= file_bytes:
            what = f"element {element.name} declares {element.count} rows, more than the limit {key} = {limit}"
            raise FormatError(path, what, line=element.line)
    singles = any(each.name in points.xyz and each.code == "f4" for each in vertex.properties)
    return Wanted(points, singles, corners, (*findings, *_left_aside(path, vertex, surfaces, corners)))


def _whole_normals(
    path: Path, points: PointNames, vertex: Element, *, recover: bool
) -> tuple[PointNames, tuple[Finding, ...]]:
    some = [name for name in points.normal if name is not None]
    if len(some) in (0, 3):
        return points, ()
    if not recover:
        what = f"the normals have only {', '.join(some)}; export all or none{OR_REPAIR}"
        raise FormatError(path, what, line=vertex.line)
    message = f"the normals have only {', '.join(some)} and were ignored"
    finding = Finding(Code.NORMALS_DROPPED, Level.WARN, message, f"{path}, line {vertex.line}")
    return replace(points, normal=(None, None, None)), (finding,)


def _corner_list(path: Path, element: Element) -> str:
    lists = [each for each in element.properties if each.name in _CORNERS and each.count_code]
    if len(lists) != 1:
        what = (
            f"element {element.name} needs one list vertex_indices and has {len(lists)}; export as a plain mesh or as "
            "points"
        )
        raise FormatError(path, what, line=element.line)
    if lists[0].code.startswith("f"):
        raise FormatError(path, f"list {lists[0].name} must hold integers, not floats", line=element.line)
    return lists[0].name


def _left_aside(path: Path, vertex: Element, surfaces: list[Element], corners: dict[str, str]) -> tuple[Finding, ...]:
    aside = [f"{each.name} of vertex" for each in vertex.properties if each.count_code]
    for element in surfaces:
        aside += [f"{each.name} of {element.name}" for each in element.properties if each.name != corners[element.name]]
    if not aside:
        return ()
    return (Finding(Code.COLUMNS_NOT_USED, Level.INFO, f"properties not used: {', '.join(aside)}", str(path)),)
