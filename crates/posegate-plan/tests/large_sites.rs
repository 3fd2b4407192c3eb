//! A shard of a large site reads only its own tasks, and they equal those of the complete site, for any formatting of
//! the file and any faults.

#[allow(dead_code)]
use posegate_testkit::{counts, plant};

use posegate_plan::site_build::{Inventory, Piece, Recipe, Shard, part};
use posegate_site::{Site, SiteIndex};
use proptest::prelude::*;
use std::collections::BTreeSet;
use std::path::Path;

/// A site with most of the syntax that may occur: names that need quotes, arrays of several lines, comments with brackets.
const SITE: &str = r##"# A comment with [task.none] and "quotes
[camera.front]
width_px = 640
height_px = 480
fx = 615.0
fy = 615.0
cx = 320.0
cy = 240.0
mount = { x = 0.25, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }

[table]
step = { xy = 0.02, yaw_deg = 1.0 }

[wall.rack]
corners = [
  [-2.0, -1.2], # [
  [12.0, -1.2],
  [12.0, -1.0],
  [-2.0, -1.0],
]
z = [0.0, 2.5]

[error_model.grows]
translation = [0.004, 0.002, 0.0, 0.001]
yaw_deg = [0.2, 0.02, 0.0, 0.02]

[tag.near]
id = 1
family = "tag36h11"
size = 0.16
pose = { x = 3.0, y = 4.0, z = 0.6, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = -90.0 }

[goal.a]
x = 3.0
y = 2.0
yaw_deg = 90.0

[goal."b [2]"]
x = 6.0
y = 2.0
yaw_deg = 90.0

[chain.left]
start = { x = 0.0, y = 2.0, yaw_deg = 0.0, bounded = { translation = 0.1, yaw_deg = 1.0 } }
steps = [{ task = "look" }, { task = "dock-a" }]

[task.dock-a]
kind = "work"
from = "left"
goal = "a"
success = { shape = "box", x = [-0.1, 0.1], y = [-0.1, 0.1], yaw_deg = [-4.0, 4.0] }

[task."dock b"]
kind = 'work' # as [task.dock-a]
goal = "b [2]"

[task."dock b".success]
any = [
  { shape = "box", x = [-0.1, 0.1], y = [-0.1, 0.1], yaw_deg = [-4.0, 4.0] },
  { shape = "footprint", footprint = [[0.4, 0.3], [-0.4, 0.3], [-0.4, -0.3], [0.4, -0.3]],
    region = [[0.5, 0.4], [-0.5, 0.4], [-0.5, -0.4], [0.5, -0.4]] },
]

[task.look]
kind = "localization"
goal = { x = 3.0, y = 1.5, yaw_deg = 90.0 }
error_bound = { translation = 0.1, yaw_deg = 4.0, coverage = 1.0 }
[task.look.success]
shape = "visibility"
camera = "front"
tags = ["near", "far#2"]
see = "any"
d_max = 4.0
phi_max_deg = 25.0
psi_max_deg = 50.0
error_model = "grows"
r = { translation = 0.1, yaw_deg = 4.0 }

[task.see]
kind = "localization"
goal = "a"
success = { shape = "visibility", camera = "front", tag = "near", d_max = 3.5, phi_max_deg = 25.0, psi_max_deg = 50.0, walls = [] }
error_bound = { translation = 0.03, yaw_deg = 1.0, coverage = 1.0 }

[tag."far#2"]
id = 2
family = "tag36h11"
size = 0.3
pose = { x = 6.0, y = 4.0, z = 0.6, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = -90.0 }
tolerance = { translation = 0.001, yaw_deg = 0.1 }

[tag.unused]
id = 3
family = "tag36h11"
size = 0.3
pose = { x = 9.0, y = 4.0, z = 0.6, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = -90.0 }
"##;

/// Returns the part of a file that each of `count` shards reads.
fn parts(path: &Path, count: u32) -> Vec<Option<(Site, Inventory)>> {
    let shards = (0..count).map(|index| Shard::new(index, count).unwrap());
    shards.map(|shard| part(path, shard, "program")).collect()
}

