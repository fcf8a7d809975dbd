from __future__ import annotations

import copy
import io
import socket
from dataclasses import replace

import pypdf
import pytest

from sicp_cam.errors import ReportError
from sicp_cam.report import pdf
from sicp_cam.report.compose import document
from sicp_cam.report.document import Picture, ReportDocument, Table, Verdict
from sicp_cam.report.figures import correction_along_contour
from sicp_cam.report.pdf import build


@pytest.fixture(scope="module")
def made(result, job) -> ReportDocument:
    return document(
        result, {"correction_1.png": correction_along_contour(job.contour)}, job="porthole", version="1.2.3"
    )


def pages(content: bytes) -> list[str]:
    return [page.extract_text() for page in pypdf.PdfReader(io.BytesIO(content)).pages]


def flat(text: str) -> str:
    return "".join(text.split())


def test_the_first_page_tells_the_whole_story(made: ReportDocument) -> None:
    text = pages(build(made))[0]
    for expected in ("porthole", "WARNINGS", "part.step", "a&b.ply", "abababababab", "1.234", "90.5 %", "OVERRIDDEN"):
        assert expected in text
    words = " ".join(text.split())
    assert "normal (across the edge, in the surface): positive = into the material" in words
    assert "out (of the surface): positive = outward, the scan surface lies above the contour" in words
    assert "both = sqrt(normal² + out²)" in words
    assert "how well the curve fits the scan, not how true it is" in words
    assert "largest turn of the tool axis beyond the rigid pose, degrees 16.25 15 OVERRIDDEN" in words
    assert "Gate axis_deg failed and was overridden: 16.25 against the limit 15." in words
    assert "two stretches are bridged" in words


def test_every_foot_has_page_version_and_safety(made: ReportDocument) -> None:
    found = pages(build(made))
    assert len(found) >= 2
    for number, text in enumerate(found, start=1):
        assert f"page {number} of {len(found)}" in text
        assert "sicp-cam 1.2.3" in text
        assert "not a safety function: verify at reduced speed" in text


def test_pictures_are_embedded_with_their_captions(made: ReportDocument) -> None:
    reader = pypdf.PdfReader(io.BytesIO(build(made)))
    assert sum(len(page.images) for page in reader.pages) == 1
    assert "Contour 1: what the correction adds" in " ".join(reader.pages[-1].extract_text().split())


@pytest.mark.parametrize(
    "name",
    [
        '<font color="[[[1]]]">red</font>.ply',
        '<img src="http://x/"/>.ply',
        "</para><para>&lt;&amp;.ply",
        "<onDraw name='x'/>.ply",
    ],
)
def test_markup_in_names_is_printed_and_not_obeyed(result, monkeypatch, name: str) -> None:
    def no_network(*args: object, **options: object) -> None:
        raise AssertionError("the report reached for the network")

    monkeypatch.setattr(socket.socket, "connect", no_network)
    changed = copy.deepcopy(result)
    changed["inputs"][0]["role"] = name
    changed["findings"][1]["message"] = name
    text = flat("".join(pages(build(document(changed, {}, job=name, version=name)))))
    assert text.count(flat(name)) >= 4


def test_control_characters_and_unknown_letters_are_spelled_out(result) -> None:
    text = flat(pages(build(document(result, {}, job="a\x1b]0;b\u202e窓 Ω é", version="1")))[0])
    assert flat("a\\x1b]0;b\\u202e\\u7a93 Ω é") in text


def test_same_document_same_bytes(made: ReportDocument) -> None:
    assert build(made) == build(made)
    assert build(made) != build(replace(made, verdict=Verdict.OK))


def test_long_texts_wrap_and_long_tables_split(made: ReportDocument) -> None:
    rows = tuple(("WARN", str(n), f"row-{n} " + "x" * 300, "w" * 80) for n in range(120))
    table = Table("Findings", ("level", "code", "what", "where"), rows, (1.2, 1, 9, 4))
    found = pages(build(replace(made, tables=(table,), reasons=("y" * 500,), job="z" * 300)))
    assert len(found) > 4
    text = flat("".join(found))
    assert all(f"row-{n}x" in text for n in range(120))
    assert "y" * 500 in text
    assert all(page.count("where") >= 1 for page in found[1:3])


@pytest.mark.parametrize(("count", "told"), [(67, "7 further rows are not"), (61, "1 further row is not")])
def test_what_is_not_printed_is_counted(made: ReportDocument, monkeypatch, count: int, told: str) -> None:
    assert pdf.MOST_ROWS == 5000
    monkeypatch.setattr(pdf, "MOST_ROWS", 60)
    rows = tuple((str(n),) for n in range(count))
    found = pages(build(replace(made, tables=(Table("t", ("n",), rows, (1,)),), pictures=())))
    assert any(f"{told} printed" in page for page in found[-2:])


@pytest.mark.parametrize("png", [b"", b"not a picture", b"\x89PNG\r\n\x1a\n" + b"\x00" * 40])
def test_a_broken_picture_is_a_report_error(made: ReportDocument, png: bytes) -> None:
    with pytest.raises(ReportError, match=r"report\.pdf"):
        build(replace(made, pictures=(Picture(png, "broken"),)))
