//! Messages of the topics that are wanted, from any kind of bag, as items of a recording.
//!
//! Entry point: [`Intake`]. A storage announces its topics and passes on every message; the intake decodes, counts and refuses.

use super::body::{Body, BodyFrames};
use super::diagnostics::{ReaderDiagnostics, SkipReason, Skipped};
use super::kind::{Format, format_of};
use super::message::{Content, Encoding, Kind, Message, decoded};
use super::transforms::{Composer, FrameNames, Pose, Transform};
use super::whole::Unpacked;
use super::{Exact, Item, RecordingError, Sample, TruePose};
use crate::mcap::chunk::LARGEST;
use posegate::report::{Heading, PoseEstimate, ros::PoseWithCovariance};
use posegate::set::Uncertainty;
use std::collections::BTreeMap;
use std::io::Read;
use std::sync::Arc;

/// The most bytes of schemas and channels that are stored.
pub(super) const MOST_NAMED: usize = 1 << 25;
/// The most pairs of frames of transforms that are counted by name.
const MOST_EDGES: usize = 64;

/// The role of a topic.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Estimates, from the source with this number.
    Estimates(u8),
    /// The true poses.
    Truth,
    /// The odometry: poses in its own frame, passed on as [`Item::Truth`].
    Odometry,
    /// Static transforms, which give frames their places on the robot.
    Static,
}

/// A topic to read.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// The topic's name.
    pub topic: String,
    /// The topic's role.
    pub role: Role,
}

/// The use of a channel's messages.
enum Use {
    Read {
        kind: Kind,
        role: Role,
        encoding: Encoding,
    },
    Skip,
}

struct Channel {
    topic: Arc<str>,
    used: Use,
}

/// A message type.
pub(super) struct Schema {
    pub name: String,
    pub encoding: String,
    /// Empty if the writer left it out.
    pub definition: String,
    /// `true` if the type has the fields of a supported type. Checked at its first topic only, since it
    /// takes time.
    pub has_fields: Option<bool>,
}

/// The state while the messages of a recording are read.
pub(super) struct Intake {
    wanted: Vec<Wanted>,
    schemas: BTreeMap<u32, Schema>,
    channels: BTreeMap<u32, Channel>,
    /// Bytes of the schemas and channels that are stored.
    kept: usize,
    frame: Option<Arc<str>>,
    child: Option<Arc<str>>,
    /// The transforms of each topic that has them.
    composers: BTreeMap<String, Composer>,
    pub names: FrameNames,
    pub body: BodyFrames,
    pub diagnostics: ReaderDiagnostics,
}

/// Schemas and channels of more than [`MOST_NAMED`] bytes.
#[derive(Debug, thiserror::Error)]
#[error("schemas and topics of more than {MOST_NAMED} bytes in all")]
pub(super) struct TooMuch;

impl Intake {
    pub fn new(wanted: &[Wanted]) -> Self {
        Self {
            wanted: wanted.to_vec(),
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            kept: 0,
            frame: None,
            child: None,
            composers: BTreeMap::new(),
            names: FrameNames::default(),
            body: BodyFrames::default(),
            diagnostics: ReaderDiagnostics::default(),
        }
    }

    /// Forgets the numbers of schemas and channels: the next file has its own.
    pub fn next_file(&mut self) {
        self.schemas.clear();
        self.channels.clear();
        self.kept = 0;
    }

    /// Returns the number of bytes of schemas and channels that are stored.
    #[cfg(test)]
    pub const fn kept(&self) -> usize {
        self.kept
    }

    /// Stores a message type, unless the number is known.
    pub fn schema(&mut self, id: u32, bytes: usize, schema: Schema) -> Result<(), TooMuch> {
        if !self.schemas.contains_key(&id) {
            self.keep(bytes)?;
            self.schemas.insert(id, schema);
        }
        Ok(())
    }

    /// Stores a topic, unless the number is known.
    pub fn channel(
        &mut self,
        id: u32,
        bytes: usize,
        topic: &str,
        schema: u32,
        encoding: &str,
    ) -> Result<(), TooMuch> {
        if !self.channels.contains_key(&id) {
            self.keep(bytes)?;
            self.open(id, topic, schema, encoding);
        }
        Ok(())
    }

