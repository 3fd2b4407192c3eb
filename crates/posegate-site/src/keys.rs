//! Every key of the site file: its meaning, unit, range and an example.

use super::reader::Key;

const fn above_0(number: f64) -> bool {
    number > 0.0
}

// The file.
pub(super) const CAMERAS: Key = Key::new("camera", "one [camera.NAME] table per camera", "{ ... }");
pub(super) const TAGS: Key = Key::new("tag", "one [tag.NAME] table per tag", "{ ... }");
pub(super) const TASKS: Key = Key::new("task", "one [task.NAME] table per task", "{ ... }");
pub(super) const CHAINS: Key = Key::new("chain", "one [chain.NAME] table per chain", "{ ... }");
pub(super) const TABLE: Key = Key::new(
    "table",
    "a table with `extent`, `step` and `layout`",
    "{ step = { xy = 0.02, yaw_deg = 1.0 } }",
);
pub(super) const CONFIDENCE: Key =
    Key::new("confidence", "a table with `epsilon`", "{ epsilon = 0.99 }");
pub(super) const EPSILON: Key = Key::number(
    "epsilon",
    "a probability above 0 and below 1",
    "0.99",
    |number| number > 0.0 && number < 1.0,
);

// The controller.
pub(super) const SITE_CONTROLLER: Key = Key::new(
    "controller",
    "a table with `core` and `cycles_per_decision`",
    "{ core = \"cortex-m4f\", cycles_per_decision = 84000 }",
);
pub(super) const CORE: Key = Key::new(
    "core",
    "\"cortex-m4f\" (also for M7 and M33), \"cortex-m0plus\" or \"rv32imc\"",
    "\"cortex-m4f\"",
);
pub(super) const CYCLES_PER_DECISION: Key = Key::new(
    "cycles_per_decision",
    "the processor cycles that a decision may take: a whole number from 1 to 4294967295",
    "84000",
);
pub(super) const CYCLES_PER_INSTRUCTION: Key = Key::number(
    "cycles_per_instruction",
    "the cycles of an instruction on average, with the wait states of the flash: from 1 to 100",
    "2.0",
    |number| (1.0..=100.0).contains(&number),
);

pub(super) const LEVEL: Key = Key::new(
    "level",
    "the archive's level of optimization: \"3\" or \"s\"",
    "\"s\"",
);
pub(super) const TRACKER: Key = Key::new(
    "tracker",
    "true if fixes are carried along odometry, else false",
    "true",
);

// Poses.
const POSE3: &str =
    "{ x = 4.0, y = 0.0, z = 0.5, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 180.0 }";
pub(super) const X: Key = Key::new("x", "a number in metres", "0.25");
pub(super) const Y: Key = Key::new("y", "a number in metres", "0.0");
pub(super) const Z: Key = Key::new("z", "a number in metres", "0.5");
pub(super) const ROLL: Key = Key::new("roll_deg", "an angle in degrees", "0.0");
pub(super) const PITCH: Key = Key::new("pitch_deg", "an angle in degrees", "0.0");
pub(super) const YAW: Key = Key::new("yaw_deg", "an angle in degrees", "90.0");

