#include "tissue_sim/simulation/health.h"

#include <gtest/gtest.h>

#include <functional>
#include <limits>

#include "floating_point_traps.h"
#include "geometry/twins.h"
#include "simulation/solid_scenes.h"

namespace tissue_sim::health_test {
namespace {

constexpr double bad_numbers[] = {std::numeric_limits<double>::quiet_NaN(),
                                  std::numeric_limits<double>::signaling_NaN(), std::numeric_limits<double>::infinity(),
                                  -std::numeric_limits<double>::infinity()};

/// Every number of a state by the name of its field.
struct Field {
  std::string name;
  std::vector<double*> numbers;
};

Field of_vectors(const std::string& name, std::vector<Vector3>& vectors) {
  Field field = {name, {}};
  for (Vector3& v : vectors) field.numbers.insert(field.numbers.end(), {&v.x(), &v.y(), &v.z()});
  return field;
}

Field of_numbers(const std::string& name, std::vector<double>& numbers) {
  Field field = {name, {}};
  for (double& number : numbers) field.numbers.push_back(&number);
  return field;
}

/// All that there are in it. Of a surface that is carried the step reads no place: it puts it there before.
std::vector<Field> fields_of(const OrganModel& model, OrganState& state) {
  std::vector<Field> fields = {of_vectors("positions", state.positions), of_vectors("velocities", state.velocities),
                               of_vectors("forces", state.forces), of_numbers("depths", state.depths),
                               of_numbers("untouched", state.untouched)};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto carried = static_cast<std::ptrdiff_t>(3 * model.rest.first_simulated);
    fields[i].numbers.erase(fields[i].numbers.begin(), fields[i].numbers.begin() + carried);
  }
  fields.push_back({"stiffening", {&state.stiffening}});
  fields.push_back({"pressing", {}});
  for (PlaceForce& place : state.pressing) {
    fields.back().numbers.insert(fields.back().numbers.end(), {&place.force, &place.stopping});
  }
  for (std::size_t piece = 0; piece < state.clearances.size(); ++piece) {
    Clearance& clearance = state.clearances[piece];
    fields.push_back({"clearances", {&clearance.shift, &clearance.turn}});
    for (const int v : model.poking[piece]) {
      fields.back().numbers.insert(fields.back().numbers.end(), {&clearance.free_until[v], &clearance.first_touch[v]});
    }
  }
  for (std::vector<Vector3>& centres : state.centres) fields.push_back(of_vectors("centres", centres));
  for (LevelState& level : state.levels) {
    fields.push_back(of_vectors("level positions", level.positions));
    fields.push_back(of_vectors("level velocities", level.velocities));
    fields.push_back(of_vectors("level push", level.push));
    fields.push_back({"level times", {&level.ahead, &level.speed}});
  }
  const auto none = [](const Field& field) { return field.numbers.empty(); };
  fields.erase(std::remove_if(fields.begin(), fields.end(), none), fields.end());
  return fields;
}

std::string not_a_number(const OrganModel& model, OrganState& state) {
  for (const Field& field : fields_of(model, state)) {
    for (const double* number : field.numbers) {
      if (!std::isfinite(*number)) return field.name;
    }
  }
  return "";
}

/// A ball that goes in and out of the organ, and numbers that are none, before every second step another one in another
/// field.
struct Injections {
  Simulation simulation;
  std::function<Pose(double)> pose_at;  ///< of a depth, m
  double depth;                         ///< m
  double duration = 0.001;              ///< s, of a step
  int made = 0;
  int recovered = 0;

  OrganState& state() { return simulation.state.organs[0]; }
  const OrganModel& model() const { return simulation.world.organs[0]; }
  Pose pose_after(int steps) const { return pose_at(depth * (0.6 + 0.4 * std::sin(0.05 * steps))); }

  void run(int count) {
    simulation.start_at(pose_at(-0.2 * depth));
    simulation.slide_to(pose_after(0), 20);
    Random random(11);
    for (int steps = 1; made < count && !testing::Test::HasFailure(); ++steps) {
      simulation.go_to(pose_after(2 * steps), duration);
      ASSERT_FALSE(simulation.report.recovered) << "step " << steps << " went bad by itself";
      inject(random, pose_after(2 * steps + 1));
    }
    EXPECT_GT(recovered, made / 4);
  }

