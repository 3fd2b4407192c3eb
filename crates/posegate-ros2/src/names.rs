//! The names of the node, its topics and its services, with remapping.

use crate::poses::PoseType;

/// The name of the node if no rule changes it.
const NODE: &str = "posegate";

/// The names in use, each absolute. Names are relative by default: `__ns:=/robot1` moves them all but `/diagnostics`
/// and `/tf`, which are absolute by convention.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Names {
    /// The namespace, `/` or `/robot1`.
    pub namespace: String,
    /// The name of the node without its namespace.
    pub node: String,
    /// Subscribed: the poses, of the type of the parameter `pose_type`.
    pub pose: String,
    /// Subscribed instead of `pose` if poses come from transforms: `tf2_msgs/msg/TFMessage`.
    pub tf: String,
    /// Subscribed if odometry is used: `nav_msgs/msg/Odometry`.
    pub odom: String,
    /// Subscribed if detections are used: `apriltag_msgs/msg/AprilTagDetectionArray`.
    pub detections: String,
    /// Subscribed if detections are used: `sensor_msgs/msg/CameraInfo`.
    pub camera_info: String,
    /// Subscribed if the node has several tables: `std_msgs/msg/String`, the task that is asked for.
    pub task: String,
    /// Published: `diagnostic_msgs/msg/DiagnosticArray`, the fail-safe permit.
    pub permission: String,
    /// Published: `std_msgs/msg/Bool`, for display only.
    pub permit: String,
    /// Published: `diagnostic_msgs/msg/DiagnosticArray`.
    pub diagnostics: String,
    /// Published: `visualization_msgs/msg/MarkerArray`.
    pub markers: String,
    /// Service: `std_srvs/srv/Trigger`.
    pub reset: String,
    /// Service: `std_srvs/srv/Trigger`.
    pub explain: String,
}

/// The reason why a rule or a name is refused.
#[derive(Debug, thiserror::Error, PartialEq, Eq)]
pub enum NameError {
    /// The text is not a rule.
    #[error("the remapping `{0}` has no `:=`: write -r FROM:=TO, such as -r pose:=/amcl_pose")]
    NotARule(String),
    /// The rule is for a name that the node does not have.
    #[error(
        "the remapping `{rule}` changes no name of this node: expected pose, __node, __ns or one of its names, which are {names}"
    )]
    NoSuchName {
        /// The rule.
        rule: String,
        /// The names of the node in its namespace, before remapping.
        names: String,
    },
    /// The text is not a ROS name.
    #[error(
        "`{0}` is not a name of ROS: expected letters, digits and underscores between single slashes, and no digit after a slash"
    )]
    Invalid(String),
}

impl Names {
    /// Returns the default names, changed by rules `FROM:=TO` as ROS applies them: `FROM` and `TO` without a leading
    /// slash are in the namespace, and the first rule that matches a name counts. `NODE:FROM:=TO` is for the node of
    /// that name alone.
    ///
    /// # Errors
    /// [`NameError`]. A rule that changes nothing is refused, because it is most likely misspelt.
    pub fn new(rules: &[String]) -> Result<Self, NameError> {
        let mut split = Vec::new();
        for rule in rules {
            let (from, to) = rule
                .split_once(":=")
                .ok_or_else(|| NameError::NotARule(rule.clone()))?;
            let (node, from) = from
                .rsplit_once(':')
                .map_or((None, from), |(node, from)| (Some(node), from));
            split.push((node, from, to, rule));
        }
        let first = |names: [&str; 2], default: &str| {
            let is_first = |(node, from, ..): &&(Option<&str>, &str, &str, &String)| {
                node.is_none_or(|node| node == NODE) && names.contains(from)
            };
            let rule = split.iter().find(is_first);
            rule.map_or(default.to_owned(), |(.., to, _)| (*to).to_owned())
        };
        let (namespace, node) = (first(["__ns"; 2], "/"), first(["__node", "__name"], NODE));
        if !(namespace == "/" || is_path(&namespace)) {
            return Err(NameError::Invalid(namespace));
        }
        if !is_token(&node) {
            return Err(NameError::Invalid(node));
        }
        let base = namespace.trim_end_matches('/');
        let absolute = |name: &str| match name.strip_prefix("~/") {
            Some(rest) => format!("{base}/{node}/{rest}"),
            None if name.starts_with('/') => name.to_owned(),
            None => format!("{base}/{name}"),
        };
        split.retain(|(of, from, ..)| {
            let is_ours = of.is_none_or(|of| of == NODE || of == node);
            // Launch files move both topics of transforms at every node.
            is_ours && !["__ns", "__node", "__name", "/tf_static"].contains(from)
        });
        let mut unused = vec![true; split.len()];
        let mut defaults = Vec::new();
        let mut name = |default: &str| {
            let default = absolute(default);
            let short = match default.rsplit_once('/') {
                Some((_, "amcl_pose")) => absolute("pose"),
                Some((_, short)) => absolute(short),
                None => default.clone(),
            };
            let mut found = None;
            for ((_, from, to, _), unused) in split.iter().zip(&mut unused) {
                if [&default, &short].contains(&&absolute(from)) {
                    *unused = false;
                    found = found.or(Some(*to));
                }
            }
            let name = found.map_or(default.clone(), absolute);
            defaults.push(default);
            match is_path(&name) {
                true => Ok(name),
                false => Err(NameError::Invalid(name)),
            }
        };
        let names = Self {
            pose: name("amcl_pose")?,
            tf: name("/tf")?,
            odom: name("odom")?,
            detections: name("detections")?,
            camera_info: name("camera_info")?,
            task: name("posegate_task")?,
            permission: name("posegate/permission")?,
            permit: name("posegate/permit")?,
            diagnostics: name("/diagnostics")?,
            markers: name("posegate/markers")?,
            reset: name("posegate/reset")?,
            explain: name("posegate/explain")?,
            namespace: namespace.clone(),
            node: node.clone(),
        };
        match split.iter().zip(unused).find(|(_, unused)| *unused) {
            None => Ok(names),
            Some(((.., rule), _)) => Err(NameError::NoSuchName {
                rule: (*rule).clone(),
                names: defaults.join(", "),
            }),
        }
    }

