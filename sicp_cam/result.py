"""A corrected path that has passed its gates, and what can be made of it: programs, a report, the result document."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from sicp_cam import output, plugins
from sicp_cam.checking.reading_back import read_back
from sicp_cam.correction import PartRegistration, contours_of
from sicp_cam.errors import ReportError
from sicp_cam.findings import Finding, Level
from sicp_cam.job import Job
from sicp_cam.model import FloatArray, Part, Program, Scan, ToolPath
from sicp_cam.report.statistics import uncertainty_summary
from sicp_cam.result_document import (
    SCHEMA,
    correction_entry,
    findings_list,
    gate_list,
    input_entry,
    registration_entry,
    status,
    uncertainty_words,
    versions,
)
from sicp_cam.rigid_motion import apply, inverse, rotate
from sicp_cam.toolpath.gates import Gate, value_and_limit
from sicp_cam.toolpath.transfer import CorrectedPath

__all__ = ["Correction", "Inputs", "input_paths", "report_files", "told"]

NO_UNCERTAINTY = -1.0
"""Stands under the mask of a column: no one who drops the mask can take it for an uncertainty."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True, eq=False)
class Inputs:
    """What was read."""

    part: Part
    scan: Scan
    path: ToolPath


@dataclass(frozen=True, slots=True, eq=False)
class Correction:
    """A corrected path that has passed its gates, and everything known about it; nothing is written yet.

    Parameters
    ----------
    job
        What was asked for.
    inputs
        Part, scan and path as read.
    registration
        The registered part; its `apply` corrects further paths.
    corrected
        The path, nominal, rigid and corrected.
    gates, findings
        How the limits were kept, and what was noticed.
    timing_s
        Seconds of each step.
    """

    job: Job
    inputs: Inputs
    registration: PartRegistration
    corrected: CorrectedPath
    gates: tuple[Gate, ...]
    findings: tuple[Finding, ...]
    timing_s: Mapping[str, float] = field(default_factory=dict)

    def __repr__(self) -> str:
        """Say in one line how it went; the arrays are in the fields."""
        coverage = min(float(contour.covered.mean()) for contour in self.registration.result.contours)
        return (
            f"<Correction {status(self.findings, self.gates)}: {len(self.corrected.nominal)} moves, method"
            f" {self.job.method}, {100.0 * coverage:.1f} % of the edge seen,"
            f" {uncertainty_words(uncertainty_summary(self.registration.result.contours))}>"
        )

    @property
    def program(self) -> Program:
        """The corrected path as a program in the frame that the job asks for."""
        path, T = self.corrected.corrected, np.eye(4)
        if self.job.frame == "part":
            T = self.registration.result.T_scan_part
            back = inverse(T)
            path = replace(path, tips_mm=apply(back, path.tips_mm), axes=rotate(back, path.axes))
        broken = tuple(
            f"gate {gate.name} overridden by the operator: {value_and_limit(gate)}"
            for gate in self.gates
            if gate.state == "overridden"
        )
        notes, columns = tuple(_notes(self)), _columns(self.corrected)
        return Program(
            self.job.name, path, self.corrected.status, T, notes, columns, broken, self.corrected.source_moves
        )

    def files(
        self, post: str, options: Mapping[str, object] | None = None
    ) -> tuple[dict[str, bytes], tuple[Finding, ...]]:
        """Return the files that a postprocessor makes of the program, read back and compared, and what it noticed."""
        writer = plugins.postprocessor(post, options or {})
        program = self.program
        noticed = writer.preflight(program)
        files = writer.write(program, noticed)
        back = read_back(writer, program, files, limits=self.job.limits)
        return files, (*noticed, *back.findings)

    def reading(
        self, post: str, options: Mapping[str, object] | None, files: Mapping[str, bytes]
    ) -> tuple[str, dict[str, Any] | str]:
        """Return the file by which a program is read, and what its reader must be told, or why none reads it."""
        writer = plugins.postprocessor(post, options or {})
        told = writer.reading()
        return writer.main_file(files), told if isinstance(told, str) else dict(told)

    def write(self, post: str, out: str | Path, *, force: bool = False, **options: object) -> list[Path]:
        """Write the program for one controller into a folder and return the files.

        Parameters
        ----------
        post
            Name of the postprocessor.
        out
            The folder; made if it does not exist.
        force
            True to replace an earlier program.
        **options
            What the post takes, such as `tool=(0, 0, 180, 0, 0, 0)`; those of the job are taken where none is given
            (`sicp-cam plugins NAME` lists them). What the post noticed goes to the log.

        Raises
        ------
        JobError, PathError, OutputError
            If the post is unknown, refuses the program, or the files may not be written.
        """
        written, noticed = self.files(post, {**self.job.post_options.get(post, {}), **options})
        for finding in noticed:
            if finding.level is not Level.INFO:
                _log.warning("%s", told(finding))
        return output.write(Path(out), written, force=force, inputs=input_paths(self.job))

    def document(self, outputs: list[dict[str, Any]] | None = None) -> dict[str, Any]:
        """Return the JSON document of the run, schema `sicp-cam/1`."""
        inputs = self.inputs
        return {
            "schema": SCHEMA,
            "status": status(self.findings, self.gates),
            "findings": findings_list(self.findings),
            "inputs": [
                input_entry("part", inputs.part.source, len(contours_of(inputs.part))),
                input_entry("scan", inputs.scan.source, len(inputs.scan.points_mm)),
                input_entry("path", inputs.path.source, len(inputs.path)),
            ],
            "outputs": outputs or [],
            "registration": registration_entry(self.registration.result),
            "uncertainty": uncertainty_summary(self.registration.result.contours),
            "correction": correction_entry(self.corrected),
            "gates": gate_list(self.gates),
            "timing_s": dict(self.timing_s),
            "versions": dict(versions()),
        }

    def report(self, file: str | Path, *, force: bool = False) -> Path:
        """Write the report as a PDF file.

        Raises
        ------
        ReportError, OutputError
            If it cannot be drawn or written.
        """
        file = Path(file)
        made, failed = report_files(self, ("pdf",), self.document())
        if failed:
            raise ReportError("; ".join(finding.message for finding in failed))
        return output.write(file.parent, {file.name: made["report.pdf"]}, force=force, inputs=input_paths(self.job))[0]


