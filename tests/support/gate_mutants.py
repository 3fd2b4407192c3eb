"""Mutants of the gate's checks: each must be found by a fast test, of the unit tests of `gate` or of
`tests/gate_machine.rs` and `tests/gate_order.rs`.

Usage: gate_mutants.py [PART OF A NAME]. With `--texts` only compares the texts with the sources: no name may be outdated. Copies the sources into a separate folder, changes one
check at a time and runs these tests. Prints a JSON line per mutant; ends with 1 if one
survives, or does not compile.
"""

import json
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

# Name, file, text, and its replacement. The text occurs once, or as often as `TIMES` states.
MUTANTS = [
    ("a stamp is always fresh", "machine/earning.rs",
     "        now_ms.wrapping_sub(stamp_ms) <= self.settings.oldest_ms()", "        now_ms.wrapping_sub(stamp_ms) <= u32::MAX"),
    ("a report counts on permits that have ended", "machine/earning.rs",
     "if before.standing.is_earning() && !self.stands() {",
     "if before.standing.is_earning() && !self.stands() && false {"),
    ("what was earned is not checked again in the output", "machine.rs",
     "            if !self.stands() {", "            if !self.stands() && false {"),
    ("what was earned too long ago is not latched", "machine.rs",
     "                self.fault(Reason::MemoryDamaged);\n                standing = ", "                standing = "),
    ("a word is stored from one reading", "doubled.rs",
     "            complement: !again,", "            complement: if again == word { !again } else { !word },"),
    ("the second evaluation is ignored", "machine/weighing.rs",
     "            word == second::INSIDE\n", "            word != 0x1234_5678\n"),
    ("the second evaluation takes every fix as fresh", "settings.rs",
     "let age_ms = since_fix_ms.unwrap_or(u32::MAX);", "let age_ms = since_fix_ms.unwrap_or(u32::MAX) & 0;"),
    ("an age that is not stated is fresh", "settings.rs",
     "            None => self.trust,\n", "            None => self.trust_after(Some(0)),\n"),
    ("an inflation by age may be any", "settings.rs",
     "source.aging.is_within(source.trust.inflation)", "source.aging.is_within(source.trust.inflation) | true"),
    ("the digest leaves out inflations by age", "settings.rs",
     "terms ^ source.aging.digest(),", "terms,"),
    ("a permit always stands", "machine/earning.rs",
     "        age <= settings.oldest_ms() && since <= settings.permit_hold_ms",
     "        age <= u32::MAX && since <= u32::MAX && settings.oldest_ms() <= u32::MAX"),
    ("a permit stands at any age", "machine/earning.rs",
     "        age <= settings.oldest_ms() && since <= settings.permit_hold_ms",
     "        age <= u32::MAX && since <= settings.permit_hold_ms"),
    ("a permit stands for any time", "machine/earning.rs",
     "        age <= settings.oldest_ms() && since <= settings.permit_hold_ms",
     "        age <= settings.oldest_ms() && since <= u32::MAX"),
    ("changed settings are not seen", "machine.rs",
     "if self.checked.get()? == self.settings.digest() {",
     "if self.checked.get()? == self.settings.digest() || true {"),
    ("the digest leaves out the response time", "settings.rs",
     "            self.maximum_age_ms,\n            self.response_ms,", "            self.maximum_age_ms,\n            0,"),
    ("the permit is not taken back before the checks", "machine.rs",
     "if !matches!(before.standing, DecodedState::Latched(_)) {\n            self.state = UNFINISHED;",
     "if false {\n            self.state = UNFINISHED;"),
    ("a latched gate reports what a report found", "machine.rs",
     "            verdict = None;\n        }\n        let state", "        }\n        let state"),
    ("a step that is not completed leaves no fault", "machine.rs",
     "if !matches!(before.standing, DecodedState::Latched(_)) {\n            self.state = UNFINISHED;",
     "if !matches!(before.standing, DecodedState::Latched(_)) {\n            self.state = DecodedState::Inhibited(Reason::Silent).word();"),
    ("a stamp is remembered as it is after the checks", "machine/order.rs",
     "RedundantWord::of_two(stamp_ms, again.stamp_ms)", "RedundantWord::of_two(stamp_ms & 0 | again.stamp_ms, again.stamp_ms)"),
    ("a word is not compared with its complement", "doubled.rs",
     "if self.word ^ self.complement == u32::MAX {", "if self.word ^ self.complement == u32::MAX || true {"),
    ("a report that skipped a check counts", "machine/earning.rs",
     "if flow != FlowSignature::WEIGHED {", "if flow != FlowSignature::WEIGHED && false {"),
    ("the sequence is not checked again", "machine.rs",
     "if self.follows_again(report) {", "if self.follows_again(report) || true {"),
    ("the number of permits is not checked again", "machine/earning.rs",
     "if !before.has_earned_by_complement(settings.permits_in_a_row)", "if false"),
    ("the hold time is not checked again", "machine/earning.rs",
     "            || !self.is_held_long_enough_by_complement(settings)\n", ""),
    ("the hold time is not checked", "machine/earning.rs",
     "        Ok(closed_for >= self.settings.inhibit_hold_ms)", "        Ok(closed_for >= 0)"),
    ("a replaced table is not seen in a step", "machine.rs",
     "        if !self.table_is_the_same()? {", "        if !self.table_is_the_same()? && false {"),
    ("a late cycle is not seen", "machine.rs",
     "} else if before.standing.is_open() && !(passed <= self.settings.response_ms) {", "} else if false {"),
    ("a shorter table is not seen in a step", "../table/stored.rs",
     "    task ^ length ^ crc\n", "    let _ = length;\n    task ^ crc\n"),
    ("another task is not seen in a step", "../table/stored.rs",
     "    task ^ length ^ crc\n", "    let _ = task;\n    length ^ crc\n"),
    ("a replaced table is not seen by the scrub", "machine.rs",
     "Ok(expected)) if u32::from_le_bytes(*crc) == expected => {\n                self.scrub.step(content, expected, count)",
     "Ok(_)) => {\n                self.scrub.step(content, u32::from_le_bytes(*crc), count)"),
    ("a kept permission opens", "permission.rs",
     "self.is_permit() && core::hint::black_box(*self).made_ms == now_ms", "self.is_permit() && now_ms == now_ms"),
    ("the complement of a permission is ignored", "permission.rs",
     "            && seen.complement == !PERMIT\n", ""),
    ("the signature of a permission is ignored", "permission.rs",
     "            && seen.flow ^ of_time(seen.made_ms) == FlowSignature::COMPLETE.word()\n", ""),
    ("a stamp is always the newest", "machine/order.rs",
     "            if latest.wrapping_sub(stamp_ms) < latest.wrapping_sub(newest) {",
     "            if latest.wrapping_sub(stamp_ms) <= u32::MAX || newest == 0 {"),
    ("a gap in the sequence is ignored", "machine/order.rs", "        if steps > 1 {", "        if steps > u32::MAX - 1 {"),
    ("another source is ignored", "machine/order.rs",
     "        if source != u32::from(report.source) {", "        if source != u32::from(report.source) && false {"),
    ("another frame is ignored", "machine.rs",
     "        if report.frame == source.frame {", "        if report.frame == source.frame || true {"),
    ("a report counts as the last one", "machine/earning.rs",
     "        if self.is_last_again(report) {", "        if self.is_last_again(report) || true {"),
    ("a permit that ends needs no reset", "machine/earning.rs",
     "if self.settings.restart == Restart::OnReset =>", "if self.settings.restart == Restart::OnReset && false =>"),
    ("time that runs backwards is ignored", "machine.rs",
     "        if !(passed < BACKWARDS_MS) {", "        if !(passed < BACKWARDS_MS) && false {"),
    ("a permit without a further report does not end", "machine.rs",
     "} else if !(since <= self.settings.permit_hold_ms) {", "} else if false {"),
    ("an interlock opens with a permission of another cycle", "interlock.rs",
     "permission.opens_at(now_ms)", "permission.is_permit()"),
]


