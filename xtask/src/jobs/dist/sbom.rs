//! The bill of materials (CycloneDX 1.5): every package of Rust in each file of a release, with its licence, checksum and what it
//! needs. `cargo metadata` describes the packages; `cargo tree` lists which of them a file has, since the former also lists optional
//! packages that are not used.

use super::build::{Crate, STATIC, Sources, WHEEL};
use crate::archive::TARGETS;
use crate::files;
use crate::need;
use crate::report::Report;
use crate::shell::{Result, cmd, program_at, say};
use serde_json::{Map, Value, json};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// A file of the release, its manifest, its package, and the targets that it is built for.
const ARTIFACTS: [(&str, &str, &str, &[&str]); 4] = [
    ("posegate", "Cargo.toml", "posegate-cli", &[STATIC]),
    (
        "posegate-node",
        "crates/posegate-ros2/Cargo.toml",
        "posegate-ros2",
        &[STATIC],
    ),
    (
        "posegate-wheel",
        "crates/posegate-python/Cargo.toml",
        "posegate-python",
        &[WHEEL],
    ),
    ("posegate-c", "Cargo.toml", "posegate-c", &TARGETS),
];
/// Validates a file by the schema of CycloneDX, and prints the number of its components.
const VALIDATE: &str = "import json, sys
from cyclonedx.schema import SchemaVersion
from cyclonedx.validation.json import JsonStrictValidator
text = open(sys.argv[1]).read()
errors = JsonStrictValidator(SchemaVersion.V1_5).validate_str(text)
if errors:
    sys.exit(str(errors))
print(len(json.loads(text)['components']))";

/// What is known about packages, by name and version.
#[derive(Default)]
struct Materials {
    components: BTreeMap<Crate, Value>,
    needs: BTreeMap<Crate, BTreeSet<Crate>>,
    /// The packages whose code is in a file. The others are needed to build one.
    contained: BTreeSet<Crate>,
    artifacts: BTreeMap<&'static str, (Crate, BTreeSet<Crate>)>,
}

