//! ROS parameters: from `-p NAME:=VALUE` and from YAML files.

use crate::names::Names;
use serde_norway::Value;
use std::collections::BTreeMap;

/// The given parameters, each with its source.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Parameters {
    values: BTreeMap<String, (Value, String)>,
}

/// The reason why a parameter is refused.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum ParameterError {
    /// The text is not an assignment.
    #[error("the parameter `{0}` has no `:=`: write -p NAME:=VALUE, such as -p max_speed:=0.3")]
    NotAnAssignment(String),
    /// The value is not a scalar.
    #[error(
        "{place}: the parameter `{name}` is not a single value: expected true, false, a number or a text"
    )]
    NotAScalar {
        /// The parameter.
        name: String,
        /// The source: the file or the argument.
        place: String,
    },
    /// The text is not YAML.
    #[error("{place}: {error}")]
    Yaml {
        /// The source: the file or the argument.
        place: String,
        /// What the YAML parser reports, with line and column.
        error: String,
    },
    /// The YAML has another structure.
    #[error(
        "{place}: no parameters for the node `{node}`: expected `{short}:`, in it `ros__parameters:`, and in that the parameters"
    )]
    NotForThisNode {
        /// The file.
        place: String,
        /// The node's full name.
        node: String,
        /// The node's name.
        short: String,
    },
}

impl Parameters {
    /// Adds an assignment `NAME:=VALUE` or `NODE:NAME:=VALUE`. An assignment for another node is ignored.
    ///
    /// # Errors
    /// [`ParameterError`]
    pub fn assign(&mut self, assignment: &str, names: &Names) -> Result<(), ParameterError> {
        let parts = assignment.split_once(":=");
        let (left, text) =
            parts.ok_or_else(|| ParameterError::NotAnAssignment(assignment.into()))?;
        let (node, name) = left
            .rsplit_once(':')
            .map_or((None, left), |(node, name)| (Some(node), name));
        if node.is_some_and(|node| !is_for(node, names)) {
            return Ok(());
        }
        let place = format!("-p {assignment}");
        self.set(name, &yaml(text, &place)?, &place)
    }

    /// Adds a parameter file. Sections of other nodes are ignored; a file without a section for this node is refused.
    ///
    /// # Errors
    /// [`ParameterError`]
    pub fn read(&mut self, text: &str, place: &str, names: &Names) -> Result<(), ParameterError> {
        let yaml = yaml(text, place)?;
        let before = self.values.len();
        if !self.sections(&yaml, "", place, names)? && before == self.values.len() {
            return Err(ParameterError::NotForThisNode {
                place: place.into(),
                node: names.full_node(),
                short: names.node.clone(),
            });
        }
        Ok(())
    }

    /// Searches `ros__parameters` below the names of nodes. Returns `true` if a section is for this node.
    fn sections(
        &mut self,
        yaml: &Value,
        path: &str,
        place: &str,
        names: &Names,
    ) -> Result<bool, ParameterError> {
        let Value::Mapping(map) = yaml else {
            return Ok(false);
        };
        let mut found = false;
        for (key, value) in map {
            let key = key.as_str().unwrap_or_default();
            if key == "ros__parameters" {
                if is_for(path, names) {
                    found = true;
                    self.section(value, "", place)?;
                }
            } else {
                let inner = match path {
                    "" => key.to_owned(),
                    _ => format!(
                        "{}/{}",
                        path.trim_end_matches('/'),
                        key.trim_start_matches('/')
                    ),
                };
                found |= self.sections(value, &inner, place, names)?;
            }
        }
        Ok(found)
    }

    fn section(&mut self, yaml: &Value, prefix: &str, place: &str) -> Result<(), ParameterError> {
        match yaml {
            Value::Mapping(map) => {
                for (key, value) in map {
                    let key = key.as_str().unwrap_or_default();
                    let name = match prefix {
                        "" => key.to_owned(),
                        _ => format!("{prefix}.{key}"),
                    };
                    self.section(value, &name, place)?;
                }
                Ok(())
            }
            // `ros__parameters:` without parameters.
            Value::Null if prefix.is_empty() => Ok(()),
            _ => self.set(prefix, yaml, place),
        }
    }

