//! The parameters of the node as the services of `rcl_interfaces` report them. None of them can be set while the node runs: they are settings
//! of the gate, which checks that its settings do not change.

use ros2_client::parameters::{ParameterDescriptor, ParameterValue, raw};
use ros2_client::rcl_interfaces::{ListParametersRequest, ListParametersResult};
use serde_norway::Value;
use std::collections::BTreeMap;

/// The parameters that a node reports, by name, with their values as given or by default.
#[derive(Clone, Debug, Default)]
pub struct ReportedParameters(pub BTreeMap<&'static str, Value>);

impl ReportedParameters {
    /// Leaves out a parameter.
    pub fn leave_out(&mut self, name: &str) {
        self.0.remove(name);
    }

    /// Returns the value of each name; "not set" for an unknown one.
    #[must_use]
    pub fn values(&self, names: &[String]) -> Vec<raw::ParameterValue> {
        let values = names.iter().map(|name| self.value(name).into());
        values.collect()
    }

    /// Returns the type of each name, as [`raw::ParameterType`] numbers them.
    #[must_use]
    pub fn types(&self, names: &[String]) -> Vec<u8> {
        let types = names
            .iter()
            .map(|name| self.value(name).to_parameter_type() as u8);
        types.collect()
    }

    /// Returns the description of each name.
    #[must_use]
    pub fn descriptors(&self, names: &[String]) -> Vec<raw::ParameterDescriptor> {
        let describe = |name: &String| ParameterDescriptor {
            param_type: self.value(name).to_parameter_type(),
            description: "docs/for-ros.md has its meaning".into(),
            // It is read only.
            ..ParameterDescriptor::unknown(name)
        };
        names.iter().map(|name| describe(name).into()).collect()
    }

    fn value(&self, name: &str) -> ParameterValue {
        match self.0.get(name) {
            Some(Value::Bool(value)) => ParameterValue::Boolean(*value),
            Some(Value::String(text)) => ParameterValue::String(text.clone()),
            Some(Value::Number(number)) => match number.as_i64() {
                Some(whole) => ParameterValue::Integer(whole),
                None => ParameterValue::Double(number.as_f64().unwrap_or_default()),
            },
            _ => ParameterValue::NotSet,
        }
    }

    /// Returns the names below the requested prefixes. (Names of this node have no separator, so each depth has them all.)
    #[must_use]
    pub fn list(&self, request: &ListParametersRequest) -> ListParametersResult {
        let is_asked = |name: &&str| {
            request.prefixes.is_empty() || request.prefixes.iter().any(|prefix| prefix == name)
        };
        let names = self.0.keys().copied().filter(is_asked);
        ListParametersResult {
            names: names.map(str::to_owned).collect(),
            prefixes: Vec::new(),
        }
    }
}

/// Returns the refusal of new values.
#[must_use]
pub fn refused(wanted: &[raw::Parameter]) -> raw::SetParametersResult {
    let names: Vec<&str> = wanted.iter().map(|given| given.name.as_str()).collect();
    let names = names.join(", ");
    Err(format!(
        "{names} cannot change while the node runs: start it again with the new value"
    ))
    .into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parameters_are_listed_and_described_with_their_types() {
        let reported = ReportedParameters(BTreeMap::from([
            ("frame_id", Value::from("map")),
            ("max_speed", Value::from(0.3)),
            ("cycle_ms", Value::from(20)),
            ("markers", Value::from(true)),
        ]));
        let listed = reported.list(&ListParametersRequest {
            prefixes: Vec::new(),
            depth: 0,
        });
        assert_eq!(
            listed.names,
            ["cycle_ms", "frame_id", "markers", "max_speed"]
        );
        let mut names = listed.names;
        names.push("unknown".into());
        assert_eq!(reported.types(&names), [2, 4, 1, 3, 0]);
        let values = reported.values(&names);
        assert_eq!(values[1].string_value, "map");
        assert_eq!(values[3].double_value, 0.3);
        assert!(
            reported
                .descriptors(&names)
                .iter()
                .all(|each| each.read_only)
        );
        let wanted = raw::Parameter {
            name: "max_speed".into(),
            value: ParameterValue::Double(0.1).into(),
        };
        assert!(!refused(&[wanted]).successful);
    }
}
