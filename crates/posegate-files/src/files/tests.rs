use super::*;
use std::fs;

fn input(path: &Path) -> Input {
    path.as_os_str().to_owned().into()
}

fn output(path: &Path) -> Output {
    path.as_os_str().to_owned().into()
}

fn folder(path: &Path) -> OutputFolder {
    path.as_os_str().to_owned().into()
}

/// Creates a folder with the file `in` and all kinds of names for it.
fn linked_file() -> (tempfile::TempDir, PathBuf, Vec<PathBuf>) {
    let linked_file = tempfile::tempdir().unwrap();
    let at = |name: &str| linked_file.path().join(name);
    fs::write(at("in"), "input").unwrap();
    fs::create_dir(at("sub")).unwrap();
    fs::hard_link(at("in"), at("hard")).unwrap();
    let mut names = vec![at("in"), at("./sub/../in"), at("hard")];
    #[cfg(unix)]
    {
        std::os::unix::fs::symlink("in", at("soft")).unwrap();
        std::os::unix::fs::symlink("../soft", at("sub/twice")).unwrap();
        std::os::unix::fs::symlink(linked_file.path(), at("sub/up")).unwrap();
        names.extend([at("soft"), at("sub/twice"), at("sub/up/in")]);
    }
    let path = at("in");
    (linked_file, path, names)
}

#[test]
fn input_cannot_be_written_under_any_name() {
    let (linked_file, path, names) = linked_file();
    for name in &names {
        for other in &names {
            let files = Files::new();
            files.declare_output(&output(name)).unwrap();
            let refused = files.read(&input(other)).unwrap_err();
            assert!(
                matches!(refused, FileError::ReplacesInput { .. }),
                "{name:?}"
            );
            let files = Files::new();
            files.read(&input(other)).unwrap();
            for refused in [
                files.declare_output(&output(name)).unwrap_err(),
                files.write(&output(name), b"x").unwrap_err(),
                files.draft(&output(name)).unwrap_err(),
            ] {
                assert!(
                    matches!(refused, FileError::ReplacesInput { .. }),
                    "{name:?}"
                );
            }
        }
    }
    let files = Files::new();
    files.register(&path).unwrap();
    let all = [("new".into(), vec![1]), ("hard".into(), vec![2])];
    assert!(files.write_into(&folder(linked_file.path()), &all).is_err());
    assert!(!linked_file.path().join("new").exists());
    assert_eq!(fs::read(&path).unwrap(), b"input");
}

#[test]
fn one_file_for_two_outputs_is_an_error() {
    let (linked_file, _, names) = linked_file();
    let at = |name: &str| linked_file.path().join(name);
    let new = vec![at("new"), at("sub/../new"), at("sub/up/new")];
    for names in [names, new] {
        for other in &names[1..] {
            let files = Files::new();
            files.declare_output(&output(&names[0])).unwrap();
            let refused = files.declare_output(&output(other));
            assert!(
                matches!(refused, Err(FileError::OneForTwo { .. })),
                "{other:?}"
            );
        }
    }
    let files = Files::new();
    for device in ["/dev/null", "/dev/null"] {
        files.declare_output(&output(Path::new(device))).unwrap();
        files.declare_input(&input(Path::new(device))).unwrap();
    }
    files.declare_output(&output(Path::new("-"))).unwrap();
    let refused = files.declare_output(&output(Path::new("-")));
    assert!(matches!(refused, Err(FileError::OneForTwo { .. })));
}

#[test]
fn standard_input_is_allowed_once() {
    let files = Files::new();
    let stdin = input(Path::new("-"));
    files.declare_input(&stdin).unwrap();
    assert!(matches!(
        files.declare_input(&stdin),
        Err(FileError::StandardInputTwice)
    ));
}

#[test]
fn input_below_a_reserved_name_is_an_error() {
    let (linked_file, path, _) = linked_file();
    let at = |name: &str| linked_file.path().join(name);
    let files = Files::new();
    files.read(&input(&path)).unwrap();
    let folder = folder(linked_file.path());
    files.reserve(&folder, &["parts", "sub"]).unwrap();
    assert!(files.reserve(&folder, &["parts", "in"]).is_err());
    fs::hard_link(&path, at("sub/linked")).unwrap();
    assert!(files.reserve(&folder, &["parts", "sub"]).is_err());
    fs::write(at("sub/own"), "").unwrap();
    let files = Files::new();
    files.read(&input(&at("sub/own"))).unwrap();
    assert!(files.reserve(&folder, &["sub"]).is_err());
}

#[test]
fn drafts_are_removed_and_open_no_existing_file() {
    let (linked_file, path, _) = linked_file();
    let files = Files::new();
    let names = || fs::read_dir(linked_file.path()).unwrap().count();
    let before = names();
    drop(files.draft(&output(&path)).unwrap());
    assert_eq!(
        (names(), fs::read(&path).unwrap()),
        (before, b"input".to_vec())
    );
    // A file with a temporary name, as a killed process with the same id would leave.
    let taken = std::format!("out.{}-0.tmp", std::process::id());
    let taken = linked_file.path().join(taken);
    fs::write(&taken, "taken").unwrap();
    let out = linked_file.path().join("out");
    files.write(&output(&out), b"new").unwrap();
    assert_eq!(fs::read(&out).unwrap(), b"new");
    assert_eq!(fs::read(&taken).unwrap(), b"taken");
}

#[test]
fn text_is_utf_8() {
    let (_linked_file, path, _) = linked_file();
    let files = Files::new();
    let (text, name) = files.read_text(&input(&path)).unwrap();
    assert_eq!((text.as_str(), name), ("input", path.display().to_string()));
    fs::write(&path, b"in\xffput").unwrap();
    let error = Files::new().read_text(&input(&path)).unwrap_err();
    assert!(
        error.to_string().contains("in: not UTF-8: ") && error.to_string().ends_with("index 2"),
        "{error}"
    );
}
