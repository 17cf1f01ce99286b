//! `deltille`: make, detect, calibrate with and verify deltille targets.
//!
//! Input: arguments. Output: files, messages and an exit code. The modules, in the order in which a user meets their
//! commands:
//!
//! 1. `make` plans and makes targets, and verifies their files.
//! 2. `see` detects targets in photographs.
//! 3. `calibrate` calibrates cameras and rigs from detections, proposes the next photograph, and compares results.
//! 4. `apply` uses the calibrated cameras: target poses, robots, undistorted images.
//! 5. `measure` evaluates the library itself.
//!
//! `files` contains the input and output shared by all of them, and `examples` the end of each command's help,
//! and `first_options` the options that its short form lists.

mod apply;
mod calibrate;
mod examples;
pub(crate) mod files;
mod first_options;
mod make;
mod measure;
mod see;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

use self::apply::{accept, check, hand_eye, pose, timing, undistort};
use self::calibrate::{compare, guide, one_camera, rig};
use self::make::{aprilgrid, board, charuco, circles, plan, solid, verify};
use self::measure::{bench, experiment};
use self::see::{detect, refine, render};
use crate::shell;
use crate::terminal::Verbosity;
use deltille::lattice::GridKind;
use deltille::targets::SolidShape;

pub use self::first_options::with_short_help;
pub use self::make::BoardSettings;

/// Make, verify and detect calibration targets, and calibrate cameras.
#[derive(Parser)]
#[command(name = "deltille", version, arg_required_else_help = false)]
pub struct Deltille {
    #[command(subcommand)]
    command: Command,
    #[command(flatten)]
    verbosity: Verbosity,
}

#[derive(Subcommand)]
enum Command {
    /// Propose a board for a camera and a range of distances
    #[command(after_help = examples::PLAN)]
    Plan(plan::Args),
    /// Make a board: its description, and files to print
    #[command(after_help = examples::BOARD, mut_arg("tags_in", |arg| arg.hide(true)))]
    Board(Box<board::Args>),
    /// Make a checkerboard, plain or with square tags
    #[command(after_help = examples::CHECKERBOARD)]
    #[command(mut_arg("family", |arg| arg.long("tags").alias("family")))]
    Checkerboard(Box<board::Args>),
    /// Make a ChArUco board (a checkerboard with markers) for OpenCV
    #[command(after_help = examples::CHARUCO)]
    Charuco(Box<charuco::Args>),
    /// Make an AprilGrid (rows of tags) for Kalibr
    #[command(after_help = examples::APRILGRID)]
    Aprilgrid(Box<aprilgrid::Args>),
    /// Make a circle grid, symmetric or asymmetric, for OpenCV
    #[command(after_help = examples::CIRCLES)]
    Circles(Box<circles::Args>),
    /// Make a tetrahedron with tagged boards on its faces: a net to print (PDF) and a mesh (glTF)
    #[command(after_help = examples::SOLID)]
    Tetrahedron(Box<solid::Args>),
    /// Make an octahedron with tagged boards on its faces: a net to print (PDF) and a mesh (glTF)
    #[command(after_help = examples::SOLID)]
    Octahedron(Box<solid::Args>),
    /// Make an icosahedron with tagged boards on its faces: a net to print (PDF) and a mesh (glTF)
    #[command(after_help = examples::SOLID)]
    Icosahedron(Box<solid::Args>),
    /// Make a cube with tagged checkerboards on its faces: a net to print (PDF) and a mesh (glTF)
    #[command(after_help = examples::CUBE)]
    #[command(mut_arg("tiles", |arg| arg.help(solid::squares::TILES)))]
    #[command(mut_arg("family", |arg| arg.help(solid::squares::FAMILY)))]
    #[command(mut_arg("tag_spacing", |arg| arg.help(solid::squares::SPACING)))]
    #[command(mut_arg("tag_border", |arg| arg.help(solid::squares::BORDER)))]
    #[command(mut_arg("dense", |arg| arg.hide(true)), mut_arg("hole", |arg| arg.hide(true)))]
    Cube(Box<solid::Args>),
    /// Make a cuboid with tagged checkerboards on its faces: a net to print (PDF) and a mesh (glTF)
    #[command(after_help = examples::CUBOID)]
    #[command(mut_arg("edge", |arg| arg.help(solid::squares::MEAN)))]
    #[command(mut_arg("tiles", |arg| arg.help(solid::squares::TILES)))]
    #[command(mut_arg("family", |arg| arg.help(solid::squares::FAMILY)))]
    #[command(mut_arg("tag_spacing", |arg| arg.help(solid::squares::SPACING)))]
    #[command(mut_arg("tag_border", |arg| arg.help(solid::squares::BORDER)))]
    #[command(mut_arg("dense", |arg| arg.hide(true)), mut_arg("hole", |arg| arg.hide(true)))]
    Cuboid(Box<solid::CuboidArgs>),
    /// Make a solid from any closed mesh of triangles, rectangles and other convex faces
    #[command(after_help = examples::MESH)]
    #[command(mut_arg("edge", |arg| arg.help(solid::MEAN_OF_MESH)))]
    Solid(Box<solid::MeshArgs>),
    /// Verify the files of a target against its description
    #[command(after_help = examples::VERIFY)]
    Verify(verify::Args),
    /// Render a synthetic photograph of a target, with the true positions of its corners
    #[command(after_help = examples::RENDER)]
    Render(render::Args),
    /// Detect a target, or untagged boards, in photographs
    #[command(after_help = examples::DETECT)]
    Detect(detect::Args),
    /// Refine given corner positions
    #[command(after_help = examples::REFINE)]
    Refine(refine::Args),
    /// Propose the next view of the target, until the camera is calibrated accurately enough
    #[command(after_help = examples::GUIDE)]
    Guide(Box<guide::Args>),
    /// Calibrate a camera from detected corners
    #[command(after_help = examples::CALIBRATE)]
    Calibrate(one_camera::Args),
    /// Calibrate the intrinsics and extrinsics of a multi-camera rig
    #[command(after_help = examples::RIG)]
    Rig(rig::Args),
    /// Test whether two calibrations of a camera or rig differ significantly
    ///
    /// The exit code is 0 if they do not differ, 1 if they do, and 3 if this cannot be determined because the
    /// uncertainties of a camera are unknown. Use the .json of a calibration, which contains them.
    #[command(after_help = examples::COMPARE)]
    Compare(compare::Args),
    /// Test whether a camera or a rig is still as calibrated, from a few photographs of a target
    ///
    /// The answer is `unchanged` (exit code 0), `changed` with what has changed (1), or `cannot tell` with what is
    /// missing (3). The camera file must contain uncertainties: the .json of `deltille calibrate` or `deltille rig`. Errors of a
    /// printed board hide small changes unless it was measured (--measure-target).
    #[command(after_help = examples::CHECK)]
    Check(check::Args),
    /// Measure known lengths with a camera or a rig, and judge their errors against a limit
    ///
    /// The photographs must not be those of the calibration. A rig triangulates corners. One camera measures them in the plane of
    /// the target and takes the scale from it. Exit code: 0 if all errors are within the limit by more than their expanded
    /// uncertainty (95 %), 1 if an error exceeds it by more, 3 if the uncertainty is too large to decide.
    #[command(after_help = examples::ACCEPT)]
    Accept(Box<accept::Args>),
    /// Estimate the pose of a target in photographs from a calibrated camera
    #[command(after_help = examples::POSE)]
    Pose(pose::Args),
    /// Locate a camera and a board on a robot (hand–eye and robot–world calibration)
    ///
    /// The result are the poses of the camera on the flange and of the board in the base (eye-in-hand), or of the camera in
    /// the base and of the board on the flange (--eye-to-hand). Poses and photographs are paired by name if each pose
    /// names its photograph, else by time stamp, else by order.
    #[command(name = "handeye", after_help = examples::HAND_EYE)]
    HandEye(Box<hand_eye::Args>),
    /// Estimate rolling shutters, and offsets of the clocks of a rig, from a recording of a moving target
    ///
    /// The recording must contain all frames; move the target smoothly and fast, but without motion blur of more than a few
    /// pixels.
    #[command(after_help = examples::TIMING)]
    Timing(timing::Args),
    /// Undistort images to a pinhole projection, or write the remap tables
    #[command(after_help = examples::UNDISTORT)]
    Undistort(undistort::Args),
    /// Rectify two cameras of a rig, so that a point is in the same row of both images
    #[command(after_help = examples::RECTIFY, mut_arg("output", |arg| arg.help("Output folder")))]
    Rectify(undistort::PairArgs),
    /// Measure the run time of the detection stages on this machine
    Bench(bench::Args),
    /// Evaluate the library on simulated images, or on the photographs of Ha et al. (ICCV 2017)
    Experiment(experiment::Args),
    /// Generate shell completions
    #[command(after_help = shell::COMPLETIONS)]
    Completions(shell::Completions),
    /// Write manual pages
    #[command(after_help = shell::MAN)]
    Man(shell::Man),
}

