"""Every command of README.md works: cheap ones are run as they stand, dear ones shortened as a table below says."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
from dataclasses import dataclass
from pathlib import Path
from typing import Callable

import pytest

from .program import ROOT, TIMEOUT, environment, program, run

README = ROOT / "README.md"
needs_readme = pytest.mark.skipif(not README.exists(), reason="there is no README.md yet")

Shorten = Callable[[list[str]], list[list[str]]]


def as_it_stands(words: list[str]) -> list[list[str]]:
    return [words]


def setup_only_checked(words: list[str]) -> list[list[str]]:
    """Says what is missing instead of installing and building."""
    return [["scripts/setup", *[w for w in words[1:] if w != "--check"], "--check"]]


def syntax_only(words: list[str]) -> list[list[str]]:
    """scripts/test runs this very test."""
    return [["bash", "-n", words[0]], ["test", "-x", words[0]]]


def study_of_the_script(words: list[str]) -> list[list[str]]:
    """The study that scripts/study would run, planned only."""
    file, options = ("studies/quick.toml", words[1:])
    if options and options[0].endswith(".toml"):
        file, options = options[0], options[1:]
    return [*syntax_only(words), ["build/release/bin/rasterbench", "study", file, *options, "--dry-run"]]


def speed_of_the_script(words: list[str]) -> list[list[str]]:
    """The study that scripts/speed would run, planned only; test_speed.py runs the script itself on small scenes."""
    return [*syntax_only(words), ["build/release/bin/rasterbench", "study", "studies/speed.toml", *words[1:], "--dry-run"]]


def compilers_of_the_script(words: list[str]) -> list[list[str]]:
    """The program that is built under two names, a study of seconds, two rounds, in the folder that the README names; what would be built is
    planned only."""
    folder = words[words.index("--out") + 1]
    given = [word for name in ("a", "b") for word in ("--program", f"{name}=build/release/bin/rasterbench")]
    return [[*words, "--dry-run"], [words[0], *given, "--study", "small.toml", "--rounds", "2", "--out", folder]]


def help_only(words: list[str]) -> list[list[str]]:
    """test_invariant0.py runs the script itself on small designs."""
    return [[*words, "--help"]]


def planned_only(words: list[str]) -> list[list[str]]:
    return [words if "--dry-run" in words else [*words, "--dry-run"]]


def machine_of_a_small_point(words: list[str]) -> list[list[str]]:
    """One thread, a small point and few repetitions."""
    return [[*words, "--threads", "1", "--triangles", "1000", "--size", "64x48", "--repetitions", "6"]]


def explanation_of_a_small_picture(words: list[str]) -> list[list[str]]:
    """A small picture and the fewest samples."""
    return [[*words, "--size", "96x64", "--samples", "6"]]


def adoption_of_a_small_picture(words: list[str]) -> list[list[str]]:
    """A small picture, few runs."""
    return [[*(word if word != "640x360" else "96x54" for word in words), "--repetitions", "2", "--race-seconds", "0.5", "--seconds", "1"]]


def trace_of_a_small_picture(words: list[str]) -> list[list[str]]:
    """A small picture and one frame."""
    return [[*words, "--size", "96x64", "--frames", "1"]]


def report_of_a_small_study(words: list[str]) -> list[list[str]]:
    """The report is drawn of a study of seconds in the folder that the README names."""
    folder = next(word for word in words if word.startswith("results/"))
    small = ["build/release/bin/rasterbench", "study", "small.toml", "--out", folder, "--replace"]
    return [small, words]


def comparison_of_small_studies(words: list[str]) -> list[list[str]]:
    """Of two runs of a study of seconds, of which nothing is asked but that they are compared."""
    folders = [word for word in words if word.startswith("results/")]
    runs = [["build/release/bin/rasterbench", "study", "small.toml", "--out", folder, "--replace"] for folder in folders[:2]]
    return [*runs, ["bash", "-c", f"{shlex.join(words)}; case $? in 0|1|4) ;; *) exit 1; esac"]]


def selftest_of_few(words: list[str]) -> list[list[str]]:
    """Two comparisons; they may differ by chance."""
    few = [*words[:2], "teapot:triangles=300", "--comparisons", "2", "--max-samples", "10", *words[4:]]
    return [["bash", "-c", f"{shlex.join(few)}; test $? -le 1"]]


def lint_of_a_small_study(words: list[str]) -> list[list[str]]:
    """Of the study that the report was drawn of: it has one launch, which breaks a rule, which is exit code 1."""
    return [["bash", "-c", f"{shlex.join(words)}; test $? -eq 1"]]


def submitted_dry(words: list[str]) -> list[list[str]]:
    """The plan only, with the program that is built; test_slurm_runs.py submits to a cluster."""
    own = words[:words.index("--")] if "--" in words else words
    dry = [] if "--dry-run" in words else ["--dry-run"]
    return [[*own, *dry, "--program", "build/release/bin/rasterbench", *words[len(own):]]]


def states_of_a_planned_study(words: list[str]) -> list[list[str]]:
    """Of a study of which nothing is done: exit code 3, and what is missing."""
    folder = words[1]
    plan = f"build/release/bin/rasterbench study small.toml --list --json > {folder}/slurm/manifest.json"
    return [["mkdir", "-p", f"{folder}/slurm"], ["bash", "-c", plan], ["bash", "-c", f"{shlex.join(words)} || [ $? = 3 ]"]]


def of_small_costs(words: list[str]) -> list[list[str]]:
    """A few invented costs, and short sleeps."""
    costs = {"schema": 1, "unit": "row", "iterations": 40, "size": [64, 48], "kernel": "row_parallel", "numeric": "f32", "threads": 2,
             "cost_us": [1.0 + i % 7 for i in range(40)]}
    if "replay" in words:
        words = [*words, "--seconds", "0.05"]
    return [["bash", "-c", f"echo {shlex.quote(json.dumps(costs))} > costs.json"], words]


def presets_that_there_are(words: list[str]) -> list[list[str]]:
    """Configuring and building again is the tests' own prerequisite."""
    kind = "build" if "--build" in words else "configure"
    return [["bash", "-c", f"cmake -S {shlex.quote(str(ROOT))} --list-presets={kind} | grep -q {shlex.quote(words[-1])}"]]


