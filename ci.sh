#!/usr/bin/env bash
# Every check as a named job: `./ci.sh JOB [ARGUMENTS]`; without a job, all that a change must pass without recordings.
# Logs go to stderr, results to stdout. What is missing is installed here, or the job fails with the
# command that installs it.
set -euo pipefail
cd "$(dirname "$0")"

THUMBS=(thumbv6m-none-eabi thumbv7em-none-eabihf)
FEATURES=("" std defmt ffi "defmt,ffi" "std,defmt")
EVERY_FEATURE="cli,defmt,ffi,firmware"

say() { printf '\n== %s\n' "$*" >&2; }

# The cross targets (those named, or all of THUMBS) and the emulator, installed where they are missing.
need_targets() {
  local target
  [ $# -gt 0 ] || set -- "${THUMBS[@]}"
  for target in "$@"; do
    if [ ! -d "$(rustc --print sysroot)/lib/rustlib/$target" ]; then
      say "rustup target add $target"
      rustup target add "$target" >&2
    fi
  done
}

need_qemu() {
  if ! command -v qemu-system-arm >/dev/null; then
    say "apt-get install -y qemu-system-arm"
    local sudo=""
    [ "$(id -u)" = 0 ] || sudo=sudo
    $sudo apt-get update -qq >&2
    $sudo apt-get install -y -qq qemu-system-arm >&2
  fi
}

# A command, installed with its package where it is missing.
need_command() {
  if ! command -v "$1" >/dev/null; then
    say "apt-get install -y $2"
    local sudo=""
    [ "$(id -u)" = 0 ] || sudo=sudo
    $sudo apt-get update -qq >&2
    $sudo apt-get install -y -qq "$2" >&2
  fi
}

job_fmt() { cargo fmt --check >&2; }

# All that is built with every feature; the library alone with each of the others.
job_clippy() {
  need_targets
  local features target
  for features in "${FEATURES[@]}"; do
    cargo clippy --lib --features "$features" -- -D warnings >&2
  done
  cargo clippy --all-targets --features "$EVERY_FEATURE" -- -D warnings >&2
  for target in "${THUMBS[@]}"; do
    cargo clippy --target "$target" -- -D warnings >&2
    cargo clippy --target "$target" --features defmt,ffi -- -D warnings >&2
  done
  cargo clippy --target thumbv7em-none-eabihf --features firmware --examples -- -D warnings >&2
  cargo clippy --target thumbv7em-none-eabihf --features firmware,defmt --examples -- -D warnings >&2
}

# The program in release, built together with an example: so it has the features of its packages that tests and
# examples have, and is not built a second time for them.
release_program() {
  cargo build --release --features cli --bin posegate --example drive_bag >&2
}

# The fast suite. (Examples are built by clippy, and run by the jobs that need them.)
job_test() {
  need_targets
  need_qemu
  cargo test --no-default-features --lib >&2
  cargo test --features cli --lib --bins --tests >&2
  cargo test --features cli --doc >&2
}

# The API documents build without a warning, with the core alone and with every feature that adds to them; and every command in
# the blocks of shell of the README and of the pages of docs/ runs, each page in a folder of its own, with the sample files in it.
job_docs() {
  need_targets
  need_qemu
  need_command arm-none-eabi-gcc gcc-arm-none-eabi
  need_command make make
  export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"
  RUSTDOCFLAGS="-D warnings" cargo doc --no-deps >&2
  RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --features cli,defmt,ffi >&2
  release_program
  local page ran pages=0
  for page in README.md docs/*.md; do
    ran=$(page_commands "$page")
    # A page without a block of commands has none to run.
    grep -q '^```sh$' "$page" || continue
    printf '{"name": "commands of %s that run", "value": %s, "unit": "commands", "goal": null}\n' "$page" "$ran"
    [ "$ran" -ge 4 ]
    pages=$((pages + 1))
  done
  [ "$pages" -ge 6 ]
}

# Runs what stands in a page's blocks of shell, and prints how many commands that were.
page_commands() {
  local folder page="$PWD/$1"
  if grep -nE '^```(bash|shell|console)' "$page" >&2; then
    echo "$1: blocks of commands begin with \`\`\`sh" >&2
    exit 1
  fi
  folder=$(mktemp -d)
  cp tests/data/estimates.csv tests/data/apriltag_errors_sample.csv examples/sites/{loading-bay,paper-chain,docks}.toml examples/sites/docks.yaml "$folder/"
  (
    POSEGATE="$PWD"
    PATH="$(realpath "$CARGO_TARGET_DIR")/release:$PATH"
    export POSEGATE PATH
    cd "$folder"
    ran=0
    while IFS= read -r line; do
      line="${line%%#*}"
      case "$line" in
        # The project's own script runs this job.
        "" | "./ci.sh"*) continue ;;
        posegate\ * | cargo\ run\ * | cargo\ rustc\ * | make\ *) ;;
        *) printf '%s: a command that is not run: %s\n' "$1" "$line" >&2; exit 1 ;;
      esac
      # The program is built already; what cargo makes, it makes of this package.
      line="${line/cargo run --release --features cli -- /posegate }"
      line="${line/#cargo run /cargo run --manifest-path \"\$POSEGATE/Cargo.toml\" }"
      line="${line/#cargo rustc /cargo rustc --manifest-path \"\$POSEGATE/Cargo.toml\" }"
      printf '$ %s\n' "$line" >&2
      code=0
      eval "$line" >&2 </dev/null || code=$?
      # `gate` answers 1 where an estimate is denied, `replay` where one was permitted falsely.
      if [ "$code" -ne 0 ] && ! { [ "$code" -eq 1 ] && [[ "$line" =~ ^posegate\ (gate|replay)\  ]]; }; then
        printf '%s: a command failed with %s: %s\n' "$1" "$code" "$line" >&2
        exit 1
      fi
      ran=$((ran + 1))
    done < <(awk '/^```sh$/ {inside = 1; next} /^```$/ {inside = 0} inside' "$page")
    echo "$ran"
  ) || { rm -r "$folder"; exit 1; }
  rm -r "$folder"
}

# What the fast suite tries a part of, in full.
job_deep() {
  POSEGATE_DEEP=1 cargo test --release --features cli --lib --test success_sets --test planning >&2
  cargo test --release --features cli --test cover --test place -- --include-ignored >&2
}

# N random and searched pose-sets against the exact oracle.
job_adversarial() {
  cargo test --release --features cli --test adversarial -- "${1:-1000000}" "${2:-1}" "${3:-grid}"
}

# The reference cases of an independent implementation.
job_cases() {
  local folder="${1:?usage: ./ci.sh cases DIR (the folder of the reference cases)}"
  [ -d "$folder" ] || { echo "no folder $folder: ./ci.sh cases DIR" >&2; exit 1; }
  POSEGATE_CASES="$(cd "$folder" && pwd)" cargo test --release --features cli --test cases --test oracle_agrees -- --include-ignored --nocapture >&2
}

# Recorded estimates through the emulated controller and the desk; what is learnt of recorded detections and of a
# recorded filter, on rows that it was not learnt from.
job_recorded() {
  local folder="${1:?usage: ./ci.sh recorded DIR (the folder of the recordings)}"
  need_targets
  need_qemu
  [ -d "$folder" ] || { echo "no folder $folder: ./ci.sh recorded DIR" >&2; exit 1; }
  POSEGATE_RECORDED="$(cd "$folder" && pwd)" cargo test --features cli --test uart_replay -- --ignored --nocapture recorded >&2
  POSEGATE_RECORDED="$(cd "$folder" && pwd)" cargo test --features cli --test learn -- --ignored --nocapture --test-threads 1 recorded |
    tee -a /dev/stderr | grep '^{'
  recorded_rules "$folder"
}

# What the gate would have permitted, beside the rules that are in use without it: AMCL's estimates of the Nav2
# recording, which has no truth, and those of a filter on real robots, whose truth is known. Fails where the gate
# permits falsely on the robots with even numbers, with covariances inflated as `learn` says of the others.
recorded_rules() {
  local folder="$1" posegate task line half inflation
  release_program
  posegate="${CARGO_TARGET_DIR:-target}/release/posegate"
  need_command python3 python3
  for task in hall dock; do
    "$posegate" replay examples/sites/turtlebot.toml "$folder/nav2/nav2_turtlebot.mcap" --task $task \
      --topic /amcl_pose --cross-terms yaw-unknown --max-age-ms 3000 --permit-hold-ms 3000 --json | python3 tests/support/rules.py "nav2, $task"
  done
  for inflation in 1 6; do
    # A false permit ends it with 1; the table says which.
    line=$("$posegate" replay examples/sites/turtlebot.toml "$folder/mrclam/ekf_estimates.csv" --task bay \
      --inflation $inflation --max-age-ms 3000 --permit-hold-ms 3000 --json) || [ $? -eq 1 ]
    python3 tests/support/rules.py "mrclam, bay, inflation $inflation" <<<"$line"
  done
  half=$(mktemp -d)
  awk -F, 'NR == 1 || $1 % 2 == 1' "$folder/mrclam/ekf_estimates.csv" >"$half/learn.csv"
  awk -F, 'NR == 1 || $1 % 2 == 0' "$folder/mrclam/ekf_estimates.csv" >"$half/held.csv"
  # Three robots have 133 independent rows: enough for a confidence of 0.7.
  inflation=$("$posegate" learn inflation "$half/learn.csv" --epsilon 0.99 --confidence 0.7 -o "$half/filter.toml" --json |
    python3 -c 'import json, sys; print(json.load(sys.stdin)["overall"]["inflation"])')
  line=$("$posegate" replay examples/sites/turtlebot.toml "$half/held.csv" --task bay \
    --inflation "$inflation" --max-age-ms 3000 --permit-hold-ms 3000 --json) || [ $? -eq 1 ]
  rm -r "$half"
  python3 tests/support/rules.py "mrclam, bay, robots 2 and 4, inflation $inflation learnt of 1, 3 and 5" <<<"$line"
  python3 -c 'import json, sys
replay = json.loads(sys.argv[1])
gate, truth = replay["rules"]["gate"], replay["truth"]
sys.exit(gate["false_permits"] != 0 or gate["permits"] == 0 or truth["coverage"] < 0.99)' "$line"
}

# Hostile files: single-bit flips of a bag, and mutants of good files of every format, each in a process of its own. Fails at an
# abort, a panic, another exit code than 0 to 3, more than 512 MiB or more than 20 s of processor time. With POSEGATE_RECORDED, the
# folder of the recordings, the flips are of its bag of Nav2; without, of one that is made.
job_hostile() {
  local result=0
  POSEGATE_FLIPS="${1:-2000}" POSEGATE_MUTANTS="${2:-20000}" POSEGATE_SEED="${3:-1}" \
    cargo test --release --features cli --test hostile_files -- --include-ignored --exact --nocapture hostile_files_are_answered |
    tee -a /dev/stderr | grep '^{' || result=$?
  return $result
}

# The core as WebAssembly, in the reports of `posegate report`: what is committed is what the source makes, byte for byte, and it
# imports nothing (a panic that can be reached would be an import).
job_wasm() {
  need_targets wasm32-unknown-unknown
  local core
  cargo rustc --lib --crate-type cdylib --profile firmware --target wasm32-unknown-unknown \
    --features ffi,panic-handler -- -C strip=symbols >&2
  core="${CARGO_TARGET_DIR:-target}/wasm32-unknown-unknown/firmware/posegate.wasm"
  printf '{"name": "core as WebAssembly", "value": %s, "unit": "B", "goal": 150000}\n' "$(stat -c %s "$core")"
  if ! cmp "$core" src/page/core.wasm >&2; then
    # Another compiler makes other bytes: those of the page are of 1.95.0.
    echo "src/page/core.wasm is not what $(rustc --version) makes of the source: cp $core src/page/core.wasm" >&2
    exit 1
  fi
  [ "$(stat -c %s "$core")" -le 150000 ]
}

# The page of `posegate report` in Debian's chromium: the vector file, dragging, keys, the command line's verdicts, nothing fetched,
# no WebAssembly; and how large a page of 50 tasks is and how long it takes. Screenshots go to FOLDER, if one is given.
job_browser() {
  local folder="${1:-}" venv="${CARGO_TARGET_DIR:-target}/browser-venv" posegate own="" begun took size name short=""
  need_command chromium chromium
  if ! "$venv/bin/python" -c 'import playwright' 2>/dev/null; then
    say "pip install playwright"
    python3 -m venv "$venv" >&2 || { echo "no venv: apt-get install -y python3-venv" >&2; exit 1; }
    "$venv/bin/pip" install -q playwright >&2 || { echo "missing: $venv/bin/pip install playwright" >&2; exit 1; }
  fi
  job_wasm
  cargo build --release --features cli --bin posegate --example plant >&2
  posegate="${CARGO_TARGET_DIR:-target}/release/posegate"
  [ -n "$folder" ] || { folder=$(mktemp -d); own="$folder"; }
  mkdir -p "$folder"
  "$posegate" init --force "$folder/site.toml" >&2
  # A goal that is turned, so that frames are told apart.
  cat >>"$folder/site.toml" <<'SITE'

[task.dock-b]
kind = "work"
goal = { x = 3.0, y = -1.5, yaw_deg = 65.0 }
success = { shape = "box", x = [-0.09, 0.12], y = [-0.08, 0.07], yaw_deg = [-4.0, 5.0] }

# Near where headings go round.
[task.dock-c]
kind = "work"
goal = { x = -2.0, y = 4.0, yaw_deg = -179.0 }
success = { shape = "box", x = [-0.09, 0.12], y = [-0.08, 0.07], yaw_deg = [-4.0, 5.0] }

[task.round]
kind = "work"
goal = { x = 1.0, y = 4.0, yaw_deg = 20.0 }
success = { shape = "box", x = [-0.3, 0.3], y = [-0.3, 0.3], yaw_deg = [-5.0, 300.0] }
table = { extent = { x = [-0.5, 0.5], y = [-0.5, 0.5], yaw_deg = [-20.0, 320.0] }, step = { xy = 0.02, yaw_deg = 1.0 }, layout = "facets" }

# Names that a browser shows alike.
[task."dock a"]
kind = "work"
goal = { x = 0.0, y = -3.0, yaw_deg = 0.0 }
success = { shape = "box", x = [-0.5, 0.5], y = [-0.5, 0.5], yaw_deg = [-20.0, 20.0] }

[task."dock  a"]
kind = "work"
goal = { x = 9.0, y = -3.0, yaw_deg = 0.0 }
success = { shape = "box", x = [-0.01, 0.01], y = [-0.01, 0.01], yaw_deg = [-5.0, 5.0] }

[task." lead"]
kind = "work"
goal = { x = 7.0, y = -3.0, yaw_deg = 0.0 }
success = { shape = "box", x = [-0.5, 0.5], y = [-0.5, 0.5], yaw_deg = [-20.0, 20.0] }
SITE
  echo '{"task": "dock-b", "compared": [["dock-b", 0.1], ["dock-c", 0.1], ["see-t7", 2.5]]}' >"$folder/tasks.json"
  "$posegate" place "$folder/site.toml" --task see-t7 --sigma-x 0.1 --sigma-y 0.1 --sigma-yaw-deg 1 \
    --free x=0.3:7,y=-3:3,yaw_deg=0:360 --budget 300 --json -o "$folder/places.svg" >"$folder/place.json"
  "$posegate" report "$folder/site.toml" --title "Sample site" --placement see-t7="$folder/place.json" \
    --picture "$folder/places.svg" -o "$folder/report.html" >&2
  "$venv/bin/python" tests/support/browser.py "$folder/report.html" "$folder/site.toml" "$posegate" "$folder"
  # Half of the fifty are boxes, half are what a camera sees, as the sample's own.
  for k in $(seq 17); do
    printf '\n[task.bay-%s]\nkind = "work"\ngoal = { x = %s.0, y = -4.0, yaw_deg = %s.0 }\nsuccess = { shape = "box", x = [-0.1, 0.1], y = [-0.0%s, 0.1], yaw_deg = [-4.0, 5.0] }\n' \
      "$k" "$k" "$k" "$((k % 9 + 1))" >>"$folder/site.toml"
  done
  for k in $(seq 24); do
    printf '\n[task.see-%s]\n' "$k"
    awk '/^\[task.see-t7\]/ { on = 1; next } /^\[/ { on = 0 } on' "$folder/site.toml"
  done >"$folder/views"
  cat "$folder/views" >>"$folder/site.toml"
  [ "$(grep -cE '^\[task\.("[^"]*"|[^.]+)\]$' "$folder/site.toml")" -eq 50 ]
  # And a plant's, with its walls, tags and plans.
  "${posegate%/*}/examples/plant" 25 >"$folder/plant.toml"
  for name in site plant; do
    begun=$(date +%s%N)
    "$posegate" report "$folder/$name.toml" -o "$folder/fifty-$name.html" >&2
    took=$(( ($(date +%s%N) - begun) / 1000000 ))
    size=$(stat -c %s "$folder/fifty-$name.html")
    printf '{"name": "report of 50 tasks, %s", "value": %s, "unit": "ms", "goal": 5000}\n' $name "$took"
    printf '{"name": "page of 50 tasks, %s", "value": %s, "unit": "B", "goal": 5000000}\n' $name "$size"
    [ "$took" -lt 5000 ] && [ "$size" -le 5000000 ] || short+=" $name"
  done
  [ -z "$short" ] || { echo "a page of 50 tasks takes too long, or too much:$short" >&2; exit 1; }
  [ -z "$own" ] || rm -r "$own"
}

# The MCAP that `replay` writes, opened by the Python package mcap, which shares no code with the writer: every
# message against the rows of the same run.
job_mcap() {
  local venv="${CARGO_TARGET_DIR:-target}/mcap-venv" folder posegate
  if ! "$venv/bin/python" -c 'import mcap' 2>/dev/null; then
    say "pip install mcap"
    python3 -m venv "$venv" >&2 || { echo "no venv: apt-get install -y python3-venv" >&2; exit 1; }
    "$venv/bin/pip" install -q mcap >&2 || { echo "missing: $venv/bin/pip install mcap" >&2; exit 1; }
  fi
  cargo build --release --features cli --bin posegate >&2
  posegate="${CARGO_TARGET_DIR:-target}/release/posegate"
  folder=$(mktemp -d)
  # The even rows get a truth to their side, so that no channel is empty; a permit may be false here.
  awk -F, -v OFS=, 'NR == 1 {
      for (k = 1; k <= NF; k++) place[$k] = k
      print $0, "true_x_m", "true_y_m", "true_yaw_rad"; next }
    NR % 2 { print $0, "", "", ""; next }
    { print $0, $place["x_m"] + 0.01, $place["y_m"] - 0.02, 0.01 }' tests/data/estimates.csv >"$folder/estimates.csv"
  "$posegate" replay examples/sites/dock.toml "$folder/estimates.csv" --task dock --json \
    --rows "$folder/rows.jsonl" --mcap "$folder/verdicts.mcap" >"$folder/summary.json" || [ $? -eq 1 ]
  "$venv/bin/python" tests/support/read_mcap.py "$folder/verdicts.mcap" "$folder/rows.jsonl" "$folder/summary.json"
  rm -r "$folder"
}

# Estimates a second through the gate, megabytes of a bag a second of one core, and that memory does not grow with
# the bag (1 GB against 100 MB, made in a temporary folder).
job_replay_speed() {
  cargo build --release --features cli --example replay_speed >&2
  "${CARGO_TARGET_DIR:-target}/release/examples/replay_speed"
}

# The figures of the budgets: bytes, seconds, voxels a second, instructions, stack, flash, and how much of
# the truth is accepted. Fails where one is beyond its goal.
job_budgets() {
  need_targets
  need_qemu
  local short="" target machine count folder begun took
  release_program
  cargo run --release --features cli --example budgets || short+=" desk"
  folder=$(mktemp -d)
  begun=$(date +%s%N)
  "${CARGO_TARGET_DIR:-target}/release/posegate" demo -o "$folder/demo" >&2
  took=$(( ($(date +%s%N) - begun) / 1000000 ))
  rm -r "$folder"
  printf '{"name": "demo", "value": %s, "unit": "ms", "goal": 5000, "most": 20000}\n' "$took"
  [ "$took" -lt 20000 ] || short+=" demo"
  while read -r target machine; do
    for count in count_instructions count_gate; do
      cargo build --profile firmware --target "$target" --features firmware --example "$count" >&2 </dev/null
      timeout 600 qemu-system-arm -M "$machine" -display none -monitor none -serial none -icount shift=6 \
        -semihosting-config enable=on,target=native \
        -kernel "${CARGO_TARGET_DIR:-target}/$target/firmware/examples/$count" </dev/null || short+=" $target"
    done
  done <<'CORES'
thumbv7em-none-eabihf mps2-an386
thumbv6m-none-eabi mps2-an385
CORES
  job_flash || short+=" flash"
  job_accuracy || short+=" accuracy"
  if [ -n "$short" ]; then
    echo "beyond a goal:$short" >&2
    exit 1
  fi
}

# How much of a visibility set is proven, how fast, and codac's paving of the same set beside it: in a Python
# environment of its own under the target folder. The smallest box of codac's in metres; 0.02 is the resolution
# of ours, and takes minutes.
job_paving() {
  cargo run --release --features std --example paving
  local environment="${CARGO_TARGET_DIR:-target}/paving-python"
  if [ ! -x "$environment/bin/python" ] || ! "$environment/bin/python" -c 'import codac' 2>/dev/null; then
    say "python3 -m venv, pip install codac"
    python3 -m venv "$environment" >&2
    "$environment/bin/pip" install --quiet codac >&2
  fi
  "$environment/bin/python" tests/support/paving_codac.py "${1:-0.08}"
}

# The cosine and sine of every one of the 2^32 headings, against their digest: minutes.
job_headings() {
  cargo test --release --lib every_heading -- --ignored >&2
  printf '{"name": "headings whose cosine and sine are as noted", "value": 4294967296, "unit": "headings", "goal": 4294967296}\n'
}

# Random success sets: what a table holds is in the set. Sets, and samples a set: 1000 1000 is what the fast suite
# has; 1000 100000 takes a night's share.
job_sets() {
  POSEGATE_SETS="${1:-1000}" POSEGATE_SAMPLES="${2:-100000}" \
    cargo test --release --features std --test success_sets -- --nocapture | tee -a /dev/stderr | grep '^{'
}

# Bytes of code that a decision takes on a Cortex-M4F: on facets, the reason of a denial included, and
# the walk of a grid.
job_flash() {
  need_targets
  if ! command -v arm-none-eabi-nm >/dev/null; then
    say "apt-get install -y binutils-arm-none-eabi"
    local sudo=""
    [ "$(id -u)" = 0 ] || sudo=sudo
    $sudo apt-get update -qq >&2
    $sudo apt-get install -y -qq binutils-arm-none-eabi >&2
  fi
  cargo build --profile firmware --target thumbv7em-none-eabihf --features firmware --example flash >&2
  arm-none-eabi-nm -C -S "${CARGO_TARGET_DIR:-target}/thumbv7em-none-eabihf/firmware/examples/flash" | {
    local size kind name facets=0 grid=0
    while read -r _ size kind name; do
      [[ "$kind" == [tT] ]] || continue
      case "$name" in
        posegate::contain::facets::* | posegate::contain::decide*) facets=$((facets + 16#$size)) ;;
        *posegate::contain::*) grid=$((grid + 16#$size)) ;;
      esac
    done
    printf '{"name": "m4f flash of the decision on facets", "value": %d, "unit": "B", "goal": 4000}\n' "$facets"
    printf '{"name": "m4f flash of the walk of a grid", "value": %d, "unit": "B", "goal": null}\n' "$grid"
    [ "$facets" -gt 1000 ] && [ "$facets" -le 4000 ]
  }
}

# The accepted scale over the true one on N random pose-sets of reference set A.
job_accuracy() {
  cargo test --release --features cli --test accuracy -- "${1:-2000}" "${2:-1}"
}

# Every fault injected: damaged tables, stale and wrapped stamps, pins, garbage and flipped bits on
# the wire, the emulated controller included; single bits of the running firmware's code, registers and
# memory (N of each kind, with a seed). Counts tried and wrongly permitted. With fewer than 700 of a kind
# the controller's line has its fast counts too: a look, not the figures.
job_faults() {
  need_targets
  need_qemu
  local counts=()
  if [ "${1:-700}" -ge 700 ]; then
    counts=(POSEGATE_GARBAGE_BYTES=1000000 POSEGATE_MUTANTS=10000 POSEGATE_FLOOD_SECONDS=10)
  fi
  cargo test --release --features cli --test table_faults -- --nocapture | tee -a /dev/stderr | grep '^{'
  local log passed
  log=$(mktemp)
  # A filter that matches nothing would pass: so the tests that ran are counted.
  {
    cargo test --release --lib gate::
    cargo test --release --lib wire::
    cargo test --features cli --test uart_replay refused
  } 2>&1 | tee "$log" >&2
  # The controller that runs by interrupts: a million random bytes, ten thousand mutants, a flood, and
  # faults of its own.
  env "${counts[@]}" cargo test --features cli --test interrupt_gate --test interrupt_faults -- --nocapture 2>&1 |
    tee -a "$log" /dev/stderr | grep '^{'
  passed=$(sed -n 's/^test result: ok\. \([0-9]*\) passed.*/\1/p' "$log" | awk '{sum += $1} END {print sum + 0}')
  rm "$log"
  printf '{"name": "fault tests of stamps, pins, frames and the controller passed", "value": %s, "unit": "tests", "goal": 50}\n' "$passed"
  [ "$passed" -ge 50 ]
  cargo test --release --features cli --test fault_injection -- "${1:-700}" "${2:-1}"
}

# The tests that start an emulator, that wait, or that look at a clock: a target, and where not all of it does, a part of the names of
# those that do. `tests/steady.rs` finds the files.
STEADY=(
  interrupt_gate
  interrupt_faults
  docking_gate
  uart_replay
  "contingent_plan firmware"
  "defmt_telemetry logs"
  fault_injection
  "command_line links_and_pipes"
  error_rendering
  hostile_files
)

# Each of them RUNS times (20) on an idle machine, which is for the caller to see to, and RUNS times beside two busy processes: not
# once may one fail. Ends at the first failure, with its log.
job_steady() {
  local runs="${1:-20}" entry target pattern load run built
  local -A program=()
  need_targets
  need_qemu
  # Not local: the busy processes end with this one, whatever its end is.
  log=$(mktemp)
  busy=()
  trap 'rm -f "$log"; [ ${#busy[@]} -eq 0 ] || kill "${busy[@]}"' EXIT
  local targets=()
  for entry in "${STEADY[@]}"; do
    targets+=(--test "${entry%% *}")
  done
  built=$(cargo test --features cli --no-run "${targets[@]}" --message-format=json)
  while read -r target run; do
    program[$target]="$run"
  done < <(sed -n 's/.*"kind":\["test"\].*"name":"\([a-z_]*\)".*"executable":"\([^"]*\)".*/\1 \2/p' <<<"$built")
  for load in "on an idle machine" "beside two busy processes"; do
    if [ "$load" != "on an idle machine" ]; then
      for run in 1 2; do
        while :; do :; done &
        busy+=($!)
      done
    fi
    for entry in "${STEADY[@]}"; do
      read -r target pattern <<<"$entry"
      [ -x "${program[$target]:-}" ] || { echo "cargo has built no test $target" >&2; exit 1; }
      say "$entry, $runs times $load"
      for run in $(seq "$runs"); do
        # shellcheck disable=SC2086
        if ! "${program[$target]}" $pattern >"$log" 2>&1 </dev/null; then
          cat "$log" >&2
          printf '{"name": "steady: %s %s, failures in %s runs", "value": 1, "unit": "failures", "goal": 0}\n' "$target" "$load" "$run"
          exit 1
        fi
        # A filter that matches nothing would pass.
        if grep -q '^running 0 tests' "$log"; then
          echo "no test of $target is named *$pattern*" >&2
          exit 1
        fi
      done
      printf '{"name": "steady: %s %s, failures in %s runs", "value": 0, "unit": "failures", "goal": 0}\n' "$target" "$load" "$runs"
    done
  done
}

# No panic is reachable from what a controller calls: a link that fails otherwise, and that is seen to
# fail with a panic put in.
job_no_panic() {
  need_targets
  local target log
  log=$(mktemp)
  for target in "${THUMBS[@]}"; do
    cargo build --profile firmware --target "$target" --features firmware --example no_panic >&2
    if RUSTFLAGS="--cfg seeded_panic" cargo build --profile firmware --target "$target" --target-dir target/seeded \
      --features firmware --example no_panic >"$log" 2>&1; then
      echo "the link test does not see a panic on $target" >&2
      exit 1
    fi
    if ! grep -q 'undefined symbol: a_panic_is_reachable' "$log"; then
      cat "$log" >&2
      exit 1
    fi
    printf '{"name": "panics reachable, %s", "value": 0, "unit": "panics", "goal": 0}\n' "$target"
  done
  rm "$log"
}

# The decisions of tests/data/vectors.bin made again on this machine and in five emulations, which say
# themselves on what core they run: a JSON line each. Fails unless each line tells of every decision.
job_vectors() {
  need_targets thumbv6m-none-eabi thumbv7m-none-eabi thumbv7em-none-eabihf thumbv8m.main-none-eabihf
  need_qemu
  local host line count target machine core code failed=""
  host=$(rustc --print host-tuple | cut -d- -f1 | tr _ -)
  line=$(cargo run --release --features firmware --example vectors) || failed=", $host"
  printf '%s\n' "$line"
  count=$(sed -n 's/.*"count":\([0-9]*\),.*/\1/p' <<<"$line")
  [ "${count:-0}" -ge 10000 ] || failed=", $host"
  right() { printf '{"name":"vectors %s","count":%s,"mismatches":0,"first_mismatch":null,"goal":0}' "$1" "$count"; }
  [ "$line" = "$(right "$host")" ] || failed=", $host"
  while read -r target machine core; do
    code=0
    cargo build --profile firmware --target "$target" --features firmware --example vectors >&2 </dev/null
    line=$(timeout 60 qemu-system-arm -M "$machine" -display none -monitor none -serial none \
      -semihosting-config enable=on,target=native \
      -kernel "${CARGO_TARGET_DIR:-target}/$target/firmware/examples/vectors" </dev/null) || code=$?
    printf '%s\n' "$line"
    [ "$code $line" = "0 $(right "$core")" ] || failed+=", $core"
  done <<'CORES'
thumbv6m-none-eabi mps2-an385 ARMv6-M on Cortex-M3
thumbv7m-none-eabi mps2-an385 Cortex-M3
thumbv7em-none-eabihf mps2-an386 Cortex-M4
thumbv7em-none-eabihf mps2-an500 Cortex-M7
thumbv8m.main-none-eabihf mps2-an505 Cortex-M33
CORES
  if [ -n "$failed" ]; then
    echo "not the decisions of tests/data/vectors.bin: ${failed#, }" >&2
    exit 1
  fi
}

# The C boundary: the header is current and clean, misuse is refused, and C firmware, built by Make and by
# CMake, answers the vector file and the serial line as the firmware in Rust does.
job_c() {
  need_targets
  need_qemu
  need_command arm-none-eabi-gcc gcc-arm-none-eabi
  need_command arm-none-eabi-g++ libstdc++-arm-none-eabi-newlib
  need_command g++ g++
  need_command make make
  need_command cmake cmake
  export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"
  local folder compiler language target machine name line rust
  folder=$(mktemp -d)
  cargo test --features ffi --test c_header --test c_boundary --test c_overlap --test layering >&2

  for compiler in "gcc -std=c99" "g++ -std=c++11" "arm-none-eabi-gcc -std=c99" "arm-none-eabi-g++ -std=c++11"; do
    language=c
    [[ "$compiler" != *++\ * ]] || language=c++
    # shellcheck disable=SC2086
    $compiler -x $language -Wall -Wextra -pedantic -Wconversion -Wshadow -Wundef -Werror -fsyntax-only include/posegate.h >&2
  done
  printf '{"name": "compilers that take the header without a warning", "value": 4, "unit": "compilers", "goal": 4}\n'

  run_c() {
    timeout 60 qemu-system-arm -M "$1" -display none -monitor none -serial none \
      -semihosting-config enable=on,target=native -kernel "$2" </dev/null
  }
  while read -r target machine; do
    make -C examples/c TARGET="$target" OUT="$folder/make/$target" >&2 </dev/null
    c_archive "$target" "$folder/make/$target" </dev/null
    cmake -S examples/c -B "$folder/cmake/$target" --toolchain arm-none-eabi.cmake \
      -DPOSEGATE_TARGET="$target" -DPOSEGATE_CARGO_DIR="$CARGO_TARGET_DIR" >&2 </dev/null
    cmake --build "$folder/cmake/$target" >&2 </dev/null
    cargo build --profile firmware --target "$target" --features firmware --example vectors >&2 </dev/null
    rust=$(run_c "$machine" "$CARGO_TARGET_DIR/$target/firmware/examples/vectors")
    for name in make cmake; do
      run_c "$machine" "$folder/$name/$target/docking_gate.elf" >&2
      run_c "$machine" "$folder/$name/$target/controller.elf" >&2
      line=$(run_c "$machine" "$folder/$name/$target/vectors.elf")
      if [ "$line" != "$rust" ]; then
        printf 'C by %s: %s\nRust: %s\n' "$name" "$line" "$rust" >&2
        exit 1
      fi
      printf '%s\n' "${line/vectors/vectors in C by $name,}"
    done
  done <<'CORES'
thumbv7em-none-eabihf mps2-an386
thumbv6m-none-eabi mps2-an385
CORES
  rm -r "$folder"

  # The smallest gate opens and closes, and the bench answers, as those in Rust do.
  POSEGATE_FIRMWARE=c cargo test --features cli --test docking_gate --test uart_replay >&2
}

# Every function of the header linked without a C library: nothing is left undefined, no panic, no
# allocator and no defmt is reachable. And the flash that a gate takes.
c_archive() {
  local target="$1" out="$2" name
  local archive="$CARGO_TARGET_DIR/$target/firmware/libposegate.a"
  local functions=() core=(-mcpu=cortex-m0plus -mfloat-abi=soft)
  [ "$target" = thumbv6m-none-eabi ] || core=(-mcpu=cortex-m4 -mfpu=fpv4-sp-d16 -mfloat-abi=hard)
  link() {
    local elf="$1"
    shift
    arm-none-eabi-gcc "${core[@]}" -mthumb -nostdlib -T examples/c/link.ld -Wl,--gc-sections \
      -Wl,-z,noexecstack -Wl,-e,posegate_abi_version "${@/#/-Wl,-u,}" "$archive" -o "$elf" >&2
  }
  mapfile -t functions < <(grep -oE '\bposegate_[a-z_0-9]+\(' include/posegate.h | tr -d '(' | sort -u)
  [ "${#functions[@]}" -ge 25 ]
  link "$out/every.elf" "${functions[@]}"
  arm-none-eabi-nm -C "$out/every.elf" >"$out/every.nm"
  for name in "${functions[@]}"; do
    grep -q " T $name$" "$out/every.nm" || { echo "not in the archive: $name" >&2; exit 1; }
  done
  if grep -E ' U |panic|defmt|__rust_alloc|__rg_|unwind' "$out/every.nm" >&2; then
    echo "in the archive for $target: see above" >&2
    exit 1
  fi
  printf '{"name": "functions of the C boundary that link alone, %s", "value": %s, "unit": "functions", "goal": null}\n' \
    "$target" "${#functions[@]}"
  link "$out/gate.elf" posegate_gate_init posegate_gate_step posegate_gate_tick posegate_permission_is_permit
  printf '{"name": "flash of a gate in C, %s", "value": %s, "unit": "B", "goal": null}\n' \
    "$target" "$(arm-none-eabi-size "$out/gate.elf" | awk 'NR == 2 {print $1 + $2}')"
}

# The checks of the gate taken away, one at a time: each must be found by a fast test. A part of a name runs those mutants alone.
job_gate_mutants() {
  need_command python3 python3
  python3 tests/support/gate_mutants.py "$@"
}

# The core rooms with operators changed and bodies emptied, one at a time: a mutant that no test sees
# is missed. First against the rooms' own tests, then what is left against those that need the desk.
# Takes most of an hour; what is left out, and why, is in .cargo/mutants.toml.
job_mutants() {
  local room folder name missed
  local files=()
  [ $# -gt 0 ] || set -- num set table contain sight
  for room in "$@"; do
    [ -e "src/$room.rs" ] || [ -d "src/$room" ] || { echo "no room $room in src" >&2; exit 1; }
    files+=(-f "src/$room.rs" -f "src/$room/**")
  done
  if ! command -v cargo-mutants >/dev/null; then
    say "cargo install cargo-mutants --locked"
    cargo install cargo-mutants --locked >&2
  fi
  folder=$(mktemp -d)
  # 2 says that mutants were missed, 3 that some ran out of time: both are counted below.
  pass() {
    local code=0
    PROPTEST_RNG_SEED=1 PROPTEST_DISABLE_FAILURE_PERSISTENCE=1 \
      cargo mutants --colors never --output "$folder" --minimum-test-timeout 20 "${files[@]}" "$@" >&2 || code=$?
    case $code in 0 | 2 | 3) ;; *) exit "$code" ;; esac
  }
  count() { cat "$folder"/mutants.out*/"$1.txt" | wc -l; }
  pass -- --lib
  if [ -s "$folder/mutants.out/missed.txt" ]; then
    pass --iterate --features std -- --test grid_walk --test vectors --test facet_faults --test sight
  fi
  for name in caught unviable; do
    printf '{"name":"mutants %s","value":%s,"unit":"mutants","goal":null}\n' "$name" "$(count "$name")"
  done
  printf '{"name":"mutants that ran out of time","value":%s,"unit":"mutants","goal":null}\n' \
    "$(wc -l <"$folder/mutants.out/timeout.txt")"
  missed=$(wc -l <"$folder/mutants.out/missed.txt")
  printf '{"name":"mutants missed","value":%s,"unit":"mutants","goal":0}\n' "$missed"
  cat "$folder/mutants.out/missed.txt" >&2
  rm -r "$folder"
  [ "$missed" -eq 0 ]
}