/// Returns the difference of a shard's part from the complete site; `None` if there is none.
fn other(complete: &Site, shard: Shard, (site, inventory): &(Site, Inventory)) -> Option<String> {
    if *inventory != Inventory::new(complete, Recipe::new(complete, None, "program")) {
        return Some("another inventory".to_owned());
    }
    for piece in inventory.share(shard) {
        let Piece::Table { task } = piece else {
            return Some(format!("{piece}"));
        };
        if site.tasks.get(task) != complete.tasks.get(task) || !complete.tasks.contains_key(task) {
            return Some(format!("another `{task}`"));
        }
    }
    let common = |site: &Site| {
        (
            site.digest,
            site.epsilon,
            site.table,
            site.walls.clone(),
            site.cameras.clone(),
        )
    };
    if common(site) != common(complete) {
        return Some("another frame of the tasks".to_owned());
    }
    let tags = |(name, tag)| complete.tags.get(name) == Some(tag);
    let goals = |(name, goal)| complete.goals.get(name) == Some(goal);
    let chains = |(name, chain)| complete.chains.get(name) == Some(chain);
    let same = site.tags.iter().all(tags)
        && site.goals.iter().all(goals)
        && site.chains.iter().all(chains);
    (!same).then(|| "other tags, goals or chains".to_owned())
}

/// Compares the parts of a text with the complete site. Returns the number of shards that read the complete file, or
/// a fault.
fn wrong(text: &[u8], count: u32) -> Result<usize, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("site.toml");
    std::fs::write(&path, text).unwrap();
    let parts = parts(&path, count);
    let complete = Site::read(&path);
    for (index, found) in parts.iter().enumerate() {
        let (Some(found), Ok(complete)) = (found, &complete) else {
            continue;
        };
        let shard = Shard::new(index as u32, count).unwrap();
        if let Some(why) = other(complete, shard, found) {
            return Err(format!("shard {shard}: {why}"));
        }
    }
    let left = parts.iter().filter(|part| part.is_none()).count();
    match complete {
        Err(fault) if left == 0 => Err(format!("no shard finds: {fault}")),
        _ => Ok(left),
    }
}

/// Returns the sections of a text: each from its header to the next header.
fn sections(text: &str) -> Vec<String> {
    let mut sections = vec![String::new()];
    for line in text.lines() {
        if line.starts_with('[') {
            sections.push(String::new());
        }
        let last = sections.last_mut().unwrap();
        *last += line;
        *last += "\n";
    }
    sections
}

/// Tasks equal those of the complete site. Each tag and goal is read by some shard, and no shard reads all of them.
#[test]
fn parts_equal_the_complete_site() {
    for (text, counts) in [
        (SITE.to_owned(), [2, 3, 4]),
        (plant::plant(1, 60), [2, 7, 30]),
    ] {
        for text in [text.clone(), text.replace('\n', "\r\n")] {
            let folder = tempfile::tempdir().unwrap();
            let path = folder.path().join("site.toml");
            std::fs::write(&path, &text).unwrap();
            let complete = Site::read(&path).unwrap();
            assert_eq!(
                SiteIndex::read(&path).unwrap().tasks(),
                complete.tasks.keys().cloned().collect::<Vec<_>>()
            );
            for count in counts {
                let (mut tasks, mut tags, mut goals) =
                    (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
                for (index, found) in parts(&path, count).into_iter().enumerate() {
                    let found = found.expect("a file of the simple kind");
                    let shard = Shard::new(index as u32, count).unwrap();
                    assert_eq!(other(&complete, shard, &found), None, "{shard}");
                    // Chains of the small site name all of its tasks.
                    let all = found.0.tasks.len() == complete.tasks.len();
                    assert!(!all || text.starts_with(SITE.lines().next().unwrap()));
                    tasks.extend(found.0.tasks.into_keys());
                    tags.extend(found.0.tags.into_keys());
                    goals.extend(found.0.goals.into_keys());
                }
                assert!(tasks.iter().eq(complete.tasks.keys()));
                assert!(tags.iter().eq(complete.tags.keys()));
                assert!(goals.iter().eq(complete.goals.keys()));
            }
        }
    }
}

/// A shard's memory does not grow with the site: its part has its own tasks, and only the tags that it needs or must
/// check.
#[test]
fn part_has_only_its_own_tasks_and_tags() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("site.toml");
    std::fs::write(&path, plant::plant(1, 2_000)).unwrap();
    let shard = Shard::new(3, 100).unwrap();
    let (site, inventory) = part(&path, shard, "program").unwrap();
    assert_eq!(inventory.pieces().len(), 4_000);
    assert_eq!(site.tasks.len(), 40);
    assert!(site.tags.len() < 80, "{}", site.tags.len());
}

