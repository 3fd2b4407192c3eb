//! `ros2` and `nav2`: the node of `crates/posegate-ros2` with rclpy and Fast DDS from wheels, on loopback. `behaviortree`: the condition of
//! `integrations/behaviortree` with BehaviorTree.CPP.

use crate::arguments::Arguments;
use crate::board::{self, Level};
use crate::files::{self, Scratch, target_folder};
use crate::need;
use crate::report::Report;
use crate::shell::{Cmd, Result, cmd, program_at, say};
use std::fs;
use std::path::{Path, PathBuf};

const CRATE: &str = "crates/posegate-ros2";
/// The core of the controller that is emulated.
const CORE: &str = "thumbv7em-none-eabihf";
/// How often each cause that ends a permit is tried.
const RUNS: u64 = 5;
/// A release of ROS 2 as wheels of Python 3.11. There is no installation of ROS in these jobs.
struct Release {
    name: &'static str,
    environment: &'static str,
    modules: &'static str,
    wheels: &'static str,
}
const JAZZY: Release = Release {
    name: "Jazzy",
    environment: "ros2-tools",
    modules: "cyclonedds, lifecycle_msgs.srv",
    wheels: "ros-rclpy==7.1.6 ros-rmw-fastrtps-cpp==8.4.3 ros-geometry-msgs==5.3.6 ros-nav-msgs==5.3.6 ros-std-msgs==5.3.6 \
             ros-std-srvs==5.3.6 ros-diagnostic-msgs==5.3.6 ros-visualization-msgs==5.3.6 ros-lifecycle-msgs==2.0.3 mcap==1.6.0 cyclonedds==11.0.1",
};
const KILTED: Release = Release {
    name: "Kilted",
    environment: "ros2-kilted-tools",
    modules: "sys",
    wheels: "ros-rclpy==9.1.2 ros-rmw-fastrtps-cpp==9.3.3 ros-geometry-msgs==5.5.1 ros-nav-msgs==5.5.1 ros-std-msgs==5.5.1 \
             ros-std-srvs==5.5.1 ros-diagnostic-msgs==5.5.1 ros-visualization-msgs==5.5.1 mcap==1.6.0",
};
/// Modules whose import shows that a release is installed.
const MODULES: &str = "rclpy, mcap, geometry_msgs.msg, nav_msgs.msg, std_msgs.msg, std_srvs.srv, diagnostic_msgs.msg, visualization_msgs.msg";
/// The package of Python whose source has BehaviorTree.CPP 4.8.2 in it.
const TREES: &str = "behaviortreepy==0.1.4";

/// Lints and tests the crate, builds its program, and runs `tests/live` of the crate with Jazzy, and a part of it with Kilted. The argument is how often each cause that ends a
/// permit is tried; 50 is the deep variant.
pub fn ros2(given: &Arguments) -> Result {
    let runs = given.number(0, RUNS)?;
    need::targets(&[CORE])?;
    need::qemu()?;
    let jazzy = python(&JAZZY)?;
    let kilted = python(&KILTED)?;
    let manifest = format!("{CRATE}/Cargo.toml");
    say("lints");
    cmd("cargo fmt --check --manifest-path")
        .arg(&manifest)
        .run()?;
    for features in ["", "--no-default-features --features humble"] {
        in_target(
            cmd("cargo clippy --locked --release --all-targets --manifest-path").arg(&manifest),
        )
        .words(features)
        .words("-- -D warnings")
        .run()?;
    }
    say("tests without a network, and damaged payloads");
    in_target(cmd("cargo test --locked --release --manifest-path").arg(&manifest))
        .words("-- --nocapture --test-threads 1")
        .json()?;
    programs()?;
    let folder = Scratch::new()?;
    let bag = folder.join("drive.mcap");
    program_at(&target_folder().join("release/examples/drive_bag"))
        .arg(&bag)
        .arg(folder.join("drive.csv"))
        .run()?;
    say(JAZZY.name);
    live(&jazzy, "listener").json()?;
    live(&jazzy, "permit").json()?;
    live(&jazzy, "odometry").json()?;
    live(&jazzy, "failsafe").arg(runs.to_string()).json()?;
    live(&jazzy, "rows").arg(&bag).json()?;
    live(&jazzy, "cyclone").json()?;
    live(&jazzy, "fleet").json()?;
    live(&jazzy, "discovery").json()?;
    live(&jazzy, "docks").json()?;
    live(&jazzy, "managed").json()?;
    live(&jazzy, "detections").json()?;
    say("a controller on a serial line");
    let firmware = board::build(Level::Fast, CORE, "interrupt_gate")?;
    live(&jazzy, "serial")
        .arg(firmware)
        .arg(runs.to_string())
        .json()?;
    say(KILTED.name);
    live(&kilted, "permit").json()?;
    live(&kilted, "odometry").json()?;
    live(&kilted, "failsafe").arg("1").json()?;
    Ok(())
}

