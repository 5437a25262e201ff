#pragma once

#include <gtest/gtest.h>

#include "geometry/twins.h"
#include "tissue_sim/contact/detection.h"
#include "tissue_sim/contact/penetration.h"
#include "tissue_sim/geometry/primitives.h"

namespace tissue_sim {

/// An organ's surface with all that contact wants to know of it, and what contact finds.
struct TestOrgan {
  TriangleMesh mesh;
  MeshTopology topology;
  std::vector<int> roots;
  mutable SurfacePatches patches;  ///< fitted by whoever looks
  Detection detection;
  Penetration penetration;
  std::vector<char> memory;
  std::vector<Vector3> detected_in;  ///< vertices of the instrument of the last pass

  explicit TestOrgan(const TriangleMesh& surface_mesh)
      : mesh(surface_mesh),
        topology(build_topology(static_cast<int>(mesh.vertices.size()), mesh.triangles)),
        patches(build_patches(mesh.vertices, mesh.triangles, topology)),
        memory(mesh.vertices.size(), 0) {
    std::vector<char> seen(mesh.vertices.size(), 0);
    for (int root = 0; root < static_cast<int>(seen.size()); ++root) {
      if (seen[root]) continue;
      roots.push_back(root);
      for (std::vector<int> stack = {root}; !stack.empty();) {
        const int vertex = stack.back();
        stack.pop_back();
        seen[vertex] = 1;
        for (const auto& [a, b] : topology.edges) {
          if (a == vertex && !seen[b]) stack.push_back(b);
          if (b == vertex && !seen[a]) stack.push_back(a);
        }
      }
    }
    prepare(detection, surface());
    prepare(penetration, surface());
  }

  OrganSurface surface() const { return {mesh.vertices, mesh.triangles, topology, roots, patches}; }

  void move(const Pose& pose) {
    mesh = moved(mesh, pose);
    forget(patches);
  }

  const std::vector<int>& detect_in(const InstrumentSurface& instrument, const Pose& pose = Pose(),
                                    CollidingSet set = CollidingSet::flood) {
    if (instrument.vertices != detected_in) prepare(detection, surface());  // what it knows is of another one
    detected_in = instrument.vertices;
    detect(surface(), instrument, pose, set, memory, detection);
    return detection.colliding;
  }

  bool collides(int vertex) const {
    return std::binary_search(detection.colliding.begin(), detection.colliding.end(), vertex);
  }
};

/// m; nearer to a surface than this, which side a vertex is on is detection's to choose.
constexpr double undecided = 2e-9;

/// How many vertices detection has wrong, by winding numbers; those on the surface may be either.
inline int count_wrong(const TestOrgan& organ, const TriangleMesh& instrument, const Pose& pose) {
  int wrong = 0;
  for (int v = 0; v < static_cast<int>(organ.mesh.vertices.size()); ++v) {
    const Vector3 local = pose.apply_inverse(organ.mesh.vertices[v]);
    if (organ.collides(v) == is_inside(instrument, local)) continue;
    wrong += distance_to_mesh(instrument, local) > undecided ? 1 : 0;
  }
  return wrong;
}

inline Pose at(double x, double y, double z) {
  return {Vector3(x, y, z), Eigen::Quaterniond::Identity()};
}

}  // namespace tissue_sim
