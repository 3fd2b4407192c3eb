//! What the archive for C leaves alone: a program's own C library and mathematics.

use crate::archive::Core;
use crate::files::{self, Scratch};
use crate::report::Report;
use crate::shell::Result;
use std::path::Path;

/// A program that calls functions of its C library, and asks the archive for its version unless it is linked without.
const PROGRAM: &str = r#"
#include <math.h>
#include <string.h>
#include "board.h"
#include "posegate.h"

static volatile double number = 2.0;
static char from[64];
static char to[64];

void on_fault(void) { stop(false); }

int main(void)
{
    const size_t length = (size_t)number;
    double sum = sin(number) + cos(number) + sqrt(number);
    memset(from, (int)length, length);
    memcpy(to, from, length);
#ifdef WITH_POSEGATE
    sum += (double)posegate_abi_version();
#endif
    number = sum + (double)to[1];
    stop(number > 2.0);
    return 0;
}
"#;
const FUNCTIONS: [&str; 5] = ["cos", "memcpy", "memset", "sin", "sqrt"];
/// A C library: its name, the option that chooses it, and its package for Debian.
const LIBRARIES: [(&str, &str, &str); 2] = [
    ("newlib", "", "libnewlib-arm-none-eabi"),
    (
        "picolibc",
        "--specs=picolibc.specs",
        "picolibc-arm-none-eabi",
    ),
];
/// What a program uses of the archive, and the options of its compiler and linker.
const USES: [(&str, &str); 2] = [
    ("its version", "-DWITH_POSEGATE"),
    (
        "a gate",
        "-DWITH_POSEGATE -Wl,-u,posegate_gate_init -Wl,-u,posegate_gate_step_tracked",
    ),
];
/// How much flash the question for the version may take, in bytes.
const MOST_BYTES: u64 = 512;

/// Links programs with an archive and each C library, in both orders. Their functions of C must be those that they have without the
/// archive, and a program that only asks for the version must not grow.
pub fn check(core: &Core, archive: &Path, report: &mut Report) -> Result {
    let folder = Scratch::new()?;
    let (source, elf) = (folder.join("program.c"), folder.join("program.elf"));
    files::write(&source, PROGRAM)?;
    let archive = archive.to_str().ok_or("a path that is no text")?;
    let mut links = 0;
    for (library, specs, package) in LIBRARIES {
        let link = |options: &str, libraries: &[&str]| -> Result<(Vec<(String, u64)>, u64)> {
            core.tool("gcc")?
                .words(core.flags)
                .words(specs)
                .words("-Os -std=c99 -Wall -Wextra -Werror -ffreestanding -ffunction-sections -nostdlib -T examples/c/link.ld")
                .words("-Wl,--gc-sections -Wl,-z,noexecstack -Wl,--no-warn-rwx-segments -Iinclude -Iexamples/c")
                .words(options)
                .arg(&source)
                .words("examples/c/startup.c examples/c/board.c")
                .args(libraries)
                .arg("-lgcc")
                .arg("-o")
                .arg(&elf)
                .run()
                .map_err(|error| format!("{error}\nif {library} is missing: apt-get install -y {package}"))?;
            let symbols = core.tool("nm")?.arg("-S").arg(&elf).read()?;
            Ok((functions_of_c(&symbols), core.flash(&elf)?))
        };
        let (own, bytes) = link("", &["-lm", "-lc"])?;
        if own.len() != FUNCTIONS.len() {
            return Err(format!("functions of {library} in a program: {own:?}").into());
        }
        for (used, options) in USES {
            for order in [["-lm", "-lc", archive], [archive, "-lm", "-lc"]] {
                let (linked, with) = link(options, &order)?;
                report.require(
                    linked == own,
                    format_args!(
                        "{library}, {used}, {order:?}: linked {linked:?}, and without the archive {own:?}"
                    ),
                );
                if options == USES[0].1 {
                    report.at_most(
                        &format!("flash of posegate_abi_version in a program with {library}"),
                        with.saturating_sub(bytes),
                        "B",
                        MOST_BYTES,
                    );
                }
                links += 1;
            }
        }
    }
    report.at_least(
        "programs with the archive and a C library, in both orders",
        links,
        "programs",
        8,
    );
    Ok(())
}

/// Returns the names and sizes of the global functions of C in a listing of `nm -S`.
fn functions_of_c(symbols: &str) -> Vec<(String, u64)> {
    let mut found: Vec<(String, u64)> = symbols
        .lines()
        .filter_map(|line| {
            let mut words = line.split(' ');
            let (_, size, kind) = (words.next()?, words.next()?, words.next()?);
            let name = words.next().filter(|name| FUNCTIONS.contains(name))?;
            let size = u64::from_str_radix(size, 16).ok()?;
            ["T", "W"].contains(&kind).then(|| (name.to_owned(), size))
        })
        .collect();
    found.sort();
    found
}

#[cfg(test)]
mod tests {
    use super::functions_of_c;

    #[test]
    fn global_functions_of_c_are_found_with_their_sizes() {
        let symbols = "00000400 00000010 T sin\n00000410 00000020 t cos\n00000430 0000000a W memcpy\n00000440 T memset\n00000450 00000004 T asin\n";
        let expected = [("memcpy".to_owned(), 10), ("sin".to_owned(), 16)];
        assert_eq!(functions_of_c(symbols), expected);
    }
}
