"""Site files: bash that is read before the program runs, here and in every job."""

from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Sequence

from .folder import Failure, InputError

HERE = Path(__file__).resolve().parent.parent


class Site:
    def __init__(self, name: str) -> None:
        known = sorted(path.stem for path in (HERE / "sites").glob("*.sh"))
        self.path = HERE / "sites" / f"{name}.sh" if name in known else Path(name)
        if not self.path.is_file():
            raise InputError("--site", f"'{name}' is neither a file nor one of {', '.join(known)}")
        try:
            self.text = self.path.read_text(encoding="utf-8")
        except UnicodeDecodeError as error:
            raise InputError(self.path, f"is not UTF-8: {error}") from None

    def run(self, command: Sequence[object]) -> str:
        """The output of a command in the site's environment. Throws Failure; bad input of the program is InputError."""
        return self._shell('exec "$@"', *command)

    def sbatch_options(self) -> list[str]:
        return [word for word in self._shell('printf "%s\\0" "${sbatch_options[@]}"').split("\0") if word]

    def _shell(self, script: str, *words: object) -> str:
        """Runs a script after the site file, of which no command may fail; what that prints goes to stderr."""
        # The trap's LINENO is of the site file where a command of it failed; else . itself did: syntax, or the last command.
        whole_script = ("trap 'code=$?; [ -z \"${BASH_SOURCE[0]:-}\" ] || echo \"line $LINENO: $(sed -n \"${LINENO}p\" \"$1\"):"
                        " exit code $code\" >&2; exit 97' ERR;"
                        f' . "$1" >&2; trap - ERR; shift; {script}')
        done = subprocess.run(["bash", "-c", whole_script, "bash", str(self.path.absolute()), *map(str, words)], stdout=subprocess.PIPE,
                              stderr=subprocess.PIPE, text=True, errors="replace", check=False)
        if done.returncode == 0:
            return done.stdout
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        if done.returncode == 97:
            raise InputError(self.path, f"fails: {last}")
        if done.returncode == 2 and last.startswith("rasterbench: "):
            place, _, problem = last.removeprefix("rasterbench: ").partition(": ")
            raise InputError(place, problem)
        raise Failure(f"{words[0] if words else self.path}: {last}")