# Every fuzz target of tests/fuzz (or those named) for so many seconds, from seeds of real tables and recorded estimates;
# what was found before in tests/fuzz/corpus is begun from, too. A line a target. Fails on a finding, and
# where a target saw fewer edges of the code than one that gets past the checksums must.
job_fuzz() {
  local seconds="${1:?usage: ./ci.sh fuzz SECONDS [TARGET..] (seconds for each target)}"
  shift
  local folder=tests/fuzz target log code edges floor executions artifact findings failed="" targets
  # In 10 s from the seeds alone they see 903, 912 and 799. A table whose checksum is not repaired is
  # left after 31; a wire harness that neither decodes nor sends anything shows 647.
  local -A floors=([table]=800 [wire]=850 [estimate]=700 [report]=700)
  if ! command -v c++ >/dev/null; then
    say "apt-get install -y g++"
    local sudo=""
    [ "$(id -u)" = 0 ] || sudo=sudo
    $sudo apt-get update -qq >&2
    $sudo apt-get install -y -qq g++ >&2
  fi
  if ! command -v cargo-fuzz >/dev/null; then
    say "cargo install cargo-fuzz --locked"
    cargo install cargo-fuzz --locked >&2
  fi
  cargo fmt --manifest-path $folder/Cargo.toml --check >&2
  cargo clippy --manifest-path $folder/Cargo.toml --target-dir "${CARGO_TARGET_DIR:-target}/fuzz" --all-targets -- -D warnings >&2
  cargo run --manifest-path $folder/Cargo.toml --target-dir "${CARGO_TARGET_DIR:-target}/fuzz" --example seeds -- $folder/corpus >&2
  targets=$(cargo fuzz list --fuzz-dir $folder)
  [ "$(wc -l <<<"$targets")" -eq "${#floors[@]}" ] || { echo "cargo fuzz lists: $targets" >&2; exit 1; }
  log=$(mktemp)
  for target in ${*:-$targets}; do
    say "fuzz $target"
    floor="${floors[$target]:?no such target}"
    code=0
    # There is no unsafe code for a sanitizer to watch; without one it runs on the stable compiler, which
    # must be told that it may instrument.
    RUSTC_BOOTSTRAP=1 cargo fuzz run --fuzz-dir $folder --target-dir "${CARGO_TARGET_DIR:-target}/fuzz" --sanitizer none "$target" -- \
      -max_total_time="$seconds" -max_len=4096 -timeout=20 -print_final_stats=1 2>&1 </dev/null | tee "$log" >&2 || code=$?
    executions=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log" | tail -1)
    edges=$(sed -n 's/.* cov: \([0-9]*\) .*/\1/p' "$log" | tail -1)
    artifact=$(sed -n 's/.*Test unit written to //p' "$log" | head -1)
    findings=0
    [ "$code" -eq 0 ] || findings=1
    printf '{"name":"fuzz %s","executions":%s,"edges":%s,"edges_goal":%s,"value":%s,"unit":"findings","goal":0}\n' \
      "$target" "${executions:-0}" "${edges:-0}" "$floor" "$findings"
    [ "$findings" -eq 0 ] || failed+="; $target: ${artifact:-no artifact, see the log}"
    [ "${edges:-0}" -ge "$floor" ] || failed+="; $target: ${edges:-0} edges of at least $floor"
  done
  rm "$log"
  if [ -n "$failed" ]; then
    echo "fuzz: ${failed#; }" >&2
    exit 1
  fi
}

