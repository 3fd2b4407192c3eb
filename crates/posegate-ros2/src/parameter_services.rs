//! The parameters of the node as the services of `rcl_interfaces` report them. None of them can be set while the node runs: they are settings
//! of the gate, which checks that its settings do not change.

use ros2_client::parameters::raw::{
    Parameter, ParameterDescriptor, ParameterType, ParameterValue, SetParametersResult,
};
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
    pub fn values(&self, names: &[String]) -> Vec<ParameterValue> {
        let value = |name: &String| raw(self.0.get(name.as_str()));
        names.iter().map(value).collect()
    }

    /// Returns the type of each name, as [`ParameterType`] numbers them.
    #[must_use]
    pub fn types(&self, names: &[String]) -> Vec<u8> {
        let values = self.values(names);
        values.into_iter().map(|value| value.ptype).collect()
    }

    /// Returns the description of each name.
    #[must_use]
    pub fn descriptors(&self, names: &[String]) -> Vec<ParameterDescriptor> {
        let describe = |(name, ptype): (&String, u8)| ParameterDescriptor {
            name: name.clone(),
            r#type: ptype,
            description: "docs/for-ros.md has its meaning".into(),
            additional_constraints: String::new(),
            read_only: true,
            dynamic_typing: false,
            floating_point_range: Vec::new(),
            integer_range: Vec::new(),
        };
        names.iter().zip(self.types(names)).map(describe).collect()
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
pub fn refused(wanted: &[Parameter]) -> SetParametersResult {
    let names: Vec<&str> = wanted.iter().map(|given| given.name.as_str()).collect();
    SetParametersResult {
        successful: false,
        reason: format!(
            "{} cannot change while the node runs: start it again with the new value",
            names.join(", ")
        ),
    }
}

fn raw(value: Option<&Value>) -> ParameterValue {
    let mut raw = ParameterValue {
        ptype: ParameterType::NOT_SET,
        boolean_value: false,
        int_value: 0,
        double_value: 0.0,
        string_value: String::new(),
        byte_array: Vec::new(),
        bool_array: Vec::new(),
        int_array: Vec::new(),
        double_array: Vec::new(),
        string_array: Vec::new(),
    };
    match value {
        Some(Value::Bool(value)) => {
            raw.ptype = ParameterType::BOOL;
            raw.boolean_value = *value;
        }
        Some(Value::String(value)) => {
            raw.ptype = ParameterType::STRING;
            raw.string_value.clone_from(value);
        }
        Some(Value::Number(number)) => match number.as_i64() {
            Some(value) => {
                raw.ptype = ParameterType::INTEGER;
                raw.int_value = value;
            }
            None => {
                raw.ptype = ParameterType::DOUBLE;
                raw.double_value = number.as_f64().unwrap_or_default();
            }
        },
        _ => {}
    }
    raw
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
        let wanted = Parameter {
            name: "max_speed".into(),
            value: raw(Some(&Value::from(0.1))),
        };
        assert!(!refused(&[wanted]).successful);
    }
}