PRODUCT = "build/release/bin/"
# A pattern of a whole command, and how it is shortened. The first that matches counts.
TABLE: list[tuple[str, Shorten]] = [
    (r"scripts/setup( .*)?", setup_only_checked),
    (r"scripts/test( .*)?", syntax_only),
    (r"scripts/study( .*)?", study_of_the_script),
    (r"scripts/speed( .*)?", speed_of_the_script),
    (r"scripts/compilers( .*)?", compilers_of_the_script),
    (r"scripts/invariant0( .*)?", help_only),
    (PRODUCT + r"rasterbench study .*", planned_only),
    (PRODUCT + r"rasterbench machine( .*)?", machine_of_a_small_point),
    (PRODUCT + r"rasterbench explain .*", explanation_of_a_small_picture),
    (PRODUCT + r"rasterbench trace .*", trace_of_a_small_picture),
    (PRODUCT + r"rasterbench selftest .*", selftest_of_few),
    (PRODUCT + r"rasterbench adopt .*", adoption_of_a_small_picture),
    (PRODUCT + r"rasterbench replay costs.json .*|scripts/python -m analysis whatif costs.json .*", of_small_costs),
    (PRODUCT + r"(rasterbench (render|list|scene|verify|advise|extremes|stability|fuzz|--help|--version)|graphics)\b.*", as_it_stands),
    (r"scripts/python -m analysis (stability|adopt|trace|compilers) .*", as_it_stands),
    (r"scripts/python -m analysis report .*", report_of_a_small_study),
    (r"scripts/python -m analysis compare .*", comparison_of_small_studies),
    (r"scripts/python -m analysis selftest .*", as_it_stands),
    (r"scripts/python -m analysis lint .*", lint_of_a_small_study),
    (r"slurm/submit .*", submitted_dry),
    (r"slurm/(status|merge) \S+", states_of_a_planned_study),
    (r"cmake --preset \S+|cmake --build --preset \S+", presets_that_there_are),
]

SMALL = """\
[sampling]
target = 1
min_samples = 6
max_samples = 6
[[sweep]]
scene = "teapot:triangles=300"
size = "64x48"
kernel = ["tile_parallel", "row_parallel"]
execution = ["serial", "openmp:static", "openmp:dynamic"]
threads = [1]
"""


@dataclass(frozen=True)
class Block:
    line: int
    commands: list[str]


