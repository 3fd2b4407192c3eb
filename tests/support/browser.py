"""Tests the page of `posegate report` in a real browser, driven by Playwright: its core repeats the decisions of the vector
file; an estimate is dragged, turned by keys, and decided as by the command line; nothing is fetched; without WebAssembly the
pictures remain. Prints JSON lines; fails if one misses its goal.

Arguments: the page, its site file, the program, and a folder for screenshots.
"""

import base64
import csv
import json
import math
import pathlib
import random
import subprocess
import sys

from playwright.sync_api import sync_playwright

PAGE, SITE, POSEGATE, FOLDER = sys.argv[1:5]
TABLES = [
    "examples/tables/dock.posegate",
    "examples/tables/see-t7.posegate",
    "examples/tables/see-t7-grid.posegate",
    "tests/data/whole-circle.posegate",
    "tests/data/turning.posegate",
    "tests/data/over-180.posegate",
    "tests/data/over-180-grid.posegate",
    "tests/data/corner.posegate",
]
good = True


def line(name, value, unit, goal, holds):
    global good
    good = good and holds
    print(json.dumps({"name": f"browser: {name}", "value": value, "unit": unit, "goal": goal}), flush=True)
    if not holds:
        print(f"browser: {name}: this falls short", file=sys.stderr)


def packed(path):
    return base64.b64encode(pathlib.Path(path).read_bytes()).decode()


def opened(browser, seen, script=None, **options):
    """Opens the page in a separate context, and records its requests and errors."""
    context = browser.new_context(viewport={"width": 1280, "height": 900}, offline=True, **options)
    page = context.new_page()
    page.on("request", lambda request: seen.append(request.url))
    page.on("pageerror", lambda error: seen.append(f"error: {error}"))
    page.on("console", lambda message: message.type == "error" and seen.append(f"console: {message.text}"))
    if script:
        page.add_init_script(script)
    page.goto(pathlib.Path(PAGE).resolve().as_uri())
    page.wait_for_selector("body[data-ready=yes]")
    return page


def verdict(page):
    return page.inner_text("#verdict")


def q16(page):
    text = page.inner_text("#margin")
    return int(text.split("(")[1].split(" ")[0]) if "(" in text else None


def drag(page, to):
    box = page.locator("#robot circle").first.bounding_box()
    panel = page.locator("#panel").bounding_box()
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(panel["x"] + to[0] * panel["width"], panel["y"] + to[1] * panel["height"], steps=8)
    page.mouse.up()


def dragged(page, task):
    choose(page, task)
    before, x = verdict(page), page.input_value("#x")
    drag(page, (0.985, 0.02))
    away, far = verdict(page), page.input_value("#x")
    worst = page.get_attribute("#worst", "visibility")
    choose(page, task)
    line("verdicts at the goal, dragged away and back", [before, away, verdict(page)], "", ["PERMIT", "DENY", "PERMIT"],
         [before, away, verdict(page)] == ["PERMIT", "DENY", "PERMIT"] and x != far and worst == "visible")


def by_keys(page, task):
    choose(page, task)
    page.focus("#task")
    # Only the tab key leads to the estimate: backwards, because it is before the list.
    for _ in range(12):
        page.keyboard.press("Shift+Tab")
        if page.evaluate("document.activeElement.id") == "robot":
            break
    reached = page.evaluate("document.activeElement.id") == "robot"
    before = [float(page.input_value(f"#{key}")) for key in ("x", "y", "yaw")]
    for key in ("ArrowRight", "ArrowUp", "ArrowUp", "["):
        page.keyboard.press(key)
    after = [float(page.input_value(f"#{key}")) for key in ("x", "y", "yaw")]
    moved = after[0] > before[0] and after[1] > before[1] and after[2] == before[2] + 1
    for _ in range(60):
        page.keyboard.press("Shift+ArrowRight")
    denied = verdict(page)
    line("by keys alone", denied, "verdict", "DENY", reached and moved and denied == "DENY")
    page.wait_for_timeout(900)
    announced = page.inner_text("#told")
    line("the verdict is announced to screen readers", announced, "", "DENY, not_contained ...",
         page.get_attribute("#told", "aria-live") == "polite" and announced.startswith("DENY, not_contained"))


