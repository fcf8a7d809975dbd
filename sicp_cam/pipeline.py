"""The whole way of a run: read, choose the contour, register, correct, judge, write, report. Each step one line."""

from __future__ import annotations

import json
import logging
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from sicp_cam import output, plugins
from sicp_cam.alignment import read_alignment
from sicp_cam.beside import beside
from sicp_cam.correction import (
    PartRegistration,
    check_units,
    choice_findings,
    choose_contours,
    contours_of,
    refuse_twins,
)
from sicp_cam.errors import InputError, JobError, PathError, RegistrationError, WarningsError
from sicp_cam.findings import Finding, Level
from sicp_cam.job import Job
from sicp_cam.model import FloatArray, Program, Scan, Status, ToolPath
from sicp_cam.output.names import joined
from sicp_cam.registration.register import register_contours
from sicp_cam.result import Correction, Inputs, input_paths, report_files, told
from sicp_cam.result_document import output_entry
from sicp_cam.summary import summary
from sicp_cam.toolpath.gates import Gate, overridden, value_and_limit
from sicp_cam.toolpath.path_gates import path_gates
from sicp_cam.toolpath.registration_gates import registration_gates

__all__ = ["Correction", "Outcome", "Progress", "correct", "run"]

Progress = Callable[[str, float], None]
"""Told the name of each step and the fraction of the whole that is done."""

DATUM_WARNING_MM = 3.0
"""Misfit of a datum pair above which the operator is warned."""

_log = logging.getLogger(__name__)


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
        output.check_free(job.out, _names_known_before(job), job.force, input_paths(job))
    try:
        return _corrected_and_written(job, progress)
    except (InputError, RegistrationError, PathError, WarningsError):
        if job.force and not job.dry_run and (names := output.supersede(job.out, input_paths(job))):
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
        reports, failed = report_files(correction, job.report, correction.document())
    timing = {**correction.timing_s, **clock.seconds, "total": round(time.perf_counter() - started, 4)}
    correction = replace(correction, findings=correction.findings + failed, timing_s=timing)
    main = dict(correction.reading(post, job.post_options.get(post), files) for post, (files, _) in written.items())
    entries = [output_entry("program", name, content, main.get(name)) for name, content in programs.items()]
    entries += [output_entry("report", name, content) for name, content in reports.items()]
    document = correction.document(entries)
    files = programs | reports | {output.MANIFEST: _json_bytes(document)}
    progress("write", 0.95)
    if not job.dry_run:
        output.write(job.out, files, force=job.force, inputs=input_paths(job))
    for finding in correction.findings:
        if finding.level is not Level.INFO:
            _log.log(logging.ERROR if finding in failed else logging.WARNING, "%s", told(finding))
    for gate in correction.gates:
        if gate.state == "warn":
            _log.warning("%s", _gate_line(gate))
    progress("done", 1.0)
    return Outcome(document, 8 if failed else 0, tuple(summary(correction, list(programs), list(reports))))


def run(job: Job, progress: Progress = _silent) -> Correction:
    """Run a job in memory: read, register, correct and judge; nothing is written.

    Raises
    ------
    JobError, InputError, RegistrationError, PathError
        See the exit codes of each.
    """
    for post in job.post:
        plugins.postprocessor(post, job.post_options.get(post, {}))  # a wrong option shows before the long work
    plugins.check_reader("part", job.cad, job.part_options)
    plugins.check_reader("scan", job.scan, job.scan_options)
    plugins.check_reader("path", job.path, job.path_options)
    clock = _Clock(progress)
    with clock.step("read", 0.0):
        T_start, noticed = _start(job)
        inputs = _read(job)
    _check_posts(job, inputs.path)
    with clock.step("contour", 0.2):
        inputs = replace(inputs, part=replace(inputs.part, contours=contours_of(inputs.part)))
        wanted = None if job.contour == "auto" else job.contour
        chosen = choose_contours(contours_of(inputs.part), inputs.path, wanted, job.gates.path_distance_mm)
        noticed += choice_findings(contours_of(inputs.part), chosen, inputs.path)
        noticed += check_units(inputs.scan, inputs.part, chosen)
    with clock.step("register", 0.3):
        refuse_twins(contours_of(inputs.part), chosen, T_start, None)
        result = register_contours(chosen, inputs.scan, T_start, method=job.method, settings=job.registration)
        T_from = result.T_scan_part if T_start is None else T_start
        refuse_twins(contours_of(inputs.part), chosen, T_from, result.T_scan_part)
        registration = PartRegistration(result, job.toolpath, job.gates)
        gates = overridden(registration_gates(result, job.gates, T_start), job.override)
        _refuse(gates, RegistrationError)
    with clock.step("correct", 0.55):
        corrected = registration.apply(inputs.path)
        gates += overridden(path_gates(corrected, corrected.feed_distance_mm, job.gates), job.override)
        _refuse(gates, PathError)
    findings = (*inputs.part.findings, *inputs.scan.findings, *inputs.path.findings, *noticed, *result.findings)
    findings += tuple(
        Finding(501, Level.WARN, f"gate {gate.name} was overridden: {value_and_limit(gate)}")
        for gate in gates
        if gate.state == "overridden"
    )
    return Correction(job, inputs, registration, corrected, gates, findings, clock.seconds)


