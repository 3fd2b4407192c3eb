"""Links the archive for the core of the board. In platformio.ini, `custom_posegate_parts` is boxes, turning or all (the default),
and `custom_posegate_level` is 3 (the default) or s."""

import os

Import("env")  # noqa: F821: PlatformIO provides it

TARGETS = {
    "cortex-m0": "thumbv6m-none-eabi",
    "cortex-m0plus": "thumbv6m-none-eabi",
    "cortex-m3": "thumbv7m-none-eabi",
    "cortex-m4": "thumbv7em-none-eabi",
    "cortex-m7": "thumbv7em-none-eabi",
    "cortex-m4 hard": "thumbv7em-none-eabihf",
    "cortex-m7 hard": "thumbv7em-none-eabihf",
    "cortex-m33 hard": "thumbv8m.main-none-eabihf",
}
core = env.BoardConfig().get("build.cpu", "")
if "-mfloat-abi=hard" in env.Flatten(env.get("CCFLAGS", [])):
    core += " hard"
if core not in TARGETS:
    raise SystemExit(f"posegate: no archive for the core `{core}`; there are: {', '.join(TARGETS)}")
parts = env.GetProjectOption("custom_posegate_parts", "all")
level = env.GetProjectOption("custom_posegate_level", "3")
folder = os.path.join(os.getcwd(), "lib", TARGETS[core], f"{parts}-{level}")
if not os.path.isdir(folder):
    raise SystemExit(f"posegate: no archive `{parts}-{level}`: custom_posegate_parts is boxes, turning or all, custom_posegate_level 3 or s")
env.Append(LIBPATH=[folder], LIBS=["posegate_c"])
