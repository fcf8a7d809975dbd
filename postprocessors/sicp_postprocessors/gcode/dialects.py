"""What controls differ in, as data: words, numbers, and the lines that open and close a program."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

__all__ = ["DIALECTS", "Dialect", "Subprograms"]

_TOWARDS_HOLDER = "points from the tip to the holder"


@dataclass(frozen=True, slots=True)
class Subprograms:
    """How a program is divided into subprograms.

    `{name}` is the name of the subprogram, `{number}` its O number; `file` is that of its file without suffix.
    """

    call: str
    start: tuple[str, ...]
    end: tuple[str, ...]
    numbered: bool = False
    suffix: str = ""
    lower_case: bool = False


@dataclass(frozen=True, slots=True)
class Dialect:
    """Words that a family of controls expects.

    Parameters
    ----------
    family
        The control, as the head of the program names it.
    orientations
        For each way to state the tool axis, the first being the usual one: what the head says of its words.
    tip_on
        For each of them, the lines that switch tool tip control on; `{tool}` is the H word of the tool, or nothing.
    length_on, length_off
        Words of the tool length, where they are not those of tip control: `{tool}` is the H word; left out without a
        tool's number. `loaded_length` takes the length of the tool in the spindle; empty where no word does.
    tip_off
        The word that switches it off, before a tool change and at the end; may be empty.
    tip_control
        False: the control does not know the tip, and gets the linear axes as the machine must move them.
    metric, inch
        Words of the unit; empty where it is stated elsewhere, None where programs in that unit are not written.
    modes
        Further lines of modes. `{feed}` is the feed mode, `{path}` the path tolerance.
    vector
        Templates of the words of the tool axis; of three numbers, or six: the axis twice.
    block
        Template of a move: `{code}`, `{tips}`, `{turn}`, `{feed}`.
    codes
        What stands at `{code}` of a rapid and of a cutting block, and what ends a rapid block; `vector_codes` where
        those of blocks with vectors are others.
    sign
        Sign of numbers: "" for minus only, "+" for both.
    program
        Lines before and after everything else, `{name}` and `{unit}` within.
    named
        "plain" or "upper": names hold letters, digits and underscores only, two letters first or all capitals; the
        file is called like the program; empty where the control takes the name of any file.
    number
        Template of the O line, empty where programs have no numbers; `smallest_number` where one must have it;
        `largest_program` the largest of a program, `largest_called` of one that M98 calls.
    tool, spindle, pause, stop
        Lines of events.
    offset
        An example of a work offset; empty where one is not chosen by a word.
    block_number, unnumbered, always_numbered, largest_number
        How blocks are numbered, first characters of lines that are not, whether all are, when they restart.
    shorter_way, stated_way
        The words by which rotary axes go the shorter way, and to the angle stated; empty where machines are set so.
    largest_inverse, inverse_decimals
        Largest F under G93, and its decimals; None where the control has no G93.
    feed_point, largest_feed
        F always has a point, as it may count thousandths without; its most per minute, None where none is known.
    dwells
        Words of the dwell time that may be chosen.
    """

    family: str
    orientations: Mapping[str, str]
    tip_on: Mapping[str, tuple[str, ...]]
    tip_off: str
    suffix: str
    comment: str
    metric: str | None = "G21"
    inch: str | None = "G20"
    length_on: str = ""
    length_off: str = ""
    loaded_length: str = ""
    tip_control: bool = True
    modes: tuple[str, ...] = ("{unit} G90 {feed} G17 G40",)
    vector: str = "I{} J{} K{}"
    block: str = "{code} {tips} {turn}{feed}{end}"
    codes: tuple[str, str, str] = ("G0", "G1", "")
    vector_codes: tuple[str, str, str] | None = None
    sign: str = ""
    first: tuple[str, ...] = ()
    last: tuple[str, ...] = ("M30",)
    named: str = ""
    number: str = ""
    smallest_number: int | None = None
    largest_program: int = 99_999_999
    largest_called: int = 9_999
    tool: tuple[str, ...] = ("T{tool} M6",)
    spindle: tuple[tuple[str, ...], tuple[str, ...]] = (("S{speed} M3",), ("S{speed} M4",))
    pause: tuple[str, ...] = ("G4 P{seconds}",)
    stop: str = "M0"
    offset: str = "G54"
    block_number: str = "N{} "
    unnumbered: str = "%O(;o"
    always_numbered: bool = False
    largest_number: int = 99_999
    longest_line: int = 255
    shorter_way: str = ""
    stated_way: str = ""
    largest_inverse: float | None = 99_999.0
    inverse_decimals: int = 4
    feed_point: bool = False
    largest_feed: float | None = None
    dwells: tuple[str, ...] = ()
    subprograms: Subprograms | None = None
    vector_decimals: int = 6


_ROTARY = "rotary words {machine}"
_ISO_SUB = Subprograms("M98 P{number}", ("{o}",), ("M99",), numbered=True)
_FANUC_LIKE = MappingProxyType({"vector": f"I J K {_TOWARDS_HOLDER}", "rotary": _ROTARY})


def _only(words: str) -> Mapping[str, str]:
    return MappingProxyType({"rotary": words})


DIALECTS: Mapping[str, Dialect] = MappingProxyType(
    {
        # P of a dwell counts milliseconds on Fanuc and takes no decimal point; X takes seconds with one.
        "fanuc": Dialect(
            family="Fanuc",
            orientations=_FANUC_LIKE,
            tip_on=MappingProxyType({"vector": ("G43.5{tool}",), "rotary": ("G43.4{tool}",)}),
            tip_off="G49",
            suffix=".nc",
            comment="({})",
            first=("%",),
            last=("M30", "%"),
            number="O{:04d}",
            length_on="G43{tool}",
            length_off="G49",
            pause=("G4 X{seconds}",),
            largest_inverse=9_999.999,
            inverse_decimals=3,
            feed_point=True,
            dwells=("X", "P_MS"),
            subprograms=_ISO_SUB,
        ),
        # G710 and G700 are Siemens' own metric and inch, feeds included. ORIWKS and ORIVECT or ORIAXES say in which
        # frame orientations are read and what is interpolated, which another program may have set otherwise.
        "siemens": Dialect(
            family="Siemens 840D TRAORI",
            orientations=MappingProxyType({"vector": f"A3 B3 C3 {_TOWARDS_HOLDER}", "rotary": _ROTARY}),
            tip_on=MappingProxyType({"vector": ("TRAORI", "ORIWKS ORIVECT"), "rotary": ("TRAORI", "ORIWKS ORIAXES")}),
            tip_off="TRAFOOF",
            suffix=".mpf",
            named="plain",
            comment="; {}",
            metric="G710",
            inch="G700",
            vector="A3={} B3={} C3={}",
            pause=("G4 F{seconds}",),
            dwells=("F",),
            unnumbered="%;",
            longest_line=512,
            subprograms=Subprograms("{name}", (), ("M17",), suffix=".spf"),
        ),
        # F in programs in inches is read in different units by different models: they are written in mm.
        "heidenhain": Dialect(
            family="Heidenhain TNC, conversational",
            orientations=MappingProxyType(
                {
                    "rotary": _ROTARY,
                    "vector": f"TX TY TZ {_TOWARDS_HOLDER}, NX NY NZ repeat it: tool deltas must be 0",
                }
            ),
            tip_on=MappingProxyType({"rotary": ("M128",), "vector": ("M128",)}),
            tip_off="M129",
            suffix=".H",
            comment="; {}",
            metric="",
            inch=None,
            modes=(),
            vector="NX{} NY{} NZ{} TX{} TY{} TZ{}",
            codes=("L", "L", " R0 FMAX"),
            vector_codes=("LN", "LN", " FMAX"),
            sign="+",
            named="upper",
            first=("BEGIN PGM {name} MM",),
            last=("M30", "END PGM {name} MM"),
            tool=("TOOL CALL {tool} Z",),
            spindle=(("TOOL CALL S{speed}", "M3"), ("TOOL CALL S{speed}", "M4")),
            pause=("CYCL DEF 9.0 DWELL TIME", "CYCL DEF 9.1 DWELL {seconds}"),
            stop="STOP",
            offset="",
            block_number="{} ",
            unnumbered="",
            always_numbered=True,
            largest_number=999_999_999,
            shorter_way="M126",
            stated_way="M127",
            largest_feed=99_999.0,
            largest_inverse=None,
            subprograms=Subprograms("CALL PGM {name}.H", ("BEGIN PGM {name} MM",), ("END PGM {name} MM",)),
            vector_decimals=7,
        ),
        "haas": Dialect(
            family="Haas G234",
            orientations=_only(_ROTARY),
            tip_on=MappingProxyType({"rotary": ("G234{tool}",)}),
            tip_off="G49",
            suffix=".nc",
            comment="({})",
            first=("%",),
            last=("M30", "%"),
            number="O{:05d}",
            smallest_number=1,
            largest_program=99_999,
            largest_called=99_999,
            length_on="G43{tool}",
            length_off="G49",
            largest_inverse=9_999.999,
            inverse_decimals=3,
            feed_point=True,
            dwells=("P", "P_MS"),
            subprograms=_ISO_SUB,
        ),
        # No tip control of its own: kinematics with M428 or the like are the site's, and so are those words.
        "linuxcnc": Dialect(
            family="LinuxCNC",
            orientations=_only(_ROTARY),
            tip_on=MappingProxyType({"rotary": ()}),
            tip_off="",
            length_on="G43{tool}",
            length_off="G49",
            loaded_length="G43",
            suffix=".ngc",
            comment="({})",
            modes=("{unit} G90 {feed} G17 G40", "G64 P{path}"),
            first=("%",),
            last=("M30", "%"),
            largest_inverse=1e7,
            dwells=("P",),
            subprograms=Subprograms("o<{name}> call", ("o<{name}> sub",), ("o<{name}> endsub", "M2"), lower_case=True),
        ),
        "plain": Dialect(
            family="ISO without tool tip control",
            orientations=_only(_ROTARY),
            tip_on=MappingProxyType({"rotary": ()}),
            tip_off="",
            length_on="G43{tool}",
            length_off="G49",
            tip_control=False,
            suffix=".nc",
            comment="({})",
            first=("%",),
            last=("M30", "%"),
            number="O{:04d}",
            largest_inverse=9_999.999,
            inverse_decimals=3,
            feed_point=True,
            dwells=("P", "X", "P_MS", "F"),
            subprograms=_ISO_SUB,
        ),
    }
)
