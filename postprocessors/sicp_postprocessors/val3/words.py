"""What VAL3 says for each verb of a robot, apart from the moves."""

from __future__ import annotations

from collections.abc import Iterator

from sicp_cam.model import Program
from sicp_postprocessors.numbers import trimmed
from sicp_postprocessors.robot import RobotPostprocessor, stop_words
from sicp_postprocessors.text import ascii_line
from sicp_postprocessors.val3.options import Val3Options

__all__ = ["Val3Words", "tool_name"]


class Val3Words(RobotPostprocessor):
    """The verbs of a robot that need no more than the options."""

    Options = Val3Options
    options: Val3Options

    def comment(self, text: str) -> str:
        """Return a comment."""
        return f"// {text}"

    def comments(self, text: str) -> list[str]:
        """Return text as comments, without the mark that ends an XML character section."""
        return RobotPostprocessor.comments(self, text.replace("]]>", "]] >"))

    def wait(self) -> Iterator[str]:
        """Return the wait for the arm."""
        yield "waitEndMove()"

    def switch(self, signal: str, on: bool) -> Iterator[str]:
        """Return the assignment that switches an output; those of the option `outputs` have variables of their own."""
        yield f"{self.options.user_outputs.get(signal, signal)}={'true' if on else 'false'}"

    def delay(self, seconds: float) -> Iterator[str]:
        """Return a pause."""
        yield f"delay({trimmed(seconds, 3)})"

    def tool(self, number: int, text: str, *, first: bool) -> Iterator[str]:
        """Return a remark on the tool, and what it weighs: the arm is at rest when it is told."""
        yield from RobotPostprocessor.tool(self, number, text, first=first)
        if self.options.payload is not None:
            if not first:
                yield from self.wait()
            yield f"setPayload({tool_name(number)},nMass,trMass,nInertia)"

    def operator(self, text: str) -> Iterator[str]:
        """Return the wait for an input, or for a variable that the operator sets."""
        if self.options.log_messages:
            yield f'logMsg("{ascii_line(stop_words(text).replace("]]>", "]] >"), drop=chr(34) + chr(92))[:60]}")'
        if self.options.continue_input:
            # A whole press: an input that is still on from the stop before does not count.
            yield "wait(diContinue==false)"
            yield "wait(diContinue==true)"
        else:
            yield "bContinue=false"
            yield "wait(bContinue)"

    def spindle_signals(self) -> tuple[str, str]:
        """Return the names of the spindle's outputs: those that are linked."""
        options = self.options
        return "doSpindle" if options.spindle_output else "", "doSpindleCcw" if options.spindle_ccw_output else ""

    def coolant_signal(self) -> str:
        """Return the name of the coolant's output, if one is linked."""
        return "doCoolant" if self.options.coolant_output else ""

    def spindle_speed(self, rev_min: float) -> Iterator[str]:
        """Return the speed as a number or analog output, where the options ask for it."""
        value = trimmed(rev_min * self.options.speed_scale, 6)
        if self.options.spindle_speed == "num":
            yield f"nSpindle={value}"
        if self.options.spindle_speed == "aio":
            yield f"aioSet(aoSpindle,{value})"

    def finish(self, program: Program) -> Iterator[str]:
        """Wait for the last move: the application ends when its program does."""
        yield from self.wait()

    def remarks(self, program: Program) -> Iterator[str]:
        """Return how the points are meant."""
        options, world = self.options, "the robot's world is at the shoulder (axes 1 and 2), not on the base plate"
        yield self.frame_remark(program, "fPart")
        if options.world_origin == "base_plate":
            pose = "the scan frame is taken to lie there" if options.cell is None else "cell was measured from there"
            height = trimmed(options.shoulder_height_mm, 3)
            yield f"{world}, which is {height} mm below; {pose}, and fPart is shifted by that"
        else:
            yield world if options.cell is None else f"{world}; cell was measured from the shoulder"
        yield "points: mm and degrees, R = Rx Ry Rz, in frame fPart; tool Z points out of the flange into the work"
        yield from self.run_remarks()


def tool_name(number: int) -> str:
    """Return the name of a tool variable, -1 for the one that the path does not name.

    >>> tool_name(3), tool_name(-1)
    ('tTool3', 'tTool')
    """
    return f"tTool{number}" if number >= 0 else "tTool"
