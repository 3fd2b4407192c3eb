//! Every format that the program reads: good files of it, and the commands that read it.

use crate::bags::{Bag, Compression, Pose};
use crate::mutate::Kind;
use posegate_testkit::mcap::{MAGIC, op};
use posegate_testkit::run::command;
use posegate_testkit::storages::{ros1, sqlite, zstd};
use std::fmt::Write as _;
use std::path::Path;

/// A format.
pub struct Format {
    pub name: &'static str,
    pub kind: Kind,
    /// The name of a mutant in its folder.
    pub file: &'static str,
    pub seeds: Vec<Vec<u8>>,
    /// Commands that read the format. Each mutant gets one of them; `{}` is the mutant.
    pub commands: &'static [&'static str],
}

/// Files that commands need in addition to the mutant.
pub const COMPANIONS: [(&str, &[u8]); 5] = [
    (
        "dock.toml",
        include_bytes!("../../../../examples/sites/dock.toml"),
    ),
    (
        "docks.toml",
        include_bytes!("../../../../examples/sites/docks.toml"),
    ),
    (
        "docks.yaml",
        include_bytes!("../../../../examples/sites/docks.yaml"),
    ),
    (
        "estimates.csv",
        include_bytes!("../../../../tests/data/estimates.csv"),
    ),
    (
        "dock.posegate",
        include_bytes!("../../../../examples/tables/dock.posegate"),
    ),
];

/// Sites that read a mutant.
const CALIBRATED: &str = "[camera.front]\ncalibration = 'mutant.yaml'\nmount = { x = 0.25, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }\n\
    [tag.t7]\nid = 7\nfamily = 'tag36h11'\nsize = 0.3\npose = { x = 4.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }\n\
    [task.see-t7]\nkind = 'localization'\ngoal = { x = 0.0, y = 0.0, yaw_deg = 0.0 }\n\
    success = { shape = 'visibility', camera = 'front', tag = 't7', d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0 }\nerror_bound = { translation = 0.05, yaw_deg = 2.0 }\n";
pub const SITES: [(&str, &str); 3] = [
    ("calibrated.toml", CALIBRATED),
    (
        "imported.toml",
        "[import.docks]\nfile = 'mutant.yaml'\nformat = 'nav2_docks'\n",
    ),
    ("learnt.toml", "[error_model.tags]\nfile = 'mutant.toml'\n"),
];

const ROS: &str = "image_width: 640\nimage_height: 480\ncamera_name: front\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [615.0, 0.0, 320.0, 0.0, 615.0, 240.0, 0.0, 0.0, 1.0]\n\
    distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [-0.05, 0.01, 0.0, 0.0, 0.0]\nrectification_matrix:\n  rows: 3\n  cols: 3\n  data: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]\n\
    projection_matrix:\n  rows: 3\n  cols: 4\n  data: [610.0, 0.0, 320.0, 0.0, 0.0, 612.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0]\n";
const KALIBR: &str = "cam0:\n  camera_model: pinhole\n  intrinsics: [615.0, 615.0, 320.0, 240.0]\n  distortion_model: radtan\n  distortion_coeffs: [-0.05, 0.01, 0.0001, 0.0002]\n  resolution: [640, 480]\n  rostopic: /front/image_raw\n";
const FIELD: &str = "{\n  \"tags\": [\n    { \"ID\": 3, \"pose\": { \"translation\": { \"x\": 4.0, \"y\": 1.5, \"z\": 0.5 }, \"rotation\": { \"quaternion\": { \"W\": 0.0, \"X\": 0.0, \"Y\": 0.0, \"Z\": 1.0 } } } },\n\
    { \"ID\": 12, \"pose\": { \"translation\": { \"x\": 0.25, \"y\": 2.5, \"z\": 0.5 }, \"rotation\": { \"quaternion\": { \"W\": 1.0, \"X\": 0.0, \"Y\": 0.0, \"Z\": 0.0 } } } }\n  ],\n  \"field\": { \"length\": 16.5, \"width\": 8.0 }\n}\n";