/// Runs the program.
pub fn run(deltille: Deltille) -> anyhow::Result<ExitCode> {
    deltille.verbosity.set();
    match deltille.command {
        Command::Bench(args) => bench::run(args),
        Command::Calibrate(args) => one_camera::run(args),
        Command::Accept(args) => accept::run(*args),
        Command::Check(args) => check::run(args),
        Command::Compare(args) => compare::run(args),
        Command::Guide(args) => guide::run(*args),
        Command::HandEye(args) => hand_eye::run(*args),
        Command::Timing(args) => timing::run(args),
        Command::Plan(args) => plan::run(args),
        Command::Board(args) => board::run(GridKind::Deltille, *args),
        Command::Checkerboard(args) => board::run(GridKind::Checker, *args),
        Command::Charuco(args) => charuco::run(*args),
        Command::Aprilgrid(args) => aprilgrid::run(*args),
        Command::Circles(args) => circles::run(*args),
        Command::Tetrahedron(args) => solid::run(SolidShape::Tetrahedron, *args),
        Command::Octahedron(args) => solid::run(SolidShape::Octahedron, *args),
        Command::Icosahedron(args) => solid::run(SolidShape::Icosahedron, *args),
        Command::Cube(args) => solid::run(SolidShape::Cube, *args),
        Command::Cuboid(args) => solid::run_cuboid(*args),
        Command::Solid(args) => solid::run_mesh(*args),
        Command::Detect(args) => detect::run(args),
        Command::Experiment(args) => experiment::run(args),
        Command::Refine(args) => refine::run(args),
        Command::Pose(args) => pose::run(args),
        Command::Rig(args) => rig::run(args),
        Command::Render(args) => render::run(args),
        Command::Undistort(args) => undistort::run(args),
        Command::Rectify(args) => undistort::run_pair(args),
        Command::Verify(args) => verify::run(args),
        Command::Completions(args) => shell::completions::<Deltille>(args),
        Command::Man(args) => shell::man::<Deltille>(args),
    }
}
