#include "benchmark/plain_step.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>
#include <tuple>

#include "tissue_sim/simulation/step.h"
#include "tissue_sim/study/paper_protocol.h"

namespace tissue_sim::plain_step_test {
namespace {

struct Comparison {
  int steps_with_contact = 0;
  int contacts = 0;
  int other_contacts = 0;     ///< vertices that one of the two presses and the other does not
  int other_colliding = 0;    ///< vertices that collide in one of the two only
  double farthest = 0.0;      ///< m, between the same vertex of the two
  double force_apart = 0.0;   ///< N, the most, of the sum over the contacts
  double most_force = 0.0;    ///< N
  double farthest_way = 0.0;  ///< m, of a vertex from its rest place: what there is to get wrong
};

int count_different(std::vector<int> a, std::vector<int> b) {
  std::sort(a.begin(), a.end());
  std::sort(b.begin(), b.end());
  std::vector<int> different;
  std::set_symmetric_difference(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(different));
  return static_cast<int>(different.size());
}

std::vector<int> vertices_of(const std::vector<OrganContact>& contacts, const TriangleMesh& mesh) {
  std::vector<int> vertices;
  for (const OrganContact& contact : contacts) {
    int corner = 0;
    EXPECT_EQ(contact.barycentric.maxCoeff(&corner), 1.0) << "the spheres touch at vertices only";
    vertices.push_back(mesh.triangles[contact.triangle][corner]);
  }
  return vertices;
}

std::vector<int> vertices_of(const std::vector<PlainContact>& contacts) {
  std::vector<int> vertices;
  for (const PlainContact& contact : contacts) vertices.push_back(contact.vertex);
  return vertices;
}

/// Both along the paper's path up to step `last`, the plain step always from where the fast one began. Let run by
/// itself it would soon be elsewhere: a vertex that touches by a rounding error more bounces another way. `lag` (steps)
/// puts its instrument behind.
Comparison compare(const PaperTest& test, Approach approach, std::size_t last, std::size_t lag = 0) {
  const Scene scene = paper_scene(test, approach);
  const TriangleMesh& mesh = scene.organs.front().mesh;
  const World world = build_world(scene);
  Workspace workspace = build_workspace(world);
  State state = rest_state(world);
  StepReport report;
  PlainSimulation plain(scene);
  const std::vector<Vector3> path = paper_path();
  Comparison result;
  for (std::size_t i = 1; i <= last; ++i) {
    const OrganState& organ = state.organs.front();
    plain.positions = organ.positions;
    plain.velocities = organ.velocities;
    plain.touching = organ.touching.front();
    if (!organ.held.empty()) plain.held = organ.held;
    const std::size_t behind = i - std::min(lag, i - 1);
    plain.step(paper_pose(path[behind - 1]), paper_pose(path[behind]), 0.001);
    EXPECT_TRUE(plain.healthy);

    report.step = i;
    step(world, {0.001, {{true, paper_pose(path[i - 1]), paper_pose(path[i])}}}, state, workspace, report);
    EXPECT_EQ(report.substeps, 1);
    EXPECT_FALSE(report.recovered);

    result.steps_with_contact += report.contacts.empty() ? 0 : 1;
    result.contacts += static_cast<int>(report.contacts.size());
    result.other_contacts += count_different(vertices_of(report.contacts, mesh), vertices_of(plain.contacts));
    result.other_colliding += count_different(workspace.organs.front().detections.front().colliding, plain.colliding);
    double force = 0.0;
    double plain_force = 0.0;
    for (const OrganContact& contact : report.contacts) force += contact.force.norm();
    for (const PlainContact& contact : plain.contacts) plain_force += contact.force;
    result.most_force = std::max(result.most_force, force);
    result.force_apart = std::max(result.force_apart, std::abs(force - plain_force));
    for (std::size_t v = 0; v < mesh.vertices.size(); ++v) {
      result.farthest = std::max(result.farthest, (organ.positions[v] - plain.positions[v]).norm());
      result.farthest_way = std::max(result.farthest_way, (organ.positions[v] - mesh.vertices[v]).norm());
    }
  }
  return result;
}

class PlainStep : public testing::TestWithParam<std::tuple<std::size_t, Approach>> {};

TEST_P(PlainStep, MakesTheContactsAndTheShapeThatTheFastStepMakes) {
  const auto [number, approach] = GetParam();
  const bool large = paper_tests[number - 1].deformable == 64;
  const Comparison result = compare(paper_tests[number - 1], approach, large ? 120 : 600);
  EXPECT_GT(result.steps_with_contact, large ? 80 : 200);
  EXPECT_GT(result.farthest_way, 0.005);
  EXPECT_EQ(result.other_colliding, 0);
  EXPECT_EQ(result.other_contacts, 0) << "of " << result.contacts;
  EXPECT_LT(result.farthest, 1e-8);
  EXPECT_LE(result.force_apart, 1e-5 * result.most_force);
}

INSTANTIATE_TEST_SUITE_P(Tests, PlainStep,
                         testing::Combine(testing::Values(1, 3, 5, 9),
                                          testing::Values(Approach::contact_only, Approach::without_restoration,
                                                          Approach::with_restoration)),
                         [](const auto& test) {
                           return std::to_string(std::get<0>(test.param)) + "_" + to_string(std::get<1>(test.param));
                         });

TEST(PlainStep, ComparisonSeesAnInstrumentThatIsOneStepBehind) {
  const Comparison result = compare(paper_tests[4], Approach::with_restoration, 60, 1);
  EXPECT_GT(result.other_colliding, 0);
  EXPECT_GT(result.farthest, 1e-5);
}

}  // namespace
}  // namespace tissue_sim::plain_step_test