// Cameras.
pub(super) const CAMERA: Key = Key::new(
    "camera",
    "a table with `width_px`, `height_px`, `fx`, `fy`, `cx`, `cy` (or `calibration`) and `mount`",
    "{ width_px = 640, ... }",
);
const PIXELS: &str = "a whole number of pixels, from 1 to 100000";
pub(super) const WIDTH: Key = Key::new("width_px", PIXELS, "640");
pub(super) const HEIGHT: Key = Key::new("height_px", PIXELS, "480");
const FOCAL: &str = "a focal length in pixels, above 0";
pub(super) const FX: Key = Key::number("fx", FOCAL, "615.0", above_0);
pub(super) const FY: Key = Key::number("fy", FOCAL, "615.0", above_0);
pub(super) const CX: Key = Key::new("cx", "the optical axis's column in pixels", "320.0");
pub(super) const CY: Key = Key::new("cy", "the optical axis's row in pixels", "240.0");
pub(super) const IMAGE: Key = Key::new(
    "image",
    "\"rect\" if the detector reads the rectified image (as apriltag_ros of ROS 2 does), \"raw\" if it reads \
     the camera's own",
    "\"rect\"",
);
pub(super) const DISTORTION: Key = Key::new(
    "distortion",
    "the lens: a table with `model` and `coefficients`",
    "{ model = \"plumb_bob\", coefficients = [-0.3, 0.1, 0.0, 0.0, 0.0] }",
);
pub(super) const MODEL: Key = Key::new(
    "model",
    "\"plumb_bob\", \"rational_polynomial\" or \"equidistant\"",
    "\"plumb_bob\"",
);
pub(super) const COEFFICIENTS: Key = Key::new(
    "coefficients",
    "k1, k2, p1, p2, k3 of plumb_bob; k1, k2, p1, p2, k3, k4, k5, k6 of rational_polynomial; k1, k2, k3, k4 of \
     equidistant",
    "[-0.3, 0.1, 0.0, 0.0, 0.0]",
);
pub(super) const CALIBRATION: Key = Key::new(
    "calibration",
    "a calibration of ROS, OpenCV, Kalibr, OKVIS, Basalt, VINS, ORB-SLAM or PhotonVision, or a CameraInfo message as text, with a path relative to the site file's folder",
    "\"front.yaml\"",
);
pub(super) const BORDER: Key = Key::number(
    "border_px",
    "width of the image's border that is not used, in pixels, at least 0",
    "2.0",
    |number| number >= 0.0,
);
pub(super) const ROI: Key = Key::new(
    "roi",
    "the part of the sensor that is read, in pixels of the whole image without binning",
    "{ x_offset = 0, y_offset = 0, width = 640, height = 480 }",
);
const OFFSET: &str = "a whole number of pixels, from 0 to 100000";
pub(super) const X_OFFSET: Key = Key::new("x_offset", OFFSET, "0");
pub(super) const Y_OFFSET: Key = Key::new("y_offset", OFFSET, "0");
pub(super) const ROI_WIDTH: Key = Key::new("width", PIXELS, "640");
pub(super) const ROI_HEIGHT: Key = Key::new("height", PIXELS, "480");
pub(super) const BINNING: Key = Key::new(
    "binning",
    "how many columns and how many rows of the sensor are binned into one: two whole numbers from 1 to 100",
    "[2, 2]",
);
pub(super) const MOUNT: Key = Key::new("mount", "the camera's pose on the robot", POSE3);

// Tags.
pub(super) const TAG: Key = Key::new(
    "tag",
    "a table with `id`, `family`, `size` and `pose`",
    "{ id = 7, ... }",
);
pub(super) const ID: Key = Key::new("id", "a whole number from 0 to 4294967295", "7");
pub(super) const FAMILY: Key = Key::new("family", "the name of a tag family", "\"tag36h11\"");
pub(super) const SIZE: Key = Key::number(
    "size",
    "the black border's outer edge in metres, above 0",
    "0.30",
    above_0,
);
pub(super) const POSE: Key = Key::new("pose", "the tag's pose in the world", POSE3);

// Candidates.
pub(super) const CANDIDATES: Key = Key::new(
    "candidate",
    "one [candidate.NAME] table per place where a tag could be mounted",
    "{ ... }",
);
pub(super) const CANDIDATE: Key = Key::new(
    "candidate",
    "a table like a tag's, with `cost`; `id` is optional",
    "{ family = \"tag36h11\", size = 0.2, pose = {...} }",
);
pub(super) const ROWS: Key = Key::new(
    "candidates",
    "one [candidates.NAME] table per row of places along a wall",
    "{ ... }",
);
pub(super) const ROW: Key = Key::new(
    "candidates",
    "a table with `wall`, `every`, `z`, `family` and `size`; `id` and `cost` are optional",
    "{ wall = \"north\", every = 1.5, z = [1.0, 1.4], family = \"tag36h11\", size = 0.2 }",
);
pub(super) const ROW_WALL: Key = Key::new(
    "wall",
    "the name of the [wall.NAME] table on which the tags could be mounted",
    "\"north\"",
);
pub(super) const ROW_EVERY: Key = Key::number(
    "every",
    "the distance between neighbours along the wall in metres, above 0",
    "1.5",
    above_0,
);
pub(super) const ROW_Z: Key = Key::new(
    "z",
    "the heights of the tags' middles above the floor in metres",
    "[1.0, 1.4]",
);
pub(super) const CANDIDATE_COST: Key = Key::number(
    "cost",
    "the cost of mounting the tag there, above 0 and at most 1000000",
    "1.0",
    |number| number > 0.0 && number <= 1e6,
);