    fn set(&mut self, name: &str, value: &Value, place: &str) -> Result<(), ParameterError> {
        // A value with a tag of YAML (`!cm 3`) is refused, since nothing reads the tag.
        if !matches!(value, Value::Bool(_) | Value::Number(_) | Value::String(_)) {
            return Err(ParameterError::NotAScalar {
                name: name.into(),
                place: place.into(),
            });
        }
        self.values
            .insert(name.to_owned(), (value.clone(), place.to_owned()));
        Ok(())
    }

    /// Returns a parameter.
    #[must_use]
    pub fn get(&self, name: &str) -> Option<&Value> {
        self.values.get(name).map(|(value, _)| value)
    }

    /// Returns the source of a parameter: the file, or the argument.
    #[must_use]
    pub fn place(&self, name: &str) -> &str {
        self.values.get(name).map_or("", |(_, place)| place)
    }

    /// Returns the names of all given parameters.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.values.keys().map(String::as_str)
    }
}

fn yaml(text: &str, place: &str) -> Result<Value, ParameterError> {
    serde_norway::from_str(text).map_err(|error| ParameterError::Yaml {
        place: place.into(),
        error: error.to_string(),
    })
}

/// Returns `true` if the name of a node in a parameter file or an assignment is this node's name or a wildcard.
fn is_for(node: &str, names: &Names) -> bool {
    let bare = node.trim_start_matches('/');
    let full = names.full_node();
    let is_everywhere =
        ["**", "*"].contains(&bare) || bare.strip_prefix("**/") == Some(&names.node);
    is_everywhere
        || bare == full.trim_start_matches('/')
        || (bare == names.node && !node.contains('/'))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names() -> Names {
        Names::new(&["__ns:=/robot1".into()]).unwrap()
    }

    #[test]
    fn parameters_of_this_node_are_read() {
        let text = "\
/**:
  ros__parameters:
    inflation: 2
robot1:
  posegate:
    ros__parameters: { max_speed: 0.3, frame_id: world }
other:
  ros__parameters: { max_speed: 9.0 }
";
        let mut given = Parameters::default();
        given.read(text, "p.yaml", &names()).unwrap();
        given.assign("use_odometry:=true", &names()).unwrap();
        given.assign("other:max_speed:=7.0", &names()).unwrap();
        given.assign("posegate:inflation:=3.5", &names()).unwrap();
        assert_eq!(given.get("max_speed"), Some(&Value::from(0.3)));
        assert_eq!(given.get("inflation"), Some(&Value::from(3.5)));
        assert_eq!(given.get("frame_id"), Some(&Value::from("world")));
        assert_eq!(given.get("use_odometry"), Some(&Value::from(true)));
        assert_eq!(
            (given.place("max_speed"), given.names().count()),
            ("p.yaml", 4)
        );
    }

    #[test]
    fn files_without_this_node_are_refused() {
        for text in [
            "",
            "max_speed: 0.3",
            "gate:\n  ros__parameters: { a: 1 }",
            "- 1",
        ] {
            let read = Parameters::default().read(text, "p.yaml", &names());
            assert!(
                matches!(read, Err(ParameterError::NotForThisNode { .. })),
                "{text}"
            );
        }
        let broken = Parameters::default().read("a: [", "p.yaml", &names());
        assert!(matches!(broken, Err(ParameterError::Yaml { .. })));
        let list = Parameters::default().read(
            "posegate:\n  ros__parameters: { a: [1] }",
            "p.yaml",
            &names(),
        );
        assert!(matches!(list, Err(ParameterError::NotAScalar { .. })));
        let tagged = Parameters::default().assign("max_speed:=!cm 3", &names());
        assert!(matches!(tagged, Err(ParameterError::NotAScalar { .. })));
    }
}