    /// Counts the text of a record that will be stored, if the limit allows.
    fn keep(&mut self, bytes: usize) -> Result<(), TooMuch> {
        let kept = self.kept + bytes;
        if kept > MOST_NAMED {
            return Err(TooMuch);
        }
        self.kept = kept;
        Ok(())
    }

    /// Returns `true` if the messages of a channel are decoded.
    pub fn reads(&self, channel: u32) -> bool {
        let channel = self.channels.get(&channel);
        channel.is_some_and(|channel| matches!(channel.used, Use::Read { .. }))
    }

    fn open(&mut self, id: u32, topic: &str, schema: u32, encoding: &str) {
        let mut schema = self.schemas.get_mut(&schema);
        let wanted = self.wanted.iter().find(|w| w.topic == topic);
        let used = match (wanted, schema.as_deref_mut()) {
            (None, _) => Err(SkipReason::NotWanted),
            (Some(_), None) => Err(SkipReason::NoSchema),
            (Some(wanted), Some(schema)) => use_of(schema, encoding, wanted.role),
        };
        let used = match used {
            Ok(used) => {
                self.diagnostics.read.entry(topic.into()).or_insert(0);
                used
            }
            Err(why) => {
                let schema = schema.as_deref();
                let of_schema = schema.map_or("", |schema| schema.encoding.as_str());
                let skipped = Skipped {
                    schema: schema.map_or(String::new(), |schema| schema.name.clone()),
                    encoding: format!("{of_schema}, {encoding}"),
                    why,
                    messages: 0,
                };
                let skips = &mut self.diagnostics.skipped;
                skips.entry(topic.into()).or_insert(skipped);
                Use::Skip
            }
        };
        let topic = topic.into();
        self.channels.insert(id, Channel { topic, used });
    }

    /// Takes a message of a channel.
    ///
    /// # Errors
    /// [`RecordingError::ChildFrame`] if it has the pose of a frame that is not known.
    pub fn message(
        &mut self,
        number: u32,
        logged_ns: i64,
        data: &[u8],
    ) -> Result<Option<Item>, RecordingError> {
        self.diagnostics.message_bytes += data.len() as u64;
        let Some(channel) = self.channels.get(&number) else {
            self.undecodable(|| format!("a message of channel {number}, which was not announced"));
            return Ok(None);
        };
        let Use::Read {
            kind,
            role,
            encoding,
        } = channel.used
        else {
            if let Some(skipped) = self.diagnostics.skipped.get_mut(&*channel.topic) {
                skipped.messages += 1;
            }
            return Ok(None);
        };
        if let Some(count) = self.diagnostics.read.get_mut(&*channel.topic) {
            *count += 1;
        }
        let topic = channel.topic.clone();
        // rosbag2 may compress each message by itself. No message begins like a frame.
        let mut unpacked = Vec::new();
        let mut data = data;
        if encoding == Encoding::Cdr && format_of(data) == Format::Zstd {
            let longest = LARGEST as u64;
            let read = Unpacked::new(data).take(longest).read_to_end(&mut unpacked);
            if let Err(why) = read {
                self.undecodable(|| format!("{topic}: {why}"));
                return Ok(None);
            }
            data = &unpacked;
        }
        match decoded(kind, encoding, data) {
            Ok(message) => self.item(&topic, message, role, logged_ns),
            Err(why) => {
                self.undecodable(|| format!("{topic}: {why}"));
                Ok(None)
            }
        }
    }

    fn undecodable(&mut self, words: impl FnOnce() -> String) {
        self.diagnostics.undecodable += 1;
        if self.diagnostics.first_undecodable.is_none() {
            self.diagnostics.first_undecodable = Some(words());
        }
    }

    /// Returns the newest pose of a message of transforms: that of the robot in the world, or in the odometry's frame.
    fn composed(&mut self, topic: &str, transforms: &[Transform], role: Role) -> Option<Message> {
        if !self.composers.contains_key(topic) {
            let composer = Composer::new(self.names.clone());
            self.composers.insert(topic.into(), composer);
        }
        let composer = self.composers.get_mut(topic)?;
        let mut newest: Option<(i64, String, Pose)> = None;
        for transform in transforms {
            let edge = (transform.parent.clone(), transform.child.clone());
            let named = &mut self.diagnostics.transforms;
            if named.len() < MOST_EDGES || named.contains_key(&edge) {
                *named.entry(edge).or_insert(0) += 1;
            }
            let found = match role {
                Role::Odometry => composer
                    .is_odometry(transform)
                    .then(|| (transform.stamp_ns, transform.parent.clone(), transform.pose)),
                _ => composer
                    .add(transform)
                    .map(|(stamp_ns, pose)| (stamp_ns, composer.world().into(), pose)),
            };
            newest = found.or(newest);
        }
        newest.map(|(stamp_ns, frame, pose)| Message {
            stamp_ns,
            frame,
            child: composer.base().map(Into::into),
            content: Content::Pose {
                pose,
                covariance: None,
            },
        })
    }

