"""What a plug-in takes: the options of a reader or a post, as its own code tells them."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, is_dataclass
from types import MappingProxyType
from typing import Any

from sicp_cam.errors import JobError, printable
from sicp_cam.options.help import Option, dataclass_options, function_options, summary
from sicp_cam.options.values import nearest
from sicp_cam.plugins.registry import CHECKERS, FORMATS, POSTPROCESSORS, ROLES, WRITERS, Plugin, owner, owners

__all__ = ["PluginOptions", "keyword_names", "plugin_options", "takes_any", "with_name"]

_GIVEN_BY_US = ("units", "limits", "recover", "unit")
_FORMAT = Option("format", "text", "none", "Suffix to treat the file as, where its own one does not tell what it is.")


@dataclass(frozen=True, slots=True)
class PluginOptions:
    """A plug-in and what it takes.

    Parameters
    ----------
    plugin
        Which one.
    role
        One of `ROLES`, `post`, `out` for a writer, or `check` for a checker.
    summary
        What it is, in one line.
    options
        What it takes by name.
    any_option
        True if it takes further names, which only its own documentation tells.
    capabilities
        What the programs of a post can hold: a few words for each matter.
    """

    plugin: Plugin
    role: str
    summary: str
    options: tuple[Option, ...]
    any_option: bool
    capabilities: Mapping[str, str] = field(default_factory=lambda: MappingProxyType({}))

    @property
    def prefix(self) -> str:
        """What stands before the name of an option behind `--set`: `post.val3`, or `scan`."""
        return f"post.{self.plugin.name}" if self.role == "post" else self.role


def with_name(name: str) -> tuple[Plugin, ...]:
    """Return the plug-ins that are meant by `val3`, `scan.asc` or, in every role, `.asc`; imports none.

    Raises
    ------
    JobError
        If there is none, with the nearest name; or if two distributions claim it.
    """
    groups = [owners(group) for group in (FORMATS, WRITERS, POSTPROCESSORS)]
    suffix = name.removeprefix(".").lower()
    wanted = dict.fromkeys([name, name.lower(), *(f"{role}.{suffix}" for role in ROLES)])
    found = [owner(claims[key]) for key in wanted for claims in groups if key in claims]
    checkers, checked = owners(CHECKERS), suffix.removeprefix("check.")
    found += [owner(checkers[checked])] if checked in checkers else []
    if not found:
        raise JobError(f"no plug-in '{printable(name, 60)}'; {nearest(name, {key for each in groups for key in each})}")
    return tuple(found)


def plugin_options(plugin: Plugin) -> PluginOptions:
    """Import a plug-in and describe what it takes.

    Raises
    ------
    JobError
        If it cannot be imported.
    """
    thing = plugin.load()
    if plugin.group == FORMATS:
        taken = (_FORMAT, *function_options(thing, keyword_names(thing)))
        return PluginOptions(plugin, plugin.name.partition(".")[0], summary(thing), taken, takes_any(thing))
    if plugin.group in (WRITERS, CHECKERS):
        role = "out" if plugin.group == WRITERS else "check"
        return PluginOptions(
            plugin, role, summary(thing), function_options(thing, keyword_names(thing)), takes_any(thing)
        )
    kind = getattr(thing, "Options", None)
    told = str(getattr(thing, "summary", "") or summary(thing))
    capabilities: Mapping[str, str] = getattr(thing, "capabilities", dict)()
    if isinstance(kind, type) and is_dataclass(kind):
        return PluginOptions(plugin, "post", told, dataclass_options(kind), False, capabilities)
    return PluginOptions(plugin, "post", told, (), True, capabilities)


def keyword_names(reader: Callable[..., Any]) -> list[str]:
    """Return the names of the options that a reader takes, in its own order."""
    parameters = inspect.signature(reader).parameters.items()
    return [name for name, p in parameters if p.kind is p.KEYWORD_ONLY and name not in _GIVEN_BY_US]


def takes_any(reader: Callable[..., Any]) -> bool:
    """Return whether a reader also takes options that its signature does not name."""
    return any(p.kind is p.VAR_KEYWORD for p in inspect.signature(reader).parameters.values())
