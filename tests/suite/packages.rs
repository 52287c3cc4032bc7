//! The nodes are a ROS 2 package: colcon finds, builds and installs it, and what is installed is launched.

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::{Path, PathBuf};
use std::process::Command;

use lgvi_tests::{World, binary, root, ros_python};

use crate::launch_file::{composed_in, end, fly};

const PROGRAMS: [&str; 5] = [
    "lgvi",
    "lgvi_planner",
    "lgvi_player",
    "lgvi_propagator",
    "lgvi_recorder",
];

/// A stand-in for cargo: what would be built is built already.
const CARGO: &str = "#!/bin/sh
echo \"$@\" >> BUILT
";

/// A command of the ROS environment, before which the stand-in for cargo is found.
fn command(world: &World, program: &str) -> Command {
    let programs = ros_python().parent().unwrap().to_owned();
    let environment = programs.parent().unwrap();
    let cargo = world.path("bin/cargo");
    fs::create_dir_all(cargo.parent().unwrap()).unwrap();
    let script = CARGO.replace("BUILT", &world.path("built").display().to_string());
    fs::write(&cargo, script).unwrap();
    fs::set_permissions(&cargo, fs::Permissions::from_mode(0o755)).unwrap();
    let paths = [world.path("bin"), programs.clone()];
    let others = std::env::var_os("PATH").unwrap_or_default();
    let paths = paths.into_iter().chain(std::env::split_paths(&others));
    let mut command = world.command(&programs.join(program));
    command
        .env("PATH", std::env::join_paths(paths).unwrap())
        .env("AMENT_PREFIX_PATH", environment)
        .env("CMAKE_PREFIX_PATH", environment)
        .env_remove("COLCON_PREFIX_PATH");
    command
}

/// Has colcon install the package from the programs under test; returns the install space.
fn build(world: &World) -> PathBuf {
    let built = world.path("build/lgvi");
    fs::create_dir_all(&built).unwrap();
    let programs = binary("lgvi").parent().unwrap().to_owned();
    symlink(programs, built.join("release")).unwrap();
    let package = root().canonicalize().unwrap().join("nodes/lgvi");
    let mut colcon = command(world, "colcon");
    colcon.args(["build", "--base-paths"]).arg(&package).args([
        "--cmake-args",
        "-GNinja",
        "-DLGVI_FEATURES=security,zenoh",
    ]);
    world.start("colcon", colcon).finish().expect(0);
    let built = fs::read_to_string(world.path("built")).unwrap();
    let manifest = package.join("Cargo.toml");
    for argument in [
        &manifest.display().to_string(),
        "--release --locked",
        "--features security,zenoh",
    ] {
        assert!(built.contains(argument), "{argument} is not in {built}");
    }
    world.path("install")
}

/// Where ROS 2 looks for packages once the workspace's set-up file has been sourced.
fn prefixes(world: &World, install: &Path) -> PathBuf {
    let mut shell = world.command(Path::new("/bin/sh"));
    shell
        .args([
            "-c",
            ". ./install/local_setup.sh && printenv AMENT_PREFIX_PATH",
        ])
        .env("COLCON_CURRENT_PREFIX", install);
    let sourced = world.start("local_setup.sh", shell).finish().expect(0);
    sourced.stdout.trim().into()
}

/// All files below a directory that have this name.
fn named(directory: &Path, name: &str) -> usize {
    let entries = fs::read_dir(directory).unwrap().flatten();
    entries
        .map(|entry| match entry.path() {
            path if path.is_dir() => named(&path, name),
            path => usize::from(path.ends_with(name)),
        })
        .sum()
}

/// What colcon prints of the repository.
fn printed(world: &World, arguments: &[&str]) -> String {
    let mut colcon = command(world, "colcon");
    colcon
        .args(arguments)
        .arg("--base-paths")
        .arg(root().canonicalize().unwrap());
    world.start("colcon", colcon).finish().expect(0).stdout
}

#[test]
fn colcon_finds_the_messages_the_nodes_and_the_example_and_no_other_crate() {
    let world = World::new();
    let listed = printed(&world, &["list"]);
    let mut packages: Vec<(&str, &str)> = listed
        .lines()
        .filter_map(|line| Some((line.split('\t').next()?, line.split('\t').nth(2)?)))
        .collect();
    packages.sort_unstable();
    assert_eq!(
        packages,
        [
            ("lgvi", "(ros.ament_cmake)"),
            ("lgvi_examples_rclcpp", "(ros.ament_cmake)"),
            ("lgvi_msgs", "(ros.ament_cmake)")
        ]
    );
}