    /// Returns the item of a message: its pose is that of the robot's base, relative to the site's origin.
    ///
    /// # Errors
    /// [`RecordingError`] if it has the pose of a frame that is not known, or with too little of its covariance.
    pub fn item(
        &mut self,
        topic: &str,
        mut message: Message,
        role: Role,
        logged_ns: i64,
    ) -> Result<Option<Item>, RecordingError> {
        let mut is_composed = false;
        if let Content::Transforms(transforms) = &message.content {
            if role == Role::Static {
                for transform in transforms {
                    self.body.note_static(transform);
                }
                return Ok(None);
            }
            match self.composed(topic, transforms, role) {
                Some(composed) => (message, is_composed) = (composed, true),
                None => return Ok(None),
            }
        }
        let Message {
            stamp_ns,
            frame,
            child,
            content,
        } = message;
        let t_s = Exact::seconds(stamp_ns);
        let exact_ns = Some(Exact {
            stamp: stamp_ns,
            logged: logged_ns,
        });
        let (pose, covariance) = match content {
            Content::Detections(found) => {
                let Role::Estimates(source) = role else {
                    return Ok(None);
                };
                return Ok(Some(Item::Detections {
                    source,
                    t_s,
                    exact_ns,
                    frame: shared(&mut self.frame, frame),
                    found,
                }));
            }
            // Replaced by a pose above.
            Content::Transforms(_) => return Ok(None),
            Content::Pose { pose, covariance } => (pose, covariance),
        };
        let is_estimate = matches!(role, Role::Estimates(_));
        let body = match self.body.body(child.as_deref(), is_estimate) {
            Some(body) => body,
            // The base was named, or found by its name.
            None if is_composed => Body::Base,
            None => {
                return Err(RecordingError::ChildFrame {
                    topic: topic.into(),
                    child: child.unwrap_or_default(),
                    known: self.body.names().join(", "),
                });
            }
        };
        let is_turned_about = is_estimate && covariance.is_some() && body.lever_m() > 0.0;
        if is_turned_about && self.body.is_partial() {
            return Err(RecordingError::PartialCovariance {
                topic: topic.into(),
                child: child.unwrap_or_default(),
            });
        }
        if let Some(child) = child.filter(|_| !is_composed) {
            let child = shared(&mut self.child, child);
            self.diagnostics.note_child(&child);
        }
        let (mut pose, covariance, lever_m) = of_base(body, pose, covariance);
        // The odometry has an origin of its own; only its increments count.
        if role != Role::Odometry {
            let [east, north] = self.body.origin();
            let [x, y, _] = &mut pose.position;
            (*x, *y) = (*x - east, *y - north);
        }
        let frame = shared(&mut self.frame, frame);
        Ok(Some(match role {
            Role::Estimates(source) => Item::Estimate(Sample {
                source,
                t_s,
                logged_s: exact_ns.map(|exact| Exact::seconds(exact.logged)),
                exact_ns,
                frame: Some(frame),
                z_m: pose.position[2],
                belief: belief(pose, covariance),
                truth: None,
                since_fix_ms: None,
                lever_m,
                other: None,
                is_ambiguous: false,
                fault: None,
            }),
            _ => Item::Truth(TruePose {
                t_s,
                frame,
                position: pose.position,
                orientation: pose.orientation,
            }),
        }))
    }
}

/// Returns a shared copy of a frame's name. Consecutive messages with the same frame share it.
fn shared(last: &mut Option<Arc<str>>, name: String) -> Arc<str> {
    match last {
        Some(frame) if **frame == *name => frame.clone(),
        _ => last.insert(Arc::from(name)).clone(),
    }
}

/// A covariance of x, y, z and the rotations about these axes.
pub(super) type Covariance = [[f64; 6]; 6];