def blocks(text: str, language: str = "sh") -> list[Block]:
    found = []
    for match in re.finditer(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        joined = match[1].replace("\\\n", " ")
        commands = [line.strip() for line in joined.splitlines() if line.strip() and not line.lstrip().startswith("#")]
        found.append(Block(text[:match.start()].count("\n") + 1, commands))
    return found


def shortened(command: str) -> list[list[str]]:
    """What is run in place of a command. Fails where the table has no row for it, or where it is more than one plain command."""
    lexer = shlex.shlex(command, posix=True, punctuation_chars=True)
    lexer.whitespace_split, lexer.commenters = True, "#"
    words = list(lexer)
    assert not any(set(word) <= set("();<>|&") for word in words), f"more than one plain command: {command}"
    for pattern, shorten in TABLE:
        if re.fullmatch(pattern, shlex.join(words)):
            return shorten(words)
    raise AssertionError(f"README.md has a command that is neither run nor in the table of {Path(__file__).name}: {command}")


@pytest.fixture(scope="module")
def checkout(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The checkout by links, so that what the commands write lies elsewhere; build/release/bin is the folder under test."""
    folder = tmp_path_factory.mktemp("checkout")
    for entry in ROOT.iterdir():
        if entry.name not in ("build", "results"):
            (folder / entry.name).symlink_to(entry)
    (folder / "build/release").mkdir(parents=True)
    (folder / "build/release/bin").symlink_to(program().parent)
    (folder / "small.toml").write_text(SMALL)
    return folder


BLOCKS = blocks(README.read_text()) if README.exists() else []


@needs_readme
@pytest.mark.parametrize("block", BLOCKS, ids=lambda block: f"line {block.line}")
def test_commands(block: Block, checkout: Path) -> None:
    """In the order of the README: later blocks may use the files of earlier ones."""
    script = "\n".join(shlex.join(words) for command in block.commands for words in shortened(command))
    done = subprocess.run(["bash", "-e", "-u", "-x", "-c", script], cwd=checkout, env=environment(), capture_output=True, text=True,
                          timeout=TIMEOUT, check=False)
    assert done.returncode == 0, f"README.md, block of line {block.line}:\n{done.stderr}"


@needs_readme
def test_commands_write_what_they_say(checkout: Path) -> None:
    """After all blocks: each -o, --ids, --depth, --parameters file, and the report."""
    for block in BLOCKS:
        for words in (words for command in block.commands for words in shortened(command)):
            for option, value in zip(words, words[1:]):
                if option in ("-o", "--ids", "--depth", "--parameters"):
                    assert (checkout / value).stat().st_size > 0, value
            if "report" in words:
                assert (checkout / words[words.index("report") + 1] / "report.html").stat().st_size > 1000


@needs_readme
def test_there_are_commands() -> None:
    text = README.read_text()
    assert len(BLOCKS) >= 4 and [["scripts/study"], ["scripts/test"]] == [b.commands for b in BLOCKS[:2]]
    assert set(re.findall(r"^```(\w*)$", text, re.MULTILINE)) <= {"sh", "toml", "cpp", ""}, "a language whose blocks nothing checks"


@needs_readme
def test_study_file_of_the_readme(tmp_path: Path) -> None:
    """The example can be read; its model is not there, so another scene takes its place."""
    (example,) = re.findall(r"^```toml\n(.*?)^```$", README.read_text(), re.MULTILINE | re.DOTALL)
    (tmp_path / "mine.toml").write_text(example)
    names = run("study", tmp_path / "mine.toml", "--scene", "teapot:triangles=300", "--list").ok().stdout.splitlines()
    assert len(names) > 4 and all("row_parallel" in name or "llvmpipe" in name for name in names)


@needs_readme
def test_code_of_the_readme_is_that_of_the_file() -> None:
    text = README.read_text()
    for file, code in re.findall(r"This is all of `([^`]+)`:\s+```cpp\n(.*?)^```$", text, re.MULTILINE | re.DOTALL):
        assert code == (ROOT / file).read_text(), f"{file} is not what README.md shows"


@needs_readme
def test_links_and_files_of_the_readme_exist() -> None:
    text = README.read_text()
    prose = re.sub(r"```.*?```", "", text, flags=re.S)  # a lambda looks like a link
    for target in re.findall(r"\]\((?!https?:)([^)#]+)\)", prose):
        assert (ROOT / target).exists(), target
    for script in re.findall(r"\b(?:scripts|studies|harness|analysis|slurm|kernels)/[\w./]*\w", text):
        if not script.startswith("results"):
            assert (ROOT / script).exists(), script


@pytest.mark.parametrize("command", ["curl https://example.org", "scripts/unknown", "rm -rf build", "build/release/bin/rasterbench runner",
                                     "scripts/study && scripts/test", "scripts/test | tail", "scripts/test; ls"])
def test_a_command_of_no_row_fails(command: str) -> None:
    with pytest.raises(AssertionError, match="neither run nor in the table|more than one plain command"):
        shortened(command)


def test_shortening() -> None:
    assert blocks("a\n```sh\n# no\nscripts/study \\\n    x.toml --shard 1/2\n\nscripts/test  # all\n```\n") == [
        Block(2, ["scripts/study      x.toml --shard 1/2", "scripts/test  # all"])]
    assert shortened("scripts/study x.toml --shard 1/2")[-1] == [PRODUCT + "rasterbench", "study", "x.toml", "--shard", "1/2", "--dry-run"]
    assert shortened("scripts/test  # all") == [["bash", "-n", "scripts/test"], ["test", "-x", "scripts/test"]]
    assert shortened("build/release/bin/rasterbench list kernels") == [[PRODUCT + "rasterbench", "list", "kernels"]]


@pytest.mark.parametrize("script", ["setup", "study", "speed", "test", "python"])
def test_scripts_parse(script: str) -> None:
    path = ROOT / "scripts" / script
    assert os.access(path, os.X_OK)
    assert subprocess.run(["bash", "-n", path], check=False).returncode == 0


@pytest.mark.parametrize("arguments, words", [(["scripts/setup", "bogus"], ["bogus", "release"]), (["scripts/study", "none.toml"], ["none.toml"])])
def test_scripts_refuse_bad_arguments(arguments: list[str], words: list[str]) -> None:
    done = subprocess.run(arguments, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 2 and done.stdout == "" and len(done.stderr.splitlines()) == 1
    assert all(word in done.stderr for word in words)