def asked(page, rows):
    """Returns the last request to the core and its answer, as numbers for the command line."""
    state = page.evaluate("[state.asked, state.verdict, state.verdict && core.reason(state.verdict.reason).name]")
    pose, verdict, reason = state[0]["pose"], state[1], state[2]
    c = state[0].get("covariance", [0.0] * 9)
    rows.append({
        "t_s": len(rows), "x_m": pose[0], "y_m": pose[1], "yaw_rad": pose[2], "cov_xx": c[0], "cov_xy": c[1],
        "cov_xyaw": c[2], "cov_yy": c[4], "cov_yyaw": c[5], "cov_yawyaw": c[8],
    })
    return verdict, reason


def same(verdict, reason, answer):
    """Returns True if the command line agrees: verdict, reason, margin and worst pose to the last bit of the integers."""
    there = answer["margin"]
    margin = None if there is None else round(there * 65536)
    worst, other = verdict["worst"], answer["worst_pose"]
    if (worst is None) != (other is None):
        return False
    near = worst is None or (
        all(round(a * 1e6) == round(b * 1e6) for a, b in zip(worst[:2], other[:2]))
        and abs(math.remainder(worst[2] - other[2], math.tau)) < 2e-9
    )
    expected = None if verdict["permit"] else reason
    return (answer["verdict"] == "permit") == verdict["permit"] and expected == answer["reason"] and margin == verdict["marginQ16"] and near


def equal_to_the_command_line(page, task, wide):
    """Random estimates give the same integers through the page's fields and through `posegate gate`."""
    table = pathlib.Path(FOLDER) / "table.posegate"
    subprocess.run([POSEGATE, "table", "build", SITE, "--task", task, "-o", table], check=True, capture_output=True)
    chance = random.Random(1)
    for kind in ("gaussian", "bounded"):
        choose(page, task)
        page.select_option("#kind", kind)
        rows, decisions = [], []
        for _ in range(60):
            own = {
                "x": chance.gauss(0, 0.4 * wide), "y": chance.gauss(0, 0.3 * wide), "yaw": chance.gauss(0, 1.5),
                "sx": chance.uniform(0.01, 0.2) * wide, "sy": chance.uniform(0.01, 0.2) * wide, "syaw": chance.uniform(0.05, 0.8),
                "rxy": chance.uniform(-0.5, 0.5), "rxa": chance.uniform(-0.5, 0.5), "rya": chance.uniform(-0.5, 0.5),
                "inflation": chance.choice([1, 1, 2.5]),
            }
            if kind == "bounded":
                own = {"x": own["x"], "y": own["y"], "yaw": own["yaw"], "sx": 0.2 * wide, "syaw": 0.5}
            for key, value in own.items():
                page.fill(f"#{key}", str(round(value, 4)))
            decisions.append(asked(page, rows))
        path = pathlib.Path(FOLDER) / "estimates.csv"
        with open(path, "w", newline="") as out:
            writer = csv.DictWriter(out, rows[0])
            writer.writeheader()
            writer.writerows({key: repr(value) for key, value in row.items()} for row in rows)
        bounds = ["--set", "bounded", "--translation", repr(round(0.2 * wide, 4)), "--yaw-deg", "0.5"]
        line_of = [POSEGATE, "gate", table, "--estimates", path, "--json", *(bounds if kind == "bounded" else [])]
        done = subprocess.run(line_of, capture_output=True, text=True)
        answers = [json.loads(text) for text in done.stdout.splitlines()]
        answers = [answer for answer in answers if "verdict" in answer]
        held = sum(same(*own, answer) for own, answer in zip(decisions, answers, strict=True))
        permits = sum(verdict["permit"] for verdict, _ in decisions)
        line(f"{task}, {kind}: judged as the command line judges them, bit for bit", [held, permits], "of 60, permits", [60, "5 to 55"], held == 60 and 5 <= permits <= 55)


