"""Runs the examples of all docstrings in a folder with the files of `posegate demo`; every class and function has one. Pickles what can be pickled."""

import doctest
import os
import pickle
import sys
import tempfile
from typing import Any, Literal

import numpy as np

import posegate
from support import figure, program, require


def examples(name: str, subject: Any) -> int:
    """Runs the examples of an object and of its methods; returns their number."""
    count = 0
    members = {name: subject}
    if isinstance(subject, type):
        members.update({f"{name}.{key}": value for key, value in vars(subject).items() if not key.startswith("_")})
    for title, member in members.items():
        doc = getattr(member, "__doc__", None)
        if callable(member) or title == name:
            require(bool(doc), f"{title} has a docstring")
        test = doctest.DocTestParser().get_doctest(doc or "", {}, title, title, 0)
        runner = doctest.DocTestRunner()
        runner.run(test)
        require(runner.summarize(verbose=False).failed == 0, f"the example of {title} is right")
        count += len(test.examples)
    return count


def main() -> None:
    """Runs all examples."""
    with tempfile.TemporaryDirectory() as folder:
        ended = program("demo", "-o", os.path.join(folder, "demo-out"))
        require(ended.returncode == 0, ended.stderr)
        os.chdir(folder)
        total = 0
        for name in posegate.__all__:
            subject = getattr(posegate, name)
            if name in ("REASONS", "__version__"):
                continue
            count = examples(name, subject)
            require(count > 0 or name == "PosegateError", f"{name} has an example")
            total += count
        figure("python: examples of docstrings", total, "count", 40)

        table = posegate.Table.open("demo-out/dock.posegate")
        again = pickle.loads(pickle.dumps(table))
        require(bytes(again) == bytes(table), "a pickled table is equal")
        cov = np.diag([1e-4, 1e-4, 1e-4])
        verdict = table.decide(0.07, 0.0, 0.0, cov)
        require(pickle.loads(pickle.dumps(verdict)) == verdict, "a pickled verdict is equal")
        site = pickle.loads(pickle.dumps(posegate.Site.open("demo-out/site.toml")))
        require("dock" in site.tasks, "a pickled site has its tasks")
        text = open("demo-out/site.toml", encoding="utf-8").read()
        site = pickle.loads(pickle.dumps(posegate.Site.parse(text)))
        require(bool(site.contains("dock", [[0.0, 0.0, 0.0]])[0]), "a pickled text is a site")
        try:
            pickle.dumps(posegate.Gate(table))
        except TypeError:
            pass
        else:
            require(False, "a gate is not pickled")

        # Margins and reasons of arrays are those of single decisions, for every trust.
        random = np.random.default_rng(5)
        poses = random.uniform(-0.1, 0.1, (300, 3))
        covs = np.tile(np.diag([1e-4, 2e-4, 1e-4]), (300, 1, 1))
        covs[0, 0, 0] = np.nan
        # A bound for all rows, and each alone; and as the program decides.
        bound = posegate.Bounded(0.02, 0.01)
        require(pickle.loads(pickle.dumps(bound)) == bound, "a pickled bound is equal")
        permit, reason, margin = table.decide_many(poses, bound, margins=True)
        require(bool(permit.any()) and not bool(permit.all()), "bounds permit some")
        for row, (x, y, yaw) in enumerate(poses):
            one = table.decide(float(x), float(y), float(yaw), bound)
            require((one.permit, one.reason) == (permit[row], posegate.REASONS[reason[row]]), row)
        # The speed is that in any direction: a pose-set grows across the robot's axis, too.
        shut = posegate.Gate(table, permits_in_a_row=1, max_speed=0.5)
        beside = shut.step(100, 100, 0.0, 0.03, 0.0, posegate.Bounded(0.001, 0.001))
        still = posegate.Gate(table, permits_in_a_row=1).step(100, 100, 0.0, 0.03, 0.0, posegate.Bounded(0.001, 0.001))
        require(still.is_open and beside.reason == "not_contained", (still, beside))
        trusts: tuple[Literal["filled", "yaw_unknown", "all_unknown"], ...] = ("filled", "yaw_unknown", "all_unknown")
        for terms in trusts:
            for inflation in (1.0, 2.5):
                permit, reason, margin = table.decide_many(
                    poses, covs, margins=True, cross_terms=terms, inflation=inflation
                )
                fast = table.decide_many(poses, covs, cross_terms=terms, inflation=inflation)
                require((fast[0] == permit).all() and (fast[1] == reason).all(), "equal without margins")
                for row, pose in enumerate(poses):
                    x, y, yaw = (float(part) for part in pose)
                    one = table.decide(x, y, yaw, covs[row], cross_terms=terms, inflation=inflation)
                    require(one.permit == permit[row], (terms, inflation, row))
                    require(one.reason == posegate.REASONS[reason[row]], (terms, inflation, row))
                    same = np.isnan(margin[row]) if one.margin is None else one.margin == margin[row]
                    require(same, (terms, inflation, row, one.margin, margin[row]))
        wrongs: list[dict[str, Any]] = [{"cross_terms": "none"}, {"inflation": 0.5}]
        for wrong in wrongs:
            try:
                table.decide(0.0, 0.0, 0.0, cov, **wrong)
            except posegate.PosegateError as error:
                require("--" not in f"{error} {error.help}", error)
            else:
                require(False, f"{wrong} is refused")
    sys.stdout.flush()


main()
