"""Register one case with one other library: run in the environment of the peers, which knows nothing of the product.

    python register.py PEER IN.npz OUT.npz

IN holds, in the scan frame after the start pose and in mm: `path` (n, 3) the nominal path along the edge; `surface`
(v, 3) and `faces` the nominal surface beside it, a strip whose first n vertices are the path; `rim` the points at
which the scan ends; `scan` the scan near the path; `spacing` its point spacing. OUT gets `path` as registered,
`seconds` of the registration alone, and `version`.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path

import numpy as np

REACHES_MM = (40.0, 15.0)
"""Largest distance of a pair, coarse to fine: the start is off by some 10 mm, the bend by as much."""
ITERATIONS = 300

Data = dict[str, np.ndarray]


def moved(T: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return (n, 3) points carried by a (4, 4) motion."""
    return points @ T[:3, :3].T + T[:3, 3]


def open3d_icp(d: Data, source: str, target: str, *, plane: bool = False) -> np.ndarray:
    """Return the path as registered by Open3D: point-to-point coarse to fine, or point-to-plane after that of the edge.

    Point-to-plane keeps the number of iterations that the library has: more of them slide further along the surface.
    """
    import open3d as o3d

    kit = o3d.pipelines.registration

    def cloud(name: str) -> o3d.geometry.PointCloud:
        return o3d.geometry.PointCloud(o3d.utility.Vector3dVector(d[name]))

    def point_to_point(source: str, target: str) -> np.ndarray:
        T, measure = np.eye(4), kit.TransformationEstimationPointToPoint()
        stop = kit.ICPConvergenceCriteria(1e-9, 1e-9, ITERATIONS)
        for reach in REACHES_MM:
            T = kit.registration_icp(cloud(source), cloud(target), reach, T, measure, stop).transformation
        return T

    if not plane:
        return moved(point_to_point(source, target), d["path"])
    fixed = cloud(target)
    fixed.estimate_normals(o3d.geometry.KDTreeSearchParamKNN(20))
    measure = kit.TransformationEstimationPointToPlane()
    start = point_to_point("path", "rim")
    found = kit.registration_icp(cloud(source), fixed, REACHES_MM[-1], start, measure)
    return moved(found.transformation, d["path"])


def small_gicp_align(d: Data, kind: str) -> np.ndarray:
    """Return the path as registered by small_gicp: its edge by `ICP`, or its surface by another kind after that.

    The cells are too small to thin the points. The second step keeps the number of iterations that the library has.
    """
    import small_gicp

    def cloud(name: str) -> tuple:
        return small_gicp.preprocess_points(d[name], downsampling_resolution=0.25 * float(d["spacing"]))

    (rim, tree), (edge, _), T = cloud("rim"), cloud("path"), np.eye(4)
    for reach in REACHES_MM:
        limits = {"max_correspondence_distance": reach, "max_iterations": ITERATIONS}
        T = small_gicp.align(rim, edge, tree, T, registration_type="ICP", **limits).T_target_source
    if kind != "ICP":
        (scan, tree), (surface, _) = cloud("scan"), cloud("surface")
        limits = {"max_correspondence_distance": REACHES_MM[-1]}
        T = small_gicp.align(scan, surface, tree, T, registration_type=kind, **limits).T_target_source
    return moved(T, d["path"])


def trimesh_icp(d: Data, source: str, target: str) -> np.ndarray:
    """Return the path as registered by `trimesh.registration.icp`."""
    from trimesh.registration import icp

    T, _, _ = icp(d[source], d[target], threshold=1e-9, max_iterations=ITERATIONS, reflection=False, scale=False)
    return moved(T, d["path"])


def trimesh_nricp(d: Data, kind: str) -> np.ndarray:
    """Return the edge of the strip as deformed by non-rigid ICP of trimesh after its rigid one, with its own steps."""
    import trimesh
    from trimesh.registration import icp, nricp_amberg, nricp_sumner

    T, _, _ = icp(d["path"], d["rim"], threshold=1e-9, max_iterations=ITERATIONS, reflection=False, scale=False)
    mesh = trimesh.Trimesh(moved(T, d["surface"]), d["faces"], process=False)
    deform = nricp_amberg if kind == "amberg" else nricp_sumner
    near = REACHES_MM[0] / mesh.scale
    found = deform(mesh, trimesh.PointCloud(d["scan"]), distance_threshold=near, use_faces=False)
    return np.asarray(found)[: len(d["path"])]


