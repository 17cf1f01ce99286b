//! Examples at the end of every command's help. `tests/it/files/help.rs` checks that each parses.

pub const PLAN: &str = "Examples:
  deltille plan --size 1920x1080 --fov 62 --distance 50cm..3m
  deltille plan --camera camera.yaml --distance 0.2..1m --tilt 60 --paper A3
  deltille plan --size 640x480 --distance 30cm..1m --checker";

pub const BOARD: &str = "Examples:
  deltille board --rows 10 --cols 11 --name desk -o desk
  deltille board --rows 7 --cols 9 --paper A3 --svg --png
  deltille board --rows 30 --cols 31 --edge 18mm --paper A4 --poster
  deltille board --rows 7 --cols 9 --edge 30mm --sdf --mjcf --texture 2048 -o models";

pub const CHECKERBOARD: &str = "Examples:
  deltille checkerboard --rows 8 --cols 11 --edge 25mm
  deltille checkerboard --rows 8 --cols 11 --tags t36h11 --name tagged -o tagged";

pub const CHARUCO: &str = "Examples:
  deltille charuco --squares 8x6 --edge 30mm --marker 22mm --dictionary 5x5_100
  deltille charuco --squares 11x8 --edge 20mm --dictionary apriltag_36h11 --svg --png -o board";

pub const APRILGRID: &str = "Examples:
  deltille aprilgrid --tags 6x6 --edge 25mm --gap 0.3
  deltille aprilgrid --tags 6x6 --edge 88mm --paper A0 --name wall -o wall";

pub const CIRCLES: &str = "Examples:
  deltille circles --circles 9x7 --spacing 25mm
  deltille circles --circles 4x11 --asymmetric --spacing 18mm --diameter 12mm";

pub const SOLID: &str = "Examples:
  deltille icosahedron --edge 150mm --pdf --name ico -o ico
  deltille octahedron --paper A4 --pages 2 --pdf
  deltille icosahedron --skeleton --per-face --pdf --dxf --name rigid -o rigid
  deltille tetrahedron --usd --texture 4096";

pub const CUBE: &str = "Examples:
  deltille cube --edge 150mm --pdf --name die -o die
  deltille cube --tiles 10 --skeleton --per-face --pdf --dxf
  deltille cube --usd --mjcf --texture 4096";

pub const CUBOID: &str = "Examples:
  deltille cuboid --size 200x150x100mm --pdf --gltf --name box -o box
  deltille cuboid --size 8x6x4in --paper tabloid --pdf";

pub const MESH: &str = "Examples:
  deltille solid --mesh part.obj --pdf
  deltille solid --mesh ball.obj --scale 1000 --name ball --gltf --pdf -o ball";

pub const VERIFY: &str = "Examples:
  deltille verify desk/desk.json
  deltille verify desk/desk.json from-the-printer.pdf --report verdict.json";

pub const RENDER: &str = "Examples:
  deltille render ico/ico.json --camera camera.yaml --eye 500,-300,350 -o view.png
  deltille render desk/desk.json --camera camera.yaml --pose 0.3,3.0,0,-90,60,420 --noise 2";

pub const DETECT: &str = "Examples:
  deltille detect photos --target desk/desk.json -o corners
  deltille detect 'photos/*.jpg' --target desk/desk.json --overlay -o corners
  deltille detect photos --grid checker --rows 8 --cols 11 -o corners
  deltille detect photos --target desk/desk.json --format parquet -o corners";

pub const REFINE: &str = "Examples:
  deltille refine photo.png --kind checker --seeds corners.csv";

pub const GUIDE: &str = "Examples:
  deltille guide photos --target desk/desk.json --picture next.png
  deltille guide photos --target desk/desk.json --once -o next.json --until 0.05";

pub const CALIBRATE: &str = "Examples:
  deltille calibrate video.mp4 --target desk/desk.json --report camera.html
  deltille calibrate run.mcap --topic /camera/image_raw --target desk/desk.json -o camera.yaml
  deltille calibrate photos --target desk/desk.json --model radtan --holdout 4
  deltille calibrate corners --grid checker --rows 8 --cols 11 --edge 25mm --model radtan5
  deltille calibrate corners --target desk/desk.json --measured 270.3,199.9";

pub const RIG: &str = "Examples:
  deltille rig run.mcap --topic /left/image_raw --topic /right/image_raw --target desk/desk.json
  deltille rig --camera left=left.mp4 --camera right=right.mp4 --target desk/desk.json -o rig
  deltille rig --camera left=corners/l --camera right=corners/r --target ico/ico.json
  deltille rig --camera a=a --camera b=b --known a=a.yaml --target ico/ico.json --refine-target";

pub const COMPARE: &str = "Examples:
  deltille compare monday.json friday.json
  deltille compare before.yaml after.json --tolerance 0.1 -o change.json";

pub const CHECK: &str = "Examples:
  deltille check camera.json today/*.jpg --target desk/desk.json
  deltille check camera.json corners --target desk/desk.json -o check.json
  deltille check rig.json --camera left=today/left --camera right=today/right --target desk/desk.json
  deltille check rig.json today.mcap --topic /left/image_raw --topic /right/image_raw --target desk/desk.json";

pub const ACCEPT: &str = "Examples:
  deltille accept camera.json today/*.jpg --target desk/desk.json --limit 0.1mm --report certificate.html
  deltille accept rig.json --camera left=today/left --camera right=today/right --target glass/glass.json --limit 0.05mm+L/5000 --lengths measured.csv --temperature 23.5±0.5 --expansion 8.5±0.3 -o acceptance.json";

pub const POSE: &str = "Examples:
  deltille pose photos --target desk/desk.json --camera camera.yaml
  deltille pose photo.png --target desk/desk.json --camera camera.yaml --all-images";

pub const HAND_EYE: &str = "Examples:
  deltille handeye photos --robot poses.csv --target desk/desk.json --camera camera.json
  deltille handeye corners --robot poses.txt --target desk/desk.json --eye-to-hand -o handeye.json";

pub const TIMING: &str = "Examples:
  deltille timing camera.json waved.mp4 --target desk/desk.json
  deltille timing rig.json waved.mcap --topic /left/image_raw --topic /right/image_raw --target desk/desk.json -o timing.json";

pub const UNDISTORT: &str = "Examples:
  deltille undistort photos --camera camera.yaml -o straight
  deltille undistort run.mcap --topic /left/image_raw --every 30 --camera left.yaml -o straight";

pub const RECTIFY: &str = "Examples:
  deltille rectify rig.json --pair left,right -o rectified
  deltille rectify rig.json --pair left,right --first left --second right -o rectified";