// Goals.
pub(super) const GOALS: Key = Key::new("goal", "one [goal.NAME] table per goal", "{ ... }");
pub(super) const ONE_GOAL: Key = Key::new(
    "goal",
    "a pose in the world: `x` and `y` in metres, `yaw_deg` in degrees",
    "{ x = 0.0, y = 0.0, yaw_deg = 0.0 }",
);

// Frames on the robot.
pub(super) const FRAMES: Key = Key::new(
    "frame",
    "one [frame.NAME] table per frame on the robot whose poses are recorded",
    "{ ... }",
);
pub(super) const FRAME: Key = Key::new(
    "frame",
    "the frame's pose on the robot: that of its origin in base_link",
    "{ x = 0.6, y = 0.0, z = 0.4, roll_deg = 0.0, pitch_deg = 0.0, yaw_deg = 0.0 }",
);

// The origin.
pub(super) const ORIGIN: Key = Key::new(
    "origin",
    "the point of the map that is subtracted from every position in it: `x` and `y` in metres",
    "{ x = 448000.0, y = 5412000.0 }",
);

// Imports.
pub(super) const IMPORTS: Key = Key::new("import", "one [import.NAME] table per file", "{ ... }");
pub(super) const IMPORT: Key = Key::new(
    "import",
    "a table with `file` and `format`",
    "{ file = \"field.json\", format = \"wpilib\", ... }",
);
pub(super) const FILE: Key = Key::new(
    "file",
    "a file of tags or docks, with a path relative to the site file's folder; `tags.yaml#NAME` is one bundle or tag of apriltag_ros",
    "\"field.json\"",
);
pub(super) const FORMAT: Key = Key::new(
    "format",
    "\"wpilib\" or \"fmap\" (a field layout), \"apriltag_ros\" (tags.yaml), \"nav2_docks\" (a dock database, or parameters of the docking server) or \"posegate\" \
     ([tag.NAME] and [goal.NAME] tables)",
    "\"wpilib\"",
);
pub(super) const CONVENTION: Key = Key::new(
    "convention",
    "the file's tag frame, right and up being a viewer's: \"posegate\" or \"wpilib\" (x out of the face, y right, z \
     up), \"apriltag\" (AprilTag 3's library: x right, y down, z into the tag), \"apriltag_ros\" (the ROS nodes: x \
     right, y up, z out of the face) or \"opencv\" (the same axes, of images that are AprilTag's turned by 180 deg)",
    "\"apriltag_ros\"",
);
pub(super) const IMPORT_POSE: Key = Key::new(
    "pose",
    "the pose of the file's frame in the world; for a bundle, like a tag's: x out of its face",
    POSE3,
);
pub(super) const DOCK_DIRECTION: Key = Key::new(
    "dock_direction",
    "\"forward\" or \"backward\": how the robot enters the docks of nav2_docks; \"backward\" turns their headings by 180 deg",
    "\"backward\"",
);
pub(super) const DOCK_FRAME: Key = Key::new(
    "frame",
    "only the docks of this frame are read (nav2_docks)",
    "\"map\"",
);
pub(super) const PREFIX: Key = Key::new(
    "prefix",
    "the prefix of a tag's number or a dock's name",
    "\"t\"",
);

