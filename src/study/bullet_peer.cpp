#include "tissue_sim/study/peers.h"

#ifdef TISSUE_SIM_HAS_BULLET
#include <BulletSoftBody/btSoftBodyHelpers.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include "tissue_sim/study/measuring.h"
#endif

namespace tissue_sim {

/// In the manner of SoftDemo, whose bodies are a few units wide, with its margins: its Init_Torus and Init_TorusMatch;
/// and less than these, as fast as it goes. Its Init_Volume flew off when it was first touched, and its clusters found
/// no contact with a kinematic sphere and were five times slower.
std::vector<BulletSettings> bullet_settings() {
  using Rigid = BulletSettings::Rigid;
  return {
      {"as Init_Torus", "edges, bending (2), 2 iterations, btSphereShape", Rigid::sphere, 2, 2, 0.0, 1.0},
      {"one iteration", "edges, bending (2), 1 iteration, btSphereShape", Rigid::sphere, 1, 2, 0.0, 1.0},
      {"as Init_TorusMatch", "edges (0.1), pose matching (0.05), btSphereShape", Rigid::sphere, 1, 0, 0.05, 0.1},
      {"edges only", "edges, 1 iteration, btSphereShape", Rigid::sphere, 1, 0, 0.0, 1.0},
      {"edges only, mesh", "edges, 1 iteration, btConvexHullShape", Rigid::hull, 1, 0, 0.0, 1.0},
  };
}

#ifdef TISSUE_SIM_HAS_BULLET

namespace {

/// Bullet's units. Its distance field has voxels of a quarter of a unit and its margins are a fraction of one: in
/// metres there would be a handful of voxels.
constexpr double cm = 100.0;

btScalar scalar(double value) {
  return static_cast<btScalar>(value);
}
btVector3 vector(const Vector3& p) {
  return {scalar(cm * p.x()), scalar(cm * p.y()), scalar(cm * p.z())};
}
btTransform transform(const Pose& pose) {
  const Eigen::Quaterniond& q = pose.orientation;
  return btTransform(btQuaternion(scalar(q.x()), scalar(q.y()), scalar(q.z()), scalar(q.w())), vector(pose.position));
}

/// The organ of the paper's scene: attached vertices without mass, which is how Bullet holds them.
std::unique_ptr<btSoftBody> make_soft_body(const Organ& organ, const BulletSettings& settings,
                                           btSoftBodyWorldInfo& info) {
  std::vector<btScalar> vertices;
  std::vector<int> triangles;
  for (const Vector3& p : organ.mesh.vertices) {
    for (int axis = 0; axis < 3; ++axis) vertices.push_back(vector(p)[axis]);
  }
  for (const Triangle& triangle : organ.mesh.triangles)
    triangles.insert(triangles.end(), triangle.begin(), triangle.end());
  std::unique_ptr<btSoftBody> body(btSoftBodyHelpers::CreateFromTriMesh(info, vertices.data(), triangles.data(),
                                                                        static_cast<int>(organ.mesh.triangles.size())));
  body->m_materials[0]->m_kLST = scalar(settings.stiffness);
  if (settings.bending > 0) body->generateBendingConstraints(settings.bending);
  body->m_cfg.piterations = settings.iterations;
  body->m_cfg.kMT = scalar(settings.matching);
  body->setTotalMass(0.03F, true);  // kg, about that of the paper's organ
  for (const int v : organ.attached) body->setMass(v, 0.0F);
  if (settings.matching > 0.0) body->setPose(false, true);
  body->setActivationState(DISABLE_DEACTIVATION);
  return body;
}

std::unique_ptr<btConvexShape> make_rigid_shape(const TriangleMesh& mesh, const BulletSettings& settings) {
  if (settings.rigid == BulletSettings::Rigid::sphere) {
    return std::make_unique<btSphereShape>(scalar(cm * paper_radius));
  }
  auto hull = std::make_unique<btConvexHullShape>();
  for (const Vector3& p : mesh.vertices) hull->addPoint(vector(p), false);
  hull->recalcLocalAabb();
  hull->setMargin(0.0F);
  return hull;
}

}  // namespace

std::string bullet_version() {
  return std::to_string(btGetVersion() / 100) + "." + std::to_string(btGetVersion() % 100);
}

std::vector<PeerStep> run_bullet(const PaperTest& test, const BulletSettings& settings) {
  const Scene scene = paper_scene(test, Approach::with_restoration);
  const Organ& organ = scene.organs.front();

  btSoftBodyRigidBodyCollisionConfiguration configuration;
  btCollisionDispatcher dispatcher(&configuration);
  btDbvtBroadphase broadphase;
  btSequentialImpulseConstraintSolver solver;
  btSoftRigidDynamicsWorld world(&dispatcher, &broadphase, &solver, &configuration);
  world.setGravity({0, 0, 0});
  btSoftBodyWorldInfo& info = world.getWorldInfo();
  info.m_gravity.setZero();
  info.air_density = 0;
  info.m_broadphase = &broadphase;
  info.m_dispatcher = &dispatcher;
  info.m_sparsesdf.Initialize();

  const std::unique_ptr<btConvexShape> shape = make_rigid_shape(scene.instruments.front().parts.front().mesh, settings);
  const std::vector<Vector3> path = paper_path();
  btDefaultMotionState motion(transform(paper_pose(path.front())));
  btRigidBody rigid(btRigidBody::btRigidBodyConstructionInfo(0, &motion, shape.get()));
  rigid.setCollisionFlags(rigid.getCollisionFlags() | btCollisionObject::CF_KINEMATIC_OBJECT);
  rigid.setActivationState(DISABLE_DEACTIVATION);
  world.addRigidBody(&rigid);
  const std::unique_ptr<btSoftBody> soft = make_soft_body(organ, settings, info);
  world.addSoftBody(soft.get());

  std::vector<PeerStep> steps;
  for (std::size_t i = 1; i < path.size(); ++i) {
    motion.setWorldTransform(transform(paper_pose(path[i])));
    const double start = processor_seconds();
    world.stepSimulation(scalar(scene.time_step), 0);
    steps.push_back({processor_seconds() - start, soft->m_rcontacts.size()});
  }
  world.removeSoftBody(soft.get());
  world.removeRigidBody(&rigid);
  return steps;
}

#else

std::string bullet_version() {
  return "";
}
std::vector<PeerStep> run_bullet(const PaperTest&, const BulletSettings&) {
  return {};
}

#endif

}  // namespace tissue_sim