/// Writes the bill of materials into a folder, and checks it against the crates that were compiled and the schema.
pub fn write(
    sources: &Sources,
    compiled: &[(&'static str, BTreeSet<Crate>)],
    folder: &Path,
    report: &mut Report,
) -> Result {
    say("bill of materials");
    let mut materials = Materials::default();
    for (name, manifest, package, targets) in ARTIFACTS {
        for target in targets {
            materials.add(sources, name, manifest, package, target)?;
        }
    }
    for (name, expected) in compiled {
        let (_, listed) = materials
            .artifacts
            .get(name)
            .ok_or_else(|| format!("no {name}"))?;
        if listed != expected {
            let missing: Vec<_> = expected.difference(listed).collect();
            let unused: Vec<_> = listed.difference(expected).collect();
            return Err(format!(
                "the bill of materials of {name} lacks {missing:?} and has {unused:?}, which are not compiled"
            )
            .into());
        }
    }
    let path = folder.join(format!("posegate-{}.cdx.json", sources.version));
    let text = serde_json::to_string_pretty(&materials.document(sources)?)?;
    files::write(&path, text + "\n")?;
    let tools = need::python(
        "sbom-tools",
        "cyclonedx.validation.json, jsonschema",
        "cyclonedx-python-lib[json-validation]==11.12.0",
    )?;
    let count = program_at(&tools)
        .arg("-c")
        .arg(VALIDATE)
        .arg(&path)
        .read()?;
    report.at_least(
        "dist: components of the bill of materials",
        count.trim().parse()?,
        "components",
        150,
    );
    Ok(())
}

impl Materials {
    /// Adds the packages of a file for a target.
    fn add(
        &mut self,
        sources: &Sources,
        name: &'static str,
        manifest: &str,
        package: &str,
        target: &str,
    ) -> Result {
        let metadata = cmd("cargo metadata --format-version 1 --locked --filter-platform")
            .arg(target)
            .arg("--manifest-path")
            .arg(manifest)
            .dir(&sources.folder)
            .read()?;
        let metadata: Value = serde_json::from_str(&metadata)?;
        let tree = |edges: &str| -> Result<BTreeSet<Crate>> {
            let text = cmd("cargo tree --locked --prefix none -f {p} --manifest-path")
                .arg(manifest)
                .words(&format!("-p {package} --target {target} -e {edges}"))
                .dir(&sources.folder)
                .read()?;
            text.lines()
                .filter(|line| !line.is_empty())
                .map(listed)
                .collect()
        };
        let built = tree("no-dev")?;
        self.contained.append(&mut tree("normal,no-proc-macro")?);
        let folder = Path::new(manifest).parent().unwrap_or(Path::new(""));
        let sums = checksums(&files::read(
            sources.folder.join(folder).join("Cargo.lock"),
        )?);
        let packages = list(&metadata["packages"])?;
        let by_id: BTreeMap<&str, Crate> = packages
            .iter()
            .map(|package| {
                Ok((
                    text(package, "id")?,
                    (
                        text(package, "name")?.into(),
                        text(package, "version")?.into(),
                    ),
                ))
            })
            .collect::<Result<_>>()?;
        for package in packages {
            let id = (
                text(package, "name")?.to_owned(),
                text(package, "version")?.to_owned(),
            );
            if built.contains(&id) {
                let component = component(package, sums.get(&id).map(String::as_str))?;
                self.components.insert(id, component);
            }
        }
        for node in list(&metadata["resolve"]["nodes"])? {
            let id = by_id
                .get(text(node, "id")?)
                .ok_or("a node without its package")?;
            if !built.contains(id) {
                continue;
            }
            let needs = self.needs.entry(id.clone()).or_default();
            for dependency in list(&node["deps"])? {
                let other = by_id
                    .get(text(dependency, "pkg")?)
                    .ok_or("a need without its package")?;
                let is_for_tests = list(&dependency["dep_kinds"])?
                    .iter()
                    .all(|kind| kind["kind"] == "dev");
                if !is_for_tests && built.contains(other) {
                    needs.insert(other.clone());
                }
            }
        }
        let root = built
            .iter()
            .find(|(name, _)| name == package)
            .ok_or("no package")?;
        let entry = self
            .artifacts
            .entry(name)
            .or_insert_with(|| (root.clone(), BTreeSet::new()));
        entry.1.extend(built);
        Ok(())
    }

    fn document(&self, sources: &Sources) -> Result<Value> {
        let mut components = self.runtime()?;
        let mut dependencies = Vec::new();
        let runtime = |artifact: &str| match artifact {
            "posegate-c" => vec!["rust-std"],
            "posegate-wheel" => vec!["rust-std"],
            _ => vec!["musl", "rust-std"],
        };
        for (name, (root, _)) in &self.artifacts {
            let reference = format!("release:{name}");
            components.push(json!({
                "type": if *name == "posegate-c" || *name == "posegate-wheel" { "library" } else { "application" },
                "bom-ref": reference, "name": name, "version": sources.version,
                "licenses": [{"expression": "MIT OR Apache-2.0"}],
            }));
            let mut needs: Vec<String> = vec![reference_of(root)];
            needs.extend(runtime(name).iter().map(|part| format!("runtime:{part}")));
            dependencies.push(json!({"ref": reference, "dependsOn": needs}));
        }
        for (id, component) in &self.components {
            let mut component = component.clone();
            // What only generates code or builds is not in any file.
            let scope = if self.contained.contains(id) {
                "required"
            } else {
                "excluded"
            };
            component["scope"] = scope.into();
            components.push(component);
            let needs: Vec<String> = self
                .needs
                .get(id)
                .into_iter()
                .flatten()
                .map(reference_of)
                .collect();
            dependencies.push(json!({"ref": reference_of(id), "dependsOn": needs}));
        }
        let all: Vec<String> = self
            .artifacts
            .keys()
            .map(|name| format!("release:{name}"))
            .collect();
        dependencies.push(json!({"ref": "release", "dependsOn": all}));
        let time = cmd("date -u +%Y-%m-%dT%H:%M:%SZ -d")
            .arg(format!("@{}", sources.epoch))
            .read()?;
        Ok(json!({
            "bomFormat": "CycloneDX",
            "specVersion": "1.5",
            "version": 1,
            "metadata": {
                "timestamp": time.trim(),
                "component": {"type": "application", "bom-ref": "release", "name": "posegate", "version": sources.version},
            },
            "components": components,
            "dependencies": dependencies,
        }))
    }

    /// Returns what the compiler links into every file.
    fn runtime(&self) -> Result<Vec<Value>> {
        let version = cmd("rustc --version").read()?;
        let version = version.split(' ').nth(1).ok_or("rustc has no version")?;
        let sysroot = cmd("rustc --print sysroot").read()?;
        let libc = Path::new(sysroot.trim())
            .join(format!("lib/rustlib/{STATIC}/lib/self-contained/libc.a"));
        let musl = musl_version(&files::bytes(&libc)?)
            .ok_or_else(|| format!("{}: no version of musl", libc.display()))?;
        let part = |name: &str, version: &str, licence: &str| {
            json!({
                "type": "library", "bom-ref": format!("runtime:{name}"), "name": name, "version": version,
                "licenses": [{"expression": licence}],
            })
        };
        Ok(vec![
            part("musl", &musl, "MIT"),
            part("rust-std", version, "MIT OR Apache-2.0"),
        ])
    }
}

/// Reads a line of `cargo tree`: `NAME vVERSION`, and more.
fn listed(line: &str) -> Result<Crate> {
    let mut words = line.split(' ');
    match (
        words.next(),
        words.next().and_then(|word| word.strip_prefix('v')),
    ) {
        (Some(name), Some(version)) => Ok((name.into(), version.into())),
        _ => Err(format!("not a line of cargo tree: {line}").into()),
    }
}

fn reference_of((name, version): &Crate) -> String {
    format!("pkg:cargo/{name}@{version}")
}

fn component(package: &Value, sum: Option<&str>) -> Result<Value> {
    let id = (
        text(package, "name")?.to_owned(),
        text(package, "version")?.to_owned(),
    );
    let mut component = Map::new();
    component.insert("type".into(), "library".into());
    component.insert("bom-ref".into(), reference_of(&id).into());
    component.insert("name".into(), id.0.clone().into());
    component.insert("version".into(), id.1.clone().into());
    let licence = package["license"]
        .as_str()
        .ok_or_else(|| format!("{} has no licence", id.0))?;
    component.insert(
        "licenses".into(),
        json!([{"expression": expression(licence)}]),
    );
    // Those of this repository are not from a registry.
    if let Some(sum) = sum {
        component.insert("purl".into(), reference_of(&id).into());
        component.insert("hashes".into(), json!([{"alg": "SHA-256", "content": sum}]));
    }
    Ok(component.into())
}

/// Returns a licence as SPDX has it: older manifests separate alternatives by a slash.
fn expression(licence: &str) -> String {
    let parts: Vec<&str> = licence.split('/').map(str::trim).collect();
    parts.join(" OR ")
}

/// Returns the checksums in a lock file.
fn checksums(lock: &str) -> BTreeMap<Crate, String> {
    let mut found = BTreeMap::new();
    for package in lock.split("[[package]]\n").skip(1) {
        let value = |key: &str| {
            let line = package.lines().find_map(|line| line.strip_prefix(key));
            line.and_then(|rest| rest.strip_prefix(" = \"")?.strip_suffix('"'))
        };
        if let (Some(name), Some(version), Some(sum)) =
            (value("name"), value("version"), value("checksum"))
        {
            found.insert((name.into(), version.into()), sum.into());
        }
    }
    found
}

/// Finds the version in musl's library: a separate string, between zeros.
fn musl_version(library: &[u8]) -> Option<String> {
    let is_version = |text: &&[u8]| {
        text.starts_with(b"1.")
            && text.iter().filter(|byte| **byte == b'.').count() == 2
            && text
                .iter()
                .all(|byte| byte.is_ascii_digit() || *byte == b'.')
    };
    let found = library.split(|byte| *byte == 0).find(is_version)?;
    String::from_utf8(found.to_vec()).ok()
}

fn list(value: &Value) -> Result<&Vec<Value>> {
    Ok(value.as_array().ok_or("cargo metadata: not a list")?)
}

fn text<'a>(value: &'a Value, key: &str) -> Result<&'a str> {
    let text = value[key].as_str();
    text.ok_or_else(|| format!("cargo metadata: no `{key}`").into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slashes_of_old_licences_are_alternatives() {
        assert_eq!(expression("MIT/Apache-2.0"), "MIT OR Apache-2.0");
        assert_eq!(expression("Apache-2.0 / MIT"), "Apache-2.0 OR MIT");
        assert_eq!(
            expression("(MIT OR Apache-2.0) AND Unicode-3.0"),
            "(MIT OR Apache-2.0) AND Unicode-3.0"
        );
    }

    #[test]
    fn lines_of_the_tree_have_a_name_and_a_version() {
        let expected = ("serde_derive".to_owned(), "1.0.2".to_owned());
        assert_eq!(
            listed("serde_derive v1.0.2 (proc-macro) (*)").unwrap(),
            expected
        );
        assert!(listed("[build-dependencies]").is_err());
    }

    #[test]
    fn checksums_are_those_of_their_packages() {
        let lock = "version = 4\n\n[[package]]\nname = \"a\"\nversion = \"1.0.0\"\n\n[[package]]\nname = \"b\"\nversion = \"2.0.0\"\nchecksum = \"00ff\"\ndependencies = [\n \"a\",\n]\n";
        let found = checksums(lock);
        assert_eq!(found.len(), 1);
        assert_eq!(found[&("b".to_owned(), "2.0.0".to_owned())], "00ff");
    }

    #[test]
    fn version_of_musl_is_a_separate_string() {
        assert_eq!(
            musl_version(b"x\x001.2\x001.2.5\0y").as_deref(),
            Some("1.2.5")
        );
        assert_eq!(musl_version(b"x1.2.5y\0"), None);
    }
}