// Tasks.
pub(super) const TASK: Key = Key::new(
    "task",
    "a table with `kind`, `goal` and `success`",
    "{ kind = \"work\", ... }",
);
pub(super) const KIND: Key = Key::new("kind", "\"work\" or \"localization\"", "\"work\"");
pub(super) const GOAL: Key = Key::new(
    "goal",
    "the goal pose in the world: `x` and `y` in metres, `yaw_deg` in degrees; or the name of a goal",
    "{ x = 0.0, y = 0.0, yaw_deg = 0.0 }",
);
pub(super) const SUCCESS: Key = Key::new(
    "success",
    "a success set: a table with a `shape`",
    "{ shape = \"box\", x = [-0.08, 0.08], y = [-0.06, 0.06], yaw_deg = [-4.0, 4.0] }",
);
pub(super) const SHAPE: Key = Key::new(
    "shape",
    "\"box\", \"disc\", \"ellipse\", \"footprint\", \"visibility\" or \"clear\"",
    "\"box\"",
);
pub(super) const ANY: Key = Key::new(
    "any",
    "an array of success sets; the pose must be in at least one",
    "[{ shape = \"box\", ... }, { shape = \"box\", ... }]",
);
pub(super) const ALL: Key = Key::new(
    "all",
    "an array of success sets; the pose must be in all of them",
    "[{ shape = \"box\", ... }, { shape = \"clear\", ... }]",
);
pub(super) const ERROR_BOUND: Key = Key::new(
    "error_bound",
    "the localization's largest error: a table with `translation` and `yaw_deg`",
    "{ translation = 0.05, yaw_deg = 2.0 }",
);
pub(super) const BOUND_TRANSLATION: Key = Key::number(
    "translation",
    "an error in metres, above 0",
    "0.05",
    above_0,
);
pub(super) const BOUND_YAW: Key =
    Key::number("yaw_deg", "an error in degrees, above 0", "2.0", above_0);
pub(super) const BOUND_COVERAGE: Key = Key::number(
    "coverage",
    "the share of observations within the bound, above 0 and at most 1; default 1",
    "0.999",
    |number| number > 0.0 && number <= 1.0,
);

// Success sets.
const LENGTHS: &str = "an interval [lo, hi] in metres, lo at most hi";
pub(super) const BOX_X: Key = Key::new("x", LENGTHS, "[-0.08, 0.08]");
pub(super) const BOX_Y: Key = Key::new("y", LENGTHS, "[-0.06, 0.06]");
pub(super) const BOX_YAW: Key = Key::new(
    "yaw_deg",
    "an arc [lo, hi] in degrees, lo at most hi and hi at most lo + 360",
    "[-4.0, 4.0]",
);
pub(super) const RADIUS: Key = Key::number(
    "radius",
    "the farthest distance of the position from the centre in metres, above 0",
    "0.03",
    above_0,
);
const SEMI_AXIS: &str = "a semi-axis in metres, above 0";
pub(super) const SEMI_AXIS_A: Key = Key::number("a", SEMI_AXIS, "0.05", above_0);
pub(super) const SEMI_AXIS_B: Key = Key::number("b", SEMI_AXIS, "0.03", above_0);
pub(super) const AXIS_TURN: Key = Key::new(
    "turn_deg",
    "the direction of the semi-axis `a` in degrees, counter-clockwise from the goal's x",
    "0.0",
);
pub(super) const ROUND_X: Key = Key::new("x", "the centre in the goal frame in metres", "0.0");
pub(super) const ROUND_Y: Key = Key::new("y", "the centre in the goal frame in metres", "0.0");
pub(super) const FOOTPRINT: Key = Key::new(
    "footprint",
    "the robot's convex outline: [x, y] corners in metres, counter-clockwise (or one point)",
    "[[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2], [0.3, -0.2]]",
);
pub(super) const REGION: Key = Key::new(
    "region",
    "a convex region: at least 3 [x, y] corners in metres, counter-clockwise",
    "[[0.5, 0.4], [-0.5, 0.4], [-0.5, -0.4], [0.5, -0.4]]",
);
pub(super) const REGIONS: Key = Key::new(
    "regions",
    "an array of convex regions; the footprint lies in their union",
    "[[[0.5, 0.4], [-0.5, 0.4], [-0.5, -0.4], [0.5, -0.4]], ...]",
);
pub(super) const OBSTACLE: Key = Key::new(
    "obstacle",
    "a convex obstacle in the goal frame: at least 3 [x, y] corners in metres, counter-clockwise",
    "[[1.0, 0.2], [0.6, 0.2], [0.6, -0.2], [1.0, -0.2]]",
);
pub(super) const SEEN_BY: Key =
    Key::new("camera", "the name of a [camera.NAME] table", "\"front\"");
