"""The table of commands: nothing is left out of it, and nobody waits for matplotlib to learn of a wrong path."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from .. import __main__ as program
from .. import commands

ROOT = Path(__file__).resolve().parents[2]
SHARED = {"__init__", "pages", "studies"}


def test_every_module_of_a_command_is_in_the_table() -> None:
    modules = {path.stem for path in Path(commands.__file__).parent.glob("*.py")} - SHARED
    assert modules == {command.__name__.rpartition(".")[2] for command in commands.COMMANDS}
    assert len({command.NAME for command in commands.COMMANDS}) == len(modules)


@pytest.mark.parametrize("command", commands.COMMANDS, ids=lambda command: command.NAME)
def test_every_command_has_help(command: commands.Command, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        program.main([command.NAME, "--help"])
    said = " ".join(capsys.readouterr().out.split())
    assert end.value.code == 0 and " ".join(command.DESCRIPTION.split()) in said


@pytest.mark.parametrize("arguments", [["report", "none"], ["table", "none"], ["speed", "none"], ["report", "--wrong"], ["compare", "a"]], ids=" ".join)
def test_matplotlib_is_not_imported_for_bad_input(arguments: list[str], tmp_path: Path) -> None:
    script = ("import sys\nfrom analysis.__main__ import main\ntry:\n    status = main(sys.argv[1:])\nexcept SystemExit as end:\n    status = end.code\n"
              "assert status == 2, status\nassert 'matplotlib' not in sys.modules\n")
    done = subprocess.run([sys.executable, "-c", script, *arguments], cwd=tmp_path, env={"PYTHONPATH": str(ROOT), "PATH": ""}, capture_output=True, text=True,
                          check=False)
    assert done.returncode == 0, done.stderr
    assert done.stderr.startswith("analysis: ") and done.stderr.count("\n") == 1
