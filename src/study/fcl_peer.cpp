#include <algorithm>
#include <chrono>

#include "tissue_sim/study/peers.h"

#ifdef TISSUE_SIM_HAS_FCL
#include <fcl/config.h>
#include <fcl/geometry/bvh/BVH_model.h>
#include <fcl/narrowphase/collision.h>
#include <fcl/narrowphase/detail/traversal/collision/mesh_collision_traversal_node.h>
#include <fcl/narrowphase/detail/traversal/collision_node.h>
#endif

namespace tissue_sim {

const char* to_string(FclTree tree) {
  switch (tree) {
    case FclTree::aabb:
      return "AABB";
    case FclTree::obbrss:
      return "OBBRSS";
  }
  return "";
}

#ifdef TISSUE_SIM_HAS_FCL

namespace {

template <class Bv>
constexpr bool oriented = !std::is_same<Bv, fcl::AABBd>::value;

/// Boxes that are not oriented know no pose: given one, fcl::collide() copies the model, turns every vertex and builds
/// the tree anew in every call, and without one it still copies. So the organ is carried into the instrument's frame
/// before, and the trees are descended without fcl::collide(), which was much faster.
template <class Bv>
class Detection : public FclDetection {
 public:
  Detection(const TriangleMesh& organ, const TriangleMesh& instrument) : placed_(organ.vertices) {
    fill(organ, organ_);
    fill(instrument, instrument_);
  }

  PeerStep detect(const std::vector<Vector3>& positions, const Pose& pose, bool points,
                  std::vector<TrianglePair>& pairs) override {
    const auto start = std::chrono::steady_clock::now();
    fcl::Transform3d tip = fcl::Transform3d::Identity();
    if (oriented<Bv>) {
      tip.linear() = pose.orientation.toRotationMatrix();
      tip.translation() = pose.position;
      placed_ = positions;
    } else {
      for (std::size_t v = 0; v < positions.size(); ++v) placed_[v] = pose.apply_inverse(positions[v]);
    }
    organ_.beginReplaceModel();
    organ_.replaceSubModel(placed_);
    organ_.endReplaceModel(true, true);

    const fcl::CollisionRequestd request(1u << 30, points);
    result_.clear();
    search(tip, request);
    PeerStep step;
    step.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

    pairs.clear();
    for (std::size_t i = 0; i < result_.numContacts(); ++i) {
      const fcl::Contactd& contact = result_.getContact(i);
      pairs.push_back({static_cast<int>(contact.b1), static_cast<int>(contact.b2)});
    }
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    step.contacts = static_cast<int>(pairs.size());
    return step;
  }

 private:
  static void fill(const TriangleMesh& mesh, fcl::BVHModel<Bv>& model) {
    std::vector<fcl::Triangle> triangles;
    for (const auto& [a, b, c] : mesh.triangles) {
      triangles.emplace_back(static_cast<std::size_t>(a), static_cast<std::size_t>(b), static_cast<std::size_t>(c));
    }
    model.beginModel();
    model.addSubModel(mesh.vertices, triangles);
    model.endModel();
  }

  void search(const fcl::Transform3d& tip, const fcl::CollisionRequestd& request) {
    if constexpr (oriented<Bv>) {
      fcl::collide(&organ_, fcl::Transform3d::Identity(), &instrument_, tip, request, result_);
    } else {
      fcl::detail::MeshCollisionTraversalNode<Bv> node;
      fcl::Transform3d organ_pose = tip;
      fcl::Transform3d instrument_pose = tip;
      fcl::detail::initialize(node, organ_, organ_pose, instrument_, instrument_pose, request, result_);
      fcl::detail::collide(&node);
    }
  }

  std::vector<Vector3> placed_;
  fcl::BVHModel<Bv> organ_;
  fcl::BVHModel<Bv> instrument_;
  fcl::CollisionResultd result_;
};

}  // namespace

std::string fcl_version() {
  return FCL_VERSION;
}

std::unique_ptr<FclDetection> make_fcl_detection(FclTree tree, const TriangleMesh& organ,
                                                 const TriangleMesh& instrument) {
  switch (tree) {
    case FclTree::aabb:
      return std::make_unique<Detection<fcl::AABBd>>(organ, instrument);
    case FclTree::obbrss:
      return std::make_unique<Detection<fcl::OBBRSSd>>(organ, instrument);
  }
  return nullptr;
}

#else

std::string fcl_version() {
  return "";
}
std::unique_ptr<FclDetection> make_fcl_detection(FclTree, const TriangleMesh&, const TriangleMesh&) {
  return nullptr;
}

#endif

}  // namespace tissue_sim