pub(super) const SEEN_TAG: Key = Key::new("tag", "the name of a [tag.NAME] table", "\"t7\"");
pub(super) const SEEN_TAGS: Key = Key::new(
    "tags",
    "the names of [tag.NAME] tables: at least one",
    "[\"t7\", \"t8\"]",
);
pub(super) const SEE: Key = Key::new(
    "see",
    "\"any\" (one of the tags is enough) or \"all\" of them",
    "\"any\"",
);
pub(super) const D_MIN: Key = Key::number("d_min", "a distance in metres, above 0", "0.4", above_0);
pub(super) const PSI_MIN: Key = Key::number(
    "psi_min_deg",
    "an angle in degrees, above 0 and below psi_max_deg",
    "15.0",
    |number| number > 0.0 && number < 90.0,
);
pub(super) const PX_PER_BIT: Key = Key::number(
    "px_per_bit_min",
    "a number of pixels, above 0",
    "2.5",
    above_0,
);
pub(super) const BITS: Key = Key::new(
    "bits",
    "a whole number: the bits along the black border's outer edge, including the border's own",
    "8",
);
pub(super) const BLUR: Key = Key::new(
    "blur",
    "a table with `yaw_rate_deg_s`, `exposure_s` and `px_max`",
    "{ yaw_rate_deg_s = 20.0, exposure_s = 0.005, px_max = 1.0 }",
);
pub(super) const YAW_RATE: Key = Key::number(
    "yaw_rate_deg_s",
    "the fastest rotation during an exposure, degrees per second, above 0",
    "20.0",
    above_0,
);
pub(super) const EXPOSURE: Key = Key::number(
    "exposure_s",
    "the exposure in seconds, above 0",
    "0.005",
    above_0,
);
pub(super) const BLUR_PX: Key = Key::number(
    "px_max",
    "the widest blur of the tag's centre in pixels, above 0",
    "1.0",
    above_0,
);
pub(super) const WALLS_SEEN: Key = Key::new(
    "walls",
    "the names of the [wall.NAME] tables that may hide the tag; default: all of them",
    "[\"rack\"]",
);
pub(super) const ERROR_MODEL: Key = Key::new(
    "error_model",
    "the name of an [error_model.NAME] table",
    "\"front-tags\"",
);
pub(super) const ERROR_LIMIT: Key = Key::new(
    "r",
    "the largest error: a table with `translation` (m) and `yaw_deg`",
    "{ translation = 0.05, yaw_deg = 2.0 }",
);

// Error models.
pub(super) const ERROR_MODELS: Key = Key::new(
    "error_model",
    "one [error_model.NAME] table per model",
    "{ ... }",
);
pub(super) const ONE_ERROR_MODEL: Key = Key::new(
    "error_model",
    "a table with `translation` and `yaw_deg`, or with `file`",
    "{ translation = [0.005, 0.002, 0.0, 0.01], yaw_deg = [0.1, 0.05, 0.0, 0.5] }",
);
pub(super) const MODEL_FILE: Key = Key::new(
    "file",
    "the path, relative to the site file's folder, of a model that `posegate learn bounds` wrote",
    "\"tags.toml\"",
);
pub(super) const MODEL_TAG_SIZE: Key = Key::number(
    "tag_size",
    "the size in metres of the tags for which the model is scaled, above 0",
    "0.30",
    above_0,
);
pub(super) const MODEL_LEAN: Key = Key::number(
    "lean_deg",
    "the largest lean of the detector's poses in degrees, 0 to 90: 0 if they are fitted on the floor; default: 20",
    "0.0",
    |lean| (0.0..=90.0).contains(&lean),
);
pub(super) const MODEL_TRANSLATION: Key = Key::number(
    "translation",
    "[c0, c1, c2, c3] of c0 + c1 d^2 + c2 phi^2 + c3 psi^2 in metres (m, rad, rad); only c3 may be below 0",
    "[0.005, 0.002, 0.0, 0.01]",
    |_| true,
);
pub(super) const MODEL_YAW: Key = Key::number(
    "yaw_deg",
    "[c0, c1, c2, c3] of c0 + c1 d^2 + c2 phi^2 + c3 psi^2 in degrees (m, rad, rad); only c3 may be below 0",
    "[0.1, 0.05, 0.0, 0.5]",
    |_| true,
);

