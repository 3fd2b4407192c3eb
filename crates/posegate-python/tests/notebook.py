"""Executes the notebook of `examples/` in a folder that has a recording, as `page.py` leaves it.

Usage: notebook.py FOLDER
"""

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from support import ROOT, end, figure, require

NAME = "verdicts.ipynb"


def main() -> None:
    folder = Path(sys.argv[1])
    shutil.copy(ROOT / "crates/posegate-python/examples" / NAME, folder / NAME)
    execute = Path(sys.executable).parent / "jupyter-execute"
    ended = subprocess.run([str(execute), "--inplace", NAME], cwd=folder, capture_output=True, text=True, check=False)
    require(ended.returncode == 0, ended.stderr)
    notebook: dict[str, Any] = json.loads((folder / NAME).read_text(encoding="utf-8"))
    outputs = [output for cell in notebook["cells"] for output in cell.get("outputs", [])]
    kinds = [kind for output in outputs for kind in output.get("data", {})]
    require("image/png" in kinds and "image/svg+xml" in kinds, kinds)
    printed = "".join("".join(output.get("text", "")) for output in outputs)
    require(" estimates are permitted" in printed and "not_contained" in printed, printed)
    shown = "".join("".join(output.get("data", {}).get("text/plain", "")) for output in outputs)
    require("Verdict(permit=True" in shown, shown)
    figure("python: outputs of the notebook", len(outputs), "outputs", 5)


main()
end()