const BUNDLES: &str = "standalone_tags: []\ntag_bundles:\n  [\n    { name: dock, layout: [\n      {id: 7, size: 0.1, x: 0.0, y: 0.0, z: 0.0, qw: 1.0, qx: 0.0, qy: 0.0, qz: 0.0},\n      {id: 8, size: 0.2, x: 0.5, y: 0.0, z: 0.0, qw: 1.0, qx: 0.0, qy: 0.0, qz: 0.0}\n    ] }\n  ]\n";
const DOCKS: &str = "docks:\n  dock1:\n    type: \"charging_dock\"\n    frame: map\n    pose: [1.0, 2.0, 1.57]\n  dock2:\n    type: \"charging_dock\"\n    pose: [-1.5, 0.25, -0.5]\n";
const PARAMETERS: &str = "/**:\n  docking_server:\n    ros__parameters:\n      dock_plugins: [charger]\n      charger:\n        plugin: a\n        docking_threshold: 0.05\n        staging_x_offset: -0.7\n        use_external_detection_pose: true\n\
    \x20       dock_direction: backward\n      docks: [home, b]\n      home: {type: charger, frame: map, pose: [1.5, -2.0, 1.57]}\n      b.pose: [0.5, 1.0, 0.0]\n";
const OPENCV: &str = "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: [ 6.0e+02, 0., 3.2e+02, 0., 6.0e+02, 2.4e+02, 0., 0., 1. ]\n\
    distortion_coefficients: !!opencv-matrix\n   rows: 5\n   cols: 1\n   dt: d\n   data: [ 1.0e-01, -2.0e-01, 0., 0., 0. ]\navg_reprojection_error: 1.4\n";
const XML: &str = "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_size>640 480</image_size>\n<camera_matrix type_id=\"opencv-matrix\">\n  <rows>3</rows>\n  <cols>3</cols>\n  <dt>d</dt>\n  <data>\n    6.0e+02 0. 3.2e+02 0. 6.0e+02 2.4e+02 0. 0. 1.</data></camera_matrix>\n\
    <dist_coeffs><_>0.1</_><_>-0.2</_><_>0</_><_>0</_></dist_coeffs>\n<rms>\"1.4\"</rms><!-- a &amp; b --><images/>\n</opencv_storage>\n";
const OKVIS: &str = "cameras:\n  - {T_SC: [1.0, 0.0], image_dimension: [640, 480],\n     distortion_coefficients: [-0.1, 0.07, 0.0002, 0.00002], distortion_type: radialtangential,\n     focal_length: [458.5, 457.5],\n     principal_point: [322.0, 248.5]}\n";
const BASALT: &str = "{\"value0\": {\"intrinsics\": [{\"camera_type\": \"kb4\", \"intrinsics\": {\"fx\": 349.5, \"fy\": 348.5, \"cx\": 325.5, \"cy\": 249.5, \"k1\": -0.01, \"k2\": 0.02, \"k3\": 0, \"k4\": 0}}], \"resolution\": [[640, 480]]}}";
const VINS: &str = "%YAML:1.0\nmodel_type: PINHOLE\ncamera_name: c\nimage_width: 752\nimage_height: 480\ndistortion_parameters:\n  k1: -0.29\n  k2: 0.08\n  p1: 0.0001\n  p2: 0.0\nprojection_parameters:\n  fx: 461.0\n  fy: 460.0\n  cx: 363.0\n  cy: 248.0\n";
const ECHO: &str = "header:\n  frame_id: c\nheight: 480\nwidth: 640\ndistortion_model: rational_polynomial\nd: [0.1, 0.2, 0.0, 0.0, 0.01, 0.3, 0.1, 0.02, 0.0, 0.0, 0.0, 0.0]\nk: [600.0, 0.0, 320.0, 0.0, 600.0, 240.0, 0.0, 0.0, 1.0]\n\
    binning_x: 2\nbinning_y: 2\nroi: {x_offset: 0, y_offset: 0, height: 480, width: 640}\n---\nA message was lost!!!\n\ttotal count change:1\n\ttotal count: 1---\nheader: 1\n";