def inflated_outwards(page, task):
    """The page's inflated set is at least the gate's, whose factor is rounded up to 2^-16 and whose lengths to micrometres."""
    choose(page, task)
    page.select_option("#kind", "bounded")
    short = []
    for bound in ("0.25", "0.5", "1.2345678", "3"):
        for factor in ("1", "1.00001", "2", "6", "4096"):
            page.fill("#sx", bound)
            page.fill("#inflation", factor)
            asked = page.evaluate("state.asked.translation")
            raw = math.ceil(float(factor) * 65536)
            root = math.isqrt(raw * 65536 - 1) + 1
            gate = math.ceil(float(bound) * 1e6 - 1e-6) * root / 65536 if raw > 65536 else float(bound) * 1e6
            if not gate <= asked * 1e6 + 1e-6 <= gate + root / 65536 + 2:
                short.append([bound, factor, asked, gate])
    page.select_option("#kind", "gaussian")
    page.fill("#inflation", "1.00001")
    ratio = page.evaluate("""() => {
      const grown = state.asked.covariance[8];
      find("inflation").value = 1;
      draw();
      return grown / state.asked.covariance[8];
    }""")
    line("inflated sets are no smaller than a gate's", short, "", [], not short and math.ceil(1.00001 * 65536) / 65536 <= ratio <= 1.0001)


def choose(page, task):
    number = page.evaluate("(name) => data.tasks.findIndex((task) => task.name === name)", task)
    page.select_option("#task", value=str(number))


def names_with_spaces(page):
    """Two names that look the same in a browser are two tasks."""
    choose(page, "dock  a")
    page.fill("#x", "0.2")
    narrow = verdict(page)
    choose(page, "dock a")
    page.fill("#x", "0.2")
    wide = verdict(page)
    choose(page, " lead")
    lead = page.evaluate("state.task.name")
    line("tasks whose names differ by a space", [narrow, wide, lead], "", ["DENY", "PERMIT", " lead"],
         [narrow, wide, lead] == ["DENY", "PERMIT", " lead"])


def invalid_numbers(page, task):
    """There is no verdict if a field is empty or out of its range, or after a fault."""
    choose(page, task)
    before = verdict(page)
    answers = []
    for key, value in {"x": "", "yaw": "", "sy": "-0.001", "syaw": "0", "rxy": "1", "inflation": "0.5"}.items():
        good = page.input_value(f"#{key}")
        page.fill(f"#{key}", value)
        answers.append((verdict(page), page.get_attribute(f"#{key}", "aria-invalid"), "must be" in page.inner_text("#reason")))
        page.fill(f"#{key}", good)
    line("fields with an invalid number", len(set(answers)), "kinds of answers", 1,
         set(answers) == {("–", "true", True)} and before == verdict(page) == "PERMIT")
    page.evaluate("void (core.examine = () => { throw new Error('made up') })")
    page.fill("#x", "0.01")
    broken = [verdict(page), page.get_attribute("#panel", "data-verdict"), page.inner_text("#reason")]
    page.evaluate("void delete core.examine")
    choose(page, task)
    line("after a fault", broken, "", ["–", "none", "no verdict: made up"],
         broken == ["–", "none", "no verdict: made up"] and verdict(page) == "PERMIT")


def shown_numbers_are_judged(page, task):
    """At the last permitted place, the numbers of the fields, typed again, get the same verdict."""
    choose(page, task)
    other = 0
    page.evaluate("void [state.x = 0.01234567, state.y = -0.00987654, state.yaw = 1.23456, moved()]")
    for _ in range(40):
        page.focus("#robot")
        page.keyboard.press("ArrowRight")
        shown = [page.input_value(f"#{key}") for key in ("x", "y", "yaw")]
        before = page.evaluate("[state.asked, state.verdict]")
        for key, value in zip(("x", "y", "yaw"), shown):
            page.fill(f"#{key}", value)
        other += page.evaluate("[state.asked, state.verdict]") != before
    line("verdicts that change when what is shown is typed", other, "of 40", 0, other == 0)


def back_and_forth(page, task):
    """After another page and back, fields and verdict are of one task."""
    choose(page, task)
    page.fill("#sx", "0.5")
    page.goto("about:blank")
    page.go_back()
    page.wait_for_selector("body[data-ready=yes]")
    page.wait_for_timeout(300)
    held = page.evaluate("""() => {
      const before = [find("verdict").textContent, JSON.stringify(state.asked)];
      draw();
      const same = before[0] === find("verdict").textContent && before[1] === JSON.stringify(state.asked);
      return same && Number(find("task").value) === state.number && data.tasks[state.number] === state.task;
    }""")
    line("gone back: fields and verdict are of one task", held, "", True, held)


