"""The command line: turns words into a job and a result into words.

A command lives in a module of its own, which is imported when the command is used; so is everything heavy.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

__all__ = ["COMMANDS", "main"]

COMMANDS = {
    "correct": ("sicp_cam.cli.correct:correct", "Correct a tool path to the scanned shape and write robot programs."),
    "inspect": ("sicp_cam.cli.inspect:inspect", "Say what is in a scan, a part or a path."),
    "convert": ("sicp_cam.cli.convert:convert", "Write a scan, a mesh or a path in another format, uncorrected."),
    "check": ("sicp_cam.cli.check:check", "Read written programs back and tell what is wrong with them."),
    "plugins": ("sicp_cam.cli.plugins_command:plugins", "List who reads and writes what, and what each one takes."),
    "settings": ("sicp_cam.cli.settings_command:settings", "List what a job may set, with types and defaults."),
    "doctor": ("sicp_cam.cli.doctor:doctor", "Say what this machine has, and what it lacks."),
}
"""Function and one-line description of each command."""

_EPILOGUE = (
    "Exit codes: 0 done; 1 a bug; 2 usage or job; 3 an input; 4 registration; 5 a gate of the path, or a program that "
    "must not run; 6 output refused; 7 warnings under --strict; 8 the program is written but a report failed; 130, 143 "
    "interrupted."
)
_SETTINGS = (
    "What --set takes: 'sicp-cam settings' lists the settings of registration, toolpath, gates and limits, "
    "'sicp-cam plugins NAME' the options of a reader or post, such as 'sicp-cam plugins val3'."
)


def main(argv: Sequence[str] | None = None) -> None:
    """Run the command line and exit with the code that its help lists.

    Parameters
    ----------
    argv
        The words behind the program's name; those of this process if left out.
    """
    from sicp_cam.cli.session import forgiving_streams, reported, terminable

    words = list(sys.argv[1:] if argv is None else argv)
    forgiving_streams()
    with terminable():
        code = reported(lambda: _dispatched(words), as_json="--json" in words)
    sys.exit(code)


def _dispatched(words: list[str]) -> int:
    import cyclopts

    from sicp_cam.errors import JobError

    app = cyclopts.App(
        name="sicp-cam",
        help="Correct CAM tool paths to the scanned shape of sagging composite parts with Subdivision-ICP.",
        help_epilogue=_EPILOGUE,
        version=_version,
        suppress_keyboard_interrupt=False,
        result_action="return_value",
    )
    for name, (function, help_text) in COMMANDS.items():
        epilogue = f"{_EPILOGUE}\n\n{_SETTINGS}" if name == "correct" else _EPILOGUE
        app.command(function, name=name, help=help_text, help_epilogue=epilogue)
    try:
        code = app(words, exit_on_error=False, print_error=False, verbose=False)
    except cyclopts.CycloptsError as error:
        text = " ".join(str(error).split())
        command = f" {words[0]}" if words and words[0] in COMMANDS else ""
        raise JobError(f"{text} See sicp-cam{command} --help.") from error
    except SystemExit:
        return 0  # rich leaves so when the reader of a help page has gone away
    return code if isinstance(code, int) else 0


def _version() -> str:
    from importlib.metadata import version

    return version("sicp-cam")