/// A file with unusual syntax is read completely. So are the site of a single shard, and a path that is not a file.
#[test]
fn unusual_files_are_read_completely() {
    for more in [
        "[import.map]\nfile = \"map.json\"\n",
        "[candidate.c]\n",
        "[tag.t]\nfamily = \"\"\"\n[task.hidden]\n\"\"\"\n",
        "[task]\ndock = { kind = \"work\" }\n",
    ] {
        assert_eq!(
            wrong(format!("{SITE}{more}").as_bytes(), 3),
            Ok(3),
            "{more}"
        );
    }
    assert_eq!(wrong(SITE.as_bytes(), 1), Ok(1));
    assert_eq!(wrong(SITE.as_bytes(), 3), Ok(0));
    assert!(SiteIndex::read("no-such-file.toml").is_none());
    assert!(SiteIndex::read("/dev/null").is_none());
}

/// Each section's fault makes at least one shard read the complete file, even if no task needs the section, and even
/// if headers and brackets are correct.
#[test]
fn fault_in_any_section_is_found() {
    let counts = 2..=5;
    for count in counts.clone() {
        assert_eq!(wrong(SITE.as_bytes(), count), Ok(0));
    }
    let sections = sections(SITE);
    let found = |text: &str, why: &str| {
        assert!(Site::parse(text, "site.toml").is_err(), "{why}");
        for count in counts.clone() {
            let left = wrong(text.as_bytes(), count);
            assert!(left.as_ref().is_ok_and(|left| *left > 0), "{why}: {left:?}");
        }
    };
    for at in 1..sections.len() {
        for fault in ["x ==\n", "unknown = 1\n", "x = [1\n", "x = 1]\n"] {
            let mut sections = sections.clone();
            sections[at] += fault;
            found(&sections.concat(), fault);
        }
        // The same section twice.
        found(&format!("{SITE}{}", sections[at]), &sections[at]);
    }
    for (right, fault) in [
        ("id = 3\n", "id = -3\n"),
        (
            "size = 0.3\npose = { x = 9.0",
            "size = 0.0\npose = { x = 9.0",
        ),
        ("[tag.unused]", "[tag.a-name-that-is-longer-than-32-bytes]"),
        ("{ task = \"look\" }", "{ task = \"none\" }"),
        ("from = \"left\"", "from = \"none\""),
        ("tags = [\"near\", \"far#2\"]", "tags = [\"near\", \"far\"]"),
        ("goal = \"b [2]\"", "goal = \"b\""),
    ] {
        assert!(SITE.contains(right), "{right}");
        found(&SITE.replace(right, fault), fault);
    }
}