# The rooms' own tests, some of the committed decisions and the C boundary, interpreted: no undefined behaviour,
# and the same answers where words have 64 bits, 32, and where their bytes stand in the other order. Long
# tests go fewer rounds there (`rounds` in src/lib.rs). Lines a machine with the tests that passed.
job_miri() {
  local target log failed=""
  if ! cargo +nightly miri --version >/dev/null 2>&1; then
    say "rustup toolchain install nightly --profile minimal --component miri,rust-src"
    rustup toolchain install nightly --profile minimal --component miri,rust-src >&2
  fi
  log=$(mktemp)
  # What it is, at least so many tests, flags, and what cargo is to test.
  interpreted() {
    local name="$1" least="$2" flags="$3" passed
    shift 3
    say "miri $name"
    # The tests' own references are floats of this machine's accuracy.
    MIRIFLAGS="-Zmiri-disable-isolation -Zmiri-no-extra-rounding-error $flags" \
      PROPTEST_CASES=4 PROPTEST_RNG_SEED=1 PROPTEST_DISABLE_FAILURE_PERSISTENCE=1 \
      cargo +nightly miri test "$@" 2>&1 </dev/null | tee "$log" >&2 || failed+="; $name"
    passed=$(sed -n 's/^test result: ok\. \([0-9]*\) passed.*/\1/p' "$log" | awk '{sum += $1} END {print sum + 0}')
    printf '{"name":"miri %s","value":%s,"unit":"tests","goal":%s}\n' "$name" "$passed" "$least"
    [ "$passed" -ge "$least" ] || failed+="; $name: $passed tests"
  }
  for target in x86_64-unknown-linux-gnu i686-unknown-linux-gnu s390x-unknown-linux-gnu; do
    interpreted "$target" 100 "" --target "$target" --lib --test any_machine
    # Storage is leaked there, so that it stays where it is.
    interpreted "$target, the C boundary" 17 -Zmiri-ignore-leaks --target "$target" --features ffi --test c_boundary
  done
  rm "$log"
  if [ -n "$failed" ]; then
    echo "miri: ${failed#; }" >&2
    exit 1
  fi
}

