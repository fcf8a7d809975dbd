"""The statements of a VAL3 program: events in their place among the moves, and the cut into several programs."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator

import numpy as np

from sicp_cam.model import BoolArray, Event, EventKind, ToolPath
from sicp_postprocessors.moves import events_in_order
from sicp_postprocessors.numbers import trimmed
from sicp_postprocessors.text import ascii_line, ascii_lines
from sicp_postprocessors.val3_motion import Motion
from sicp_postprocessors.val3_options import Val3Options
from sicp_postprocessors.val3_xml import Variable

__all__ = [
    "changes_tool_by_hand",
    "closing",
    "comments",
    "event_statements",
    "event_variables",
    "move_statements",
    "programs_of",
    "stopping",
    "tool_names",
]


def comments(text: str) -> list[str]:
    """Return text as comment lines of plain ASCII, without the mark that ends an XML character section."""
    return [f"// {line}" for line in ascii_lines(text.replace("]]>", "]] >"))]


def programs_of(rapid: BoolArray, longest: int) -> list[range]:
    """Cut the moves of a path into stretches of at most `longest`, before a rapid move where one is near.

    >>> programs_of(np.array([1, 0, 0, 1, 0, 0, 0], bool), 5)
    [range(0, 3), range(3, 7)]
    """
    stretches, start = [], 0
    while len(rapid) - start > longest:
        half = start + longest // 2 + 1
        retracts = np.flatnonzero(rapid[half : start + longest + 1])
        stop = half + int(retracts[-1]) if len(retracts) else start + longest
        stretches.append(range(start, stop))
        start = stop
    return [*stretches, range(start, len(rapid))]


def event_statements(path: ToolPath, options: Val3Options) -> dict[int, list[str]]:
    """Return the statements of the events before each move; those after the last one stand at the number of moves."""
    statements: dict[int, list[str]] = defaultdict(list)
    turns_back, runs = _turns_back(path), False
    for event in events_in_order(path):
        statements[event.before_move] += _event(event, options, runs, turns_back)
        if event.kind is EventKind.SPINDLE:
            runs = event.value != 0
        elif changes_tool_by_hand(event):
            runs = False
    return statements


def move_statements(motion: Motion, tools: list[str]) -> list[str]:
    """Return one statement for each move."""
    statements = [
        f"movel({point},{tool},{speed})" for point, tool, speed in zip(motion.points, tools, motion.speeds, strict=True)
    ]
    # Only the first move may take any way through space. Rapid moves stay straight: joint moves bow out, and near a
    # large part nobody has checked where to.
    statements[0] = statements[0].replace("movel", "movej")
    return statements


def closing(path: ToolPath) -> list[str]:
    """Return the statements after the last move and event: wait for it, and switch off what still runs."""
    last = {event.kind: event.value for event in events_in_order(path)}
    still = [kind for kind in (EventKind.SPINDLE, EventKind.COOLANT) if last.get(kind)]
    return ["waitEndMove()", *(line for kind in still for line in _off(kind, _turns_back(path)))]


def stopping(path: ToolPath) -> list[str]:
    """Return the statements that the controller runs when the application is stopped."""
    kinds = {event.kind for event in path.events}
    used = [kind for kind in (EventKind.SPINDLE, EventKind.COOLANT) if kind in kinds]
    return [line for kind in used for line in _off(kind, _turns_back(path))]


def event_variables(path: ToolPath, options: Val3Options) -> list[Variable]:
    """Return the variables that the statements of the events use, and no others."""
    kinds = {event.kind for event in path.events}
    variables = []
    if EventKind.SPINDLE in kinds:
        variables.append(Variable("doSpindle", "dio", [_link(options.spindle_link)]))
        if _turns_back(path):
            variables.append(Variable("doSpindleCcw", "dio", [_link(options.spindle_ccw_link)]))
        if options.spindle_speed == "num":
            variables.append(Variable("nSpindle", "num", [{"value": "0"}]))
        if options.spindle_speed == "aio":
            variables.append(Variable("aoSpindle", "aio", [_link(options.spindle_speed_link)]))
    if EventKind.COOLANT in kinds:
        variables.append(Variable("doCoolant", "dio", [_link(options.coolant_link)]))
    if any(_waits_for_operator(event) for event in path.events):
        variables.append(
            Variable("diContinue", "dio", [_link(options.continue_link)])
            if options.continue_link
            else Variable("bContinue", "bool", [{"value": "false"}])
        )
    return variables


def tool_names(path: ToolPath) -> list[str]:
    """Return the tool variable of each move: tTool, or tTool3 after tool 3 was called."""
    names = ["tTool"] * len(path)
    for event in events_in_order(path):
        if event.kind is EventKind.TOOL:
            names[event.before_move :] = [f"tTool{int(event.value)}"] * (len(path) - event.before_move)
    return names


def changes_tool_by_hand(event: Event) -> bool:
    """Say whether a tool is called after the path has begun: a robot has no word for it, so a person must act."""
    return event.kind is EventKind.TOOL and event.before_move > 0


def _waits_for_operator(event: Event) -> bool:
    return event.kind is EventKind.STOP or changes_tool_by_hand(event)


def _event(event: Event, options: Val3Options, spindle_runs: bool, turns_back: bool) -> Iterator[str]:
    if event.kind is EventKind.COMMENT:
        yield from comments(event.text)
    if event.kind in (EventKind.COMMENT, EventKind.OTHER):
        return
    # The interpreter runs ahead of the arm: without this the event would happen moves too early.
    yield "waitEndMove()"
    match event.kind:
        case EventKind.SPINDLE if event.value == 0:
            yield from _off(EventKind.SPINDLE, turns_back)
        case EventKind.SPINDLE:
            yield from _spindle_on(event.value, options, turns_back)
        case EventKind.COOLANT:
            yield f"doCoolant={'true' if event.value > 0 else 'false'}"
        case EventKind.DWELL:
            yield f"delay({trimmed(event.value, 3)})"
        case EventKind.TOOL:
            yield from comments(f"tool {int(event.value)} {event.text}")
        case EventKind.STOP:
            yield from comments(f"stop {event.text}")
    if changes_tool_by_hand(event) and spindle_runs:
        yield from _off(EventKind.SPINDLE, turns_back)
    if _waits_for_operator(event):
        yield from _operator(event, options)


def _spindle_on(rev_min: float, options: Val3Options, turns_back: bool) -> Iterator[str]:
    yield from comments(
        f"spindle {trimmed(abs(rev_min), 3)} rev/min {'counter-clockwise' if rev_min < 0 else 'clockwise'}"
    )
    value = trimmed(abs(rev_min) * options.speed_scale, 6)
    if options.spindle_speed == "num":
        yield f"nSpindle={value}"
    if options.spindle_speed == "aio":
        yield f"aioSet(aoSpindle,{value})"
    wanted, other = ("doSpindleCcw", "doSpindle") if rev_min < 0 else ("doSpindle", "doSpindleCcw")
    if turns_back:
        yield f"{other}=false"
    yield f"{wanted}=true"
    yield f"delay({trimmed(options.spindle_dwell_s, 3)})"


def _operator(event: Event, options: Val3Options) -> Iterator[str]:
    if options.log_messages:
        what = f"tool {int(event.value)}" if event.kind is EventKind.TOOL else "stop"
        yield f'logMsg("{ascii_line(f"{what} {event.text}", drop=chr(34) + chr(92))[:60]}")'
    if options.continue_link:
        # A whole press: an input that is still on from the stop before does not count.
        yield "wait(diContinue==false)"
        yield "wait(diContinue==true)"
    else:
        yield "bContinue=false"
        yield "wait(bContinue)"


def _off(kind: EventKind, turns_back: bool) -> list[str]:
    if kind is EventKind.COOLANT:
        return ["doCoolant=false"]
    return ["doSpindle=false", "doSpindleCcw=false"] if turns_back else ["doSpindle=false"]


def _turns_back(path: ToolPath) -> bool:
    return any(event.kind is EventKind.SPINDLE and event.value < 0 for event in path.events)


def _link(link: str) -> dict[str, str]:
    return {"link": link} if link else {}