/// Plays the recording of Nav2 with its odometry to the node, at 1 and 20 times real time. Compares each verdict with the row of
/// `posegate replay`. The argument is the folder of the recordings.
pub fn nav2(given: &Arguments) -> Result {
    let folder = given.folder(0, "the folder of the recordings")?;
    let bag = folder.join("nav2/nav2_turtlebot.mcap");
    programs()?;
    for (release, speeds) in [(&JAZZY, "1 20"), (&KILTED, "20")] {
        let python = python(release)?;
        say(release.name);
        live(&python, "nav2")
            .arg(&bag)
            .arg("examples/sites/turtlebot.toml")
            .words(speeds)
            .json()?;
    }
    Ok(())
}

/// Builds the node and the program.
fn programs() -> Result {
    let manifest = format!("{CRATE}/Cargo.toml");
    in_target(cmd("cargo build --locked --release --manifest-path").arg(manifest)).run()?;
    cmd("cargo build --release -p posegate-cli -p posegate-replay --bin posegate")
        .words("--example drive_bag")
        .run()
}

/// Returns a command that runs a test of `tests/live` with a release of ROS.
fn live(python: &Path, name: &str) -> Cmd {
    program_at(python)
        .arg(format!("{CRATE}/tests/live/{name}.py"))
        .env("POSEGATE_NODE", files::release("posegate-node"))
        .env("POSEGATE", files::release("posegate"))
        .limit(600)
}

/// Builds BehaviorTree.CPP, and the condition with its test by CMake, and runs it.
pub fn behaviortree(_: &Arguments) -> Result {
    need::command("cmake", "cmake")?;
    need::command("g++", "g++")?;
    let library = behavior_tree_library()?;
    let build = target_folder().join("behaviortree");
    remove(&build)?;
    cmd("cmake -S integrations/behaviortree -DCMAKE_BUILD_TYPE=Release -DPOSEGATE_TESTS=ON -B")
        .arg(&build)
        .arg(format!("-DCMAKE_PREFIX_PATH={}", library.display()))
        .run()?;
    cmd("cmake --build").arg(&build).words("-j 2").run()?;
    program_at(&build.join("permit_test"))
        .arg("integrations/behaviortree/trees/dock_if_permitted.xml")
        .json()?;
    // What is installed is found by another project.
    let installed = build.join("installed");
    cmd("cmake --install")
        .arg(&build)
        .words("--prefix")
        .arg(&installed)
        .run()?;
    let user = build.join("user");
    cmd("cmake -S integrations/behaviortree/tests/user -B")
        .arg(&user)
        .arg(format!(
            "-DCMAKE_PREFIX_PATH={};{}",
            library.display(),
            installed.display()
        ))
        .run()?;
    cmd("cmake --build").arg(&user).run()?;
    let mut report = Report::default();
    let code = program_at(&user.join("user")).code()?;
    report.at_most(
        "behaviortree: a project that finds the package",
        code,
        "exit code",
        0,
    );
    report.finish()
}

/// Returns the Python with a release of ROS.
fn python(release: &Release) -> Result<PathBuf> {
    need::command("python3", "python3")?;
    let version = cmd("python3 --version").read()?;
    if !version.trim().starts_with("Python 3.11.") {
        return Err(format!(
            "the wheels of ROS 2 are for Python 3.11, and python3 is {}",
            version.trim()
        )
        .into());
    }
    let modules = format!("{MODULES}, {}", release.modules);
    need::python(release.environment, &modules, release.wheels)
}

/// Returns the folder in which BehaviorTree.CPP is installed. It is built once.
fn behavior_tree_library() -> Result<PathBuf> {
    let folder = target_folder().join("behaviortree-library");
    let installed = folder.join("installed");
    if installed.join("lib/cmake/behaviortree_cpp").is_dir() {
        return Ok(installed);
    }
    say("BehaviorTree.CPP");
    remove(&folder)?;
    files::make_folder(&folder)?;
    cmd("python3 -m pip download -q --no-deps --no-binary :all: -d")
        .arg(&folder)
        .arg(TREES)
        .run()?;
    let archives = files::files_ending(&folder, ".tar.gz")?;
    let archive = archives.first().ok_or("no source was downloaded")?;
    cmd("tar -C").arg(&folder).words("-xf").arg(archive).run()?;
    let name = files::name(archive);
    let source = folder
        .join(name.trim_end_matches(".tar.gz"))
        .join("BehaviorTree.CPP");
    let build = folder.join("build");
    cmd("cmake -DCMAKE_BUILD_TYPE=Release -DBTCPP_GROOT_INTERFACE=OFF -DBTCPP_SQLITE_LOGGING=OFF -DBTCPP_EXAMPLES=OFF")
        .words("-DBTCPP_BUILD_TOOLS=OFF -DBUILD_TESTING=OFF -S")
        .arg(&source)
        .arg("-B")
        .arg(&build)
        .arg(format!("-DCMAKE_INSTALL_PREFIX={}", installed.display()))
        .run()?;
    cmd("cmake --build").arg(&build).words("-j 2").run()?;
    cmd("cmake --install").arg(&build).run()?;
    Ok(installed)
}

/// Returns a command that builds into the folder of the other jobs.
fn in_target(command: Cmd) -> Cmd {
    command.env("CARGO_TARGET_DIR", target_folder())
}

/// Removes a folder of an earlier run.
fn remove(folder: &Path) -> Result {
    match folder.exists() {
        true => Ok(fs::remove_dir_all(folder)?),
        false => Ok(()),
    }
}