def _check_posts(job: Job, path: ToolPath) -> None:
    """Refuse at once what the posts would only find out after the long work.

    Raises
    ------
    JobError
        If two posts would write one file.
    PathError
        If a post cannot write this path, corrected or not.
    """
    written: dict[str, str] = {}
    status = (Status.APPROACH,) * len(path)
    nominal = Program(job.name, path, status, source_moves=np.arange(len(path)), placed=False)
    for name in job.post:
        post = plugins.postprocessor(name, job.post_options.get(name, {}))
        suffix = path.original.suffix if name == "same" and path.original is not None else post.suffix
        if suffix and suffix in written:
            raise JobError(
                f"post: {written[suffix]} and {name} both write {job.name}{suffix}; run them into two folders"
            )
        written[suffix] = name
        failed = [finding for finding in post.preflight(nominal) if finding.level is Level.FAIL]
        if failed:
            more = f"; and {len(failed) - 1} more" if len(failed) > 1 else ""
            raise PathError(f"no program: post {name} cannot write this path: {told(failed[0])}{more}")


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
    largest = float(alignment.residuals_mm[worst])
    text = f"datum pairs fit within {largest:.2f} mm; the worst is pair {worst + 1}"
    level = Level.WARN if largest > DATUM_WARNING_MM else Level.INFO
    return alignment.T_scan_part, (Finding(403, level, text, str(job.align)),)


def _read(job: Job) -> Inputs:
    """Read the three inputs; scan and path are read while the CAD kernel works in its own process.

    This thread waits for the CAD kernel, so that an interrupt reaches it and ends the child.
    """
    feed = {} if job.toolpath.feed_mm_min is None else {"feed_mm_min": job.toolpath.feed_mm_min}
    path_options = {**feed, **job.path_options}

    def scan_and_path() -> tuple[Scan, ToolPath]:
        return (
            plugins.read_scan(
                job.scan, units=job.scan_units, limits=job.limits, options=job.scan_options, recover=job.recover
            ),
            plugins.read_path(
                job.path, units=job.path_units, limits=job.limits, options=path_options, recover=job.recover
            ),
        )

    others = beside(scan_and_path)
    part = plugins.read_part(
        job.cad, units=job.cad_units, limits=job.limits, options=job.part_options, recover=job.recover
    )
    return Inputs(part, *others.result())


def _refuse(gates: tuple[Gate, ...], error: type[RegistrationError] | type[PathError]) -> None:
    failed = [gate for gate in gates if gate.state == "fail"]
    if failed:
        told = [_gate_line(gate) for gate in failed]
        names = " ".join(f"--override {gate.name}" for gate in failed)
        raise error(f"no program: {'; '.join(told)}; look at the scan and the start pose, or allow it with {names}")


def _gate_line(gate: Gate) -> str:
    return f"{gate.name}: {gate.text}: {value_and_limit(gate)}"


def _judge_warnings(correction: Correction) -> None:
    if not correction.job.strict:
        return
    warnings = [told(finding) for finding in correction.findings if finding.level is Level.WARN]
    warnings += [_gate_line(gate) for gate in correction.gates if gate.state == "warn"]
    if warnings:
        raise WarningsError(f"no program, because of --strict: {'; '.join(warnings)}")


def _names_known_before(job: Job) -> list[str]:
    names = [output.MANIFEST]
    names += ["report.pdf"] if "pdf" in job.report else []
    return names + (["report/"] if "png" in job.report else [])


def _json_bytes(document: Mapping[str, Any]) -> bytes:
    return (json.dumps(document, indent=1, allow_nan=False) + "\n").encode()
