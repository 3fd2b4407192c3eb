//! The names of the node, its topics and its services, with remapping.

/// The names in use, each absolute.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Names {
    /// The namespace, `/` or `/robot1`.
    pub namespace: String,
    /// The name of the node without its namespace.
    pub node: String,
    /// Subscribed: `geometry_msgs/msg/PoseWithCovarianceStamped`.
    pub pose: String,
    /// Subscribed if odometry is used: `nav_msgs/msg/Odometry`.
    pub odom: String,
    /// Subscribed if detections are used: `apriltag_msgs/msg/AprilTagDetectionArray`.
    pub detections: String,
    /// Subscribed if detections are used: `sensor_msgs/msg/CameraInfo`.
    pub camera_info: String,
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
        "the remapping `{0}` changes no name of this node: expected one of pose, odom, detections, camera_info, /posegate/permission, /posegate/permit, /diagnostics, /posegate/markers, /posegate/reset, /posegate/explain, __node, __ns"
    )]
    NoSuchName(String),
    /// The text is not a ROS name.
    #[error(
        "`{0}` is not a name of ROS: expected letters, digits and underscores between single slashes, and no digit after a slash"
    )]
    Invalid(String),
}

impl Names {
    /// Returns the default names, changed by rules `FROM:=TO`.
    ///
    /// # Errors
    /// [`NameError`]. A rule that changes nothing is refused, because it is most likely misspelt.
    pub fn new(rules: &[String]) -> Result<Self, NameError> {
        let mut names = Self {
            namespace: "/".into(),
            node: "posegate".into(),
            pose: "/amcl_pose".into(),
            odom: "odom".into(),
            detections: "detections".into(),
            camera_info: "camera_info".into(),
            permission: "/posegate/permission".into(),
            permit: "/posegate/permit".into(),
            diagnostics: "/diagnostics".into(),
            markers: "/posegate/markers".into(),
            reset: "/posegate/reset".into(),
            explain: "/posegate/explain".into(),
        };
        let mut split = Vec::new();
        for rule in rules {
            let (from, to) = rule
                .split_once(":=")
                .ok_or_else(|| NameError::NotARule(rule.clone()))?;
            // `node:name:=other` is for one node of a process, and this process has one.
            let from = from.rsplit(':').next().unwrap_or(from);
            match from {
                "__ns" => names.namespace = to.to_owned(),
                "__node" | "__name" => names.node = to.to_owned(),
                _ => split.push((from, to, rule)),
            }
        }
        for (from, to, rule) in split {
            *names
                .topic(from)
                .ok_or_else(|| NameError::NoSuchName(rule.clone()))? = to.to_owned();
        }
        names.check()
    }

    /// Returns the name that a rule changes: by its short name or its default.
    fn topic(&mut self, from: &str) -> Option<&mut String> {
        Some(match from {
            "pose" | "amcl_pose" | "/amcl_pose" => &mut self.pose,
            "odom" | "/odom" => &mut self.odom,
            "detections" | "/detections" => &mut self.detections,
            "camera_info" | "/camera_info" => &mut self.camera_info,
            "permission" | "/posegate/permission" => &mut self.permission,
            "permit" | "/posegate/permit" => &mut self.permit,
            "diagnostics" | "/diagnostics" => &mut self.diagnostics,
            "markers" | "/posegate/markers" => &mut self.markers,
            "reset" | "/posegate/reset" => &mut self.reset,
            "explain" | "/posegate/explain" => &mut self.explain,
            _ => return None,
        })
    }

    /// Makes every name absolute and checks it.
    fn check(mut self) -> Result<Self, NameError> {
        if !self.namespace.starts_with('/') || !(self.namespace == "/" || is_path(&self.namespace))
        {
            return Err(NameError::Invalid(self.namespace));
        }
        if !is_token(&self.node) {
            return Err(NameError::Invalid(self.node));
        }
        let base = self.namespace.trim_end_matches('/').to_owned();
        let private = format!("{base}/{}", self.node);
        for name in [
            &mut self.pose,
            &mut self.odom,
            &mut self.detections,
            &mut self.camera_info,
            &mut self.permission,
            &mut self.permit,
            &mut self.diagnostics,
            &mut self.markers,
            &mut self.reset,
            &mut self.explain,
        ] {
            if let Some(rest) = name.strip_prefix("~/") {
                *name = format!("{private}/{rest}");
            } else if !name.starts_with('/') {
                *name = format!("{base}/{name}");
            }
            if !is_path(name) {
                return Err(NameError::Invalid(name.clone()));
            }
        }
        Ok(self)
    }

    /// Returns the name of the node with its namespace.
    #[must_use]
    pub fn full_node(&self) -> String {
        format!("{}/{}", self.namespace.trim_end_matches('/'), self.node)
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
    fn names_are_remapped_and_made_absolute() {
        let plain = names(&[]).unwrap();
        assert_eq!(
            (plain.pose.as_str(), plain.odom.as_str()),
            ("/amcl_pose", "/odom")
        );
        assert_eq!(
            (plain.detections.as_str(), plain.camera_info.as_str()),
            ("/detections", "/camera_info")
        );
        let given = names(&[
            "pose:=filter/pose",
            "__ns:=/robot1",
            "__node:=dock_gate",
            "/posegate/permission:=~/permission",
            "camera_info:=/front/camera_info",
        ]);
        let given = given.unwrap();
        assert_eq!(given.pose, "/robot1/filter/pose");
        assert_eq!(given.odom, "/robot1/odom");
        assert_eq!(given.detections, "/robot1/detections");
        assert_eq!(given.camera_info, "/front/camera_info");
        assert_eq!(given.permit, "/posegate/permit");
        assert_eq!(given.permission, "/robot1/dock_gate/permission");
        assert_eq!(given.full_node(), "/robot1/dock_gate");
    }

    #[test]
    fn misspelt_rules_are_refused() {
        assert!(matches!(names(&["pose=/x"]), Err(NameError::NotARule(_))));
        assert!(matches!(
            names(&["poses:=/x"]),
            Err(NameError::NoSuchName(_))
        ));
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