const PHOTON: &str = "{\"resolution\":{\"width\":640.0,\"height\":480.0},\"cameraIntrinsics\":{\"rows\":3,\"cols\":3,\"type\":6,\"data\":[600,0,320,0,600,240,0,0,1]},\"distCoeffs\":{\"rows\":1,\"cols\":5,\"type\":6,\"data\":[0.1,-0.2,0,0,0]}}";
const PHOTON_OLD: &str = "{\"resolution\":{\"width\":640,\"height\":480},\"cameraIntrinsics\":{\"data\":[600,0,320,0,600,240,0,0,1]},\"cameraExtrinsics\":{\"data\":[0.01,-0.02,0,0]},\"isFisheye\":true}";
const ORB_SLAM: &str = "%YAML:1.0\nCamera.type: \"PinHole\"\nCamera1.fx: 517.5\nCamera1.fy: 516.5\nCamera1.cx: 318.5\nCamera1.cy: 255.5\nCamera1.k1: 0.26\nCamera1.k2: -0.2\nCamera1.p1: -0.005\nCamera1.p2: 0.002\nCamera1.k3: 0.1\n\
    Camera.width: 640\nCamera.height: 480\n";
const ROWS: &str = "{image_width: 640, image_height: 480, mtx: [[520.5, 0, 322], [0, 521, 238.5], [0, 0, 1]], dist: [[0.1, -0.2, 0.001, 0.002, 0]]}\n";
const SENSOR: &str = "sensor_type: camera\nresolution: [640, 480]\ncamera_model: pinhole\nintrinsics: [458.5, 457.5, 322.0, 238.0]\ndistortion_model: radial-tangential\ndistortion_coefficients: [-0.1, 0.02, 0.0002, 0.00002]\n";
const FMAP: &str = "{\"type\":\"frc\",\"fiducials\":[{\"family\":\"apriltag3_36h11_classic\",\"id\":4,\"size\":165.1,\"transform\":[0,-1,0,-2.5,1,0,0,1.25,0,0,1,0.6,0,0,0,1],\"unique\":1}]}";
const METADATA: &str = "rosbag2_bagfile_information:\n  version: 5\n  storage_identifier: mcap\n  relative_file_paths:\n    - a_0.mcap\n    - a_1.mcap\n  compression_mode: \"\"\n";
const TABLES: &str = "[tag.t7]\nid = 7\nfamily = \"tag36h11\"\nsize = 0.3\npose = { x = 4.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }\n\n[goal.dock]\nx = 1.0\ny = 2.0\nyaw_deg = 90.0\n";
/// A site with compact tables, which are quick to build.
const SITE: &str = "[camera.front]\nwidth_px = 640\nheight_px = 480\nfx = 615.0\nfy = 615.0\ncx = 320.0\ncy = 240.0\ndistortion = { model = \"plumb_bob\", coefficients = [-0.05, 0.01, 0.0, 0.0, 0.0] }\n\
    mount = { x = 0.25, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }\n[tag.t7]\nid = 7\nfamily = \"tag36h11\"\nsize = 0.3\npose = { x = 4.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }\n\
    tolerance = { translation = 0.01, yaw_deg = 0.5 }\n[wall.north]\nfrom = [5.0, -3.0]\nto = [5.0, 3.0]\nz = [0.0, 2.0]\n[task.see-t7]\nkind = \"localization\"\ngoal = { x = 0.0, y = 0.0, yaw_deg = 0.0 }\n\
    success = { shape = \"visibility\", camera = \"front\", tag = \"t7\", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0 }\nerror_bound = { translation = 0.05, yaw_deg = 2.0 }\n\
    [task.dock]\nkind = \"work\"\ngoal = { x = 0.0, y = 0.0, yaw_deg = 90.0 }\nsuccess = { all = [ { shape = \"footprint\", footprint = [[0.25, 0.15], [-0.25, 0.15], [-0.25, -0.15], [0.25, -0.15]], regions = [[[0.5, 0.3], [-0.5, 0.3], [-0.5, -0.3], [0.5, -0.3]], [[2.5, 0.5], [0.4, 0.5], [0.4, -0.5], [2.5, -0.5]]] }, { shape = \"clear\", footprint = [[0.0, 0.0]], obstacle = [[0.2, 0.2], [0.2, 0.25], [0.15, 0.25]] } ] }\n\
    table = { extent = { x = [-0.4, 0.4], y = [-0.4, 0.4], yaw_deg = [-10.0, 10.0] }, step = { xy = 0.05, yaw_deg = 2.0 } }\n[chain.back]\nstart = { x = 0.0, y = 0.0, yaw_deg = 0.0, bounded = { translation = 0.1, yaw_deg = 2.0 } }\n\
    steps = [ { task = \"see-t7\" }, { navigate = [[0.0, 0.0, 0.0], [0.5, 0.2, 10.0]], model = { kind = \"bounded\", k_turn = 0.02, k_drift = 0.01, k_slip = 0.02 } }, { task = \"dock\" } ]\n[confidence]\nepsilon = 0.99\n";

