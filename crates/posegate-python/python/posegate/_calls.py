"""The commands of the program `posegate` as functions: what `posegate COMMAND --json` prints, as a dict.

Every function takes the other options of its command as keywords: `--max-speed 0.5` is `max_speed=0.5`, an option without a value is `True`, and an
option that may be repeated takes a list. `posegate COMMAND --help` lists them.
"""

import json
import os
import re
import tempfile
from pathlib import Path
from typing import Any, Optional, Union

from . import _core

_Path = Union[str, "os.PathLike[str]"]
_Site = Union[_Path, _core.Site]


def _word(value: Any) -> str:
    """Returns a value as the command line takes it."""
    if isinstance(value, (tuple, list)):
        return ",".join(_word(part) for part in value)
    return os.fspath(value) if isinstance(value, os.PathLike) else str(value)


def _python(text: str) -> str:
    """Returns a message with arguments of Python in place of options."""
    return re.sub(r"(?<![\w-])--([a-z][a-z0-9-]*)", lambda found: found[1].replace("-", "_"), text)


def _answer(*words: _Path, **options: Any) -> str:
    """Runs a command and returns what it prints."""
    line = ["posegate", *(os.fspath(word) for word in words)]
    for name, value in options.items():
        option = "--" + name.replace("_", "-")
        if name in ("cross_terms", "method") and isinstance(value, str):
            value = value.replace("_", "-")
        if value is True:
            line.append(option)
        elif isinstance(value, list):
            line += [f"{option}={_word(part)}" for part in value]
        elif value is not None and value is not False:
            line.append(f"{option}={_word(value)}")
    try:
        return _core.answer(line)
    except _core.PosegateError as error:
        refused = _core.PosegateError(_python(str(error)))
        refused.help = _python(error.help) if error.help else None
        raise refused from None


class _File:
    """A site as a file: its own path, or a temporary one with its text. Or a path in a temporary folder."""

    def __init__(self, site: Optional[_Site], name: str = "site.toml") -> None:
        self.folder: Optional[tempfile.TemporaryDirectory[str]] = None
        if isinstance(site, _core.Site):
            site = site.path if site.text is None else self._written(site.text, name)
        elif site is None:
            site = self._written(None, name)
        assert site is not None
        self.path: _Path = site

    def _written(self, text: Optional[str], name: str) -> str:
        self.folder = tempfile.TemporaryDirectory()
        path = Path(self.folder.name) / name
        if text is not None:
            path.write_text(text, encoding="utf-8")
        return str(path)

    def __enter__(self) -> _Path:
        return self.path

    def __exit__(self, *_: object) -> None:
        if self.folder is not None:
            self.folder.cleanup()


