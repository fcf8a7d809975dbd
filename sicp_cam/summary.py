"""What an operator reads at the end of a run."""

from __future__ import annotations

from collections.abc import Iterator

from sicp_cam import output
from sicp_cam.report.statistics import uncertainty_summary
from sicp_cam.result import Correction
from sicp_cam.result_document import registration_entry, status, uncertainty_words

__all__ = ["summary"]


def summary(correction: Correction, programs: list[str], reports: list[str]) -> Iterator[str]:
    """Give the lines that an operator reads at the end of a run."""
    job, entry = correction.job, registration_entry(correction.registration.result)
    verdict = {"ok": "OK", "warn": "OK, with warnings", "fail": "FAILED"}[status(correction.findings, correction.gates)]
    coverage = min(contour["coverage"] for contour in entry["contours"])
    yield (
        f"{verdict}: {len(correction.corrected.nominal)} moves corrected with {job.method};"
        f" the scan shows {100.0 * coverage:.1f} % of the edge;"
        f" {uncertainty_words(uncertainty_summary(correction.registration.result.contours))}"
    )
    i, j, k = correction.corrected.corrected.axes.mean(axis=0)
    yield f"the tool comes from ({i:.2f}, {j:.2f}, {k:.2f}) in the scan frame; check that this is the outer side"
    for name, words in (("out", "out of the surface"), ("normal", "across the edge")):
        rigid, after = entry["rigid"][name], entry["corrected"][name]
        if rigid and after:
            yield (
                f"fit to the scan {words} (RMS): {rigid['rms']:.3f} mm with the rigid pose,"
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