/// Returns all formats. Files in formats that the program writes are written by the program in this folder.
pub fn all(folder: &Path, recorded: Option<&[u8]>) -> Vec<Format> {
    let sites = [
        "contingent",
        "dock",
        "docks",
        "lens",
        "loading-bay",
        "paper-chain",
        "turtlebot",
    ];
    let sites = sites.iter().map(|name| {
        let path = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
            .join(format!("examples/sites/{name}.toml"));
        std::fs::read(path).expect("a site file")
    });
    let sites = sites.chain([SITE.as_bytes().to_vec()]).collect();
    let bytes = |name: &str| std::fs::read(folder.join(name)).expect("a file of the program");
    let text = |parts: &[&str]| {
        parts
            .iter()
            .map(|part| part.as_bytes().to_vec())
            .collect::<Vec<_>>()
    };
    let estimates = include_str!("../../../../tests/data/estimates.csv");
    let estimates = estimates.lines().take(60).collect::<Vec<_>>().join("\n");
    let detections = include_str!("../../../../tests/data/apriltag_errors_sample.csv");
    let few: String = detections
        .lines()
        .take(200)
        .flat_map(|line| [line, "\n"])
        .collect();

    program(
        folder,
        "learn bounds detections.csv --quantile 0.9 -o model.toml",
        &[("detections.csv", detections.as_bytes())],
    );
    let scored = scored();
    program(
        folder,
        "learn inflation scored.csv --epsilon 0.9 --confidence 0.6 -o filter.toml",
        &[("scored.csv", scored.as_bytes())],
    );
    program(
        folder,
        "table build dock.toml --task dock --layout grid -o grid.posegate",
        &[],
    );
    program(
        folder,
        "table build dock.toml --task see-t7 --layout facets -o sight.posegate",
        &[],
    );
    program(folder, "site build docks.toml --tables-only -o built", &[]);
    let placement = "place dock.toml --task see-t7 --sigma-x 0.1 --sigma-y 0.1 --sigma-yaw-deg 1 --free x=0.3:7,y=-3:3 --budget 50 --json";
    let placement = program(folder, placement, &[]);
    let part = std::fs::read_dir(folder.join("built/parts")).expect("parts");
    let mut parts: Vec<_> = part.map(|entry| entry.expect("a part").path()).collect();
    parts.sort();
    let parts: Vec<Vec<u8>> = parts
        .iter()
        .map(|path| std::fs::read(path).expect("a part"))
        .collect();
    let mut bags: Vec<Vec<u8>> = [None, Some(Compression::Lz4), Some(Compression::Zstd)]
        .into_iter()
        .map(|compression| bag(compression, 30))
        .collect();
    bags.push(without_checksums(bag(None, 30)));
    let poses: Vec<Pose> = (0..20)
        .map(|k| Pose {
            t_s: 1.0 + 0.1 * f64::from(k),
            ..Pose::AT_DOCK
        })
        .collect();
    const TOPIC: &str = "/amcl_pose";
    let storages = vec![
        sqlite(TOPIC, &poses, false, |bytes| bytes),
        sqlite(TOPIC, &poses, true, |bytes| zstd(&bytes)),
        ros1(TOPIC, &poses, "none"),
        ros1(TOPIC, &poses, "lz4"),
        ros1(TOPIC, &poses, "bz2"),
        zstd(&bags[0]),
        zstd(&sqlite(TOPIC, &poses, false, |bytes| bytes)),
    ];
    bags.extend(recorded.map(<[u8]>::to_vec));

    let format = |name, kind, file, seeds, commands| Format {
        name,
        kind,
        file,
        seeds,
        commands,
    };
    use Kind::{Binary, Text};
    vec![
        format(
            "site TOML",
            Text,
            "mutant.toml",
            sites,
            &[
                "check {} --json",
                "check {}",
                "contains {} --task dock --poses estimates.csv --json",
                "chain {} --name back",
                "table build {} --task dock -o out.posegate",
                "plan {} --from back --to dock",
                "cost {} --task see-t7 --sigma-x 0.1 --sigma-y 0.1 --sigma-yaw-deg 1",
                "table verify dock.posegate {}",
                "site build {} --tables-only --shard 1/2 -o out",
                "check {} --draw out",
            ],
        ),
        format(
            "estimates CSV",
            Text,
            "mutant.csv",
            text(&[&estimates]),
            &[
                "gate dock.posegate --estimates {} --json",
                "replay dock.toml {} --task dock --json",
                "contains dock.toml --task dock --poses {} --json",
                "gate dock.posegate --estimates {}",
                "replay dock.toml estimates.csv --task dock --truth {}",
            ],
        ),
        format(
            "scored estimates CSV",
            Text,
            "mutant.csv",
            text(&[&scored]),
            &[
                "learn inflation {} --epsilon 0.9 --confidence 0.6 -o out.toml",
                "predict filter.toml --at {} --json",
                "replay dock.toml {} --task dock --json",
            ],
        ),
        format(
            "trajectories TUM",
            Text,
            "mutant.txt",
            text(&[&tum()]),
            &[
                "metrics {} trajectory.txt --json",
                "metrics trajectory.txt {} --align se3 --json",
                "replay dock.toml {} --task dock --set bounded --translation 0.01 --yaw-deg 1",
            ],
        ),
        format(
            "bags MCAP",
            Binary,
            "mutant.mcap",
            bags,
            &[
                "replay dock.toml {} --task dock --topic /amcl_pose --cross-terms yaw-unknown --json",
                "replay dock.toml {} --task dock --topic /amcl_pose --truth /truth --json",
                "replay dock.toml {} --task dock --topic /tags --json",
                "replay dock.toml {} --task dock",
            ],
        ),
        format(
            "bags SQLite and ROS 1",
            Binary,
            "mutant.db3",
            storages,
            &[
                "replay dock.toml {} --task dock --topic /amcl_pose --json",
                "replay dock.toml {} --task dock",
                "replay dock.toml {} --task dock --topic /amcl_pose --odom /amcl_pose2 --max-speed 1",
            ],
        ),
        format(
            "metadata of a bag YAML",
            Text,
            "bag/metadata.yaml",
            text(&[METADATA]),
            &[
                "replay dock.toml bag --task dock --topic /amcl_pose --json",
                "replay dock.toml bag --task dock",
            ],
        ),
        format(
            "trajectories EuRoC and KITTI",
            Text,
            "mutant.csv",
            text(&[
                &euroc(),
                &kitti(),
                &format!(
                    "timestamp, p_x, p_y, p_z, q_x, q_y, q_z, q_w, v_x\n{}",
                    euroc()
                ),
                "#timestamp [s],x,y,z,qw,qx,qy,qz\n0.5,1,2,0,1,0,0,0\n1.5,1,2.5,0,0.8,0,0,0.6\n",
            ]),
            &[
                "metrics {} trajectory.txt --json",
                "metrics trajectory.txt {} --times times.txt --json",
                "replay dock.toml estimates.csv --task dock --truth {} --json",
                "replay dock.toml {} --task dock --set bounded --translation 0.01 --yaw-deg 1 --times times.txt",
            ],
        ),
        format(
            "Limelight JSON",
            Text,
            "mutant.json",
            text(&[FMAP]),
            &[
                "import {} --format fmap --json",
                "import {} --format fmap --pose x=8,y=4",
            ],
        ),
        format(
            "detections CSV",
            Text,
            "mutant.csv",
            text(&[&few]),
            &[
                "learn bounds {} --quantile 0.9 -o out.toml",
                "predict model.toml --at {} --json",
            ],
        ),
        format(
            "outcomes CSV",
            Text,
            "mutant.csv",
            text(&[&outcomes()]),
            &[
                "learn outcomes {} --epsilon 0.9 --json",
                "learn outcomes {} --epsilon 0.99",
            ],
        ),
        format(
            "dockings CSV",
            Text,
            "mutant.csv",
            text(&[&dockings()]),
            &[
                "learn survey dock.toml {} --json",
                "learn survey dock.toml {}",
            ],
        ),
        format(
            "learnt models TOML",
            Text,
            "mutant.toml",
            vec![bytes("model.toml"), bytes("filter.toml")],
            &[
                "predict {} --at detections.csv --json",
                "check learnt.toml",
                "predict {} --at scored.csv --json",
            ],
        ),
        format(
            "tables",
            Binary,
            "mutant.posegate",
            vec![
                bytes("grid.posegate"),
                bytes("sight.posegate"),
                bytes("dock.posegate"),
            ],
            &[
                "table info {} --json",
                "table verify {} dock.toml",
                "table export {} --format c -o out.h",
                "gate {} --estimates estimates.csv --json",
                "table info {}",
            ],
        ),
        format(
            "calibrations YAML and XML",
            Text,
            "mutant.yaml",
            text(&[
                ROS, KALIBR, OPENCV, XML, OKVIS, BASALT, VINS, ECHO, PHOTON, PHOTON_OLD, ORB_SLAM,
                ROWS, SENSOR,
            ]),
            &["check calibrated.toml", "check calibrated.toml --json"],
        ),
        format(
            "WPILib JSON",
            Text,
            "mutant.json",
            text(&[FIELD]),
            &[
                "import {} --format wpilib --size 0.1651 --family tag36h11 --json",
                "import {} --format wpilib --size 0.1651 --family tag36h11",
            ],
        ),
        format(
            "apriltag_ros YAML",
            Text,
            "mutant.yaml",
            text(&[BUNDLES]),
            &[
                "import {} --format apriltag_ros --convention apriltag_ros --family tag36h11 --pose x=4,z=0.5,yaw_deg=180",
                "import {}#dock --format apriltag_ros --convention apriltag_ros --family tag36h11 --pose x=4,z=0.5,yaw_deg=180 --json",
            ],
        ),
        format(
            "Nav2 docks YAML",
            Text,
            "mutant.yaml",
            text(&[DOCKS, PARAMETERS]),
            &[
                "import {} --format nav2_docks --json",
                "check imported.toml",
            ],
        ),
        format(
            "tables of one's own TOML",
            Text,
            "mutant.toml",
            text(&[TABLES]),
            &[
                "import {} --format posegate",
                "import {} --format posegate --json",
            ],
        ),
        format(
            "placements JSON",
            Text,
            "mutant.json",
            vec![placement],
            &["report dock.toml --placement see-t7={} -o out.html"],
        ),
        format(
            "costs and covariances CSV",
            Text,
            "mutant.csv",
            text(&[
                "from,to,cost\nstart,dock-1,2.5\n",
                "0.01,0.0,0.0\n0.0,0.01,0.0\n0.0,0.0,0.001\n",
            ]),
            &[
                "plan docks.toml --to dock-1 --costs {}",
                "cost dock.toml --task see-t7 --covariance-file {}",
            ],
        ),
        format(
            "firmware ELF",
            Binary,
            "mutant.elf",
            vec![firmware()],
            &["table seal {} -o out.elf", "table seal {} --json"],
        ),
        format(
            "parts of a site build",
            Text,
            "built/parts/{part}",
            parts,
            &[
                "site merge built",
                "site merge built --site docks.toml",
                "site build docks.toml --tables-only --resume -o built",
            ],
        ),
    ]
}

