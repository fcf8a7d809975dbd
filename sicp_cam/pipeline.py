"""The whole way of a run: read, choose the contour, register, correct, judge, write, report. Each step one line."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from sicp_cam import output, plugins
from sicp_cam.alignment import read_alignment
from sicp_cam.correction import PartRegistration, check_scan_unit, choose_contours, contours_of
from sicp_cam.errors import InputError, JobError, PathError, RegistrationError, ReportError, WarningsError, printable
from sicp_cam.findings import Finding, Level
from sicp_cam.job import Job
from sicp_cam.model import FloatArray, Part, Program, Scan, ToolPath
from sicp_cam.output_names import joined
from sicp_cam.registration.register import register_contours
from sicp_cam.result_document import (
    SCHEMA,
    correction_entry,
    findings_list,
    gate_list,
    input_entry,
    output_entry,
    registration_entry,
    status,
    versions,
)
from sicp_cam.rigid_motion import apply, inverse, rotate
from sicp_cam.toolpath.gates import GATE_NAMES, Gate, overridden, path_gates, registration_gates
from sicp_cam.toolpath.transfer import CorrectedPath

__all__ = ["Correction", "Outcome", "Progress", "correct", "run"]

Progress = Callable[[str, float], None]
"""Told the name of each step and the fraction of the whole that is done."""

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

    @property
    def program(self) -> Program:
        """The corrected path as a program in the frame that the job asks for."""
        path, T = self.corrected.corrected, np.eye(4)
        if self.job.frame == "part":
            T = self.registration.result.T_scan_part
            back = inverse(T)
            path = replace(path, tips_mm=apply(back, path.tips_mm), axes=rotate(back, path.axes))
        return Program(self.job.name, path, self.corrected.status, T, tuple(_notes(self)))

    def files(
        self, post: str, options: Mapping[str, object] | None = None
    ) -> tuple[dict[str, bytes], tuple[Finding, ...]]:
        """Return the files that a postprocessor makes of the program, and what it noticed."""
        writer = plugins.postprocessor(post, options or {})
        program = self.program
        return writer.write(program), tuple(writer.preflight(program))

    def write(self, post: str, out: str | Path, *, force: bool = False, **options: object) -> list[Path]:
        """Write the program for one controller into a folder and return the files.

        Raises
        ------
        JobError, PathError, OutputError
            If the post is unknown, refuses the program, or the files may not be written.
        """
        written, _ = self.files(post, options)
        return output.write(Path(out), written, force=force, inputs=_input_paths(self.job))

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
            "uncertainty": None,
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
        made, failed = _report_files(self, ("pdf",), self.document())
        if failed:
            raise ReportError("; ".join(finding.message for finding in failed))
        return output.write(file.parent, {file.name: made["report.pdf"]}, force=force, inputs=_input_paths(self.job))[0]


@dataclass(frozen=True, slots=True, eq=False)
class Outcome:
    """How a run ended: the JSON document, the exit code (0 or 8), and the lines for the operator."""

    document: dict[str, Any]
    exit_code: int
    lines: tuple[str, ...]


class _Clock:
    """Times the steps of a run and tells how far it is."""

    def __init__(self, progress: Progress) -> None:
        self.progress = progress
        self.seconds: dict[str, float] = {}

    @contextmanager
    def step(self, name: str, done: float) -> Iterator[None]:
        self.progress(name, done)
        start = time.perf_counter()
        try:
            yield
        finally:
            self.seconds[name] = round(time.perf_counter() - start, 4)


def _silent(step: str, fraction: float) -> None:
    return


def correct(job: Job, progress: Progress = _silent) -> Outcome:
    """Run a job: from its files to the programs, the report and the result in its output folder.

    Raises
    ------
    SicpError
        Of the kind that gives the exit code; no output exists then.
    """
    if not job.dry_run:
        output.check_free(job.out, _names_known_before(job), job.force, _input_paths(job))
    try:
        return _corrected_and_written(job, progress)
    except (InputError, RegistrationError, PathError, WarningsError):
        if job.force and not job.dry_run and (names := output.supersede(job.out, _input_paths(job))):
            _log.warning(
                "%s: the earlier %s no longer holds: renamed *%s", job.out, ", ".join(names), output.SUPERSEDED
            )
        raise


def _corrected_and_written(job: Job, progress: Progress) -> Outcome:
    started = time.perf_counter()
    correction = run(job, progress)
    clock = _Clock(progress)
    with clock.step("write", 0.6):
        written = {post: correction.files(post, job.post_options.get(post)) for post in job.post}
        programs = joined({post: files for post, (files, _) in written.items()})
    correction = replace(
        correction, findings=correction.findings + tuple(f for _, noticed in written.values() for f in noticed)
    )
    _judge_warnings(correction)
    with clock.step("report", 0.65):
        reports, failed = _report_files(correction, job.report, correction.document())
    timing = {**correction.timing_s, **clock.seconds, "total": round(time.perf_counter() - started, 4)}
    correction = replace(correction, findings=correction.findings + failed, timing_s=timing)
    entries = [output_entry("program", name, content) for name, content in programs.items()]
    entries += [output_entry("report", name, content) for name, content in reports.items()]
    document = correction.document(entries)
    files = programs | reports | {output.MANIFEST: _json_bytes(document)}
    progress("write", 0.95)
    if not job.dry_run:
        output.write(job.out, files, force=job.force, inputs=_input_paths(job))
    for finding in correction.findings:
        if finding.level is not Level.INFO:
            _log.warning("%s", _told(finding))
    progress("done", 1.0)
    return Outcome(document, 8 if failed else 0, tuple(_summary(correction, list(programs), list(reports))))


def run(job: Job, progress: Progress = _silent) -> Correction:
    """Run a job in memory: read, register, correct and judge; nothing is written.

    Raises
    ------
    JobError, InputError, RegistrationError, PathError
        See the exit codes of each.
    """
    unknown = [name for name in job.override if name not in GATE_NAMES]
    if unknown:
        raise JobError(f"override: no gate is called '{printable(unknown[0])}'; gates are {', '.join(GATE_NAMES)}")
    for post in job.post:
        plugins.postprocessor(post, job.post_options.get(post, {}))  # a wrong option shows before the long work
    clock = _Clock(progress)
    with clock.step("read", 0.0):
        T_start, noticed = _start(job)
        inputs = _read(job)
    with clock.step("contour", 0.2):
        wanted = None if job.contour == "auto" else job.contour
        chosen = choose_contours(contours_of(inputs.part), inputs.path, wanted, job.gates.path_distance_mm)
        check_scan_unit(inputs.scan, inputs.part, chosen)
    with clock.step("register", 0.3):
        result = register_contours(chosen, inputs.scan, T_start, method=job.method, settings=job.registration)
        registration = PartRegistration(result, job.toolpath, job.gates)
        gates = overridden(registration_gates(result.contours, job.gates), job.override)
        _refuse(gates, RegistrationError)
    with clock.step("correct", 0.55):
        corrected = registration.apply(inputs.path)
        distance = registration.assignment(inputs.path).distance_mm[~inputs.path.rapid]
        gates += overridden(path_gates(corrected, distance, job.gates), job.override)
        _refuse(gates, PathError)
    findings = (*inputs.part.findings, *inputs.scan.findings, *inputs.path.findings, *noticed, *result.findings)
    findings += tuple(
        Finding(501, Level.WARN, f"gate {gate.name} was overridden: {gate.value:.4g}, limit {gate.limit:g}")
        for gate in gates
        if gate.state == "overridden"
    )
    return Correction(job, inputs, registration, corrected, gates, findings, clock.seconds)


def _start(job: Job) -> tuple[FloatArray | None, tuple[Finding, ...]]:
    """Return the start pose that the job gives, None where it is to be found."""
    if job.align == "auto":
        return None, ()
    if job.align == "given":
        return np.eye(4), ()
    alignment = read_alignment(Path(job.align))
    if not len(alignment.residuals_mm):
        return alignment.T_scan_part, ()
    worst = int(np.argmax(alignment.residuals_mm))
    text = f"datum pairs fit within {alignment.residuals_mm[worst]:.2f} mm; the worst is pair {worst + 1}"
    return alignment.T_scan_part, (Finding(403, Level.INFO, text, str(job.align)),)


def _read(job: Job) -> Inputs:
    """Read the three inputs; scan and path are read while the CAD kernel works in its own process.

    This thread waits for the CAD kernel, so that an interrupt reaches it and ends the child.
    """
    feed = {} if job.toolpath.feed_mm_min is None else {"feed_mm_min": job.toolpath.feed_mm_min}
    path_options = {**feed, **job.path_options}
    with ThreadPoolExecutor(1) as beside:
        scan = beside.submit(
            plugins.read_scan, job.scan, units=job.scan_units, limits=job.limits, options=job.scan_options
        )
        path = beside.submit(plugins.read_path, job.path, units=job.path_units, limits=job.limits, options=path_options)
        part = plugins.read_part(job.cad, units=job.cad_units, limits=job.limits, options=job.part_options)
        return Inputs(part, scan.result(), path.result())


def _refuse(gates: tuple[Gate, ...], error: type[RegistrationError] | type[PathError]) -> None:
    failed = [gate for gate in gates if gate.state == "fail"]
    if failed:
        told = [f"{gate.name}: {gate.text} is {gate.value:.4g}, limit {gate.limit:g}" for gate in failed]
        names = " ".join(f"--override {gate.name}" for gate in failed)
        raise error(f"no program: {'; '.join(told)}; look at the scan and the start pose, or allow it with {names}")


def _judge_warnings(correction: Correction) -> None:
    if not correction.job.strict:
        return
    warnings = [finding for finding in correction.findings if finding.level is Level.WARN]
    if warnings:
        raise WarningsError(f"no program, because of --strict: {'; '.join(_told(finding) for finding in warnings)}")


def _told(finding: Finding) -> str:
    return f"{finding.where}: {finding.message}" if finding.where else finding.message


def _input_paths(job: Job) -> list[Path]:
    return [job.cad, job.scan, job.path, *([job.align] if isinstance(job.align, Path) else [])]


def _names_known_before(job: Job) -> list[str]:
    names = [output.MANIFEST]
    names += ["report.pdf"] if "pdf" in job.report else []
    return names + (["report/"] if "png" in job.report else [])


def _json_bytes(document: Mapping[str, Any]) -> bytes:
    import json

    return (json.dumps(document, indent=1, allow_nan=False) + "\n").encode()


def _notes(correction: Correction) -> Iterator[str]:
    """Give the lines for the head of a program: no date, so that the same inputs give the same bytes."""
    result = correction.registration.result
    yield f"sicp-cam {versions()['sicp-cam']}, method {result.method}, coordinates in the {correction.job.frame} frame"
    inputs = correction.inputs
    for role, source in (("part", inputs.part.source), ("scan", inputs.scan.source), ("path", inputs.path.source)):
        if source is not None:
            yield f"{role} {Path(source.path).name} sha256 {source.sha256[:16]}"
    for gate in correction.gates:
        if gate.state == "overridden":
            yield f"gate {gate.name} overridden by the operator: {gate.value:.4g}, limit {gate.limit:g}"


def _report_files(
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
        except ReportError as error:
            failed += (Finding(702, Level.WARN, str(error), "report.pdf"),)
    return files, failed


def _summary(correction: Correction, programs: list[str], reports: list[str]) -> Iterator[str]:
    """Give the lines that an operator reads at the end of a run."""
    job, entry = correction.job, registration_entry(correction.registration.result)
    verdict = {"ok": "OK", "warn": "OK, with warnings", "fail": "FAILED"}[status(correction.findings, correction.gates)]
    coverage = min(contour["coverage"] for contour in entry["contours"])
    yield (
        f"{verdict}: {len(correction.corrected.nominal)} moves corrected with {job.method};"
        f" the scan shows {100.0 * coverage:.1f} % of the edge"
    )
    for name, words in (("out", "out of the surface"), ("normal", "across the edge")):
        rigid, after = entry["rigid"][name], entry["corrected"][name]
        if rigid and after:
            yield (
                f"distance to the scan {words} (RMS): {rigid['rms']:.3f} mm with the rigid pose,"
                f" {after['rms']:.3f} mm corrected"
            )
    if job.dry_run:
        yield "dry run: nothing was written"
        return
    for name in _tops(programs):
        yield f"program: {job.out / name}"
    for name in _tops(reports):
        yield f"{'pictures' if name == 'report' else 'report'}: {job.out / name}"
    yield f"result: {job.out / output.MANIFEST}"


def _tops(names: list[str]) -> list[str]:
    return list(dict.fromkeys(name.split("/")[0] for name in names))
