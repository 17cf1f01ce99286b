"""Calibrate a rig of two cameras with an icosahedron: extrinsics of the cameras, and the true poses of its faces.

    python rig_with_icosahedron.py

The images are synthetic, so that the results can be compared with the truth.
"""

import numpy

import deltille


def main() -> None:
    target = deltille.Icosahedron(edge_mm=100, name="ico")
    camera = deltille.Camera(1600, 1200, 1600 / 2 / numpy.tan(0.25))
    # Two cameras, a quarter of a metre apart, that look at the same point.
    places = {
        "left": deltille.Pose.looking_at((-125, 0, 0), (0, 0, 700), (0, -1, 0)),
        "right": deltille.Pose.looking_at((125, 0, 0), (0, 0, 700), (0, -1, 0)),
    }
    pictures: dict[str, list[numpy.ndarray]] = {name: [] for name in places}
    for i in range(15):
        turn = 3 * numpy.sin([0.7 * i, 1.1 * i + 1.57, 0.3 * i])
        moved = (30 * numpy.sin(i), 30 * numpy.cos(i), 680 + 20 * numpy.sin(i))
        world_from_target = deltille.Pose(turn, moved)
        for name, camera_from_world in places.items():
            picture, _ = deltille.render(target, camera, camera_from_world @ world_from_target, seed=i)
            pictures[name].append(picture)

    detector = deltille.Detector(target)
    seen = {}
    for name, of_camera in pictures.items():
        # Images taken at the same time have the same name, here their index in the list.
        found = deltille.detect_many(of_camera, detector, ink_of_all=False)
        print(f"{name}: {sum(len(one) for one in found)} corners in {len(found)} images")
        seen[name] = found

    rig = deltille.rig(seen, target, refine_target=True)
    print(rig)
    truth = places["right"] @ places["left"].inverse()
    right = rig.cameras["right"]
    off = right.pose @ truth.inverse()
    print(f"right camera: {numpy.linalg.norm(right.pose.tvec - truth.tvec):.3f} mm and "
          f"{numpy.degrees(numpy.linalg.norm(off.rvec)):.4f}° off the truth")
    print("standard deviations:", numpy.round(right.pose_sd[3:], 3), "mm")
    rig.save("rig.json")
    rig.report("rig.html")
    [refined] = rig.refined_targets
    moved = numpy.linalg.norm(refined.corners - target.corners, axis=1)
    print(f"corners are up to {moved.max():.3f} mm from their nominal positions")
    refined.save(".", formats=[])


if __name__ == "__main__":
    main()