/// Returns the pose of the base from that of a frame on the robot, its covariance by the derivative of this step, and the distance
/// of the frame from the base's vertical axis, metres.
fn of_base(
    body: Body,
    pose: Pose,
    covariance: Option<Covariance>,
) -> (Pose, Option<Covariance>, f64) {
    let Body::At(place) = body else {
        return (pose, covariance, 0.0);
    };
    let base = pose.of(&place.inverse());
    // How far the base moves per radian of a turn about the frame.
    let [x, y, _] = pose.position;
    let [base_x, base_y, _] = base.position;
    let (per_x, per_y) = (y - base_y, base_x - x);
    let moved = |mut rows: Covariance| {
        for (to, per) in [(0, per_x), (1, per_y)] {
            let turn = rows[5];
            for (entry, added) in rows[to].iter_mut().zip(turn) {
                *entry += per * added;
            }
            for row in &mut rows {
                row[to] += per * row[5];
            }
        }
        rows
    };
    (base, covariance.map(moved), body.lever_m())
}

/// Returns the estimate of the base from that of a frame on the robot.
pub(super) fn sample_of_base(sample: Sample, body: Body) -> Sample {
    if body == Body::Base {
        return sample;
    }
    let orientation = match sample.belief.heading {
        Heading::Quaternion(orientation) => orientation,
        Heading::Radians(yaw) => [0.0, 0.0, libm::sin(0.5 * yaw), libm::cos(0.5 * yaw)],
        // No text has these.
        Heading::RollPitchYaw(_) => [f64::NAN; 4],
    };
    let pose = Pose {
        position: [sample.belief.x_m, sample.belief.y_m, sample.z_m],
        orientation,
    };
    let covariance = match sample.belief.spread {
        Some(Uncertainty::Gaussian(rows)) => {
            const AXES: [usize; 3] = [0, 1, 5];
            let mut all: Covariance = [[0.0; 6]; 6];
            for (row, to) in rows.iter().zip(AXES) {
                for (entry, axis) in row.iter().zip(AXES) {
                    all[to][axis] = *entry;
                }
            }
            Some(all)
        }
        _ => None,
    };
    let (pose, covariance, lever_m) = of_base(body, pose, covariance);
    Sample {
        z_m: pose.position[2],
        belief: belief(pose, covariance),
        lever_m,
        ..sample
    }
}

/// Returns how to use the messages of a channel.
///
/// # Errors
///
/// The reason why they cannot be read.
fn use_of(schema: &mut Schema, encoding: &str, role: Role) -> Result<Use, SkipReason> {
    let kind = Kind::of(&schema.name).ok_or(SkipReason::UnknownSchema)?;
    let encoding = match (schema.encoding.as_str(), encoding) {
        ("ros2msg", "cdr") => Encoding::Cdr,
        ("ros1msg", "ros1") => Encoding::Ros1,
        _ => return Err(SkipReason::UnknownEncoding),
    };
    let definition = &schema.definition;
    let has_fields = schema.has_fields;
    let has_fields = has_fields.unwrap_or_else(|| kind.has_fields_of(encoding, definition));
    schema.has_fields = Some(has_fields);
    if !has_fields {
        return Err(SkipReason::OtherFields);
    }
    if kind == Kind::Detections && !matches!(role, Role::Estimates(_)) {
        return Err(SkipReason::NoPose);
    }
    if role == Role::Static && kind != Kind::Transforms {
        return Err(SkipReason::UnknownSchema);
    }
    Ok(Use::Read {
        kind,
        role,
        encoding,
    })
}

fn belief(
    Pose {
        position,
        orientation,
    }: Pose,
    covariance: Option<Covariance>,
) -> PoseEstimate {
    match covariance {
        Some(rows) => {
            let mut covariance = [0.0; 36];
            for (to, from) in covariance.iter_mut().zip(rows.as_flattened()) {
                *to = *from;
            }
            PoseEstimate::from(&PoseWithCovariance {
                position,
                orientation,
                covariance,
            })
        }
        None => PoseEstimate {
            x_m: position[0],
            y_m: position[1],
            heading: Heading::Quaternion(orientation),
            spread: None::<Uncertainty>,
        },
    }
}

/// Returns the yaw of a quaternion x, y, z, w of any length, radians.
pub(crate) fn yaw_of([x, y, z, w]: [f64; 4]) -> f64 {
    libm::atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)
}