# The lens models, and the windows that are proven for them, held against OpenCV's projections: the largest
# difference of 1,000 random points of each lens, and how far a point of a window falls outside the image.
job_lenses() {
  local venv="${CARGO_TARGET_DIR:-target}/lenses-venv"
  if ! "$venv/bin/python" -c 'import cv2, numpy' 2>/dev/null; then
    python3 -m venv "$venv" >&2 || { echo "no venv: apt-get install -y python3-venv" >&2; exit 1; }
    say "pip install opencv-python-headless numpy"
    "$venv/bin/pip" install -q opencv-python-headless numpy >&2
  fi
  cargo build --release --features std --example lenses >&2
  "${CARGO_TARGET_DIR:-target}/release/examples/lenses" | "$venv/bin/python" tests/support/lenses.py
}

# Chains and plans: a million runs of plans by a judge of its own; what a plan takes on sites of 10 to 1,000 tags, with
# the plot of it (where a file for it is named); instructions of a chain on both cores; a plan under emulation.
job_planning() {
  need_targets
  need_qemu
  local plot="${1:-}" target machine short=""
  cargo test --release --features cli --test planning -- --nocapture 2>&1 | tee -a /dev/stderr | grep '^{'
  # shellcheck disable=SC2086
  cargo run --release --features cli --example planning -- $plot || short+=" desk"
  cargo test --features cli --test contingent_plan >&2
  while read -r target machine; do
    cargo build --profile firmware --target "$target" --features firmware --example count_chain >&2 </dev/null
    timeout 600 qemu-system-arm -M "$machine" -display none -monitor none -serial none -icount shift=6 \
      -semihosting-config enable=on,target=native \
      -kernel "${CARGO_TARGET_DIR:-target}/$target/firmware/examples/count_chain" </dev/null || short+=" $target"
  done <<'CORES'
thumbv7em-none-eabihf mps2-an386
thumbv6m-none-eabi mps2-an385
CORES
  if [ -n "$short" ]; then
    echo "beyond a goal:$short" >&2
    exit 1
  fi
}

