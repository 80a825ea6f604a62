"""Files are written beside their place and renamed into it, so that a failed run loses nothing."""

from __future__ import annotations

import json
import os
import tempfile
from pathlib import Path

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


def write_folder(folder: Path, files: dict[str, str | bytes]) -> None:
    """Writes the files, then removes those that an earlier run wrote and this one did not. Others' files stay."""
    manifest = folder / MANIFEST
    try:
        earlier = json.loads(manifest.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        earlier = []
    for name, content in files.items():
        write(folder / name, content)
    for name in earlier if isinstance(earlier, list) else []:
        if isinstance(name, str) and name not in files and Path(name).name == name:
            (folder / name).unlink(missing_ok=True)
    if files or manifest.exists():
        write(manifest, json.dumps(sorted(files)) + "\n")
