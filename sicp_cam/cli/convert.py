"""`sicp-cam convert`: a scan, a mesh or a path into another format."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any, Literal

from cyclopts import Parameter

from sicp_cam.cli.reader_settings import Unit
from sicp_cam.cli.session import Talk, logging_to, reported, say, say_json

__all__ = ["convert"]


def convert(
    source: Path,
    target: Path,
    /,
    *,
    role: Literal["scan", "part", "path"] | None = None,
    units: Annotated[Unit | None, Parameter(alias=["--scan-units", "--cad-units", "--path-units"])] = None,
    out_units: Unit | None = None,
    post: str | None = None,
    recover: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    force: Annotated[bool, Parameter(negative="", show_default=False)] = False,
    set_: Annotated[list[str] | None, Parameter(name="--set", negative="")] = None,
    as_json: Annotated[bool, Parameter(name="--json", negative="", show_default=False)] = False,
    talk: Talk = Talk(),  # noqa: B008  # frozen
) -> int:
    """Write a scan or mesh in another format, or a path as another program; nothing is corrected.

    What was written is read back and compared before it is kept. A path of the same suffix is written in its own words,
    byte for byte; name a postprocessor with --post for another dialect.

    Parameters
    ----------
    source
        The file to read: scan.asc, part.step, path.dxf ...
    target
        The file to write; its suffix says as what: scan.ply, part.stl, path.apt ...
    role
        What the file is, where neither suffix nor content tells.
    units
        Unit of the numbers read, where the file does not state one: mm, cm, m, inch.
    out_units
        Unit of the numbers written; mm if left out.
    post
        Postprocessor of a path, where the suffix does not tell, such as val3.
    recover
        Repair a damaged file where that can be done, and tell each repair as a warning.
    force
        Replace an existing file.
    set_
        KEY=VALUE: what the reader takes, such as scan.decimal=, or path.rotary=AC; what the writer takes, such as
        out.encoding=ascii, or out.decimals=4 for a post; or a cap, such as limits.points=1000000. May be repeated.
    as_json
        Print one JSON document.
    talk
        How much is said.
    """

    def work() -> int:
        from sicp_cam import conversion
        from sicp_cam.cli.reader_settings import reader_settings

        caps, tables = reader_settings(set_ or [], (*_ROLES, "out"))
        chosen: str | None = role or next((name for name in _ROLES if tables[name]), None)
        document = conversion.convert(
            conversion.Conversion(
                source,
                target,
                chosen,
                units,
                out_units,
                post,
                recover,
                force,
                tables[chosen] if chosen else {},
                tables["out"],
                caps,
            )
        )
        if as_json:
            say_json(document)
        else:
            _tell(document)
        return 0

    with logging_to(talk):
        return reported(work, as_json=as_json)


_ROLES = ("scan", "part", "path")


def _tell(document: dict[str, Any]) -> None:
    from sicp_cam.cli.inspect_lines import finding_line, unit_words

    (read,) = document["inputs"]
    noun = _NOUN[read["role"]]
    say(f"read {read['role']} {read['path']}: {read['format']}, {read['count']} {noun}, unit {unit_words(read)}")
    for written in document["outputs"]:
        say(f"wrote {written['path']}: {written['kind']}, unit {written['units']}")
    back = document["read_back"]
    if back is not None and back["largest_difference_mm"] is not None:
        say(f"read back: {back['count']} {noun}, at most {back['largest_difference_mm']:.3g} mm off")
    for finding in document["findings"]:
        say(finding_line(finding))


_NOUN = {"scan": "points", "part": "points", "path": "moves"}
