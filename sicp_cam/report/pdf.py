"""A report document as a PDF file: the same document gives the same bytes.

Text reaches reportlab only escaped, so that markup in a file name is printed and not obeyed; there is no clock in the
file and no network access in making it.
"""

from __future__ import annotations

import io
from typing import Any
from xml.sax.saxutils import escape

from reportlab.lib.colors import HexColor
from reportlab.lib.enums import TA_RIGHT
from reportlab.lib.pagesizes import A4
from reportlab.lib.styles import ParagraphStyle
from reportlab.lib.units import mm
from reportlab.pdfbase import pdfmetrics
from reportlab.pdfbase.ttfonts import TTFont
from reportlab.pdfgen.canvas import Canvas
from reportlab.platypus import (
    CondPageBreak,
    Flowable,
    Image,
    KeepTogether,
    Paragraph,
    SimpleDocTemplate,
    Spacer,
    TableStyle,
)
from reportlab.platypus import Table as LaidOutTable
from reportlab.platypus.doctemplate import LayoutError

from sicp_cam.errors import ReportError, printable
from sicp_cam.report.document import Picture, ReportDocument, Table, Verdict
from sicp_cam.report.typeface import BOLD_FILE, REGULAR_FILE, literal

__all__ = ["MOST_ROWS", "build"]

MOST_ROWS = 5000
"""Longest table that is printed; what is left out is counted below it."""

_REGULAR, _BOLD = "SicpSans", "SicpSans-Bold"
_MARGIN = 18 * mm
_FRAME_PADDING = 6.0
_WIDTH = A4[0] - 2 * _MARGIN - 2 * _FRAME_PADDING
_PICTURE_HEIGHT = 0.385 * A4[1]
_COLOURS = {Verdict.OK: "#1d7a3a", Verdict.WARNINGS: "#b36b00", Verdict.FAILED: "#b01818"}
_SAFETY = "not a safety function: verify at reduced speed"


def build(document: ReportDocument) -> bytes:
    """Return the document as a PDF file of A4 pages.

    Raises
    ------
    ReportError
        If a picture is not a PNG file that can be read, or the pages cannot be laid out.
    """
    _register_fonts()
    file = io.BytesIO()
    pages = SimpleDocTemplate(
        file,
        pagesize=A4,
        invariant=1,
        pageCompression=1,
        leftMargin=_MARGIN,
        rightMargin=_MARGIN,
        topMargin=16 * mm,
        bottomMargin=20 * mm,
        title=literal(f"{document.title}: {document.job}"),
        author=literal(f"sicp-cam {document.version}"),
        creator="sicp-cam",
    )
    try:
        pages.build(_story(document), canvasmaker=_canvas_maker(document))
    except (OSError, ValueError, SyntaxError, LayoutError) as error:
        raise ReportError(f"report.pdf: the pages cannot be laid out ({printable(str(error))})") from error
    return file.getvalue()


def _story(document: ReportDocument) -> list[Flowable]:
    story: list[Flowable] = [_text(document.title, 18, bold=True), _text(f"Job: {document.job}", 11), Spacer(1, 3 * mm)]
    story += _verdict(document)
    for index, table in enumerate(document.tables):
        story += _table(table)
        if index == 0:
            story += [Spacer(1, 3.5 * mm), _text("Signs", 11, bold=True)]
            story += [_text(line, 8.5) for line in document.sign_convention]
    for picture in document.pictures:
        story += [Spacer(1, 4 * mm), _picture(picture)]
    return story


def _verdict(document: ReportDocument) -> list[Flowable]:
    colour = HexColor(_COLOURS[document.verdict])
    word = _text(document.verdict.value, 26, bold=True, colour=colour)
    bar = LaidOutTable([[word]], colWidths=[_WIDTH])
    bar.setStyle(
        TableStyle([("BOX", (0, 0), (-1, -1), 1.5, colour), ("BOTTOMPADDING", (0, 0), (-1, -1), 3 * mm)]),
    )
    return [bar, Spacer(1, 1.5 * mm), *(_text(reason, 9.5) for reason in document.reasons)]