def pycpd(d: Data, kind: str) -> np.ndarray:
    """Return the path as registered by coherent point drift to the rim, lengths in radii of the path."""
    from pycpd import AffineRegistration, DeformableRegistration, RigidRegistration

    centre = d["path"].mean(axis=0)
    radius = np.linalg.norm(d["path"] - centre, axis=1).max()
    X, Y = (d["rim"] - centre) / radius, (d["path"] - centre) / radius
    common = {"X": X, "Y": Y, "w": 0.1, "max_iterations": ITERATIONS, "tolerance": 1e-8}
    if kind == "rigid":
        found = RigidRegistration(scale=False, **common)
    elif kind == "affine":
        found = AffineRegistration(**common)
    else:
        common["Y"] = RigidRegistration(scale=False, **common).register()[0]
        found = DeformableRegistration(**common)
    return found.register()[0] * radius + centre


def cloudcompare(d: Data, source: str, target: str) -> np.ndarray:
    """Return the path as registered by CloudCompare's ICP from its command line, headless."""
    with tempfile.TemporaryDirectory() as folder:
        moving, fixed = Path(folder) / "moving.xyz", Path(folder) / "fixed.xyz"
        np.savetxt(moving, d[source], fmt="%.6f")
        np.savetxt(fixed, d[target], fmt="%.6f")
        command = ["CloudCompare", "-platform", "offscreen", "-SILENT", "-AUTO_SAVE", "OFF", "-C_EXPORT_FMT", "ASC"]
        command += ["-O", str(moving), "-O", str(fixed), "-ICP", "-ITER", str(ITERATIONS), "-OVERLAP", "90"]
        command += ["-RANDOM_SAMPLING_LIMIT", "100000"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        matrices = list(Path(folder).glob("*MATRIX*.txt"))
        if not matrices:
            raise SystemExit(f"CloudCompare wrote no matrix: {(done.stdout + done.stderr).strip()[-200:]}")
        return moved(np.loadtxt(matrices[0]), d["path"])


def cloudcompare_version() -> str:
    """Return the version of the installed Debian package."""
    asked = ["dpkg-query", "--showformat=${Version}", "--show", "cloudcompare"]
    return subprocess.run(asked, capture_output=True, text=True, check=True).stdout


PEERS: dict[str, tuple[str, Callable[[Data], np.ndarray]]] = {
    "Open3D point-to-point, edge to rim": ("open3d", lambda d: open3d_icp(d, "path", "rim")),
    "Open3D point-to-point, surface": ("open3d", lambda d: open3d_icp(d, "surface", "scan")),
    "Open3D point-to-plane, surface": ("open3d", lambda d: open3d_icp(d, "surface", "scan", plane=True)),
    "small_gicp point-to-point, edge to rim": ("small_gicp", lambda d: small_gicp_align(d, "ICP")),
    "small_gicp point-to-plane, surface": ("small_gicp", lambda d: small_gicp_align(d, "PLANE_ICP")),
    "small_gicp GICP, surface": ("small_gicp", lambda d: small_gicp_align(d, "GICP")),
    "trimesh icp, edge to rim": ("trimesh", lambda d: trimesh_icp(d, "path", "rim")),
    "trimesh nricp_amberg, surface": ("trimesh", lambda d: trimesh_nricp(d, "amberg")),
    "trimesh nricp_sumner, surface": ("trimesh", lambda d: trimesh_nricp(d, "sumner")),
    "pycpd rigid, edge to rim": ("pycpd", lambda d: pycpd(d, "rigid")),
    "pycpd affine, edge to rim": ("pycpd", lambda d: pycpd(d, "affine")),
    "pycpd deformable, edge to rim": ("pycpd", lambda d: pycpd(d, "deformable")),
    "CloudCompare ICP, edge to rim": ("cloudcompare", lambda d: cloudcompare(d, "path", "rim")),
    "CloudCompare ICP, surface": ("cloudcompare", lambda d: cloudcompare(d, "surface", "scan")),
}


def main() -> None:
    """Register one case."""
    name, source, target = sys.argv[1:]
    package, run = PEERS[name]
    told = cloudcompare_version() if package == "cloudcompare" else version(package)
    if package != "cloudcompare":
        __import__(package)
    with np.load(source) as data:
        d = dict(data)
    begin = time.perf_counter()
    path = run(d)
    np.savez(target, path=path, seconds=time.perf_counter() - begin, version=told)


if __name__ == "__main__":
    main()
