"""`decide_many`: equal to `decide` row by row, faster than plain NumPy, in constant memory, next to other threads and after a fork.

Usage: many.py SETS; SETS is the number of sets over which the memory is watched.
"""

import multiprocessing
import sys
import threading
import time
from pathlib import Path
from typing import Callable

import numpy as np
import posegate
from numpy_facets import FacetTable
from support import ROOT, Floats, end, figure, open_table, pose_sets, require, tables

MIB = 1 << 20


def rows_agree() -> None:
    rows = permits = 0
    for number, path in enumerate(tables()):
        table = open_table(path)
        for width in (0.1, 1.0):
            poses, covs = pose_sets(1_000, number, width)
            permit, codes = table.decide_many(poses, covs)
            for index, (x, y, yaw) in enumerate(poses):
                verdict = table.decide(x, y, yaw, covs[index])
                found = (bool(permit[index]), posegate.REASONS[codes[index]])
                require(found == (verdict.permit, verdict.reason), f"{path.name}: {poses[index]} {covs[index]}: {found}, {verdict!r}")
            rows += len(poses)
            permits += int(permit.sum())
    require(permits > rows // 20, permits)
    figure("python: rows of decide_many equal to decide", rows, "rows", 20_000)


def layouts_agree() -> None:
    """Arrays of other types, orders and strides, lists, and empty ones."""
    table = open_table(ROOT / "examples/tables/dock.posegate")
    poses, covs = pose_sets(500, 7, 0.1)
    expected = table.decide_many(poses, covs)
    wide = np.zeros((500, 7))
    wide[:, ::3] = poses
    for others in (
        (np.asfortranarray(poses), np.asfortranarray(covs)),
        (wide[:, ::3], covs[::-1][::-1]),
        (poses.tolist(), covs.tolist()),
    ):
        found = table.decide_many(*others)
        require(all(np.array_equal(a, b) for a, b in zip(found, expected)), "another layout gives other verdicts")
    permit, codes = table.decide_many(np.zeros((0, 3)), np.zeros((0, 3, 3)))
    require(permit.shape == codes.shape == (0,), "no rows")


def seconds(work: Callable[[], object]) -> float:
    """Returns the shortest of seven runs."""
    best = float("inf")
    for _ in range(7):
        start = time.perf_counter()
        work()
        best = min(best, time.perf_counter() - start)
    return best


def is_fast() -> None:
    count = 200_000
    for name, width, goal in (("see-t7", 0.2, 10.0), ("dock", 0.1, None)):
        table = open_table(ROOT / f"examples/tables/{name}.posegate")
        plain = FacetTable(bytes(table))
        poses, covs = pose_sets(count, 1, width)
        permit, _ = table.decide_many(poses, covs)
        same = float(np.mean(permit == plain.decide_many(poses, covs)))
        fast = seconds(lambda: table.decide_many(poses, covs))
        slow = seconds(lambda: plain.decide_many(poses, covs))
        # Else the two do not do the same work.
        figure(f"python: {name}: verdicts of plain NumPy that agree", round(same, 4), "1", 0.97)
        figure(f"python: {name}: decide_many", round(fast / count * 1e9, 1), "ns/set")
        figure(f"python: {name}: plain NumPy", round(slow / count * 1e9, 1), "ns/set")
        figure(f"python: {name}: plain NumPy over decide_many", round(slow / fast, 1), "1", goal)


def resident() -> float:
    """Returns the memory of this process, MiB."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / MIB


def is_flat(sets: int) -> None:
    table = open_table(ROOT / "examples/tables/see-t7.posegate")
    site = posegate.Site.open(ROOT / "examples/sites/dock.toml")
    poses, covs = pose_sets(50_000, 2)

    def work() -> None:
        table.decide_many(poses, covs)
        site.contains("see-t7", poses[:1_000])
        for index in range(200):
            x, y, yaw = poses[index]
            table.decide(x, y, yaw, covs[index])
        for _ in range(5):
            posegate.Table(bytes(table))
            try:
                table.decide_many(poses, covs[:9])
            except posegate.PosegateError:
                pass

    for _ in range(4):
        work()
    before = resident()
    rounds = max(1, sets // len(poses))
    for _ in range(rounds):
        work()
    growth = resident() - before
    figure("python: sets over which the memory is watched", rounds * len(poses), "sets", sets)
    figure("python: growth of the memory", round(growth, 2), "MiB", 0.5, at_least=False)


def lock_is_released() -> None:
    """Another thread counts while one call decides."""
    table = open_table(ROOT / "examples/tables/see-t7-grid.posegate")
    poses, covs = pose_sets(200_000, 4, 0.2)
    steps: list[float] = []
    ended = threading.Event()

    def count() -> None:
        while not ended.is_set():
            steps.append(time.perf_counter())
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    start = time.perf_counter()
    table.decide_many(poses, covs)
    stop = time.perf_counter()
    ended.set()
    thread.join()
    within = sum(start < step < stop for step in steps)
    figure("python: steps of another thread during one call", within, "steps", 5)


def child(data: bytes, poses: Floats, covs: Floats) -> int:
    permit, _ = posegate.Table(data).decide_many(poses, covs)
    return int(permit.sum())


def fork_is_safe() -> None:
    """A forked process has no threads of its parent's pool, and must not wait for them."""
    table = open_table(ROOT / "examples/tables/dock.posegate")
    poses, covs = pose_sets(50_000, 5, 0.1)
    permit, _ = table.decide_many(poses, covs)
    with multiprocessing.get_context("fork").Pool(2) as pool:
        waiting = pool.apply_async(child, (bytes(table), poses, covs))
        try:
            found = waiting.get(timeout=60)
        except multiprocessing.TimeoutError:
            pool.terminate()
            require(False, "decide_many hangs in a forked process")
    require(found == int(permit.sum()), "a forked process decides otherwise")


rows_agree()
layouts_agree()
is_fast()
is_flat(int(sys.argv[1]))
lock_is_released()
fork_is_safe()
end()