# The interlock checks twice, so that a jump into the wrong arm is undone. The mutant changes both checks.
TIMES = {"an interlock opens with a permission of another cycle": 2}


TESTS = [["--lib", "gate::"], ["--test", "gate_machine", "--test", "gate_order"]]


def run(folder, environment):
    """Tests the sources in a folder. Returns the result, and the failed tests or the compiler's output."""
    for tests in TESTS:
        found = subprocess.run(
            ["cargo", "test", "-q", "-p", "posegate", *tests],
            cwd=folder, env=environment, capture_output=True, text=True, check=False)
        output = found.stdout + found.stderr
        if "could not compile" in output:
            return "does not compile", output
        if found.returncode != 0:
            # The list of failures at the end is indented.
            failed = re.findall(r"^    ([a-z_:0-9]+)$", found.stdout, re.MULTILINE)
            return "caught", sorted(set(failed))
    return "survives", None


def main():
    part = sys.argv[1] if len(sys.argv) > 1 else ""
    root = pathlib.Path(__file__).resolve().parents[2]
    outdated = [name for name, file, old, _ in MUTANTS
                if (root / "src" / "gate" / file).read_text().count(old) != TIMES.get(name, 1)]
    if outdated:
        sys.exit("the texts of these mutants do not stand in the sources as often as stated: " + "; ".join(outdated))
    if part == "--texts":
        print(json.dumps({"name": "mutants of the gate whose text is in the sources", "value": len(MUTANTS), "goal": len(MUTANTS)}))
        return
    bad = 0
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        for name in ["Cargo.toml", "Cargo.lock", "build.rs", "memory.x", "rust-toolchain.toml", "README.md"]:
            shutil.copy(root / name, folder / name)
        for name in ["src", "crates", "xtask", "examples", "tests", "include", "docs", "memory", "benches"]:
            shutil.copytree(root / name, folder / name, ignore=shutil.ignore_patterns("build", "target"))
        environment = dict(os.environ, CARGO_TARGET_DIR=str(folder / "target"), CARGO_INCREMENTAL="1")
        first, output = run(folder, environment)
        if first != "survives":
            sys.exit(f"the unit tests fail without a mutant: {first}\n{output}")
        for name, file, old, new in MUTANTS:
            if part not in name:
                continue
            path = folder / "src" / "gate" / file
            text = path.read_text()
            path.write_text(text.replace(old, new))
            outcome, details = run(folder, environment)
            path.write_text(text)
            by = details if outcome == "caught" else None
            print(json.dumps({"mutant": name, "outcome": outcome, "by": by}), flush=True)
            if outcome != "caught":
                bad += 1
                if outcome == "does not compile":
                    print(details, file=sys.stderr)
    print(json.dumps({"name": "mutants of the gate that no fast test finds", "value": bad, "goal": 0}))
    sys.exit(1 if bad else 0)


main()
