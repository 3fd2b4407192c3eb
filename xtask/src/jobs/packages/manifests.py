"""Checks what PlatformIO, Arduino and Zephyr read in the folder of the release: python manifests.py FOLDER."""

import os
import pathlib
import sys

import kconfiglib
import yaml
from platformio.package.manifest.parser import ManifestParserFactory
from platformio.package.manifest.schema import ManifestSchema

folder = pathlib.Path(sys.argv[1]).absolute()


def platformio():
    for name in ("library.json", "library.properties"):
        manifest = ManifestParserFactory.new_from_file(str(folder / name)).as_dict()
        # Its validator asks a server for the names of licences.
        assert manifest.pop("license", "MIT OR Apache-2.0") == "MIT OR Apache-2.0", name
        ManifestSchema().load_manifest(manifest)
        assert manifest["name"] == "posegate" and manifest["description"], name
        assert (folder / "include" / "posegate.h").is_file()


class Environment(dict):
    """What the script for PlatformIO asks for."""

    def BoardConfig(self):
        return {"build.cpu": self["cpu"]}

    def GetProjectOption(self, name, default):
        return self.get(name, default)

    Flatten = staticmethod(list)

    def Append(self, **options):
        self.update(options)


def linked(**options):
    """The folder that the script for PlatformIO links, below `lib`, or why it links none."""
    env = Environment(options)
    os.chdir(folder)
    script = (folder / "platformio.py").read_text()
    try:
        exec(compile(script, "platformio.py", "exec"), {"Import": lambda name: None, "env": env})
    except SystemExit as refused:
        return str(refused)
    assert env["LIBS"] == ["posegate_c"]
    return str(pathlib.Path(env["LIBPATH"][0]).relative_to(folder / "lib"))


def script_of_platformio():
    hard = ["-Os", "-mfloat-abi=hard"]
    found = [
        linked(cpu="cortex-m0plus"),
        linked(cpu="cortex-m3"),
        linked(cpu="cortex-m4", CCFLAGS=["-mfloat-abi=softfp"]),
        linked(cpu="cortex-m7", CCFLAGS=hard, custom_posegate_parts="boxes", custom_posegate_level="s"),
        linked(cpu="cortex-m33", CCFLAGS=hard),
    ]
    expected = [
        "thumbv6m-none-eabi/all-3",
        "thumbv7m-none-eabi/all-3",
        "thumbv7em-none-eabi/all-3",
        "thumbv7em-none-eabihf/boxes-s",
        "thumbv8m.main-none-eabihf/all-3",
    ]
    assert found == expected, found
    assert "no archive for the core `cortex-m33`" in linked(cpu="cortex-m33")
    assert "no archive `some-3`" in linked(cpu="cortex-m3", custom_posegate_parts="some")


def arduino():
    lines = (folder / "library.properties").read_text().splitlines()
    properties = dict(line.split("=", 1) for line in lines)
    needed = "name version author maintainer sentence paragraph category url architectures precompiled"
    assert all(properties.get(key) for key in needed.split()), properties
    archives = sorted(str(path.parent.relative_to(folder / "src")) for path in (folder / "src").rglob("libposegate_c.a"))
    expected = ["cortex-m0plus", "cortex-m3", "cortex-m33/fpv5-sp-d16-hard", "cortex-m4", "cortex-m4/fpv4-sp-d16-hard", "cortex-m7"]
    assert archives == expected, archives
    assert (folder / "src" / "posegate.h").is_file()


def zephyr():
    build = yaml.safe_load((folder / "zephyr" / "module.yml").read_text())["build"]
    assert (folder / build["cmake"] / "CMakeLists.txt").is_file(), build
    kconfig = folder / build["kconfig"]
    # Zephyr's own symbols, of a board with a Cortex-M33 that passes floats in registers.
    board = folder / "Kconfig.board"
    symbols = sorted(
        symbol.name
        for symbol in kconfiglib.Kconfig(str(kconfig), warn=False).syms.values()
        if not symbol.nodes and symbol.name.isupper()
    )
    assert "FP_HARDABI" in symbols, symbols
    text = "".join(f"config {name}\n\tbool \"{name}\"\n" for name in symbols if len(name) > 1)
    board.write_text(text + f"source \"{kconfig}\"\n")
    config = kconfiglib.Kconfig(str(board), warn=True, warn_to_stderr=False)
    posegate = config.syms["POSEGATE"]
    config.syms["CPU_CORTEX_M33"].set_value(2)
    assert posegate.visibility == 0, "a Cortex-M33 that passes floats otherwise has no archive"
    config.syms["FP_HARDABI"].set_value(2)
    posegate.set_value(2)
    config.syms["SIZE_OPTIMIZATIONS"].set_value(2)
    assert posegate.tri_value == 2 and config.syms["POSEGATE_PARTS"].str_value == "all"
    assert config.syms["POSEGATE_SMALL"].tri_value == 2
    config.syms["POSEGATE_PARTS_BOXES"].set_value(2)
    assert config.syms["POSEGATE_PARTS"].str_value == "boxes"
    assert not config.warnings, config.warnings


for check in (platformio, script_of_platformio, arduino, zephyr):
    check()
    print(check.__name__, file=sys.stderr)
