"""Runs every command and every block of Python of docs/for-python.md, and compares what the latter print with the page.

Usage: page.py FOLDER; FOLDER is an empty folder in which the page runs.
"""

import os
import subprocess
import sys
from pathlib import Path

from support import ROOT, end, figure, require

PAGE = ROOT / "docs/for-python.md"


def blocks() -> list[tuple[str, str, str]]:
    """Returns the fenced blocks: language, text, and the indented lines after an `Expected:` that follows."""
    found: list[tuple[str, str, str]] = []
    language = ""
    text: list[str] = []
    expected: list[str] = []
    collects = False
    for line in PAGE.read_text().splitlines():
        if line.startswith("```"):
            if language:
                found.append((language, "\n".join(text) + "\n", ""))
                language, text = "", []
            else:
                language = line[3:]
                require(language in ("sh", "python"), f"a block of {language} is not run")
        elif language:
            text.append(line)
        elif line == "Expected:":
            collects, expected = True, []
        elif collects and line.startswith("    "):
            expected.append(line[4:])
        elif collects and expected:
            collects = False
            found[-1] = (*found[-1][:2], "\n".join(expected) + "\n")
    return found


def main() -> None:
    folder = Path(sys.argv[1])
    (folder / "crates").symlink_to(ROOT / "crates")
    bin = str(Path(sys.executable).parent)
    env = dict(os.environ, PATH=bin + os.pathsep + os.environ["PATH"])
    commands = scripts = 0
    for language, text, expected in blocks():
        if language == "sh":
            for line in text.splitlines():
                print(f"$ {line}", file=sys.stderr, flush=True)
                # The crates' own folder, else cargo takes the links for another workspace.
                line = line.replace("cargo run ", f"cargo run --manifest-path {ROOT}/Cargo.toml ")
                line = line.replace("-m crates/", f"-m {ROOT}/crates/")
                ended = subprocess.run(["bash", "-c", line], cwd=folder, env=env, stdout=sys.stderr.fileno(), check=False)
                require(ended.returncode == 0, f"{ended.returncode}: {line}")
                commands += 1
        else:
            run = subprocess.run([sys.executable, "-c", text], cwd=folder, env=env, capture_output=True, text=True, check=False)
            require(run.returncode == 0, f"{text}{run.stderr}")
            require(expected != "" and run.stdout == expected, f"{text}prints\n{run.stdout}the page states\n{expected}")
            scripts += 1
    picture = folder / "verdicts.png"
    require(picture.is_file() and picture.stat().st_size > 10_000, "no picture")
    figure("python: commands of docs/for-python.md that run", commands, "commands", 7)
    figure("python: scripts of docs/for-python.md that print the stated output", scripts, "scripts", 3)


main()
end()
