"""Every estimate of tests/data on every committed table, and every site of the examples: the module gives what the program prints."""

import csv
import json
import math
import tempfile
from pathlib import Path
from typing import Any, Optional

import numpy as np
import posegate
from support import ROOT, Floats, answers, end, figure, open_table, program, require, tables

COLUMNS = ["x_m", "y_m", "yaw_rad", "cov_xx", "cov_xy", "cov_xyaw", "cov_yy", "cov_yyaw", "cov_yawyaw", "cov_yx", "cov_yawx", "cov_yawy"]


def estimates() -> tuple[list[list[str]], Floats, Floats]:
    """Returns the estimates of tests/data, as text without times and as arrays."""
    with (ROOT / "tests/data/estimates.csv").open(newline="") as file:
        rows = [[row[name] for name in COLUMNS] for row in csv.DictReader(file)]
    poses = np.array([[float(field) for field in row[:3]] for row in rows])

    def covariance(row: list[str]) -> list[list[float]]:
        xx, xy, xt, yy, yt, tt = (float(field) for field in row[3:9])
        lower = [float(field) if field else same for field, same in zip(row[9:], (xy, xt, yt))]
        return [[xx, xy, xt], [lower[0], yy, yt], [lower[1], lower[2], tt]]

    return rows, poses, np.array([covariance(row) for row in rows])


def same(found: Optional[float], printed: Optional[float]) -> bool:
    """Returns `True` if two numbers are equal bit for bit."""
    if found is None or printed is None:
        return found is None and printed is None
    return math.copysign(1, found) == math.copysign(1, printed) and found == printed


def is_same(verdict: posegate.Verdict, line: dict[str, Any]) -> bool:
    """Returns `True` if a verdict is the one that the program prints."""
    pose, printed = verdict.worst_pose, line["worst_pose"]
    poses = pose is None and printed is None or (pose is not None and printed is not None and list(pose) == printed)
    decided = verdict.permit == (line["verdict"] == "permit") and verdict.reason == line["reason"]
    return decided and poses and same(verdict.margin, line["margin"]) and bool(verdict) == verdict.permit


def gate(folder: Path) -> None:
    rows, poses, covs = estimates()
    recording = folder / "estimates.csv"
    with recording.open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(COLUMNS)
        writer.writerows(rows)
    compared = permits = 0
    reasons = set()
    for path in tables():
        table = open_table(path)
        require(posegate.Table(path.read_bytes()).task == table.task and bytes(table) == path.read_bytes(), path)
        for epsilon in (None, 0.5, 0.999):
            words = [] if epsilon is None else ["--epsilon", str(epsilon)]
            lines = answers("gate", str(path), "--estimates", str(recording), "--json", *words)
            require(len(lines) == len(rows), path)
            permit, codes = table.decide_many(poses, covs, epsilon)
            require(permit.dtype == np.bool_ and codes.dtype == np.uint8 and permit.shape == codes.shape == (len(rows),), path)
            for index, line in enumerate(lines):
                x, y, yaw = poses[index]
                verdict = table.decide(x, y, yaw, covs[index], epsilon)
                require(is_same(verdict, line), f"{path.name}, {epsilon}: {verdict!r} is not {line}")
                require(bool(permit[index]) == verdict.permit, f"{path.name}, {epsilon}, row {index}: decide_many permits otherwise")
                require(posegate.REASONS[codes[index]] == verdict.reason, f"{path.name}, {epsilon}, row {index}: {codes[index]}")
                compared += 1
                permits += verdict.permit
                reasons.add(verdict.reason)
    require(permits > 500 and len(reasons) >= 9, (permits, reasons))
    figure("python: verdicts equal to those of posegate gate", compared, "verdicts", 15_000)


def sites(folder: Path) -> None:
    random = np.random.default_rng(3)
    members = built = 0
    for path in sorted([*ROOT.glob("examples/sites/*.toml"), ROOT / "tests/data/reference-a.toml"]):
        checked = program("check", str(path))
        if checked.returncode != 0:
            # An import alone is not a site; the module must say the same.
            refuses(lambda path=path: posegate.Site.open(path), checked.stderr)
            continue
        site = posegate.Site.open(path)
        for task in site.tasks:
            poses = random.uniform(-1.0, 1.0, (200, 3)) * [6.0, 6.0, 3.2]
            poses[:40] *= 0.02
            file = folder / "poses.csv"
            np.savetxt(file, poses, delimiter=",", header="x_m,y_m,yaw_rad", comments="", fmt="%.17g")
            lines = answers("contains", str(path), "--task", task, "--poses", str(file), "--json")
            inside = site.contains(task, poses)
            require(inside.dtype == np.bool_ and inside.tolist() == [line["inside"] for line in lines], f"{path.name}: {task}")
            members += len(poses)
        for task in site.tasks[:2]:
            file = folder / "built.posegate"
            ended = program("table", "build", str(path), "--task", task, "-o", str(file), "--json")
            if ended.returncode != 0:
                refuses(lambda site=site, task=task: site.build(task), ended.stderr)
                continue
            require(bytes(site.build(task)) == file.read_bytes(), f"{path.name}: {task}: other bytes")
            built += 1
    figure("python: poses with the membership of posegate contains", members, "poses", 1_000)
    figure("python: tables built with the bytes of posegate table build", built, "tables", 6)


