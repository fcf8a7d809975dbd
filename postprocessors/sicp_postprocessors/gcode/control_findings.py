"""What the control must hold or do that the program does not say, and numbers that it would read otherwise than meant.

Codes: 623 no work offset, 626 what the control must see to itself, 628 feeds that it cannot read.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from sicp_cam.findings import Finding, Level
from sicp_cam.model import BoolArray, EventKind, FloatArray, Program
from sicp_postprocessors.checks import event_place, frame_name, stretch_findings
from sicp_postprocessors.gcode.feeds import least_feed
from sicp_postprocessors.gcode.options import GCodeOptions
from sicp_postprocessors.gcode.positions import Positions
from sicp_postprocessors.gcode.site_words import lacks_length
from sicp_postprocessors.options import flag

__all__ = ["control_findings", "feed_findings", "named_at_start", "number_findings"]


def control_findings(post: str, program: Program, options: GCodeOptions) -> Iterator[Finding]:
    """Return what the control must hold or do that the program does not say."""
    if not options.work_offset:
        message = (
            f"no work offset is written: the coordinates are those of the {frame_name(program)} frame, and the active "
            "offset must hold that frame"
        )
        if options.control.offset:
            message += f"; name one with {flag(post, 'work_offset', options.control.offset)}"
        yield Finding(623, Level.INFO, message)
    if options.words == "rotary" and not options.machine:
        message = (
            f"no machine is named: {options.machine_name}, with both rotary axes in the head, is taken; another one "
            f"stands otherwise at the same angles: name it with {flag(post, 'machine', options.machine_name)}"
        )
        yield Finding(626, Level.WARN, message)
    yield from _length_findings(post, program, options)
    if options.dialect == "linuxcnc" and options.knows_tip and not options.tcp_on:
        message = (
            "no words switch the kinematics that hold the tip: they must be active; if the site has words for it, name "
            f"them with {flag(post, 'tcp_on', 'M428')} and {flag(post, 'tcp_off', 'M429')}"
        )
        yield Finding(626, Level.WARN, message)


def named_at_start(program: Program) -> bool:
    """Say whether the path names its tool before the first move."""
    return any(event.kind is EventKind.TOOL and event.before_move == 0 for event in program.path.events)


def _length_findings(post: str, program: Program, options: GCodeOptions) -> Iterator[Finding]:
    if not lacks_length(options):
        return
    why = "so the control takes whatever tool length is active, or none"
    if not options.tool and not named_at_start(program):
        message = f"no H word is written, as nothing names the tool, {why}; name it with {flag(post, 'tool', 'N')}"
        yield Finding(626, Level.WARN, message)
    for event in program.path.events:
        if event.kind is EventKind.TOOL and not int(event.value):
            message = f"no H word is written for tool 0, {why}; give the tool its number in CAM"
            yield Finding(626, Level.WARN, message, event_place(event))


def number_findings(post: str, program_count: int, options: GCodeOptions) -> Iterator[Finding]:
    """Return that the O numbers of subprograms are larger than the control calls: it would take their last digits.

    Parameters
    ----------
    post
        Name of the post.
    program_count
        How many parts the path has; one needs no subprogram.
    options
        Number of the main program.
    """
    control = options.control
    if program_count < 2 or control.subprograms is None or not control.subprograms.numbered:
        return
    last = (options.number or 0) + program_count
    if last > control.largest_called:
        message = (
            f"its {program_count} subprograms have the numbers up to {last}, larger than {control.largest_called}, "
            f"which {options.dialect_name} does not call; choose a smaller {flag(post, 'program_number', 'N')}"
        )
        yield Finding(626, Level.FAIL, message)


def feed_findings(
    program: Program, options: GCodeOptions, positions: Positions, feeds: FloatArray
) -> Iterator[Finding]:
    """Return which cutting moves have a feed, or a time, that cannot be written as the control reads it."""
    cuts = ~positions.program.path.rapid
    if options.states_time:
        yield from _time_findings(program, options, positions, feeds, cuts)
        return
    slow = positions.told((feeds < least_feed(options)) & cuts)
    message = "the feed is too slow for the decimals of the program and would be written as 0; correct the path"
    yield from stretch_findings(program.path, slow, 628, Level.FAIL, message)
    largest = options.control.largest_feed
    if largest is not None:
        fast = positions.told((feeds > largest) & cuts)
        message = f"the feed is above F{largest:.0f}, the largest that {options.dialect_name} takes; correct the path"
        yield from stretch_findings(program.path, fast, 628, Level.FAIL, message)


def _time_findings(
    program: Program, options: GCodeOptions, positions: Positions, feeds: FloatArray, cuts: BoolArray
) -> Iterator[Finding]:
    path, least = program.path, least_feed(options)
    begins = np.zeros(len(feeds), np.bool_)
    begins[:1] = cuts[:1]
    message = "the path begins with a cutting move, whose time is not known; begin with a rapid move"
    yield from stretch_findings(path, positions.told(begins), 628, Level.FAIL, message)
    long = (feeds < least) & cuts & ~begins
    message = f"the move takes more than {1.0 / least:g} minutes, too long for inverse time; divide it in CAM"
    yield from stretch_findings(path, positions.told(long), 628, Level.FAIL, message)
    most = options.control.largest_inverse or np.inf
    short = (feeds >= most * (1.0 - 1e-9)) & cuts & ~begins
    message = f"the move takes less than 1/{most:.9g} minutes and is made slower"
    yield from stretch_findings(path, positions.told(short), 628, Level.INFO, message)