def headings_wrap(page):
    """S over an arc beyond 180 degrees: the section at -100 is that at 260; beyond the arc there is no section."""
    choose(page, "round")
    sections = []
    for yaw in ("-100", "260", "-30"):
        page.fill("#yaw", yaw)
        sections.append([page.inner_text("#at").split(" the ")[0][:24], len(page.get_attribute("#set", "d")) > 0])
    line("sections wrap", sections, "", None, sections[0] == sections[1] and sections[0][1] and not sections[2][1])


def timed(page, task):
    choose(page, task)
    steps = page.evaluate("""() => {
      const took = [];
      for (let k = 0; k < 300; k += 1) {
        state.x = 0.05 * Math.sin(k / 20); state.y = 0.05 * Math.cos(k / 17); state.yaw = 3 * Math.sin(k / 11);
        const started = performance.now(); moved(); took.push(performance.now() - started);
      }
      took.sort((a, b) => a - b);
      return [took[150], took[297]];
    }""")
    line("a drag step, median", round(steps[0], 3), "ms", 16, steps[0] < 16)
    line("a drag step, 99 % are below", round(steps[1], 3), "ms", 16, steps[1] < 16)


# Returns the texts that a reader sees with a font below 11 px.
SMALL = """() => [...document.querySelectorAll("body *")].filter((element) => {
  if (element.closest("script, style, details:not([open])")) return false;
  if (![...element.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim())) return false;
  const svg = element.closest("svg");
  const drawn = svg && svg.viewBox.baseVal.width > 0;
  const shown = drawn ? svg.getBoundingClientRect().width / svg.viewBox.baseVal.width : 1;
  return parseFloat(getComputedStyle(element).fontSize) * shown < 10.99;
}).map((element) => element.textContent.slice(0, 30))"""

# Returns the pairs of texts of the pictures in a file whose boxes overlap by more than a pixel.
OVERLAPS = """() => [...document.querySelectorAll("svg")].flatMap((svg) => {
  const all = [...svg.querySelectorAll("text")].map((text) => [text.textContent, text.getBoundingClientRect()]);
  return all.flatMap(([text, a], index) => all.slice(index + 1)
    .filter(([, b]) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1
      && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1)
    .map(([other]) => [text, other]));
})"""


def pages_of(page):
    """Returns the number of A4 pages that a file prints on."""
    return page.pdf(prefer_css_page_size=True).count(b"/Type /Page\n")


def hall(browser):
    """The page and the mounting sheet of a hall of six docks: on a telephone, and in print."""
    folder = pathlib.Path(FOLDER).resolve()
    context = browser.new_context(viewport={"width": 390, "height": 844}, is_mobile=True, offline=True)
    page = context.new_page()
    page.goto((folder / "hall.html").as_uri())
    page.wait_for_selector("body[data-ready=yes]")
    summary = page.inner_text("#summary")
    line("the summary comes first", summary, "", "6 of 6 docks served by ... proven",
         summary.startswith("6 of 6 docks served by ") and summary.endswith(", proven"))
    small = page.evaluate(SMALL)
    line("texts below 11 px on a telephone", small[:5], "", [], small == [])
    shrunk = page.evaluate("""async () => {
      const all = [...document.images].filter((image) => !image.closest("details"));
      all.forEach((image) => (image.loading = "eager"));
      await Promise.all(all.map((image) => image.decode().catch(() => null)));
      return all.filter((image) => image.naturalWidth > 0 && image.clientWidth < 0.99 * image.naturalWidth).length;
    }""")
    line("pictures that are shrunk on a telephone", shrunk, "", 0, shrunk == 0)
    wide = page.evaluate("document.documentElement.scrollWidth")
    line("width of the page on a telephone", wide, "px", 390, wide <= 390)
    ticks = page.evaluate("document.querySelectorAll('#axes text').length")
    line("labels of the panel's axes", ticks, "", "at least 6", ticks >= 6)
    margin = page.evaluate("state.verdict.marginQ16 / 65536")
    line("margin of the first pose-set", round(margin, 3), "", "1.3 to 2", 1.3 <= margin <= 2)
    count = pages_of(page)
    line("pages of A4 for six docks", count, "pages", 4, 1 <= count <= 4)
    sheet = context.new_page()
    sheet.goto((folder / "sheet.html").as_uri())
    overlaps = sheet.evaluate(OVERLAPS)
    line("texts of the mounting sheet that overlap", overlaps[:3], "", [], overlaps == [])
    drawn, printed = sheet.locator("body > svg").count(), pages_of(sheet)
    line("pages of the mounting sheet", [drawn, printed], "drawn, printed", "equal", drawn == printed >= 2)