# Where a tag hangs best: `place` and its genetic algorithm beside RUNS long runs (20) of SciPy's differential evolution, on the
# same cost, for the two pose-sets of Fig. 4; and how many poses and places are looked at in a second.
job_placement() {
  local runs="${1:-20}" iterations="${2:-1000}" venv="${CARGO_TARGET_DIR:-target}/scipy-venv" folder sigma seed tenth posegate placement
  if ! "$venv/bin/python" -c 'import scipy' 2>/dev/null; then
    say "pip install scipy"
    python3 -m venv "$venv" >&2 || { echo "no venv: apt-get install -y python3-venv" >&2; exit 1; }
    "$venv/bin/pip" install -q scipy >&2 || { echo "missing: $venv/bin/pip install scipy" >&2; exit 1; }
  fi
  cargo build --release --features cli --bin posegate --example placement >&2
  posegate="${CARGO_TARGET_DIR:-target}/release/posegate"
  placement="${CARGO_TARGET_DIR:-target}/release/examples/placement"
  "$placement" rate
  folder=$(mktemp -d)
  for sigma in 0.1 0.3; do
    "$venv/bin/python" tests/support/differential_evolution.py "$placement" tests/data/reference-a.toml see-t7 $sigma $sigma 1 \
      "$runs" "$iterations" >"$folder/scipy-$sigma.json"
    # A tenth of what SciPy's middle run took; and as many as are usual.
    tenth=$("$venv/bin/python" -c 'import json, statistics, sys
print(int(statistics.median(json.load(open(sys.argv[1]))["evaluations"])) // 10)' "$folder/scipy-$sigma.json")
    place() {
      "$posegate" place tests/data/reference-a.toml --task see-t7 --sigma-x $sigma --sigma-y $sigma --sigma-yaw-deg 1 \
        --free x=0.3:7,y=-3:3,z=0:2,yaw_deg=0:360 --json "$@"
    }
    for seed in $(seq 20); do
      place --budget "$tenth" --seed $seed >"$folder/tenth-$seed-$sigma.json"
    done
    place >"$folder/cmaes-$sigma.json"
    place --method ga >"$folder/ga-$sigma.json"
  done
  "$venv/bin/python" tests/support/placements.py "$folder" || { rm -r "$folder"; exit 1; }
  rm -r "$folder"
}

# The fewest tags for a warehouse of 100 docks and 2,000 candidates, to a proven gap; its plans are made anew on the
# written site, and executed by the judge of the planning job. Small sites are held against all subsets by `test`.
job_cover() {
  cargo run --release --features cli --example cover
}

# The package as a stranger gets it: nothing in it that a user does not need, every file that its pages link; unpacked somewhere
# else, its program installed and run, its smallest gate in C built and run, and a firmware of one's own linked against it, at the
# addresses of its own memory.x and with nothing of this package's.
job_package() {
  need_targets
  need_qemu
  need_command arm-none-eabi-readelf binutils-arm-none-eabi
  need_command arm-none-eabi-gcc gcc-arm-none-eabi
  need_command make make
  export CARGO_TARGET_DIR="${CARGO_TARGET_DIR:-$PWD/target}"
  local folder packed firmware start size page link foreign
  folder=$(mktemp -d)
  cargo package --no-verify --allow-dirty >&2
  packed=$(find "$CARGO_TARGET_DIR/package" -maxdepth 1 -name 'posegate-*.crate' | sort | tail -1)
  size=$(stat -c %s "$packed")
  printf '{"name": "package", "value": %s, "unit": "B", "goal": 1300000}\n' "$size"
  [ "$size" -le 1300000 ]
  # What the manifest includes, and what cargo adds.
  foreign=$(tar -tzf "$packed" | cut -d/ -f2- | grep -vE '^(\.cargo/config\.toml|\.cargo_vcs_info\.json|(ARCHITECTURE|CHANGELOG|CONTRIBUTING|README)\.md|Cargo\.(lock|toml|toml\.orig)|LICENSE-(APACHE|MIT)|build\.rs|cbindgen\.toml|memory\.x|(benches|docs|examples|include|memory|src)/.*)$' || true)
  if [ -n "$foreign" ]; then
    printf 'in the package, and of no use to a user:\n%s\n' "$foreign" >&2
    exit 1
  fi
  tar -xzf "$packed" -C "$folder"
  mv "$folder"/posegate-* "$folder/posegate"
  for name in README.md CHANGELOG.md LICENSE-MIT LICENSE-APACHE include/posegate.h src/page/core.wasm; do
    [ -f "$folder/posegate/$name" ] || { echo "the package has no $name" >&2; exit 1; }
  done
  for page in README.md CONTRIBUTING.md $(cd docs && printf 'docs/%s ' *.md); do
    for link in $(grep -oE '\]\([^)#]+' "$folder/posegate/$page" | cut -c3- | grep -v '://'); do
      [ -e "$folder/posegate/$(dirname "$page")/$link" ] || { echo "the package has no $link, which its $page links" >&2; exit 1; }
    done
  done
  make -C "$folder/posegate/examples/c" OUT="$folder/c" CARGO_TARGET_DIR="$folder/target" run >&2
  cargo install --locked --path "$folder/posegate" --features cli --root "$folder/root" >&2
  (cd "$folder" && root/bin/posegate init site.toml >&2 && root/bin/posegate check site.toml >&2)
  mkdir -p "$folder/firmware/src"
  cat >"$folder/firmware/Cargo.toml" <<'TOML'
[package]
name = "own-firmware"
version = "0.0.0"
edition = "2024"

[dependencies]
posegate = { path = "../posegate" }
cortex-m = { version = "0.7.7", features = ["critical-section-single-core"] }
cortex-m-rt = "0.7.5"

[profile.release]
panic = "abort"
TOML
  cat >"$folder/firmware/src/main.rs" <<'RUST'
#![no_std]
#![no_main]
use posegate::gate::self_test;
use posegate::table::Table;

static TABLE: &[u8] = include_bytes!("../../posegate/examples/tables/dock.posegate");

#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    loop {}
}

#[cortex_m_rt::entry]
fn main() -> ! {
    let whole = core::hint::black_box(Table::parse(core::hint::black_box(TABLE)).is_ok());
    let healthy = core::hint::black_box(self_test().is_ok());
    loop {
        core::hint::black_box((whole, healthy));
    }
}
RUST
  printf 'MEMORY { FLASH : ORIGIN = 0x08040000, LENGTH = 256K RAM : ORIGIN = 0x20010000, LENGTH = 32K }\n' >"$folder/firmware/memory.x"
  (
    cd "$folder/firmware"
    RUSTFLAGS="-C link-arg=-L$folder/firmware -C link-arg=-Tlink.x -C link-arg=--nmagic" \
      cargo build --release --target thumbv7em-none-eabihf >&2
  )
  firmware="$CARGO_TARGET_DIR/thumbv7em-none-eabihf/release/own-firmware"
  start=$(arm-none-eabi-readelf -S -W "$firmware" | awk '$2 == ".vector_table" || $3 == ".vector_table" { for (k = 1; k <= NF; k++) if ($k == "PROGBITS") print $(k + 1) }')
  printf '{"name": "vector table of a firmware with a memory.x of its own", "value": "%s", "unit": "address", "goal": "08040000"}\n' "$start"
  [ "$start" = 08040000 ]
  rm -r "$folder"
}

# A site as an array of four shards on a Slurm of four nodes of this machine: the same bytes as from one process; then again
# with one node killed in the middle, its task queued again, and a merge that waits for all: the same bytes, and no finished
# piece made twice. Endpoints of the made-up plant: 120, or what is named; with few of them starting the processes is most of it.
job_slurm() {
  local endpoints="${1:-120}" name missing=""
  for name in slurmctld slurmd sbatch munged; do
    command -v $name >/dev/null || missing+=" $name"
  done
  if [ -n "$missing" ]; then
    echo "missing:$missing: apt-get install -y slurm-wlm munge" >&2
    exit 1
  fi
  cargo build --release --features cli --bin posegate --example plant >&2
  local bin folder
  bin="$(realpath "${CARGO_TARGET_DIR:-target}")/release"
  folder=$(mktemp -d)
  # shellcheck source=tests/support/slurm.sh
  . tests/support/slurm.sh
  # shellcheck disable=SC2064
  trap "slurm_down; rm -rf '$folder'" EXIT
  "$bin/examples/plant" "$endpoints" >"$folder/site.toml"

  # What runs in place of the program: it tells when and where, and with what ids.
  cat >"$folder/posegate" <<WRAPPER
#!/bin/sh
echo "\${SLURMD_NODENAME:-none} \${POSEGATE_SHARD_INDEX:-0} \$\$ \$PPID \$(date +%s.%N)" >>"\$STARTED"
"$bin/posegate" "\$@" --json &
echo "\${SLURMD_NODENAME:-none} \$!" >>"\$STARTED.ids"
wait \$! || exit \$?
date +%s.%N >>"\$STARTED.ends"
times >>"\$STARTED.times"
WRAPPER
  chmod +x "$folder/posegate"
  export POSEGATE="$folder/posegate" POSEGATE_OPTIONS=""
  say "slurm: four nodes"
  slurm_up "$folder"

  # Runs as the nodes do, so that the same is counted.
  local array alone four lost share short=""
  STARTED="$folder/started-alone" "$folder/posegate" site build "$folder/site.toml" --threads 2 -o "$folder/alone" >&2
  "$bin/posegate" site merge "$folder/alone" >&2
  # Whether a merged folder is the one of a single machine.
  same() { diff -r --exclude=parts "$folder/alone" "$1" >&2; }

  export STARTED="$folder/started-array"
  array=$(sbatch --parsable -o "$folder/array-%a.log" --array=0-3 examples/slurm/build.sbatch "$folder/site.toml" "$folder/array")
  slurm_wait "the array" slurm_ended "$array"
  "$bin/posegate" site merge "$folder/array" >&2
  same "$folder/array"
  printf '{"name": "slurm: files that differ from a build on one machine", "value": 0, "unit": "files", "goal": 0}\n'
  # Seconds by the clock, from the first start to the last end, and of the processor.
  clock() { awk 'FILENAME ~ /ends$/ {if ($1 > last) last = $1; next} !first || $5 < first {first = $5} END {print last - first}' "$1.ends" "$1"; }
  processor() { awk 'NR % 2 == 0 {for (k = 1; k <= 2; k++) {split($k, t, /[ms]/); sum += 60 * t[1] + t[2]}} END {print sum}' "$1.times"; }
  for name in clock processor; do
    alone=$($name "$folder/started-alone")
    four=$($name "$STARTED")
    printf '{"name": "slurm: one process with two threads, %s", "value": %.2f, "unit": "s", "goal": null}\n' $name "$alone"
    printf '{"name": "slurm: four nodes, %s", "value": %.2f, "unit": "s", "goal": null}\n' $name "$four"
    share=$(awk -v alone="$alone" -v four="$four" 'BEGIN {printf "%.1f", 100 * (four / alone - 1)}')
    printf '{"name": "slurm: lost by four nodes, %s", "value": %s, "unit": "%%", "goal": %s}\n' $name "$share" "$([ $name = processor ] && echo 10 || echo null)"
    # Where others use the machine the clock says little: the processor's time decides.
    if [ $name = processor ] && ! awk -v alone="$alone" -v four="$four" 'BEGIN {exit !(alone > 0 && four > 0 && four < 1.1 * alone)}'; then
      echo "slurm: four nodes lose $share % of the processor's time: 10 or more" >&2
      short=yes
    fi
  done

  say "slurm: a node is killed in the middle"
  export STARTED="$folder/started-killed"
  local victim index merge before ids id own kept
  read -r array merge < <(SBATCH_OUTPUT="$folder/killed-%A-%a.log" examples/slurm/submit.sh "$folder/site.toml" "$folder/killed" 4)
  finished() { find "$folder/killed/parts" -type f 2>/dev/null | grep -cE '/[0-9a-f]{64}$' || true; }
  some_finished() { [ "$(finished)" -ge $((endpoints / 2)) ] && [ "$(wc -l <"$STARTED.ids")" -eq 4 ]; }
  slurm_wait "some finished pieces" some_finished
  read -r victim index ids < <(awk '{print $1, $2, $3 " " $4}' "$STARTED")
  # The node, the daemon of its task, its script and the program: as when its power fails.
  ids="$(cat "$folder/node-$victim") ${ids#* } ${ids% *} $(awk -v node="$victim" '$1 == node {print $2}' "$STARTED.ids")"
  for id in $ids; do
    kill -9 "$id" 2>/dev/null || true
  done
  find "$folder/killed/parts" -type f -printf '%f\n' >"$folder/before"
  before=$(grep -cE '^[0-9a-f]{64}$' "$folder/before")
  if [ -e "$folder/killed/parts/shard-$index-of-4.json" ]; then
    echo "slurm: shard $index had ended before its node was killed" >&2
    exit 1
  fi
  # A node's name stays with its address: what it holds is gone, and it is told to be down at once.
  scontrol update NodeName="$victim" State=DOWN Reason=killed
  queued_again() { scontrol show job "${array}_$index" 2>/dev/null | grep -q 'Restarts=[1-9]'; }
  slurm_wait "the task to be queued again" queued_again
  # Slurm holds what is queued again for two minutes.
  scontrol update JobId="${array}_$index" StartTime=now
  slurm_wait "the array" slurm_ended "$array"
  slurm_wait "the merge" slurm_ended "$merge"
  cat "$folder/killed-$merge"-*.log >&2
  same "$folder/killed"
  printf '{"name": "slurm: finished pieces when a node was killed", "value": %s, "unit": "pieces", "goal": null}\n' "$before"
  printf '{"name": "slurm: files that differ after a node was killed", "value": 0, "unit": "files", "goal": 0}\n'
  # All that the killed shard had finished was kept by its second run.
  own=$(grep -oE '"key": "[0-9a-f]{64}"' "$folder/killed/parts/shard-$index-of-4.json" | grep -cFf <(grep -E '^[0-9a-f]{64}$' "$folder/before") || true)
  kept=$(sed -n 's/.*"kept":\([0-9]*\),.*/\1/p' "$folder/killed-$array-$index.log" | tail -1)
  printf '{"name": "slurm: of them of the killed shard", "value": %s, "unit": "pieces", "goal": null}\n' "$own"
  lost=$((own - kept))
  printf '{"name": "slurm: finished pieces lost", "value": %s, "unit": "pieces", "goal": 0}\n' "$lost"
  if [ "$own" -eq 0 ]; then
    echo "slurm: the killed shard had finished nothing, and so had nothing to lose: give it more endpoints" >&2
    short=yes
  fi
  [ "$lost" -eq 0 ] && [ -z "$short" ]
}

# What the tables and proofs of a site take as it grows from 10 to 100,000 endpoints, and on how many nodes, with the plots
# where files for them are named; the model of what is not measured is in examples/scale.rs.
job_scale() {
  cargo build --release --features cli --bin posegate --example scale >&2
  local bin
  bin="$(realpath "${CARGO_TARGET_DIR:-target}")/release"
  "$bin/examples/scale" "$bin/posegate" "$@"
}

# Every picture into a folder: the paper's, those of the loading bay, of which two are in docs/, and a plan's.
job_figures() {
  local folder="${1:?usage: ./ci.sh figures DIR}" site=examples/sites/loading-bay.toml posegate task name
  cargo build --release --features cli --bin posegate >&2
  posegate="${CARGO_TARGET_DIR:-target}/release/posegate"
  "$posegate" demo -o "$folder" >&2
  for task in see-bay enter-bay; do
    "$posegate" table build $site --task $task -o "$folder/$task.posegate" >&2
    "$posegate" draw $site --task $task --table "$folder/$task.posegate" --expected -o "$folder/$task-sections.svg"
    "$posegate" draw $site --task $task --kind plan --expected -o "$folder/$task-plan.svg"
  done
  "$posegate" draw $site --task see-bay --kind image --expected -o "$folder/see-bay-image.svg"
  "$posegate" doctor $site -o "$folder/doctor" >&2
  "$posegate" plan examples/sites/paper-chain.toml --from back-to-dock --to dock -o "$folder/plan.svg" >&2
  # Measurements: they are drawn anew by `./ci.sh planning docs/planning-growth.svg` and `./ci.sh scale docs/scale-endpoints.svg
  # docs/scale-nodes.svg`, and kept.
  cp docs/planning-growth.svg docs/scale-*.svg "$folder/"
  # Drawn by hand.
  cp docs/first-picture.svg "$folder/"
  for name in docs/*.svg; do
    if ! cmp "$name" "$folder/$(basename "$name")" >&2; then
      echo "$name is not what the program draws: cp $folder/$(basename "$name") $name" >&2
      exit 1
    fi
  done
  printf '{"name": "pictures drawn", "value": %s, "unit": "pictures", "goal": 15}\n' "$(find "$folder" -name '*.svg' | wc -l)"
}

job_all() {
  local job started
  for job in fmt clippy wasm no_panic test docs "faults 21" vectors c budgets "adversarial 1000000 1 grid" "adversarial 1000000 1 facets"; do
    started=$SECONDS
    say "$job"
    # A job and its arguments.
    # shellcheck disable=SC2086
    job_$job
    say "$job took $((SECONDS - started)) s"
  done
}

job="${1:-all}"
[ $# -gt 0 ] && shift
if ! declare -F "job_$job" >/dev/null; then
  echo "no job $job; jobs: $(declare -F | sed -n 's/declare -f job_//p' | tr '\n' ' ')" >&2
  exit 2
fi
"job_$job" "$@"
