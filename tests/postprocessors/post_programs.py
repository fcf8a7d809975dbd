"""Programs for the tests of the posts, built from the model only."""

import numpy as np

from sicp_cam.model import Event, EventKind, Program, Status, ToolPath

NASTY = 'Hello "Robots"\nNext (x) ; % \' ]]> é 😀'


def leaning_axes(count, lean=0.3, turn=1.0):
    t = np.linspace(0.0, turn, count)
    axes = np.column_stack([lean * np.cos(t), lean * np.sin(t), np.ones(count)])
    return axes / np.linalg.norm(axes, axis=1, keepdims=True)


def path_of(tips, axes, feeds=600.0, rapid=False, events=(), **more):
    count = len(tips)
    lines = more.pop("lines", np.arange(count) + 10)
    return ToolPath(
        tips, axes, np.broadcast_to(feeds, count), np.broadcast_to(rapid, count), lines, tuple(events), **more
    )


def program_of(path, name="porthole", **more):
    return Program(name, path, (Status.COVERED,) * len(path), **more)


def simple_events():
    return (
        Event(0, EventKind.TOOL, 3.0, "LOADTL/3", 2),
        Event(0, EventKind.SPINDLE, 12000.0, "SPINDL/12000,CLW", 3),
        Event(1, EventKind.COOLANT, 1.0, "COOLNT/ON", 5),
        Event(2, EventKind.COMMENT, 0.0, "first side", 7),
        Event(3, EventKind.DWELL, 1.5, "DELAY/1.5", 9),
        Event(4, EventKind.STOP, 0.0, "STOP", 11),
        Event(5, EventKind.OTHER, 0.0, "INSERT/X", 13),
        Event(6, EventKind.COOLANT, 0.0, "COOLNT/OFF", 15),
        Event(6, EventKind.SPINDLE, 0.0, "SPINDL/OFF", 16),
    )


def simple_program(**more):
    """Rapid to the first point, four cuts with two feeds on an arc, rapid away; every kind of event."""
    t = np.linspace(0.0, 1.0, 6)
    tips = np.column_stack([100 * np.cos(t), 100 * np.sin(t), 5.0 + t / 7.0])
    feeds = [0.0, 2000.0, 2000.0, 900.0, 900.0, 0.0]
    rapid = [True, False, False, False, False, True]
    path = path_of(tips, leaning_axes(6), feeds, rapid, simple_events(), name="trim")
    more = {"notes": ("corrected by sicp_cam", "gates: all passed"), **more}
    return program_of(path, **more)


def nasty_program():
    path = path_of(
        [[0, 0, 5], [10, 0, 5]],
        leaning_axes(2),
        [0, 600],
        [True, False],
        [
            Event(0, EventKind.TOOL, 1.0, NASTY),
            Event(1, EventKind.COMMENT, 0.0, NASTY),
            Event(1, EventKind.STOP, 0.0, NASTY),
            Event(2, EventKind.OTHER, 0.0, NASTY),
        ],
        name=NASTY,
    )
    return program_of(path, name=NASTY, notes=(NASTY, "\x1b]0;x\x07 bell", "(msg,active)"))


def straight_program(count, feed=600.0, rapid=False, spacing=1.0, **more):
    """A straight row of moves along x with upright axes; the first is rapid."""
    tips = np.column_stack([np.arange(count) * spacing, np.zeros(count), np.zeros(count)])
    rapid = np.broadcast_to(rapid, count).copy()
    rapid[0] = True
    events = more.pop("events", ())
    return program_of(path_of(tips, [[0, 0, 1]] * count, feed, rapid, events), **more)
