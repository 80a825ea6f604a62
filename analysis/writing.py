"""Files are written beside their place and renamed into it, so that a failed run loses nothing."""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path
from typing import Iterable

from .load import InputError

MANIFEST = ".written.json"


def umask_mode() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return 0o666 & ~mask


def write(path: Path, content: str | bytes) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    data = content.encode("utf-8") if isinstance(content, str) else content
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", dir=path.parent)
    try:
        with os.fdopen(handle, "wb") as file:
            file.write(data)
        os.chmod(name, umask_mode())  # mkstemp makes files that only the owner can read
        os.replace(name, path)
    except BaseException:
        Path(name).unlink(missing_ok=True)
        raise


def refuse_inputs(outputs: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Raises InputError where a file that is about to be written is one that was read, under whatever name or link."""
    read = [path for path in inputs if path.exists()]
    for output in outputs:
        if output.exists() and any(output.samefile(path) for path in read):
            raise InputError(output, "is read, and would be written over: write into another folder (--out)")


def write_folder(folder: Path, files: dict[str, str | bytes], writer: str, inputs: Iterable[Path] = ()) -> None:
    """Writes the files, then removes those that an earlier run of this writer wrote and this one did not. Others' files stay.
    The manifest is {writer: [file]}; one without writers, as older versions left it, says whose nothing is. inputs: files that
    must not be written over."""
    inputs = list(inputs)
    refuse_inputs((folder / name for name in files), inputs)
    manifest = folder / MANIFEST
    try:
        found = json.loads(manifest.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        found = {}
    known = {key: {name for name in names if isinstance(name, str)} for key, names in found.items() if isinstance(names, list)} \
        if isinstance(found, dict) else {}
    stale = {name for name in known.pop(writer, set()) - files.keys() if Path(name).name == name}
    # A file that two wrote is the later one's.
    known = {key: names - files.keys() for key, names in known.items()}
    stale -= set().union(*known.values())
    refuse_inputs((folder / name for name in stale), inputs)
    for name, content in files.items():
        write(folder / name, content)
    for name in stale:
        (folder / name).unlink(missing_ok=True)
    if files or manifest.exists():
        known[writer] = set(files)
        write(manifest, json.dumps({key: sorted(names) for key, names in sorted(known.items()) if names}) + "\n")
