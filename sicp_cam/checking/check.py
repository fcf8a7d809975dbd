"""Check written programs: find them, read each back, judge its text and its path, and compare it with another one."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any

from sicp_cam import plugins
from sicp_cam.checking.comparison import Comparison, compared
from sicp_cam.checking.facts import path_facts
from sicp_cam.checking.review import ReviewLimits, review
from sicp_cam.checking.written_programs import WrittenProgram, programs_in
from sicp_cam.errors import InputError, JobError, printable
from sicp_cam.findings import Finding, Level
from sicp_cam.limits import DEFAULT_LIMITS, Limits
from sicp_cam.model import ToolPath
from sicp_cam.options.values import nearest, table
from sicp_cam.plugins.checkers import check_program, checker, options_taken
from sicp_cam.result_document import SCHEMA, findings_list, input_entry, versions
from sicp_cam.result_document import status as worst_of

__all__ = ["Check", "check", "programs_of"]

Options = Mapping[str, object]

NOT_JUDGED, UNREADABLE = 899, 903
"""Codes of the findings: the text of the program was judged by nobody; the program cannot be read."""

_FRAME_STATED = 317
"""Warns whoever corrects a path; that a written program says in which frame its points stand is as it should be."""


def _none() -> Options:
    return MappingProxyType({})


@dataclass(frozen=True, slots=True)
class Check:
    """What is to be checked.

    Parameters
    ----------
    targets
        Programs, or folders of programs, see `programs_in`.
    units
        Unit of programs that state none.
    against
        Another program of the same path, in the same frame, that each one is compared with.
    tolerance_mm, tolerance_deg
        How far tips and tool axes may be off from that.
    path_options, check_options, against_options
        What the readers, the checkers and `ReviewLimits`, and the reader of `against` take by name.
    limits
        Caps that readers and checkers keep.
    strict
        True if a warning is to end the check with exit code 7.
    """

    targets: tuple[Path, ...]
    units: str | None = None
    against: Path | None = None
    tolerance_mm: float = 0.002
    tolerance_deg: float = 0.002
    path_options: Options = field(default_factory=_none)
    check_options: Options = field(default_factory=_none)
    against_options: Options = field(default_factory=_none)
    limits: Limits = DEFAULT_LIMITS
    strict: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class _Judged:
    """One program: what was read, None if it could not be, what is to be told, and why nobody tried to read it."""

    file: Path
    path: ToolPath | None
    findings: tuple[Finding, ...]
    comparison: Comparison | None = None
    unread: str = ""


def check(job: Check) -> dict[str, Any]:
    """Check programs and return the document of the result.

    Returns
    -------
    dict
        `status`, `exit_code` (3 if a program cannot be read, 5 if one must not run, 7 for warnings if `strict`),
        `findings`, `inputs`, and for each program `facts`, see `path_facts`, and its findings.

    Raises
    ------
    JobError
        If an option is wrong, or a folder holds no program.
    InputError
        If `against` cannot be read.
    """
    programs = [program for target in job.targets for program in programs_in(target)]
    limits, rest = _review_limits(job.check_options)
    shared = _Shared(job, limits, _divided([each.file for each in programs], job, rest), _reference(job))
    judged = [_judged(each, shared) for each in programs if job.against is None or not _same(each.file, job.against)]
    if not judged:
        raise JobError(f"--against {printable(str(job.against))}: that is the only program; name another one to check")
    findings = [finding for each in judged for finding in each.findings]
    return {
        "schema": SCHEMA,
        "status": worst_of(findings, ()),
        "exit_code": _exit_code(judged, strict=job.strict),
        "findings": findings_list(findings),
        "inputs": [
            {**input_entry("path", each.path.source, len(each.path)), "path": str(each.file)}
            for each in judged
            if each.path is not None
        ],
        "programs": [_entry(each) for each in judged],
        "versions": dict(versions()),
    }


def programs_of(target: Path) -> tuple[Path, ...]:
    """Return the files by which the programs of a file or folder are read, see `programs_in`."""
    return tuple(program.file for program in programs_in(target))


# --- options ---


@dataclass(frozen=True, slots=True, eq=False)
class _Shared:
    """What holds for every program: the job, limits, options of its reader and checker by file, and the reference."""

    job: Check
    limits: ReviewLimits
    options: Mapping[Path, tuple[Options, Options]]
    reference: ToolPath | None


def _review_limits(options: Options) -> tuple[ReviewLimits, dict[str, object]]:
    own = {each.name for each in fields(ReviewLimits)}
    limits, problems = table(ReviewLimits, {key: value for key, value in options.items() if key in own})
    if limits is None:
        raise JobError(*(f"check.{key}: {problem}" for key, problem in problems.items()))
    return limits, {key: value for key, value in options.items() if key not in own}


def _divided(files: list[Path], job: Check, rest: Options) -> dict[Path, tuple[Options, Options]]:
    """Return what each file's reader and checker take; of one file all, as they say best what they do not know.

    Raises
    ------
    JobError
        If nobody takes an option.
    """
    suffix = job.path_options.get("format")
    named = str(suffix) if suffix is not None else None
    judges = {file: checker(file, suffix=named) for file in files}
    if len(files) == 1:
        _refuse_unknown(rest, set() if judges[files[0]] is None else set(rest))
        return {files[0]: (job.path_options, rest)}
    readers = {file: plugins.reader("path", file, suffix=named) for file in files if "path" in plugins.roles(file)}
    reading = {file: {"format", *options_taken(function, job.path_options)} for file, function in readers.items()}
    judging = {file: options_taken(function, rest) for file, function in judges.items() if function is not None}
    _refuse_unknown(job.path_options, set().union(*reading.values()), "path")
    _refuse_unknown(rest, set().union(*judging.values()))
    return {
        file: (_only(job.path_options, reading.get(file, set())), _only(rest, judging.get(file, set())))
        for file in files
    }


def _refuse_unknown(options: Iterable[str], taken: set[str], prefix: str = "check") -> None:
    own = [each.name for each in fields(ReviewLimits)] if prefix == "check" else []
    unknown = [key for key in options if key not in taken]
    if unknown:
        raise JobError(*(f"{prefix}.{printable(key)}: unknown option; {nearest(key, own)}" for key in unknown))


def _only(options: Options, names: set[str]) -> Options:
    return {key: value for key, value in options.items() if key in names}


def _reference(job: Check) -> ToolPath | None:
    if job.against is None:
        return None
    return plugins.read_path(job.against, units=job.units, limits=job.limits, options=job.against_options)


def _same(file: Path, other: Path) -> bool:
    return other.exists() and file.exists() and file.samefile(other)


# --- one program ---


def _judged(program: WrittenProgram, shared: _Shared) -> _Judged:
    job, file = shared.job, program.file
    reading, judging = shared.options[file]
    unread = program.unread if not reading else ""
    findings: list[Finding] = []
    try:
        findings += _text_findings(file, job, judging)
        if unread:
            what = f"no path was read, so none was judged: {unread}"
            findings.append(Finding(NOT_JUDGED, Level.INFO, what, printable(str(file))))
            return _Judged(file, None, tuple(findings), unread=unread)
        options = {**program.reading, **reading}
        path = plugins.read_path(file, units=job.units, limits=job.limits, options=options)
    except InputError as error:
        findings.append(Finding(UNREADABLE, Level.FAIL, str(error)))
        return _Judged(file, None, tuple(findings))
    findings += [replace(each, level=Level.INFO) if each.code == _FRAME_STATED else each for each in path.findings]
    findings += review(path, shared.limits, str(file))
    if shared.reference is None:
        return _Judged(file, path, tuple(findings))
    comparison = compared(
        path, shared.reference, str(file), tolerance_mm=job.tolerance_mm, tolerance_deg=job.tolerance_deg
    )
    return _Judged(file, path, (*findings, *comparison.findings), comparison)


def _text_findings(file: Path, job: Check, options: Options) -> Iterator[Finding]:
    suffix = job.path_options.get("format")
    function = checker(file, suffix=str(suffix) if suffix is not None else None)
    if function is not None:
        yield from check_program(function, file, limits=job.limits, options=options)
        return
    what = "no checker knows the words of this format; they were not judged"
    yield Finding(NOT_JUDGED, Level.INFO, what, printable(str(file)))


def _entry(judged: _Judged) -> dict[str, Any]:
    return {
        "path": str(judged.file),
        "status": worst_of(judged.findings, ()),
        "facts": None if judged.path is None else path_facts(judged.path),
        "unread": judged.unread or None,
        "against": None if judged.comparison is None else judged.comparison.facts,
        "findings": findings_list(judged.findings),
    }


def _exit_code(judged: list[_Judged], *, strict: bool) -> int:
    levels = {finding.level for each in judged for finding in each.findings}
    if any(each.path is None and not each.unread for each in judged):
        return InputError.exit_code
    if Level.FAIL in levels:
        return 5
    return 7 if strict and Level.WARN in levels else 0
