"""The user's options of sbatch: which are submit's own, and where a word is a value and where it would be a script."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Sequence

from .folder import InputError

# Options that decide what a result means, or where submit finds it: they are not the user's.
_OWN = {"array": "a", "cpus-per-task": "c", "nodes": "N", "ntasks": "n", "output": "o", "error": "e", "dependency": "d", "chdir": "D",
        "job-name": "J", "signal": "", "open-mode": "", "parsable": "", "requeue": "", "no-requeue": "", "wrap": "", "test-only": "",
        "threads-per-core": "", "hint": "", "export": "", "export-file": "", "wait": "W", "quiet": "Q", "help": "h", "version": "V",
        "usage": "", "comment": "", "clusters": "M", "cluster": "", "no-kill": "k", "extra-node-info": "B", "cores-per-socket": "",
        "sockets-per-node": "", "ntasks-per-node": "", "ntasks-per-core": "", "ntasks-per-socket": "", "ntasks-per-gpu": "",
        "cpus-per-gpu": "", "overcommit": "O", "input": "i", "batch": "", "uid": "", "gid": ""}
_OWN_SHORT = {short for short in _OWN.values() if short}
# Of the others, those that take no value, or only one after "=": the word that follows is not theirs.
_FLAGS = {"contiguous", "exclusive", "get-user-env", "hold", "ignore-pbs", "nice", "oversubscribe", "propagate", "reboot", "spread-job",
          "use-min-nodes", "verbose", "container-id", "mem-bind-verbose", "stepmgr", "resv-ports"}
_SHORT_FLAGS = {"H", "s", "v"}
_FULL_NAMES = {"t": "time"}
MEMORY = ("mem", "mem-per-cpu", "mem-per-gpu")  # exclude one another


@dataclass(frozen=True)
class Option:
    name: str
    value: str | None
    words: tuple[str, ...]


def parsed(words: Sequence[str]) -> list[Option]:
    """Throws InputError for options that are submit's own, and for what sbatch would take as a script."""
    found: list[Option] = []
    rest = list(words)
    while rest:
        word = rest.pop(0)
        if word == "--" or not word.startswith("-") or word == "-":
            raise InputError(word or "''", "is no option of sbatch; a script is not expected after --")
        found += _long(word, rest) if word.startswith("--") else _short(word, rest)
    return found


def _value(word: str, rest: list[str]) -> str:
    if not rest or rest[0].startswith("-"):
        raise InputError(word, "this option of sbatch needs a value")
    return rest.pop(0)


def _long(word: str, rest: list[str]) -> list[Option]:
    name, equals, value = word[2:].partition("=")
    # sbatch takes any beginning of a name that is clear.
    own = next((own for own in _OWN if own == name or own.startswith(name) and name not in _FLAGS), None)
    if own:
        raise InputError(word, "slurm/submit sets this option of sbatch itself" + ("" if own == name else f" (--{own})"))
    if equals:
        return [Option(name, value, (word,))]
    if name in _FLAGS:
        return [Option(name, None, (word,))]
    value = _value(word, rest)
    return [Option(name, value, (word, value))]


def _short(word: str, rest: list[str]) -> list[Option]:
    """-t 10, -t10, and bundles: -Hst10."""
    found = []
    for position, letter in enumerate(word[1:], start=1):
        if letter in _OWN_SHORT:
            raise InputError(word, f"slurm/submit sets this option of sbatch itself (-{letter})")
        if letter in _SHORT_FLAGS:
            found.append(Option(letter, None, (f"-{letter}",)))
            continue
        attached = word[position + 1:]
        value = attached or _value(word, rest)
        words = (f"-{letter}{attached}",) if attached else (f"-{letter}", value)
        return [*found, Option(_FULL_NAMES.get(letter, letter), value, words)]
    return found


def joined(site: Sequence[Option], user: Sequence[Option]) -> list[str]:
    """The site's, then the user's, which win; --mem-per-cpu of a site beside --mem of the user would be refused by sbatch."""
    if any(option.name in MEMORY for option in user):
        site = [option for option in site if option.name not in MEMORY]
    return [word for option in (*site, *user) for word in option.words]


def minutes(text: str) -> float | None:
    """Of a value of --time: minutes, minutes:seconds, hours:minutes:seconds, days-hours[:minutes[:seconds]]; else None."""
    match = re.fullmatch(r"(?:(\d+)-)?(\d+)(?::(\d+))?(?::(\d+))?", text)
    if not match:
        return None
    days, *parts = (int(part) if part else 0 for part in match.groups())
    if match[1]:
        hours, minute, second = parts
    elif match[4]:
        hours, minute, second = parts
    else:
        hours, (minute, second, _) = 0, parts
    total = days * 1440 + hours * 60 + minute + second / 60
    return total or None  # 0: no limit
