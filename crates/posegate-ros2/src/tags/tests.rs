use super::*;
use crate::fixtures::{self, ODOMETRY, at, odometry, origin, with_variances};
use crate::message::{AprilTagDetection, Header, Odometry};
use crate::permit_gate::{Answer, PermitGate};
use crate::settings::NodeSettings;
use posegate::bake::BakeInput;
use posegate::gate::self_test;
use posegate::gate::{Gate, Reason};
use posegate::report::{FrameId, Report};
use posegate_site::Site;

const SITE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/live/tags.toml");
/// The goal, and the place from which tag 7 looks almost the same: mirrored about its normal.
const GOAL: [f64; 3] = [0.0, 0.0, 0.0];
const MIRRORED_DEG: f64 = 40.0;
const LINE: &str =
    "-p stands_still:=true -p use_detections:=true -p corner_sigma_px:=0.3 -p permits_in_a_row:=1";

fn table() -> Vec<u8> {
    let site = Site::read(SITE).unwrap();
    let task = site.task("dock").unwrap();
    let order = BakeInput {
        task: "dock",
        success: &task.success,
        spec: *site.table_spec(task).unwrap(),
        epsilon: site.epsilon,
    };
    posegate::verify::build(&order, &|| ()).unwrap().0
}

fn settings(table: &[u8], line: &str) -> NodeSettings {
    fixtures::settings(table, &format!("--site {SITE} --ros-args {line}"))
}

fn mirrored() -> [f64; 3] {
    let turn = (180.0 + MIRRORED_DEG).to_radians();
    let yaw = MIRRORED_DEG.to_radians();
    let camera = [1.25 + turn.cos(), turn.sin()];
    [
        camera[0] - 0.25 * yaw.cos(),
        camera[1] - 0.25 * yaw.sin(),
        yaw,
    ]
}

/// Returns the corners of an upright tag from a pose, by the frames of the site's file: robot, camera, pixels.
fn corners(id: i32, [x, y, yaw]: [f64; 3]) -> [[f64; 2]; 4] {
    let (size, tag, normal) = match id {
        7 => (0.04, [1.25, 0.0], 200.0f64),
        _ => (0.15, [1.35, 0.2], 225.0),
    };
    let (sin, cos) = normal.to_radians().sin_cos();
    let half = 0.5 * size;
    [[-half, -half], [half, -half], [half, half], [-half, half]].map(|[across, up]| {
        let world = [tag[0] - sin * across - x, tag[1] + cos * across - y];
        let ahead = yaw.cos() * world[0] + yaw.sin() * world[1] - 0.25;
        let left = yaw.cos() * world[1] - yaw.sin() * world[0];
        [640.0 - 1720.0 * left / ahead, 480.0 - 1720.0 * up / ahead]
    })
}

fn detection(id: i32, pose: [f64; 3]) -> AprilTagDetection {
    AprilTagDetection {
        family: "tag36h11".into(),
        id,
        hamming: 0,
        goodness: 0.0,
        decision_margin: 80.0,
        centre: [640.0, 480.0],
        corners: corners(id, pose),
        homography: [0.0; 9],
    }
}

fn header(ms: u32) -> Header {
    fixtures::header(at(ms), "front")
}

fn at_rest(ms: u32) -> Odometry {
    odometry(header(ms), "base_link", with_variances(0.0, [0.0; 3]))
}

fn image(ms: u32, detections: Vec<AprilTagDetection>) -> AprilTagDetectionArray {
    AprilTagDetectionArray {
        header: header(ms),
        detections,
    }
}

fn info() -> CameraInfo {
    CameraInfo {
        header: header(0),
        height: 960,
        width: 1280,
        distortion_model: "plumb_bob".into(),
        d: vec![0.0; 5],
        k: [1720.0, 0.0, 640.0, 0.0, 1720.0, 480.0, 0.0, 0.0, 1.0],
        r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: [
            1720.0, 0.0, 640.0, 0.0, 0.0, 1720.0, 480.0, 0.0, 0.0, 0.0, 1.0, 0.0,
        ],
        ..CameraInfo::default()
    }
}

/// A node under test: images every 100 ms.
struct Node<'a> {
    gate: PermitGate<'a>,
    ms: u32,
    number: i64,
}