/// Runs the program on good files. Returns what it printed.
fn program(folder: &Path, arguments: &str, files: &[(&str, &[u8])]) -> Vec<u8> {
    for (name, bytes) in files {
        std::fs::write(folder.join(name), bytes).expect("a file");
    }
    let output = command(folder, arguments).output();
    let output = output.expect("the program starts");
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments}: {stderr}");
    output.stdout
}

/// Returns a bag with a short drive and its truth, looks at a tag, and a topic of another type.
pub fn bag(compression: Option<Compression>, count: u32) -> Vec<u8> {
    let mut bag = Bag::new(compression, true);
    for k in 0..count {
        let t_s = 1.0 + 0.1 * f64::from(k);
        let pose = Pose {
            t_s,
            ..Pose::AT_DOCK
        };
        bag.truth("/truth", &pose);
        bag.pose("/amcl_pose", &pose);
        if k % 4 == 0 {
            bag.look("/tags", t_s, 7, [0.01, 0.02, 0.03]);
        }
    }
    bag.other("/tf", "tf2_msgs/msg/TFMessage", 3);
    bag.finish()
}

/// Returns a bag whose chunks have no checksums, so that the reader of the records finds the damage.
fn without_checksums(mut bag: Vec<u8>) -> Vec<u8> {
    let mut at = MAGIC.len();
    while let Some(head) = bag.get(at..at + 9) {
        let length = u64::from_le_bytes(head[1..].try_into().expect("8 bytes")) as usize;
        if head[0] == op::CHUNK {
            bag[at + 33..at + 37].fill(0);
        }
        at += 9 + length;
    }
    bag
}

