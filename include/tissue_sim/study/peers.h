#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "tissue_sim/study/paper_protocol.h"

namespace tissue_sim {

/// What a user would pick instead, from the distribution's packages, run on the same meshes along the same path. Where
/// a package was absent when the benchmark was built its functions answer with nothing.

struct PeerStep {
  double seconds = 0.0;
  int contacts = 0;
};

/// Bullet's soft body: the whole step.
struct BulletSettings {
  enum class Rigid { sphere, hull };  ///< btSphereShape, or btConvexHullShape of the rigid sphere's vertices
  const char* name = "";
  const char* text = "";
  Rigid rigid = Rigid::sphere;
  int iterations = 1;      ///< of the position solver
  int bending = 0;         ///< links between vertices up to this many edges apart; 0: edges only
  double matching = 0.0;   ///< kMT
  double stiffness = 1.0;  ///< kLST
};

std::string bullet_version();  ///< empty: absent
std::vector<BulletSettings> bullet_settings();
std::vector<PeerStep> run_bullet(const PaperTest& test, const BulletSettings& settings);

/// FCL's bounding volume hierarchies, refitted to the organ in every step: detection.
enum class FclTree { aabb, obbrss };
constexpr std::array<FclTree, 2> fcl_trees = {FclTree::aabb, FclTree::obbrss};
const char* to_string(FclTree tree);
std::string fcl_version();  ///< empty: absent

using TrianglePair = std::array<int, 2>;  ///< of the organ, of the instrument

class FclDetection {
 public:
  virtual ~FclDetection() = default;

  /// Refits the organ's tree to `positions` (scene frame) and finds every pair of triangles that intersect, ascending.
  /// Only the refit and the search are timed. `points`: the contact points and normals of each pair are found too.
  virtual PeerStep detect(const std::vector<Vector3>& positions, const Pose& instrument, bool points,
                          std::vector<TrianglePair>& pairs) = 0;
};
/// Null: FCL is absent.
std::unique_ptr<FclDetection> make_fcl_detection(FclTree tree, const TriangleMesh& organ,
                                                 const TriangleMesh& instrument);

}  // namespace tissue_sim