def words(printed: str) -> str:
    """Returns a printed failure without its frame: letters and digits alone, since lines are broken at any place."""
    return "".join(c for c in printed if c.isalnum())


def refuses(call: Any, printed: str) -> None:
    """Checks that a call raises the error that the program prints."""
    try:
        call()
    except posegate.PosegateError as error:
        require(bool(str(error)) and isinstance(error, ValueError), repr(error))
        # The program shows the place of a fault in a file in a picture with the lines around it.
        message = str(error).split(": ", 1)[1] if ".toml:" in str(error) else str(error)
        require(words(message) in words(printed), f"{error} is not in {printed}")
        require(error.help is None or words(error.help) in words(printed), f"{error.help} is not in {printed}")
        return
    require(False, f"not refused: {printed}")


def errors(folder: Path) -> None:
    dock = ROOT / "examples/tables/dock.posegate"
    site = ROOT / "examples/sites/dock.toml"
    table = open_table(dock)
    opened = posegate.Site.open(site)
    damaged = folder / "damaged.posegate"
    damaged.write_bytes(dock.read_bytes()[:-1] + b"\0")
    faulty = folder / "faulty.toml"
    faulty.write_text(site.read_text().replace("width_px", "width", 1))
    poses = folder / "some.csv"
    poses.write_text("x_m,y_m,yaw_rad\n0,0,0\n")
    recording = ROOT / "tests/data/estimates.csv"
    missing = folder / "missing"
    good = np.diag([1e-4, 1e-4, 1e-4])
    cases: list[tuple[Any, list[str]]] = [
        (lambda: posegate.Table.open(missing), ["table", "info", str(missing)]),
        (lambda: posegate.Table.open(str(damaged)), ["gate", str(damaged), "--estimates", str(recording)]),
        (lambda: posegate.Table.open(site), ["gate", str(site), "--estimates", str(recording)]),
        (lambda: posegate.Site.open(missing), ["check", str(missing)]),
        (lambda: posegate.Site.open(faulty), ["check", str(faulty)]),
        (lambda: posegate.Site.open(dock), ["check", str(dock)]),
        (lambda: opened.contains("dok", [[0, 0, 0]]), ["contains", str(site), "--task", "dok", "--poses", str(poses)]),
        (lambda: opened.build("dok"), ["table", "build", str(site), "--task", "dok", "--dry-run"]),
    ]
    for epsilon in ("0", "1", "2", "0.1", "-3"):
        value = float(epsilon)
        words = ["gate", str(dock), "--estimates", str(recording), f"--epsilon={epsilon}"]
        cases.append((lambda value=value: table.decide(0, 0, 0, good, value), words))
        cases.append((lambda value=value: table.decide_many([[0, 0, 0]], [good], value), words))
    for call, line in cases:
        ended = program(*line)
        require(ended.returncode == 2, f"{line}: {ended.returncode}")
        refuses(call, ended.stderr)
    arguments: list[tuple[Any, str]] = [
        (lambda: posegate.Table(b"POSEGATE"), "the argument is not a table"),
        (lambda: table.decide(0, 0, 0, np.eye(2)), "cov has the shape (2, 2), not (3, 3)"),
        (lambda: table.decide(0, 0, 0, "abc"), "cov is not an array of numbers"),
        (lambda: table.decide_many(np.zeros((4, 2)), np.zeros((4, 3, 3))), "poses has the shape (4, 2), not (n, 3)"),
        (lambda: table.decide_many(np.zeros((4, 3)), np.zeros((4, 9))), "covs has the shape (4, 9), not (n, 3, 3)"),
        (lambda: table.decide_many(np.zeros((4, 3)), np.zeros((5, 3, 3))), "4 poses have 5 covariances"),
        (lambda: opened.contains("dock", [0, 0, 0]), "poses has the shape (3,), not (n, 3)"),
    ]
    for call, text in arguments:
        try:
            call()
        except posegate.PosegateError as error:
            require(text in str(error) and bool(error.help), f"{error} is not {text}")
        else:
            require(False, f"not refused: {text}")
    figure("python: errors with the words of the program", len(cases) + len(arguments), "errors", 25)


def command_line() -> None:
    ended = program("gate", "examples/tables/dock.posegate", "--estimates", "tests/data/estimates.csv", "--json")
    require(ended.returncode == 1 and json.loads(ended.stdout.splitlines()[0])["verdict"] == "permit", ended.stderr)
    require(program("check", "examples/sites/dock.toml").returncode == 0, "check")
    require(program("--help").stdout.startswith("Decides whether"), "--help")
    require(program("nonsense").returncode == 2, "usage")
    require(program("--version").stdout.split()[-1] == posegate.__version__, posegate.__version__)


with tempfile.TemporaryDirectory() as name:
    gate(Path(name))
    sites(Path(name))
    errors(Path(name))
command_line()
end()