def _dict(text: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(text)
    return found


def replay(site: _Site, bag: _Path, task: str, *, rows: bool = False, **options: Any) -> dict[str, Any]:
    """Replays a recording through the gate: the summary, with all estimates in `rows` if asked.

    `bag` is a bag (then `topic` names its estimates), a trajectory or a CSV; `truth` a topic or a file.

    >>> import posegate
    >>> with open("drive.csv", "w") as file:
    ...     _ = file.write("t_s,x_m,y_m,yaw_rad\\n1.00,0.01,0,0\\n1.05,0.11,0,0\\n")
    >>> found = posegate.replay(
    ...     "demo-out/site.toml", "drive.csv", "dock", set="bounded", translation=0.02, yaw_deg=1.0, rows=True
    ... )
    >>> found["estimates"], [row["verdict"] for row in found["rows"]]
    (2, ['permit', 'deny'])
    """
    with _File(site) as path, _File(None, "rows.jsonl") as lines:
        if rows:
            options["rows"] = lines
        found = _dict(_answer("replay", path, bag, task=task, json=True, **options))
        if rows:
            with open(lines, encoding="utf-8") as file:
                found["rows"] = [json.loads(line) for line in file]
    return found


def _learnt(command: str, data: _Path, output: Optional[_Path], options: dict[str, Any]) -> dict[str, Any]:
    site = options.pop("site", None)
    with _File(None, "model.toml") as model, _File(site if site is not None else "") as path:
        to = model if output is None else output
        found = _dict(_answer("learn", command, data, output=to, site=path or None, json=True, **options))
        if output is None:
            found["model"] = Path(model).read_text(encoding="utf-8")
    return found


def learn_bounds(detections: _Path, quantile: float, output: Optional[_Path] = None, **options: Any) -> dict[str, Any]:
    """Learns error bounds of detections by distance and angles. Without `output` the answer has the text of the model as `model`.

    >>> import random, posegate
    >>> drawn = random.Random(1)
    >>> with open("views.csv", "w") as file:
    ...     _ = file.write("d_m,phi_deg,psi_deg,detected,err_translation_m,err_yaw_rad\\n")
    ...     for _ in range(1000):
    ...         d, phi, psi = drawn.uniform(1, 4), drawn.uniform(0, 20), drawn.uniform(0, 40)
    ...         _ = file.write(f"{d},{phi},{psi},1,{abs(drawn.gauss(0, 0.01 * d))},{abs(drawn.gauss(0, 0.01))}\\n")
    >>> found = posegate.learn_bounds("views.csv", quantile=0.9)
    >>> found["views"], "posegate_model = 1" in found["model"]
    (1000, True)
    """
    return _learnt("bounds", detections, output, {"quantile": quantile, **options})


def learn_inflation(estimates: _Path, epsilon: float, output: Optional[_Path] = None, **options: Any) -> dict[str, Any]:
    """Learns the factor by which a source's covariance must grow. Without `output` the answer has the text of the model as `model`.

    >>> import random, posegate
    >>> drawn = random.Random(1)
    >>> with open("estimates.csv", "w") as file:
    ...     _ = file.write("t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw,true_x_m,true_y_m,true_yaw_rad\\n")
    ...     for t in range(500):
    ...         x, y, yaw = (drawn.gauss(0, 0.02) for _ in range(3))
    ...         _ = file.write(f"{t},{x},{y},{yaw},1e-4,0,0,1e-4,0,1e-4,0,0,0\\n")
    >>> found = posegate.learn_inflation("estimates.csv", epsilon=0.9)
    >>> 3.5 < found["overall"]["inflation"] < 6
    True
    >>> posegate.learn_inflation("estimates.csv", epsilon=2)
    Traceback (most recent call last):
        ...
    posegate.PosegateError: epsilon 2 is no share; expected a number above 0 and below 1
    """
    return _learnt("inflation", estimates, output, {"epsilon": epsilon, **options})


def metrics(reference: _Path, estimate: _Path, **options: Any) -> dict[str, Any]:
    """Compares two trajectories (TUM, EuRoC, KITTI), as `evo` does.

    >>> import posegate
    >>> for name, x in [("reference.txt", 0.0), ("estimate.txt", 0.1)]:
    ...     with open(name, "w") as file:
    ...         _ = file.write(f"0.0 {x} 0 0 0 0 0 1\\n0.1 {x + 1} 0 0 0 0 0 1\\n")
    >>> round(posegate.metrics("reference.txt", "estimate.txt")["ape"]["translation"]["rmse"], 6)
    0.1
    """
    return _dict(_answer("metrics", reference, estimate, json=True, **options))


def plan(site: _Site, start: str, to: str, **options: Any) -> dict[str, Any]:
    """Plans the looks and drives before a work task, from the start of a chain of the site. `status` says if there is a plan.

    >>> import posegate
    >>> posegate.plan("demo-out/site.toml", "nowhere", "dock")
    Traceback (most recent call last):
        ...
    posegate.PosegateError: the site has no chain `nowhere`; it has `look-then-dock`
    """
    with _File(site) as path:
        return _dict(_answer("plan", path, to=to, json=True, **{"from": start, **options}))


def place(site: _Site, task: str, **options: Any) -> dict[str, Any]:
    """Searches the best place for the tag of a localization task.

    `sigma_x`, `sigma_y` (m) and `sigma_yaw_deg`, or `exact=True`, state the uncertainty; `free="x=1:4,y=-1:1"` what may change.

    >>> import posegate
    >>> found = posegate.place("demo-out/site.toml", "see-t7", exact=True, free="x=2:4", budget=200)
    >>> 2.0 <= found["tag_pose"]["x"] <= 4.0
    True
    """
    with _File(site) as path:
        return _dict(_answer("place", path, task=task, json=True, **options))


def cover(site: _Site, **options: Any) -> dict[str, Any]:
    """Chooses the fewest candidates of tags with which every work task has a plan.

    >>> import posegate
    >>> posegate.cover("demo-out/site.toml")
    Traceback (most recent call last):
        ...
    posegate.PosegateError: demo-out/site.toml: the site has no candidates: add [candidate.NAME] tables, written like tags, or [candidates.NAME] tables with `wall`, `every` and `z`
    """
    with _File(site) as path:
        return _dict(_answer("cover", path, json=True, **options))


class Drawing(str):
    """A picture: the text of an SVG, which notebooks show.

    >>> import posegate
    >>> posegate.Drawing("<svg/>")._repr_svg_()
    '<svg/>'
    """

    def _repr_svg_(self) -> str:
        return str(self)


def draw(site: _Site, task: str, **options: Any) -> Drawing:
    """Draws a task's success set (`kind` is "sections", "plan" or "image"). Returns the SVG.

    >>> import posegate
    >>> posegate.draw("demo-out/site.toml", "dock")[:4]
    '<svg'
    """
    with _File(site) as path, _File(None, "picture.svg") as picture:
        _answer("draw", path, task=task, output=picture, **options)
        return Drawing(Path(picture).read_text(encoding="utf-8"))