  void inject(Random& random, const Pose& next) {
    const auto any = [&](std::size_t count) {
      return std::uniform_int_distribution<std::size_t>(0, count - 1)(random);
    };
    const std::vector<Field> fields = fields_of(model(), state());
    const Field& field = fields[any(fields.size())];
    double& number = *field.numbers[any(field.numbers.size())];
    const double was = number;
    // What was not read before it was written again changes nothing: the same step from a sound state tells.
    const State before = simulation.state;
    const Pose pose = simulation.poses[0];
    number = bad_numbers[any(4)];
    const double is = number;
    simulation.go_to(next, duration);
    ++made;
    // Of what sleeps and of instruments far away a step looks at a few hundred vertices.
    const std::size_t turns = (state().positions.size() + 255) / 256;
    for (std::size_t i = 1; i < turns && !simulation.report.recovered && !not_a_number(model(), state()).empty(); ++i) {
      simulation.go_to(next, duration);
    }
    EXPECT_EQ(not_a_number(model(), state()), "") << "after " << is << " for " << was << " in " << field.name;
    for (const OrganContact& contact : simulation.report.contacts) {
      EXPECT_TRUE(contact.point.allFinite() && contact.force.allFinite() && std::isfinite(contact.depth));
    }
    EXPECT_TRUE(simulation.report.wrenches[0].force.allFinite() && simulation.report.wrenches[0].torque.allFinite());
    if (simulation.report.recovered) {
      ++recovered;
      return;
    }
    if (turns > 1) return;  // the steps are not one
    const std::uint64_t hash = simulation.hash();
    simulation.state = before;
    simulation.poses[0] = pose;
    forget(simulation.workspace.organs[0]);
    simulation.go_to(next, duration);
    EXPECT_EQ(simulation.hash(), hash) << is << " for " << was << " in " << field.name << " was read and not noticed";
  }
};

constexpr double radius = 0.005;  // m

Pose over_sphere(double depth) {
  return {{0.0003, 0.0002, 0.02 + radius - depth}, Eigen::Quaterniond::Identity()};
}
Pose over_block(double depth) {
  return ball_over_block(radius, depth);
}

Organ small_sphere(Model model) {
  Organ organ = wall_sphere(8, 0.02);
  organ.model = model;
  return organ;
}

/// A tenth of them without TISSUE_SIM_LONG=1.
int long_run(int count) {
  return std::getenv("TISSUE_SIM_LONG") != nullptr ? count : count / 10;
}

void inject(const Scene& scene, Pose (*pose_at)(double), double depth, int count) {
  const WithoutTraps without_traps;
  Injections injections = {Simulation(scene), pose_at, depth};
  injections.duration = scene.time_step;
  injections.run(long_run(count));
  testing::Test::RecordProperty("injected", injections.made);
  testing::Test::RecordProperty("recovered", injections.recovered);
}

// 100,000 in all, of which the ordinary run makes a tenth.
TEST(Injected, IntoAnOrganThatIsOnlyTouched) {
  inject(scene_of(small_sphere(Model::contact_only), {ball(radius)}), over_sphere, 0.004, 20'000);
}

TEST(Injected, IntoAWall) {
  inject(scene_of(small_sphere(Model::surface), {ball(radius)}), over_sphere, 0.004, 20'000);
}

TEST(Injected, IntoAWallByDescent) {
  Organ organ = small_sphere(Model::surface);
  organ.integrator = Integrator::vertex_block_descent;
  inject(scene_of(organ, {ball(radius)}), over_sphere, 0.004, 10'000);
}

TEST(Injected, IntoAPlasticWallByThePapersScheme) {
  Organ organ = small_sphere(Model::surface);
  organ.restoration = false;
  organ.depth = DepthScheme::paper;
  inject(scene_of(organ, {ball(radius)}), over_sphere, 0.004, 10'000);
}

TEST(Injected, IntoSolids) {
  for (const Model model : {Model::volume, Model::fem}) {
    inject(scene_of(soft_block(model, 2), {ball(radius)}), over_block, 0.003, 10'000);
  }
}

TEST(Injected, IntoASolidByDescent) {
  const Organ organ = soft_block(Model::fem, 2, Integrator::vertex_block_descent);
  inject(scene_of(organ, {ball(radius)}), over_block, 0.003, 10'000);
}

TEST(Injected, IntoASolidThatCarriesASurface) {
  Organ organ = embedded_sphere(0.02, 10, 4, Model::fem);
  organ.integrator = Integrator::explicit_substeps;
  inject(
      scene_of(organ, {ball(radius)}),
      [](double depth) {
        return Pose{{0.0003, 0.0002, -0.002 + radius - depth}, Eigen::Quaterniond::Identity()};
      },
      0.003, 5'000);
}

/// 40 x 40 x 20 mm in cells of 3.3 mm, of which a part is awake.
TEST(Injected, IntoLevels) {
  const Vector3 size(0.06, 0.06, 0.02);
  Organ organ = solid_organ(make_block(size, {18, 18, 6}), size, Model::fem);
  organ.integrator = Integrator::explicit_substeps;
  organ.levels_tolerance = 0.2;
  const Scene scene = scene_of(organ, {ball(radius)});
  const World world = build_world(scene);
  ASSERT_FALSE(world.organs[0].levels.empty());
  inject(scene, over_block, 0.003, 4'000);
}

TEST(Injected, IntoAWallOfWhichAPartIsAwake) {
  Organ organ = wall_sphere(40, 0.04);
  organ.wall_thickness = 0.0004;
  organ.levels_tolerance = 0.05;
  organ.attached.clear();
  for (int v = 0; v < static_cast<int>(organ.mesh.vertices.size()); v += 5) organ.attached.push_back(v);
  const Scene scene = scene_of(organ, {ball(radius)});
  const World world = build_world(scene);
  ASSERT_FALSE(world.organs[0].regions.empty());
  inject(
      scene,
      [](double depth) {
        return Pose{{0.0003, 0.0002, 0.04 + radius - depth}, Eigen::Quaterniond::Identity()};
      },
      0.003, 1'000);
}

TEST(Injected, IntoAnOrganAsleep) {
  const WithoutTraps without_traps;
  for (const bool in_velocity : {false, true}) {
    Simulation simulation(scene_of(small_sphere(Model::surface), {ball(radius)}));
    simulation.start_at(over_sphere(-0.1));
    simulation.go_to(over_sphere(-0.11));
    OrganState& state = simulation.state.organs[0];
    ASSERT_TRUE(state.asleep);
    (in_velocity ? state.velocities : state.positions)[7].x() = bad_numbers[0];
    simulation.go_to(over_sphere(-0.12));
    EXPECT_TRUE(simulation.report.recovered);
    EXPECT_EQ(simulation.organ().positions, simulation.rest().positions);
    simulation.go_to(over_sphere(-0.13));
    EXPECT_FALSE(simulation.report.recovered);
  }
}

/// Too many to look at in every step: in turn, until the state is shown again.
TEST(Injected, IntoALargeOrganAsleepIsFoundInTurn) {
  const WithoutTraps without_traps;
  Organ organ = wall_sphere(100);
  organ.model = Model::contact_only;
  Simulation simulation(scene_of(organ, {ball(radius)}));
  const std::size_t vertices = organ.mesh.vertices.size();
  for (const std::size_t v : {std::size_t{0}, vertices / 2, vertices - 1}) {
    simulation.start_at(over_sphere(-0.2));
    simulation.state.organs[0].positions[v].z() = bad_numbers[2];
    int steps = 0;
    do {
      simulation.go_to(over_sphere(-0.2));
    } while (++steps < 100 && !simulation.report.recovered);
    EXPECT_LE(steps, 40) << "of " << vertices << " vertices, 256 a step";
    EXPECT_EQ(simulation.organ().positions, simulation.rest().positions);
  }
}

}  // namespace
}  // namespace tissue_sim::health_test