def main():
    site = json.loads(pathlib.Path(FOLDER, "tasks.json").read_text())
    task = site["task"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        seen = []
        page = opened(browser, seen)
        held = page.evaluate(
            "async ([file, tables]) => (await Core.of(unpacked(data.core))).replay(unpacked(file), tables.map(unpacked))",
            [packed("tests/data/vectors.bin"), [packed(path) for path in TABLES]],
        )
        line("decisions of the vector file", held["count"], "decisions", 10000, held["count"] >= 10000)
        line("decisions other than the file says", held["mismatches"], "decisions", 0, held["mismatches"] == 0)
        broken = bytearray(pathlib.Path(TABLES[0]).read_bytes())
        broken[len(broken) // 2] ^= 1
        wrong = page.evaluate(
            "async ([file, tables]) => (await Core.of(unpacked(data.core))).replay(unpacked(file), tables.map(unpacked))",
            [packed("tests/data/vectors.bin"),
             [base64.b64encode(broken).decode()] + [packed(path) for path in TABLES[1:]]],
        )
        line("with a bit of a table fallen, others", wrong["mismatches"], "decisions", "above 0", wrong["mismatches"] > 0)
        dragged(page, task)
        by_keys(page, task)
        for one, wide in site["compared"]:
            equal_to_the_command_line(page, one, wide)
        names_with_spaces(page)
        invalid_numbers(page, task)
        shown_numbers_are_judged(page, task)
        inflated_outwards(page, task)
        headings_wrap(page)
        back_and_forth(page, task)
        timed(page, task)
        hall(browser)
        # The picture of the README.
        page.set_viewport_size({"width": 1200, "height": 860})
        choose(page, "see-t7")
        for key, value in {"x": 1.2, "y": 0.55, "yaw": -4, "sx": 0.35, "sy": 0.12, "syaw": 0.8, "rxy": 0.5}.items():
            page.fill(f"#{key}", str(value))
        page.focus("#robot")
        page.evaluate("scrollTo(0, 0)")
        page.screenshot(path=f"{FOLDER}/report.png")
        page.screenshot(path=f"{FOLDER}/whole.png", full_page=True)
        pictures = page.evaluate("""async () => {
          const all = [...document.images];
          all.forEach((image) => (image.loading = 'eager'));
          await Promise.all(all.map((image) => image.decode().catch(() => null)));
          return [all.length, all.filter((image) => image.naturalWidth > 0).length];
        }""")
        line("pictures that are seen", pictures[1], f"of {pictures[0]}", pictures[0], pictures[0] == pictures[1] > 3)
        dark = opened(browser, seen, color_scheme="dark")
        ground = [page.evaluate("getComputedStyle(document.body).backgroundColor") for page in (page, dark)]
        line("grounds of light and dark", ground, "", None, ground[0] != ground[1])
        dark.screenshot(path=f"{FOLDER}/dark.png")
        bare = opened(browser, seen, script="delete globalThis.WebAssembly")
        without = bare.inner_text("#without") if bare.is_visible("#without") else ""
        kept = bare.evaluate("document.getElementById('set').getAttribute('d').length")
        line("without WebAssembly it says so", without[:40], "", "Without WebAssembly ...",
             without.startswith("Without WebAssembly") and kept > 20 and verdict(bare) == "–")
        context = browser.new_context(java_script_enabled=False, offline=True)
        still = context.new_page()
        still.goto(pathlib.Path(PAGE).resolve().as_uri())
        kept = [still.is_visible("#without"), still.locator("figure img").count()]
        line("without JavaScript it says so, with pictures", kept, "", None, kept[0] and kept[1] == pictures[0])
        own = pathlib.Path(PAGE).resolve().as_uri()
        others = [url for url in seen if url != own and not url.startswith("data:")]
        line("things fetched, and errors", others[:5], "", [], others == [])
        browser.close()
    sys.exit(0 if good else 1)


main()