// Walls.
pub(super) const WALLS: Key =
    Key::new("wall", "one [wall.NAME] table per wall or block", "{ ... }");
pub(super) const WALL: Key = Key::new(
    "wall",
    "a table with `from` and `to`, or with `corners`, and with `z`",
    "{ from = [2.0, 1.0], to = [2.0, 3.0], z = [0.0, 2.5] }",
);
pub(super) const WALL_FROM: Key =
    Key::new("from", "a corner [x, y] in the world, metres", "[2.0, 1.0]");
pub(super) const WALL_TO: Key = Key::new(
    "to",
    "another corner [x, y] in the world, metres",
    "[2.0, 3.0]",
);
pub(super) const WALL_CORNERS: Key = Key::new(
    "corners",
    "a block's convex outline: at least 3 [x, y] corners in the world, metres, counter-clockwise",
    "[[2.5, 1.0], [2.5, 3.0], [2.0, 3.0], [2.0, 1.0]]",
);
pub(super) const WALL_Z: Key = Key::new(
    "z",
    "its lower and upper end [lo, hi] above the floor in metres, lo below hi",
    "[0.0, 2.5]",
);
pub(super) const WALL_KEEP_OUTS: Key = Key::new(
    "keep_out",
    "areas where no tag may be mounted: doors, windows, shelves",
    "[{ along = [1.0, 2.0], z = [0.0, 2.1] }]",
);
pub(super) const KEEP_OUT_ALONG: Key = Key::new(
    "along",
    "an interval [lo, hi] along the wall, in metres from its first corner, lo below hi",
    "[1.0, 2.0]",
);
pub(super) const KEEP_OUT_Z: Key = Key::new(
    "z",
    "an interval [lo, hi] above the floor, in metres, lo below hi",
    "[0.0, 2.1]",
);

// Tolerances.
const OFF_BY: &str = "a distance in metres, 0 or more";
pub(super) const TOLERANCE: Key = Key::new(
    "tolerance",
    "how far off it may be: a table with `translation` (m) and `yaw_deg`",
    "{ translation = 0.01, yaw_deg = 0.5 }",
);
pub(super) const EXPECTED: Key = Key::new(
    "expected",
    "where the robot is expected about the goal: a table with `translation` (m) and `yaw_deg`",
    "{ translation = 1.0, yaw_deg = 10.0 }",
);
pub(super) const EXPECTED_YAW: Key = Key::number(
    "yaw_deg",
    "an angle in degrees, from 0 to 180",
    "10.0",
    |number| (0.0..=180.0).contains(&number),
);
pub(super) const MOUNT_TOLERANCE: Key = Key::new(
    "mount_tolerance",
    "how far off the mount may be: a table with `translation` (m) and `angle_deg` (about any axis)",
    "{ translation = 0.005, angle_deg = 0.3 }",
);
pub(super) const TOLERANCE_TRANSLATION: Key =
    Key::number("translation", OFF_BY, "0.01", |number| number >= 0.0);
const OFF_BY_ANGLE: &str = "an angle in degrees, from 0 to 45";
pub(super) const INTRINSICS: Key = Key::new(
    "tolerance",
    "how far off the calibration may be: a table with `focal` (a share of fx and of fy) and `centre_px` (of cx and \
     of cy)",
    "{ focal = 0.01, centre_px = 2.0 }",
);
pub(super) const FOCAL_SHARE: Key = Key::number(
    "focal",
    "a share of the focal lengths, from 0 to 0.5",
    "0.01",
    |number| (0.0..=0.5).contains(&number),
);
pub(super) const CENTRE_PX: Key = Key::number(
    "centre_px",
    "pixels of the image that the detector reads, 0 or more",
    "2.0",
    |number| number >= 0.0,
);
const fn small_angle(number: f64) -> bool {
    number >= 0.0 && number <= 45.0
}
pub(super) const TOLERANCE_YAW: Key = Key::number("yaw_deg", OFF_BY_ANGLE, "0.5", small_angle);
pub(super) const TOLERANCE_ANGLE: Key = Key::number("angle_deg", OFF_BY_ANGLE, "0.3", small_angle);
pub(super) const D_MAX: Key = Key::number("d_max", "a distance in metres, above 0", "5.5", above_0);
pub(super) const PHI_MAX: Key = Key::number(
    "phi_max_deg",
    "an angle in degrees, above 0 and at most 180",
    "25.0",
    |number| number > 0.0 && number <= 180.0,
);
pub(super) const PSI_MAX: Key = Key::number(
    "psi_max_deg",
    "an angle in degrees, above 0 and at most 90",
    "50.0",
    |number| number > 0.0 && number <= 90.0,
);
pub(super) const Z_NEAR: Key = Key::number("z_near", "a depth in metres, above 0", "0.05", above_0);

