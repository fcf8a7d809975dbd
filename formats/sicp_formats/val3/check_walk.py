"""Walk along a VAL3 application as it would run, as far as that is plain, and keep the moves that it makes in order.

Unlike the reader this never refuses: where a condition or a computed point hides what happens, the walk has a gap.
"""

from __future__ import annotations

import re
from collections.abc import Sequence

from sicp_cam.findings import Level
from sicp_formats.robot.motion import number_of
from sicp_formats.robot.program import RobotError, Statement, split_arguments
from sicp_formats.val3.check_files import Application, Code
from sicp_formats.val3.check_moves import MOVE
from sicp_formats.val3.check_report import Report
from sicp_formats.val3.check_steps import Step, Walker, blend_of, pose_of
from sicp_formats.val3.check_syntax import strings_blank
from sicp_formats.val3.words import OUTPUTS, WAITS

__all__ = ["walk"]

_CALL = re.compile(r"call\s+([A-Za-z_]\w*)\s*\(\s*\)", re.ASCII | re.I)
_TASK = re.compile(r"taskcreate(?:sync)?\s.*,\s*([A-Za-z_]\w*)\s*\(", re.ASCII | re.I)
_FOR = re.compile(r"for\s+([A-Za-z_]\w*)\s*=(.+?)\sto\s(.+?)(?:\sstep\s(.+))?", re.ASCII | re.I)
_ASSIGNMENT = re.compile(
    r"([A-Za-z_]\w*)(?::[A-Za-z_]\w*)?\s*(?:\[([^\]]*)\])?((?:\s*\.\s*\w+)*)\s*=(?!=)\s*(.*)", re.ASCII
)
_CHANGES = re.compile(r"(?:setFrame|link|append|insert|resize|delete)\s*\((.*)\)", re.ASCII)
_NAMES = re.compile(r"[A-Za-z_]\w*", re.ASCII)
_OPENS = re.compile(r"(?:if|for|while|do|switch)\b", re.I)
_CLOSES = re.compile(r"(?:endIf|endFor|endWhile|until|endSwitch)\b", re.I)
_WAIT = re.compile(rf"\b(?:{'|'.join(sorted(WAITS))})\s*\(")
_OUTPUT = re.compile(rf"(?:{'|'.join(sorted(OUTPUTS))})\s*\(")
_DEEPEST_CALL = 32


def walk(application: Application, report: Report, most: int) -> tuple[list[Step], frozenset[int]]:
    """Return the moves in the order in which they run, and those after which the arm comes to rest.

    Outputs that are switched while moves wait in the queue, and programs that end so, go into the report.

    Parameters
    ----------
    application, report
        What is walked along, and where findings go.
    most
        Moves and statements of loops after which the walk ends.
    """
    walker = Walker(application, report, most, 4 * most)
    programs = {code.name.lower(): code for code in application.programs}
    walker.roots = ["start"]
    while walker.roots:
        code = programs.get(walker.roots.pop(0))
        if code is not None and code.name.lower() not in walker.reached:
            _run_root(walker, code, programs, ends=True)
    for name, code in programs.items():
        if name not in walker.reached:
            _run_root(walker, code, programs, ends=False)
    return walker.steps, frozenset(walker.stops)


def _run_root(walker: Walker, code: Code, programs: dict[str, Code], *, ends: bool) -> None:
    walker.gap, walker.pending = True, False
    _run_program(walker, code, programs)
    if ends and walker.pending and code.statements:
        message = "the program ends while moves wait in the queue; write waitEndMove() behind the last one"
        walker.report.add(869, Level.WARN, message, code.file, code.statements[-1].line, kind="end")
    _rest(walker)


def _run_program(walker: Walker, code: Code, programs: dict[str, Code]) -> None:
    walker.reached.add(code.name.lower())
    if walker.depth >= _DEEPEST_CALL:
        return
    walker.depth += 1
    with walker.scope.within(frozenset(code.own)):
        _run(walker, code, code.statements, programs)
    walker.depth -= 1


def _run(walker: Walker, code: Code, statements: Sequence[Statement], programs: dict[str, Code]) -> None:
    at = 0
    while at < len(statements) and walker.left > 0:
        walker.left -= 1
        text = statements[at].text
        if text.startswith("//"):
            pass
        elif _OPENS.match(text):
            end = _block_end(statements, at)
            _block(walker, code, statements[at : end + 1], programs)
            at = end
        else:
            _statement(walker, code, text, statements[at].line, programs)
        at += 1