/// Returns the trajectory that mutants are compared with.
pub fn tum() -> String {
    let line = |k: u32| format!("{}.5 {} 0.25 0 0 0 0 1\n", k, 0.1 * f64::from(k));
    (0..40).map(line).collect()
}

/// Returns the times of the trajectory without times.
pub fn times() -> String {
    (0..40).map(|k| format!("{k}.5\n")).collect()
}

fn euroc() -> String {
    let line = |k: u32| format!("{k}500000000,{},0.25,0,1,0,0,0,9\n", 0.1 * f64::from(k));
    (1..40).map(line).collect()
}

fn kitti() -> String {
    let line = |k: u32| format!("1 0 0 {} 0 1 0 0.25 0 0 1 0\n", 0.1 * f64::from(k));
    (0..40).map(line).collect()
}

fn dockings() -> String {
    let rows = (0..30).map(|k| format!("{k},dock,t7,0.0{},0.0{},0.0{}\n", k % 7, k % 5, k % 3));
    ["run,dock,tag,x_m,y_m,yaw_rad\n".to_owned()]
        .into_iter()
        .chain(rows)
        .collect()
}

fn outcomes() -> String {
    let rows = (0..60).map(|k| format!("{k},{}\n", u8::from(k % 17 != 0)));
    ["t_s,success\n".to_owned()]
        .into_iter()
        .chain(rows)
        .collect()
}

/// Returns estimates with their truth.
fn scored() -> String {
    let mut text = String::from(
        "t_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw,true_x_m,true_y_m,true_yaw_rad\n",
    );
    for k in 0..400_u32 {
        let off = f64::from(k * 7919 % 201) / 100.0 - 1.0;
        let other = f64::from(k * 104_729 % 211) / 105.0 - 1.0;
        let (x, y, yaw) = (0.02 * off, 0.02 * other, 0.005 * off * other);
        writeln!(text, "{k},{x},{y},{yaw},0.0004,0,0,0.0004,0,0.000025,0,0,0").expect("a text");
    }
    text
}

/// Returns a linked firmware with a record to fill in.
fn firmware() -> Vec<u8> {
    let mut image = b"code before ".to_vec();
    image.extend(posegate::gate::Seal::MAGIC);
    image.extend([0xff; 12]);
    image.extend([7; 300]);
    posegate_testkit::commands::elf(0x0800_0000, &image)
}
