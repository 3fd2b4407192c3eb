//! A shard that is killed or has a full disk loses no finished piece. The next merge completes an interrupted merge.

use super::{Folder, PLANT, checked, flip, plant};
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, Output};

/// The signal for a write beyond the size limit.
const SIGXFSZ: i32 = 25;

fn length(path: &Path) -> u64 {
    std::fs::metadata(path).unwrap().len()
}

/// Runs the program with files limited to a number of blocks of 512 bytes.
fn limited(folder: &Folder, before: &str, blocks: u64, line: &str) -> Output {
    let limited = format!("{before} ulimit -c 0; ulimit -f {blocks}; exec \"$0\" {line}");
    let mut command = Command::new("sh");
    command.args(["-c", &limited, env!("CARGO_BIN_EXE_posegate")]);
    command.current_dir(folder.path()).output().unwrap()
}

#[test]
fn killed_shard_loses_no_finished_piece() {
    let folder = Folder::with(&plant::plant(1, 6));
    folder.expect(0, "site build site.toml -o whole");
    folder.expect(0, "site merge whole");
    // The kernel kills it in the middle of the first of the two longest pieces.
    let pieces = folder.pieces("whole");
    let mut lengths: Vec<u64> = pieces.iter().map(|path| length(path)).collect();
    lengths.sort_unstable();
    let blocks = lengths[pieces.len() - 2] / 512;
    let line = "site build site.toml --threads 1 -o out";
    let output = limited(&folder, "", blocks, line);
    assert_eq!(output.status.signal(), Some(SIGXFSZ), "{output:?}");
    let finished = folder.pieces("out").len();
    assert!((3..18).contains(&finished), "{finished}");
    folder.run("site merge out").is_refused_with(&[
        "pieces that are missing or damaged: ",
        ": shard 0/1, parts/",
    ]);
    // The rest of a killed write, which looks like the file of another process, and the damage of a bad disk.
    folder.write("out/parts/.posegate-1-1.tmp", "half");
    folder.write("out/parts/.posegate-1-2.tmp", "half");
    let old = std::fs::File::options()
        .write(true)
        .open(folder.path().join("out/parts/.posegate-1-1.tmp"))
        .unwrap();
    let days = std::time::Duration::from_secs(2 * 24 * 60 * 60);
    old.set_modified(std::time::SystemTime::now() - days)
        .unwrap();
    let pieces = folder.pieces("out");
    let damaged = std::fs::read(&pieces[0]).unwrap();
    std::fs::write(&pieces[0], &damaged[..damaged.len() - 1]).unwrap();
    flip(&pieces[1]);
    let built = folder
        .run("site build site.toml --resume --json -o out")
        .json(0);
    assert_eq!(built["pieces"], 18);
    let kept = built["kept"].as_u64().unwrap() as usize;
    assert!(kept >= finished - 2 && kept < 18, "{kept} of {finished}");
    assert_eq!(kept, pieces.len() - 2, "all but the damaged ones are kept");
    folder.expect(0, "site merge out");
    assert!(folder.results("out") == folder.results("whole"));
    // The temporary file of the killed child is also young.
    let drafts = folder.parts("out");
    let drafts: Vec<&str> = drafts
        .iter()
        .map(String::as_str)
        .filter(|name| name.ends_with(".tmp"))
        .collect();
    assert!(drafts.contains(&".posegate-1-2.tmp"), "{drafts:?}");
    assert!(!drafts.contains(&".posegate-1-1.tmp"), "{drafts:?}");
    // The second run has nothing to build.
    let built = folder
        .run("site build site.toml --resume --json -o out")
        .json(0);
    assert_eq!(built["kept"], 18);
}

#[test]
fn full_disk_leaves_no_partial_file() {
    let folder = Folder::with(&PLANT);
    folder.expect(0, "site build site.toml -o whole");
    folder.expect(0, "site merge whole");
    // The size of the inventory in blocks of 512 bytes; a plan is larger.
    let parts = folder.parts("whole");
    let inventory = parts
        .iter()
        .find(|name| name.starts_with("inventory-"))
        .unwrap();
    let blocks = length(&folder.path().join("whole/parts").join(inventory)).div_ceil(512);
    let most = folder
        .pieces("whole")
        .iter()
        .map(|path| length(path))
        .max()
        .unwrap();
    assert!(most > blocks * 512, "{most} against {blocks} blocks");
    // A size limit instead of a full disk: if its signal is ignored, the write fails in the same way.
    let line = "site build site.toml -o out";
    let limited = || limited(&folder, "trap '' XFSZ;", blocks, line);
    let output = limited();
    let (_, err) = checked(2, line, output);
    let squeezed = err.replace(' ', "");
    assert!(
        squeezed.contains("out/parts/")
            && squeezed.contains("Filetoolarge(oserror27)")
            && squeezed.contains("--resume"),
        "{err}"
    );
    let left = folder.parts("out");
    assert!(left.iter().all(|name| !name.contains(".tmp")), "{left:?}");
    for piece in folder.pieces("out") {
        let same = folder
            .path()
            .join("whole/parts")
            .join(piece.file_name().unwrap());
        assert!(std::fs::read(&piece).unwrap() == std::fs::read(same).unwrap());
    }
    folder.expect(0, "site build site.toml --resume -o out");
    folder.expect(0, "site merge out");
    assert!(folder.results("out") == folder.results("whole"));
    // A failed write does not remove finished pieces.
    let output = limited();
    checked(2, line, output);
    let same = folder.pieces("out");
    assert_eq!(same.len(), folder.pieces("whole").len());
    for piece in same {
        let other = folder
            .path()
            .join("whole/parts")
            .join(piece.file_name().unwrap());
        assert!(std::fs::read(&piece).unwrap() == std::fs::read(other).unwrap());
    }
}

/// A merge that is killed or has a full disk leaves no manifest. The next merge completes it.
#[test]
fn interrupted_merge_is_completed_by_the_next_merge() {
    let folder = Folder::with(&PLANT);
    folder.expect(0, "site build site.toml -o out");
    folder.copied("out", "whole");
    folder.expect(0, "site merge whole");
    let whole = folder.results("whole");
    let manifest = whole["manifest.json"].len() as u64;
    let longest = whole.values().map(|bytes| bytes.len() as u64).max();
    // First the longest result cannot be written, then several results and the manifest.
    for (number, length) in [longest.unwrap(), manifest].into_iter().enumerate() {
        let blocks = (length - 1) / 512;
        for (before, ends) in [("", None), ("trap '' XFSZ;", Some(2))] {
            let copy = format!("copy-{number}-{}", before.len());
            let line = format!("site merge {copy}");
            folder.copied("out", &copy);
            folder.expect(0, &line);
            let output = limited(&folder, before, blocks, &line);
            assert_eq!(output.status.code(), ends, "{output:?}");
            assert!(!folder.path().join(&copy).join("manifest.json").exists());
            folder.expect(0, &line);
            assert!(folder.results(&copy) == whole, "{copy}");
        }
    }
}