def _block_end(statements: Sequence[Statement], start: int) -> int:
    depth = 0
    for at in range(start, len(statements)):
        text = statements[at].text
        depth += bool(_OPENS.match(text)) - bool(_CLOSES.match(text))
        if depth == 0:
            return at
    return len(statements) - 1


def _block(walker: Walker, code: Code, block: Sequence[Statement], programs: dict[str, Code]) -> None:
    loop, body = _FOR.fullmatch(block[0].text), block[1:-1]
    moves = any("move" in each.text or "call" in each.text for each in body)
    turns = _turns(walker, loop) if loop is not None and moves else None
    if loop is not None and turns is not None:
        for value in turns:
            walker.scope.set(loop[1], value)
            _run(walker, code, body, programs)
            if walker.left <= 0:
                return
        return
    # How often, or whether at all, a block runs is not known: it is walked once, with a gap before and behind.
    if _WAIT.search(block[0].text) or _WAIT.search(block[-1].text):
        _rest(walker)
    _forget(walker, block)
    walker.gap = True
    _run(walker, code, body, programs)
    _forget(walker, block)
    walker.gap = True


def _turns(walker: Walker, loop: re.Match[str]) -> range | None:
    try:
        first, last, step = (walker.scope.whole(text) for text in (loop[2], loop[3], loop[4] or "1"))
    except RobotError:
        return None
    return range(first, last + (1 if step > 0 else -1), step) if step else None


def _forget(walker: Walker, block: Sequence[Statement]) -> None:
    for each in block:
        assigned = _FOR.fullmatch(each.text) or _ASSIGNMENT.fullmatch(each.text)
        if assigned and not each.text.startswith("//"):
            walker.scope.set(assigned[1], None)


def _statement(walker: Walker, code: Code, text: str, line: int, programs: dict[str, Code]) -> None:
    move = MOVE.fullmatch(text)
    if move:
        _move(walker, code, move[1], split_arguments(move[2]), line)
    elif call := _CALL.fullmatch(text):
        called = programs.get(call[1].lower())
        if called is None:
            walker.gap = True
        else:
            _run_program(walker, called, programs)
    elif task := _TASK.match(text):
        walker.roots.append(task[1].lower())
    elif _WAIT.search(strings_blank(text)):
        _rest(walker)
    elif text.lower().startswith("call"):
        _call_with_arguments(walker, text, programs)
    else:
        _other(walker, code, text, line)


def _call_with_arguments(walker: Walker, text: str, programs: dict[str, Code]) -> None:
    """Walk along a program whose parameters are not known: its moves stand alone."""
    name = re.match(r"call\s+([A-Za-z_]\w*)\s*\(", text, re.ASCII | re.I)
    called = programs.get(name[1].lower()) if name else None
    walker.scope.changed.update(_NAMES.findall(strings_blank(text)))
    walker.gap = True
    if called is not None and called.name.lower() not in walker.reached:
        _run_program(walker, called, programs)
    walker.gap = True


def _other(walker: Walker, code: Code, text: str, line: int) -> None:
    plain = strings_blank(text)
    assignment = _ASSIGNMENT.fullmatch(plain)
    if assignment:
        name, index, attribute, value = assignment.groups()
        variable = walker.application.variables.get(name)
        if name not in code.own and variable is not None and variable.type in ("dio", "aio"):
            _output(walker, code, line)
        number = number_of(value)
        whole = number is not None and number.is_integer() and not index and not attribute
        walker.scope.set(name, int(number) if whole and number is not None else None)
    elif _OUTPUT.match(plain):
        _output(walker, code, line)
    elif changes := _CHANGES.match(plain):
        walker.scope.changed.update(_NAMES.findall(changes[1]))


def _output(walker: Walker, code: Code, line: int) -> None:
    if walker.pending and (code.file, line) not in walker.told:
        walker.told.add((code.file, line))
        message = "an output is switched while moves wait in the queue, so before they end; write waitEndMove() first"
        walker.report.add(869, Level.WARN, message, code.file, line, kind="output")


def _rest(walker: Walker) -> None:
    walker.pending = False
    if walker.steps:
        walker.stops.add(len(walker.steps) - 1)


def _move(walker: Walker, code: Code, word: str, arguments: list[str], line: int) -> None:
    walker.pending = True
    if len(walker.steps) >= walker.most:
        walker.left = 0
        return
    pose, father = None, ""
    leave = reach = 0.0
    if len(arguments) >= 3:
        pose, father = pose_of(walker, code, arguments[-3], line)
        leave, reach = blend_of(walker, arguments[-1])
    if pose is None:
        father = ""
    walker.steps.append(Step(pose, father, word != "movej", leave, reach, walker.gap, code.file, line))
    walker.gap = False