// Tables.
pub(super) const EXTENT: Key = Key::new(
    "extent",
    "the poses that a table covers, in the goal frame: `x`, `y` and `yaw_deg`",
    "{ x = [-2.0, 2.0], y = [-2.0, 2.0], yaw_deg = [-20.0, 20.0] }",
);
const EXTENT_LENGTHS: &str = "an interval [lo, hi] in metres, lo below hi";
pub(super) const EXTENT_X: Key = Key::new("x", EXTENT_LENGTHS, "[-2.0, 2.0]");
pub(super) const EXTENT_Y: Key = Key::new("y", EXTENT_LENGTHS, "[-2.0, 2.0]");
pub(super) const EXTENT_YAW: Key = Key::new(
    "yaw_deg",
    "an arc [lo, hi] in degrees, lo below hi and hi at most lo + 360",
    "[-20.0, 20.0]",
);
pub(super) const STEP: Key = Key::new(
    "step",
    "the size of a table's cells: a table with `xy` and `yaw_deg`",
    "{ xy = 0.02, yaw_deg = 1.0 }",
);
pub(super) const STEP_XY: Key =
    Key::number("xy", "a cell's edge in metres, above 0", "0.02", above_0);
pub(super) const STEP_YAW: Key = Key::number(
    "yaw_deg",
    "a cell's height in degrees, above 0",
    "1.0",
    above_0,
);
pub(super) const LAYOUT: Key = Key::new(
    "layout",
    "\"facets\", \"grid\", \"both\" or \"auto\"",
    "\"auto\"",
);

