"""Which distributions offer readers and postprocessors, as registered; loads one when it is asked for.

Entry-point group `sicp_cam.formats`: the name is `role.suffix` with a role of `ROLES`, the value a function
`read(path, *, units, limits, **options)`; one that can repair damaged files also takes `recover`. Group
`sicp_cam.writers`: `role.suffix` with the role scan or part, the value a function `write(thing, *, unit, **options)`
that returns bytes. Group `sicp_cam.postprocessors`: the value is a `Postprocessor` class. Group `sicp_cam.checkers`:
the name is a suffix, the value a function `check(path, *, limits, **options)` that returns findings. A name that
another distribution owns is taken over only through the group with `.override` appended.
"""

from __future__ import annotations

from dataclasses import dataclass
from importlib.metadata import EntryPoint, entry_points
from typing import Any

from sicp_cam.errors import JobError, printable
from sicp_cam.findings import Finding, Level

__all__ = [
    "CHECKERS",
    "FORMATS",
    "POSTPROCESSORS",
    "ROLES",
    "WRITERS",
    "Plugin",
    "broken",
    "listing",
    "owner",
    "owners",
]

FORMATS = "sicp_cam.formats"
POSTPROCESSORS = "sicp_cam.postprocessors"
WRITERS = "sicp_cam.writers"
CHECKERS = "sicp_cam.checkers"
ROLES = ("scan", "part", "path")


@dataclass(frozen=True, slots=True)
class Plugin:
    """An entry point as it is registered; nothing of it has been imported.

    Parameters
    ----------
    group
        `FORMATS`, `WRITERS`, `POSTPROCESSORS` or `CHECKERS`.
    name
        `role.suffix`, the name of a post, or the suffix that a checker judges.
    value
        `module:attribute`.
    owner
        Distribution and version that registered it.
    override
        True if it takes the name over from another distribution.
    """

    group: str
    name: str
    value: str
    owner: str
    override: bool

    def load(self) -> Any:
        """Import and return what is registered.

        Raises
        ------
        JobError
            If the import fails; the message names the plug-in, its owner and the reason.
        """
        try:
            return EntryPoint(self.name, self.value, self.group).load()
        except Exception as error:
            reason = printable(f"{type(error).__name__}: {error}")
            raise JobError(
                f"plug-in {self.name} ({self.value}, from {self.owner}) cannot be loaded: {reason}; "
                "update or uninstall that distribution"
            ) from error


def listing() -> tuple[tuple[Plugin, ...], tuple[Finding, ...]]:
    """Return every registered plug-in, in order of name, and what is wrong with the registration; imports none."""
    plugins: list[Plugin] = []
    findings: list[Finding] = []
    for group in (FORMATS, WRITERS, POSTPROCESSORS, CHECKERS):
        for name, claims in sorted(owners(group).items()):
            plugins += claims
            findings += _registration_findings(group, name, claims)
    return tuple(plugins), tuple(findings)


def broken(plugins: tuple[Plugin, ...]) -> tuple[Finding, ...]:
    """Import the given plug-ins and report those that fail."""
    findings = []
    for plugin in plugins:
        try:
            plugin.load()
        except JobError as error:
            findings.append(Finding(802, Level.WARN, str(error), plugin.owner))
    return tuple(findings)


def owners(group: str) -> dict[str, list[Plugin]]:
    """Return the claims on each name of a group, those of its override group behind the others; imports none."""
    claims: dict[str, list[Plugin]] = {}
    told: dict[int, str] = {}
    registered = entry_points()
    for override in (False, True):
        for entry in registered.select(group=f"{group}.override" if override else group):
            dist = told.get(id(entry.dist)) or _owner_of(entry)
            told[id(entry.dist)] = dist  # looking it up parses the metadata of the distribution
            name = entry.name if group == POSTPROCESSORS else entry.name.lower()
            claims.setdefault(name, []).append(Plugin(group, name, entry.value, dist, override))
    return claims


def _owner_of(entry: EntryPoint) -> str:
    return f"{entry.dist.name} {entry.dist.version}" if entry.dist else "an unknown distribution"


def owner(claims: list[Plugin]) -> Plugin:
    """Return the plug-in that has a name among those that claim it.

    Raises
    ------
    JobError
        If two claim it in the same group; the message names both.
    """
    claiming = [plugin for plugin in claims if plugin.override] or claims
    if len(claiming) > 1:
        raise JobError(_claimed_twice(claiming))
    return claiming[0]


def _claimed_twice(claiming: list[Plugin]) -> str:
    where = f"group {claiming[0].group}{'.override' if claiming[0].override else ''}"
    both = " and ".join(f"{plugin.owner} ({plugin.value})" for plugin in claiming)
    return (
        f"{claiming[0].name}: claimed by {both} in the {where}; "
        "uninstall one of them, or let one register it as an override"
    )


def _registration_findings(group: str, name: str, claims: list[Plugin]) -> list[Finding]:
    findings = []
    try:
        chosen = owner(claims)
        if chosen.override and len(claims) > 1:
            lost = ", ".join(plugin.owner for plugin in claims if plugin is not chosen)
            findings.append(Finding(803, Level.INFO, f"{name}: {chosen.owner} takes it over from {lost}", name))
    except JobError as error:
        findings.append(Finding(801, Level.WARN, str(error), name))
    role, _, suffix = name.partition(".")
    if group in (FORMATS, WRITERS) and (role not in ROLES or not suffix):
        message = f"{name} from {claims[0].owner}: not of the form role.suffix with role {', '.join(ROLES)}; never used"
        findings.append(Finding(804, Level.WARN, message, name))
    return findings
