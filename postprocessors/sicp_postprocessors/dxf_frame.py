"""What every R2000 drawing must hold besides its entities: header, tables, blocks and objects, with fixed handles.

A drawing is a row of lines, group codes and values in turn. Each entry of a table, block or dictionary names its owner
by handle, and the same handle must not come twice; those below `FIRST_FREE_HANDLE` are used here.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

__all__ = ["FIRST_FREE_HANDLE", "MODEL_SPACE", "document"]

MODEL_SPACE = 0x17
"""Handle of the block record that owns the entities of the model space."""
FIRST_FREE_HANDLE = 0x100
"""Handles from here on are free for entities."""
_FIRST_LAYER_HANDLE = 0x40
_LAYERS = "0 TABLE|2 LAYER|5 1|330 0|100 AcDbSymbolTable|70 "
_LAYER = "0 LAYER|5 {handle:X}|330 1|100 AcDbSymbolTableRecord|100 AcDbLayerTableRecord|2 {name}|70 0|62 {colour}|"
_SOLID = "6 Continuous"

_HEADER = "9 $ACADVER|1 AC1015|9 $DWGCODEPAGE|3 ANSI_1252|9 $HANDSEED|5 {handle:X}|9 $MEASUREMENT|70 1|9 $INSUNITS|70 4"
_BEFORE_LAYERS = (
    "0 TABLE|2 VPORT|5 8|330 0|100 AcDbSymbolTable|70 0|0 ENDTAB",
    "0 TABLE|2 LTYPE|5 2|330 0|100 AcDbSymbolTable|70 3",
    "0 LTYPE|5 24|330 2|100 AcDbSymbolTableRecord|100 AcDbLinetypeTableRecord|2 ByBlock|70 0|3 |72 65|73 0|40 0.0",
    "0 LTYPE|5 25|330 2|100 AcDbSymbolTableRecord|100 AcDbLinetypeTableRecord|2 ByLayer|70 0|3 |72 65|73 0|40 0.0",
    "0 LTYPE|5 26|330 2|100 AcDbSymbolTableRecord|100 AcDbLinetypeTableRecord|2 Continuous|70 0|3 |72 65|73 0|40 0.0",
    "0 ENDTAB",
)
_AFTER_LAYERS = (
    "0 ENDTAB",
    "0 TABLE|2 STYLE|5 5|330 0|100 AcDbSymbolTable|70 1",
    "0 STYLE|5 29|330 5|100 AcDbSymbolTableRecord|100 AcDbTextStyleTableRecord|2 Standard|70 0|40 0.0|41 1.0|50 0.0",
    "71 0|42 2.5|3 txt|4 |0 ENDTAB",
    "0 TABLE|2 VIEW|5 7|330 0|100 AcDbSymbolTable|70 0|0 ENDTAB",
    "0 TABLE|2 UCS|5 6|330 0|100 AcDbSymbolTable|70 0|0 ENDTAB",
    "0 TABLE|2 APPID|5 3|330 0|100 AcDbSymbolTable|70 1",
    "0 APPID|5 2A|330 3|100 AcDbSymbolTableRecord|100 AcDbRegAppTableRecord|2 ACAD|70 0|0 ENDTAB",
    "0 TABLE|2 DIMSTYLE|5 4|330 0|100 AcDbSymbolTable|70 1|100 AcDbDimStyleTable",
    "0 DIMSTYLE|105 2B|330 4|100 AcDbSymbolTableRecord|100 AcDbDimStyleTableRecord|2 Standard|70 0|0 ENDTAB",
    "0 TABLE|2 BLOCK_RECORD|5 9|330 0|100 AcDbSymbolTable|70 2",
    "0 BLOCK_RECORD|5 17|330 9|100 AcDbSymbolTableRecord|100 AcDbBlockTableRecord|2 *Model_Space",
    "0 BLOCK_RECORD|5 1B|330 9|100 AcDbSymbolTableRecord|100 AcDbBlockTableRecord|2 *Paper_Space",
    "0 ENDTAB",
)
_BLOCKS = (
    "0 BLOCK|5 18|330 17|100 AcDbEntity|8 0|100 AcDbBlockBegin|2 *Model_Space|70 0",
    "10 0.0|20 0.0|30 0.0|3 *Model_Space|1 ",
    "0 ENDBLK|5 19|330 17|100 AcDbEntity|8 0|100 AcDbBlockEnd",
    "0 BLOCK|5 1C|330 1B|100 AcDbEntity|8 0|100 AcDbBlockBegin|2 *Paper_Space|70 0",
    "10 0.0|20 0.0|30 0.0|3 *Paper_Space|1 ",
    "0 ENDBLK|5 1D|330 1B|100 AcDbEntity|8 0|100 AcDbBlockEnd",
)
_OBJECTS = (
    "0 DICTIONARY|5 C|330 0|100 AcDbDictionary|281 1|3 ACAD_GROUP|350 D",
    "0 DICTIONARY|5 D|330 C|100 AcDbDictionary|281 1",
)


def document(remarks: Iterable[str], layers: Mapping[str, int], entities: Iterable[str], next_handle: int) -> str:
    """Return the text of a drawing in mm.

    Parameters
    ----------
    remarks
        Lines of plain text for the head.
    layers
        The number of the colour of each layer.
    entities
        The lines of the entities.
    next_handle
        The first handle that is not used.
    """
    lines = [part for remark in remarks for part in ("999", remark)]
    lines += _section("HEADER", _lines(_HEADER.format(handle=next_handle)))
    lines += _section("TABLES", [*_lines(*_BEFORE_LAYERS), *_layer_table(layers), *_lines(*_AFTER_LAYERS)])
    lines += _section("BLOCKS", _lines(*_BLOCKS))
    lines += _section("ENTITIES", entities)
    lines += _section("OBJECTS", _lines(*_OBJECTS))
    return "\n".join([*lines, "0", "EOF", ""])


def _section(name: str, content: Iterable[str]) -> list[str]:
    return ["0", "SECTION", "2", name, *content, "0", "ENDSEC"]


def _layer_table(layers: Mapping[str, int]) -> list[str]:
    """Return the table of layers up to its end; the layer 0 must be there."""
    lines = _lines(f"{_LAYERS}{len(layers) + 1}")
    for handle, (name, colour) in enumerate([("0", 7), *layers.items()], _FIRST_LAYER_HANDLE):
        lines += _lines(_LAYER.format(handle=handle, name=name, colour=colour) + _SOLID)
    return lines


def _lines(*tags: str) -> list[str]:
    """Return the lines of tags that are written `code value|code value`."""
    pairs = (pair.partition(" ") for text in tags for pair in text.split("|"))
    return [part for code, _, value in pairs for part in (code, value)]