// Chains and driving.
pub(super) const CHAIN: Key = Key::new(
    "chain",
    "a table with `start` and `steps`",
    "{ start = { x = 0.0, y = 0.0, yaw_deg = 0.0, bounded = { translation = 1.0, yaw_deg = 2.0 } }, steps = [] }",
);
pub(super) const CHAIN_START: Key = Key::new(
    "start",
    "where the robot is believed to be: `x`, `y`, `yaw_deg`, and `bounded` or `covariance`",
    "{ x = 0.0, y = 0.0, yaw_deg = 0.0, bounded = { translation = 1.0, yaw_deg = 2.0 } }",
);
pub(super) const CHAIN_FRAME: Key = Key::new(
    "frame",
    "\"world\", or \"goal\" if `x`, `y`, `yaw_deg` and `covariance` are in the goal frame of the task to plan for",
    "\"world\"",
);
pub(super) const TASK_FROM: Key = Key::new(
    "from",
    "the name of a [chain.NAME] table: what is known of the pose where the robot sets out for this task",
    "\"staging\"",
);
pub(super) const CHAIN_SPREAD: Key = Key::new(
    "spread",
    "how far from there the estimate may be when the chain begins: `translation` (m) and `yaw_deg`; default: at that pose",
    "{ translation = 0.1, yaw_deg = 2.0 }",
);
pub(super) const CHAIN_BOUNDED: Key = Key::new(
    "bounded",
    "the farthest that the robot can be from there: `translation` (m) and `yaw_deg`",
    "{ translation = 1.0, yaw_deg = 2.0 }",
);
pub(super) const KNOWN_YAW: Key = Key::number(
    "yaw_deg",
    "an angle in degrees, from 0 to 180",
    "2.0",
    |number| (0.0..=180.0).contains(&number),
);
pub(super) const CHAIN_COVARIANCE: Key = Key::new(
    "covariance",
    "the covariance of x, y and yaw: three rows of three numbers, metres and radians, world axes",
    "[[0.04, 0.0, 0.0], [0.0, 0.04, 0.0], [0.0, 0.0, 0.001]]",
);
pub(super) const CHAIN_STEPS: Key = Key::new(
    "steps",
    "an array of `{ task = NAME }` and `{ navigate = [...], model = {...} }`",
    "[{ task = \"see-t7\" }, { task = \"dock\" }]",
);
pub(super) const STEP_TASK: Key = Key::new("task", "the name of a task", "\"dock\"");
pub(super) const NAVIGATE: Key = Key::new(
    "navigate",
    "an array of places: `[x, y, yaw_deg]` on a straight line, or `{ arc = [x, y] }` on a circle",
    "[[0.0, 0.0, 0.0], [0.5, 0.2, 10.0]]",
);
pub(super) const ARC: Key = Key::new(
    "arc",
    "the end of a circular arc that leaves in the robot's heading: x and y in metres",
    "[1.0, 0.5]",
);
pub(super) const DRIVE_MODEL: Key = Key::new(
    "model",
    "how driving adds to the pose error: `kind` is \"bounded\" (`k_turn`, `k_drift`, `k_slip`) or \"gaussian\" (`a1` to `a4`)",
    "{ kind = \"bounded\", k_turn = 0.02, k_drift = 0.01, k_slip = 0.02 }",
);
pub(super) const DRIVE_KIND: Key = Key::new("kind", "\"bounded\" or \"gaussian\"", "\"bounded\"");
const GAIN: &str = "a gain, at least 0";
const fn gain(number: f64) -> bool {
    number >= 0.0
}
pub(super) const K_TURN: Key = Key::number("k_turn", GAIN, "0.02", gain);
pub(super) const K_DRIFT: Key = Key::number("k_drift", GAIN, "0.01", gain);
pub(super) const K_SLIP: Key = Key::number("k_slip", GAIN, "0.02", gain);
pub(super) const A1: Key = Key::number("a1", GAIN, "0.002", gain);
pub(super) const A2: Key = Key::number("a2", GAIN, "0.001", gain);
pub(super) const A3: Key = Key::number("a3", GAIN, "0.003", gain);
pub(super) const A4: Key = Key::number("a4", GAIN, "0.002", gain);
pub(super) const NAVIGATION: Key = Key::new(
    "navigation",
    "a table with `model` and `controller`",
    "{ model = { kind = \"bounded\", k_turn = 0.02, k_drift = 0.01, k_slip = 0.02 } }",
);
pub(super) const CONTROLLER: Key = Key::new(
    "controller",
    "how far from a drive's end the controller may leave the estimate: `translation` (m) and `yaw_deg`",
    "{ translation = 0.01, yaw_deg = 0.5 }",
);

// The planner.
pub(super) const PLANNER: Key = Key::new(
    "planner",
    "a table with `look`, `r`, `metre`, `look_cost`, `views`, `range` and `least_margin`",
    "{ look = { camera = \"front\", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0 }, r = [[0.05, 2.0]] }",
);
pub(super) const PLANNER_LOOK: Key = Key::new(
    "look",
    "a visibility set without `tag`: every tag of the site gets a localization task with it",
    "{ camera = \"front\", d_max = 5.5, phi_max_deg = 25.0, psi_max_deg = 50.0 }",
);
pub(super) const PLANNER_R: Key = Key::new(
    "r",
    "an array of the largest errors [translation m, yaw_deg] of those tasks",
    "[[0.02, 1.0], [0.05, 2.0]]",
);
const PRICE: &str = "a cost, at least 0";
pub(super) const PLANNER_METRE: Key = Key::number("metre", PRICE, "1.0", gain);
pub(super) const PLANNER_LOOK_COST: Key = Key::number("look_cost", PRICE, "1.0", gain);
pub(super) const PLANNER_VIEWS: Key = Key::new(
    "views",
    "the number of places from which a tag is observed: a whole number from 1 to 64",
    "6",
);
fn margin(number: f64) -> bool {
    (1.0..=8.0).contains(&number)
}
pub(super) const PLANNER_LEAST_MARGIN: Key = Key::number(
    "least_margin",
    "the smallest margin of each step of a plan, from 1 to 8",
    "1.1",
    margin,
);
pub(super) const PLANNER_RANGE: Key = Key::number(
    "range",
    "the longest drive, metres, above 0",
    "20.0",
    above_0,
);