/// A fault in a section that no task names prevents the same piece for any number of shards. So no combination of
/// shards has all pieces.
#[test]
fn fault_prevents_one_piece_for_any_number_of_shards() {
    let complete = Site::parse(SITE, "site.toml").unwrap();
    let inventory = Inventory::new(&complete, Recipe::new(&complete, None, "program"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("site.toml");
    for unused in ["unused", "another", "third", "fourth"] {
        let text = SITE.replace("[tag.unused]", &format!("[tag.{unused}]"));
        let text = text.replace(
            "size = 0.3\npose = { x = 9.0",
            "size = 0.0\npose = { x = 9.0",
        );
        std::fs::write(&path, text).unwrap();
        assert!(Site::read(&path).is_err());
        let all = || inventory.pieces().len();
        let mut missing: BTreeSet<usize> = (0..all()).collect();
        for count in 2..40 {
            let failed: BTreeSet<usize> = parts(&path, count)
                .iter()
                .enumerate()
                .filter_map(|(index, part)| part.is_none().then_some(index))
                .collect();
            missing.retain(|piece| failed.contains(&(piece % count as usize)));
        }
        assert!(!missing.is_empty(), "{unused}");
    }
}

/// Very long chains of names are followed only to a limit.
#[test]
fn long_chains_of_names_are_read_completely() {
    let mut text = SITE.to_owned();
    for link in 1..100 {
        let before = if link == 1 {
            "see".to_owned()
        } else {
            format!("t{}", link - 1)
        };
        text += &format!(
            "[chain.c{link}]\nstart = {{ x = 0.0, y = 2.0, yaw_deg = 0.0, bounded = {{ translation = 0.1, yaw_deg = 1.0 }} }}\n\
             steps = [{{ task = \"{before}\" }}]\n\
             [task.t{link}]\nkind = \"work\"\nfrom = \"c{link}\"\ngoal = \"a\"\n\
             success = {{ shape = \"box\", x = [-0.1, 0.1], y = [-0.1, 0.1], yaw_deg = [-4.0, 4.0] }}\n"
        );
    }
    Site::parse(&text, "site.toml").unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("site.toml");
    std::fs::write(&path, text).unwrap();
    let contents = SiteIndex::read(&path).unwrap();
    let of = |task: &str| contents.part(|kind, name| kind == "task" && name == task);
    assert!(of("t99").is_none());
    // Its chain, and the tasks that the chain names.
    assert_eq!(of("t1").unwrap().tasks.len(), 2);
}

/// A file that changes between two readings is read completely, which gives the content of one moment.
#[test]
fn changing_file_is_read_completely() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("site.toml");
    std::fs::write(&path, SITE).unwrap();
    let contents = SiteIndex::read(&path).unwrap();
    assert!(contents.part(|_, _| true).is_some());
    std::fs::write(&path, SITE.replace("size = 0.16", "size = 0.17")).unwrap();
    assert!(contents.part(|_, _| true).is_none());
    std::fs::remove_file(&path).unwrap();
    assert!(contents.part(|_, _| true).is_none());
}

/// An edit of a text. A place is a share of the text.
#[derive(Clone, Debug)]
enum Edit {
    Insert(f64, &'static str),
    Delete(f64, usize),
    Move(f64, f64),
}

fn edit() -> impl Strategy<Value = Edit> {
    const BITS: [&str; 30] = [
        "[",
        "]",
        "{",
        "}",
        "\"",
        "'",
        "#",
        "\\",
        "\n",
        "\r",
        "\r\n",
        ",",
        "=",
        ".",
        "\"\"\"",
        "'''",
        "[[",
        "]]",
        "\n[task.look]\n",
        "\n[tag.near]\n",
        "\n[tag.more]\n",
        "\n[table]\n",
        "\n[task]\n",
        "\n[[tag.near]]\n",
        "\n# [\n",
        "\n\"[a]\" = 1\n",
        "\u{feff}",
        "\\u0041",
        "\n[task.look.success]\n",
        "\n[ tag . 'near' ]\n",
    ];
    prop_oneof![
        4 => (0.0..1.0, prop::sample::select(&BITS[..])).prop_map(|(at, bit)| Edit::Insert(at, bit)),
        2 => (0.0..1.0, 1_usize..80).prop_map(|(at, length)| Edit::Delete(at, length)),
        1 => (0.0..1.0, 0.0..1.0).prop_map(|(from, to)| Edit::Move(from, to)),
    ]
}

fn place(text: &str, share: f64) -> usize {
    let at = (text.len() as f64 * share) as usize;
    (0..=at)
        .rev()
        .find(|at| text.is_char_boundary(*at))
        .unwrap_or(0)
}

fn edited(text: &str, edit: &Edit) -> String {
    match *edit {
        Edit::Insert(at, bit) => {
            let mut text = text.to_owned();
            text.insert_str(place(&text, at), bit);
            text
        }
        Edit::Delete(at, length) => {
            let from = place(text, at);
            let to = text.len().min(from + length);
            let to = (to..=text.len()).find(|to| text.is_char_boundary(*to));
            format!("{}{}", &text[..from], &text[to.unwrap_or(from)..])
        }
        // A section moved to another place.
        Edit::Move(from, to) => {
            let mut sections = sections(text);
            let from = (sections.len() as f64 * from) as usize;
            let section = sections.remove(from);
            let to = (sections.len() as f64 * to) as usize;
            sections.insert(to, section);
            sections.concat()
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(counts::cases(4_000) as u32))]

    /// For any edit of a file, the tasks of every shard equal those of the complete site. If the complete site has a
    /// fault, at least one shard reads the complete file and finds it.
    #[test]
    fn edits_are_detected_or_harmless(edits in prop::collection::vec(edit(), 1..4), count in 2_u32..5) {
        let text = edits.iter().fold(SITE.to_owned(), |text, edit| edited(&text, edit));
        let found = wrong(text.as_bytes(), count);
        prop_assert!(found.is_ok(), "{found:?}\n{text}");
    }
}