def _table(table: Table) -> list[Flowable]:
    heading = [CondPageBreak(30 * mm), Spacer(1, 3.5 * mm), _text(table.title, 11, bold=True), Spacer(1, 1 * mm)]
    shown = table.rows[:MOST_ROWS]
    cells = [[_text(cell, 7.5, bold=True, right=i >= table.numeric) for i, cell in enumerate(table.head)]]
    cells += [[_text(cell, 7.5, right=i >= table.numeric) for i, cell in enumerate(row)] for row in shown]
    widths = [_WIDTH * width / sum(table.widths) for width in table.widths]
    laid_out = LaidOutTable(cells, colWidths=widths, repeatRows=1)
    laid_out.setStyle(
        TableStyle(
            [
                ("VALIGN", (0, 0), (-1, -1), "TOP"),
                ("TOPPADDING", (0, 0), (-1, -1), 1.5),
                ("BOTTOMPADDING", (0, 0), (-1, -1), 2.0),
                ("LEFTPADDING", (0, 0), (-1, -1), 3),
                ("RIGHTPADDING", (0, 0), (-1, -1), 3),
                ("BACKGROUND", (0, 0), (-1, 0), HexColor("#e9edf2")),
                ("LINEBELOW", (0, 0), (-1, -1), 0.25, HexColor("#c4c9d0")),
            ]
        )
    )
    left_out = len(table.rows) - len(shown)
    rows_are = "row is" if left_out == 1 else "rows are"
    notes = [f"{left_out} further {rows_are} not printed; result.json has them all."] if left_out else []
    return [*heading, laid_out, Spacer(1, 1 * mm), *(_text(note, 8) for note in [*notes, table.note] if note)]


def _picture(picture: Picture) -> Flowable:
    image = Image(io.BytesIO(picture.png))
    scale = min(_WIDTH / image.imageWidth, _PICTURE_HEIGHT / image.imageHeight)
    image.drawWidth, image.drawHeight = image.imageWidth * scale, image.imageHeight * scale
    return KeepTogether([image, _text(picture.caption, 8.5)])


def _text(
    text: str, size: float, *, bold: bool = False, right: bool = False, colour: HexColor | None = None
) -> Paragraph:
    style = ParagraphStyle(
        "plain",
        fontName=_BOLD if bold else _REGULAR,
        fontSize=size,
        leading=size * 1.3,
        textColor=colour or HexColor("#1a1a1a"),
        **({"alignment": TA_RIGHT} if right else {}),
    )
    return Paragraph(escape(literal(text)), style)


def _register_fonts() -> None:
    for name, file in ((_REGULAR, REGULAR_FILE), (_BOLD, BOLD_FILE)):
        if name not in pdfmetrics.getRegisteredFontNames():
            pdfmetrics.registerFont(TTFont(name, str(file)))


def _canvas_maker(document: ReportDocument) -> type[Canvas]:
    """Return a canvas that holds the pages back until their number is known, and then writes the foot of each."""
    left = literal(f"sicp-cam {document.version}")

    class Paged(Canvas):  # type: ignore[misc]  # reportlab has no types
        def __init__(self, *args: Any, **options: Any) -> None:
            super().__init__(*args, **options)
            self._held: list[dict[str, Any]] = []

        def showPage(self) -> None:  # noqa: N802 - reportlab's name
            self._held.append(dict(self.__dict__))
            self._startPage()

        def save(self) -> None:
            for number, page in enumerate(self._held, start=1):
                self.__dict__.update(page)
                self.setFont(_REGULAR, 8)
                self.setFillColor(HexColor("#505050"))
                self.drawString(_MARGIN, 10 * mm, left)
                self.drawCentredString(A4[0] / 2, 10 * mm, _SAFETY)
                self.drawRightString(A4[0] - _MARGIN, 10 * mm, f"page {number} of {len(self._held)}")
                super().showPage()
            super().save()

    return Paged