    /// Returns the topic of poses of a type.
    #[must_use]
    pub fn of_poses(&self, kind: PoseType) -> &str {
        match kind {
            PoseType::Transforms => &self.tf,
            _ => &self.pose,
        }
    }

    /// Returns the name of the node with its namespace.
    #[must_use]
    pub fn full_node(&self) -> String {
        format!("{}/{}", self.namespace.trim_end_matches('/'), self.node)
    }

    /// Returns a warning if a topic of poses is not in the namespace of the node: the poses of another robot would give this one a permit.
    /// Transforms have one topic for all robots.
    #[must_use]
    pub fn warning(&self, topic: &str) -> Option<String> {
        let space = format!("{}/", self.namespace.trim_end_matches('/'));
        (!topic.starts_with(&space) && topic != "/tf").then(|| {
            format!(
                "{topic} is not in the namespace {}: poses of another robot would give this one a permit",
                self.namespace
            )
        })
    }
}

fn is_path(name: &str) -> bool {
    name.strip_prefix('/')
        .is_some_and(|rest| rest.split('/').all(is_token))
}

fn is_token(token: &str) -> bool {
    let is_letter = |c: char| c.is_ascii_alphanumeric() || c == '_';
    token.chars().all(is_letter)
        && token.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
        && !token.contains("__")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(rules: &[&str]) -> Result<Names, NameError> {
        let rules: Vec<String> = rules.iter().map(|rule| (*rule).to_owned()).collect();
        Names::new(&rules)
    }

    #[test]
    fn names_are_relative_to_the_namespace() {
        let plain = names(&[]).unwrap();
        assert_eq!(
            (plain.pose.as_str(), plain.odom.as_str()),
            ("/amcl_pose", "/odom")
        );
        assert_eq!(plain.permission, "/posegate/permission");
        let moved = names(&["__ns:=/robot1"]).unwrap();
        assert_eq!(moved.full_node(), "/robot1/posegate");
        assert_eq!([&moved.diagnostics, &moved.tf], ["/diagnostics", "/tf"]);
        for name in [
            &moved.pose,
            &moved.odom,
            &moved.detections,
            &moved.camera_info,
            &moved.task,
            &moved.permission,
            &moved.permit,
            &moved.markers,
            &moved.reset,
            &moved.explain,
        ] {
            assert!(name.starts_with("/robot1/"), "{name}");
        }
    }

    #[test]
    fn poses_of_another_namespace_are_warned_of() {
        for (rules, is_warned) in [
            (&["__ns:=/robot2"][..], false),
            (&["__ns:=/robot2", "pose:=/robot1/amcl_pose"], true),
            (&["__ns:=/robot2", "pose:=/amcl_pose"], true),
            (&["__ns:=/robot2", "pose:=/robot22/amcl_pose"], true),
            (&["__ns:=/robot2", "pose:=filter/pose"], false),
            (&["pose:=/robot1/amcl_pose"], false),
        ] {
            let names = names(rules).unwrap();
            assert_eq!(names.warning(&names.pose).is_some(), is_warned, "{rules:?}");
            assert_eq!(names.warning(&names.tf), None);
        }
    }

    #[test]
    fn rules_match_with_and_without_a_leading_slash() {
        let given = names(&[
            "pose:=filter/pose",
            "__ns:=/robot1",
            "__node:=dock_gate",
            "posegate/permission:=~/permission",
            "/robot1/camera_info:=/front/camera_info",
            "other:odom:=/wrong",
            "posegate:odom:=wheels",
            "dock_gate:permit:=/shown",
            "odom:=/later",
            "/diagnostics:=diagnostics",
        ]);
        let given = given.unwrap();
        assert_eq!(given.pose, "/robot1/filter/pose");
        assert_eq!(given.odom, "/robot1/wheels");
        assert_eq!(given.detections, "/robot1/detections");
        assert_eq!(given.camera_info, "/front/camera_info");
        assert_eq!(given.permit, "/shown");
        assert_eq!(given.permission, "/robot1/dock_gate/permission");
        assert_eq!(given.diagnostics, "/robot1/diagnostics");
        assert_eq!(given.full_node(), "/robot1/dock_gate");
        for from in ["pose", "amcl_pose", "/amcl_pose", "posegate:amcl_pose"] {
            let given = names(&[&format!("{from}:=/filter/pose")]).unwrap();
            assert_eq!(given.pose, "/filter/pose", "{from}");
        }
    }

    #[test]
    fn misspelt_rules_are_refused() {
        assert!(matches!(names(&["pose=/x"]), Err(NameError::NotARule(_))));
        for rules in [
            &["poses:=/x"][..],
            // The name of another robot, as in ROS.
            &["__ns:=/robot1", "/amcl_pose:=/x"],
        ] {
            let refused = names(rules);
            assert!(
                matches!(refused, Err(NameError::NoSuchName { .. })),
                "{refused:?}"
            );
        }
        for bad in [
            "pose:=/a//b",
            "pose:=/1a",
            "pose:=",
            "pose:=/a b",
            "__node:=a/b",
            "__ns:=robot1",
            "pose:=/a__b",
        ] {
            assert!(matches!(names(&[bad]), Err(NameError::Invalid(_))), "{bad}");
        }
    }
}