def input_paths(job: Job) -> list[Path]:
    """Return the files that a job reads, none of which may be replaced by its results."""
    return [job.cad, job.scan, job.path, *([job.align] if isinstance(job.align, Path) else [])]


def _columns(corrected: CorrectedPath) -> dict[str, FloatArray]:
    """Return the uncertainty of each move as a column, masked where there is none; no column where none is stated."""
    if corrected.u_mm is None:
        return {}
    none = np.isnan(corrected.u_mm)
    return {"u_mm": np.ma.array(np.where(none, NO_UNCERTAINTY, corrected.u_mm), mask=none)}


def _notes(correction: Correction) -> Iterator[str]:
    """Give the lines for the head of a program: no date, so that the same inputs give the same bytes."""
    result = correction.registration.result
    yield f"sicp-cam {versions()['sicp-cam']}, method {result.method}, coordinates in the {correction.job.frame} frame"
    inputs = correction.inputs
    for role, source in (("part", inputs.part.source), ("scan", inputs.scan.source), ("path", inputs.path.source)):
        if source is not None:
            yield f"{role} {Path(source.path).name} sha256 {source.sha256[:16]}"


def report_files(
    correction: Correction, kinds: tuple[str, ...], document: dict[str, Any]
) -> tuple[dict[str, bytes], tuple[Finding, ...]]:
    """Return the report files, and findings for what could not be drawn."""
    if not kinds:
        return {}, ()
    from sicp_cam.report import compose, pdf  # matplotlib and reportlab are slow to load

    corrected = correction.corrected
    pictures, failed = compose.pictures(
        correction.inputs.part.mesh,
        correction.inputs.scan,
        correction.registration.result,
        corrected.rigid,
        corrected.corrected,
        correction.job.gates.residual_mm,
    )
    files = {f"report/{name}": content for name, content in pictures.items()} if "png" in kinds else {}
    if "pdf" in kinds:
        try:
            files["report.pdf"] = pdf.build(compose.document(document, pictures, job=correction.job.name))
        except Exception as error:  # whatever a page stumbles over, it must not cost the program
            text = str(error) if isinstance(error, ReportError) else f"{type(error).__name__}: {error}"
            failed += (Finding(702, Level.WARN, text, "report.pdf"),)
    return files, failed


def told(finding: Finding) -> str:
    """Return a finding as one line."""
    return f"{finding.where}: {finding.message}" if finding.where else finding.message