impl Node<'_> {
    fn look(&mut self, detections: Vec<AprilTagDetection>) -> Answer {
        self.ms += 100;
        self.number += 1;
        let image = image(self.ms, detections);
        let _ = self.gate.tick(at(self.ms));
        self.gate
            .detections(at(self.ms), &image, origin(self.number))
    }

    fn open(&mut self) {
        for _ in 0..10 {
            if self.look(vec![detection(8, GOAL)]).is_open {
                return;
            }
        }
        panic!("{:?} {:?}", self.gate.last(), self.gate.tags());
    }

    fn problem(&self) -> String {
        self.gate.tags().unwrap().problem().unwrap_or_default()
    }
}

/// Runs a test with a node that has the camera info.
fn with_node(line: &str, test: impl FnOnce(Node<'_>)) {
    let table = table();
    let settings = settings(&table, line);
    let gate = settings.gate();
    let mut gate = PermitGate::new(self_test(), &table, &settings, &gate, at(0)).unwrap();
    gate.camera_info(Some(&info()));
    test(Node {
        gate,
        ms: 0,
        number: 0,
    });
}

#[test]
fn tag_with_one_pose_permits() {
    with_node(LINE, |mut node| {
        node.open();
        assert_eq!(node.problem(), "");
        let answer = node.look(vec![detection(8, [0.2, 0.0, 0.0])]);
        assert!(!answer.is_open && node.problem().is_empty());
        // The other place of tag 8 is also excluded by the two tags together.
        node.open();
        let both = vec![detection(7, GOAL), detection(8, GOAL)];
        let answer = node.look(both);
        let (last, problem) = (node.gate.last(), node.problem());
        assert!(answer.is_open, "{answer:?} {last:?} {problem}");
    });
}

/// The robot is not at the goal, but the small tag also fits a view from there. The pose at the goal alone would be
/// permitted.
#[test]
fn second_pose_denies_although_the_first_alone_would_be_permitted() {
    with_node(LINE, |mut node| {
        for truth in [mirrored(), GOAL] {
            let found = vec![detection(7, truth)];
            let Look::Poses(poses, true) = node
                .gate
                .tags()
                .unwrap()
                .clone()
                .look(&image(0, found.clone()))
            else {
                panic!("no pose");
            };
            let [first, second] = poses[..] else {
                panic!("{} poses", poses.len());
            };
            assert!((first.x_m - truth[0]).abs() < 1e-6 && (first.y_m - truth[1]).abs() < 1e-6);
            // Each pose alone, by a gate with the same settings.
            let table = table();
            let settings = settings(&table, LINE);
            let gate_settings = settings.gate();
            let permits = |belief: PoseEstimate| {
                let mut gate = Gate::new(&table, &gate_settings, 0).unwrap();
                let report = |sequence: u32| Report {
                    source: 0,
                    frame: FrameId::of("map"),
                    sequence,
                    stamp_ms: 1_000 * sequence,
                    belief,
                };
                let steps: Vec<bool> = (1..5)
                    .map(|number| {
                        let now_ms = 1_000 * number;
                        let step = gate.step(now_ms, &report(number));
                        step.permission.opens_at(now_ms)
                    })
                    .collect();
                steps.contains(&true)
            };
            let [at_goal, elsewhere] = if truth == GOAL {
                [first, second]
            } else {
                [second, first]
            };
            assert!(permits(at_goal), "{at_goal:?}");
            assert!(!permits(elsewhere), "{elsewhere:?}");
            for _ in 0..20 {
                assert!(!node.look(found.clone()).is_open);
            }
            let last = node.gate.last().unwrap();
            assert_eq!(last.step, Err(Reason::TagPosesAmbiguous));
            // An open gate closes at once.
            node.open();
            assert!(!node.look(found).is_open);
        }
    });
}

#[test]
fn detections_without_camera_info_give_no_pose_and_a_reason() {
    with_node(LINE, |mut node| {
        let table = table();
        let settings = settings(&table, LINE);
        let gate = settings.gate();
        let fresh = PermitGate::new(self_test(), &table, &settings, &gate, at(0)).unwrap();
        let mut fresh = Node {
            gate: fresh,
            ms: 0,
            number: 0,
        };
        for _ in 0..10 {
            assert!(!fresh.look(vec![detection(8, GOAL)]).is_open);
        }
        assert!(
            fresh
                .problem()
                .contains("no camera info has arrived on /camera_info")
        );
        assert_eq!(fresh.gate.tags().unwrap().status().level, ERROR);
        assert!(fresh.gate.last().is_none());
        // A camera info that is not the site's, or cannot be decoded, also removes the earlier one.
        let half = CameraInfo {
            binning: [2, 2],
            ..info()
        };
        let part = CameraInfo {
            roi: ([0, 0, 480, 640], false),
            ..info()
        };
        for (wrong, words) in [
            (
                Some(half),
                "640 x 480, and the site's camera `front` has 1280 x 960",
            ),
            (Some(part), "640 x 480"),
            (Some(CameraInfo::default()), "calibrate the camera"),
            (None, "could not be read"),
        ] {
            node.gate.camera_info(Some(&info()));
            node.open();
            node.gate.camera_info(wrong.as_ref());
            // The permit ends when its time is over.
            let mut looks = 0;
            while node.look(vec![detection(8, GOAL)]).is_open {
                looks += 1;
                assert!(looks < 6, "{words}");
            }
            assert!(node.problem().contains(words), "{}", node.problem());
        }
    });
}

#[test]
fn unknown_tags_are_ignored_and_contradictions_close_immediately() {
    with_node(LINE, |mut node| {
        let mut other = detection(8, GOAL);
        other.id = 9;
        let mut family = detection(8, GOAL);
        family.family = "tag25h9".into();
        let mut hamming = detection(8, GOAL);
        hamming.hamming = 1;
        for (found, words) in [
            (vec![], "no tag is detected"),
            (vec![other], "tag36h11 9 is not in the site"),
            (vec![family], "tag25h9 8 is not in the site"),
            (vec![hamming], "1 corrected bits"),
        ] {
            node.open();
            // A message that was not a report leaves no gap in the sequence.
            assert!(node.look(found).is_open, "{words}");
            assert!(node.problem().contains(words), "{}", node.problem());
            assert!(node.look(vec![detection(8, GOAL)]).is_open, "{words}");
        }
        let mut broken = detection(8, GOAL);
        broken.corners[1][0] = f64::NAN;
        let mut rolled = detection(8, GOAL);
        rolled.corners.rotate_left(1);
        let mut outside = detection(8, GOAL);
        outside.corners[1][0] = -9.0;
        let misfit = Reason::CornersDoNotFit;
        for (found, words, reason) in [
            (vec![broken], "not finite", Reason::TooFewCorners),
            (vec![rolled], "do not fit", misfit),
            (vec![outside], "not in the image", misfit),
            (
                vec![detection(8, GOAL), detection(8, GOAL)],
                "twice",
                misfit,
            ),
        ] {
            node.open();
            let answer = node.look(found);
            assert!(!answer.is_open, "{words}");
            assert_eq!(answer.reason(), Some(reason), "{words}");
            assert!(node.problem().contains(words), "{}", node.problem());
        }
        // Detections of another camera.
        node.open();
        let mut elsewhere = image(node.ms + 50, vec![detection(8, GOAL)]);
        elsewhere.header.frame_id = "rear".into();
        node.number += 1;
        let answer = node
            .gate
            .detections(at(node.ms + 50), &elsewhere, origin(node.number));
        assert!(!answer.is_open && node.problem().contains("of two cameras"));
        // A lost message is a gap, even if the next one is not a report.
        node.ms += 50;
        node.open();
        node.number += 1;
        assert!(node.look(vec![]).is_open);
        let answer = node.look(vec![detection(8, GOAL)]);
        assert_eq!(answer.reason(), Some(Reason::SequenceGap));
    });
}

/// With odometry, one pose is carried. Two poses are not carried, and are evaluated with the inflation.
#[test]
fn two_poses_are_not_carried_along_odometry() {
    let line = format!("{LINE} {ODOMETRY} -p odometry_maximum_gap_ms:=200");
    with_node(&line, |mut node| {
        let mut number = 0;
        let mut step = |node: &mut Node<'_>, found: Option<i32>| {
            let ms = node.ms + 100;
            number += 1;
            let wheels = at_rest(ms);
            let carried = node.gate.odometry(at(ms), &wheels, origin(number));
            match found {
                Some(id) => node.look(vec![detection(id, GOAL)]),
                None => {
                    node.ms = ms;
                    carried
                }
            }
        };
        let mut opened = 0;
        while !step(&mut node, Some(8)).is_open {
            opened += 1;
            assert!(opened < 20, "{:?}", node.gate.last());
        }
        // Longer than a permit is held.
        for _ in 0..8 {
            assert!(step(&mut node, None).is_open);
        }
        assert!(!step(&mut node, Some(7)).is_open);
        for _ in 0..20 {
            assert!(
                !step(&mut node, None).is_open,
                "the fix before is still carried"
            );
        }
    });
}