/// The crates below a directory that colcon's extension for Cargo would find, beside packages of ROS.
fn crates_for_colcon(directory: &Path) -> Vec<PathBuf> {
    let hidden = ["COLCON_IGNORE", "package.xml"];
    if hidden.iter().any(|name| directory.join(name).exists()) {
        return Vec::new();
    }
    let manifest = fs::read_to_string(directory.join("Cargo.toml")).unwrap_or_default();
    if manifest.contains("[package]") {
        return vec![directory.to_owned()];
    }
    let entries = fs::read_dir(directory).unwrap().flatten();
    entries
        .map(|entry| entry.path())
        .filter(|path| path.is_dir() && !path.ends_with("target") && !path.ends_with(".git"))
        .flat_map(|path| crates_for_colcon(&path))
        .collect()
}

#[test]
fn crates_are_no_packages_of_colcon() {
    assert_eq!(crates_for_colcon(&root()), Vec::<PathBuf>::new());
}

#[test]
fn the_nodes_are_built_without_the_example_and_it_without_them() {
    let world = World::new();
    let graph = printed(&world, &["graph", "--dot"]);
    let dependencies: Vec<_> = graph.lines().filter(|line| line.contains("->")).collect();
    let [one] = *dependencies else {
        panic!("{graph}")
    };
    assert!(one.trim().starts_with(r#""lgvi" -> "lgvi_msgs""#), "{one}");
}

#[test]
fn what_colcon_installs_is_found_by_ros_and_flies() {
    let world = World::new();
    let install = build(&world);
    let prefixes = prefixes(&world, &install);

    // As `ros2 pkg`, `ros2 run` and `ros2 launch` look for it: by the index, in `lib`, and anywhere in `share`.
    let find = "from ament_index_python.packages import *
print(get_packages_with_prefixes()['lgvi'], get_package_share_directory('lgvi'))";
    let mut python = world.command(&ros_python());
    python
        .env("AMENT_PREFIX_PATH", &prefixes)
        .args(["-c", find]);
    let found = world.start("ament_index_python", python).finish().expect(0);
    let (prefix, share) = (install.join("lgvi"), install.join("lgvi/share/lgvi"));
    assert_eq!(
        found.stdout.trim(),
        format!("{} {}", prefix.display(), share.display())
    );
    let programs = fs::read_dir(prefix.join("lib/lgvi")).unwrap().flatten();
    let mut programs: Vec<_> = programs.map(|entry| entry.file_name()).collect();
    programs.sort();
    assert_eq!(programs, PROGRAMS);
    for file in [
        "lgvi.launch.py",
        "node.launch.py",
        "replay.launch.py",
        "lgvi.rviz",
        "free_body.toml",
    ] {
        assert_eq!(named(&share, file), 1, "{file} in {}", share.display());
    }

    let bag = world.path("flight");
    let arguments = [
        format!(
            "scene:={}",
            share.join("scenes/inclination_change.toml").display()
        ),
        format!("bag:={}", bag.display()),
    ];
    let arguments: Vec<_> = arguments.iter().map(String::as_str).collect();
    let file = share.join("launch_scripts/lgvi.launch.py");
    let launched = composed_in(&world, &file, &arguments, &prefixes);
    for command in &launched.commands {
        let program = Path::new(&command[0]);
        assert!(program.starts_with(&prefix), "{command:?}");
    }
    end(fly(&world, &launched.commands, "/lgvi_propagator"));
    world.verify_agrees(&bag, 1001);
}

#[test]
fn a_debian_package_contains_programs_that_run_their_pages_and_their_completions() {
    let world = World::new();
    let programs = binary("lgvi").parent().unwrap().to_owned();
    fs::create_dir(world.path("packages")).unwrap();
    let mut debian = world.command(&root().join("packaging/debian"));
    debian
        .arg(programs)
        .env("CARGO_TARGET_DIR", world.path("packages"))
        // To compress the programs of a test takes a minute.
        .env("DPKG_DEB_COMPRESSOR_TYPE", "none");
    let made = world.start("debian", debian).finish().expect(0).stdout;

    let mut extract = world.command(Path::new("dpkg-deb"));
    extract
        .args(["--extract", made.trim()])
        .arg(world.path("root"));
    world.start("dpkg-deb", extract).finish().expect(0);
    let user = world.path("root/usr");
    for program in PROGRAMS {
        let mut help = world.command(&user.join("bin").join(program));
        help.arg("--help");
        let told = world.start(program, help).finish().expect(0).stdout;
        assert!(told.contains(program), "{told}");
    }
    for file in [
        "share/man/man1/lgvi-run.1.gz",
        "share/bash-completion/completions/lgvi",
        "share/lgvi/scenes/inclination_change.toml",
        "share/doc/lgvi/copyright",
    ] {
        assert!(user.join(file).is_file(), "{file} is missing");
    }
    let mut control = world.command(Path::new("dpkg-deb"));
    control.args(["--field", made.trim(), "Version", "Depends"]);
    let fields = world.start("dpkg-deb", control).finish().expect(0).stdout;
    let expected = concat!("Version: ", env!("CARGO_PKG_VERSION"), "\nDepends: libc6\n");
    assert_eq!(fields, expected, "of programs that are linked dynamically");
}
