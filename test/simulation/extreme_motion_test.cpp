#include <gtest/gtest.h>

#include <functional>

#include "simulation/solid_scenes.h"
#include "tissue_sim/simulation/timeline.h"

/// Instruments that move faster than any hand, and stand where none can.
namespace tissue_sim::extreme_motion_test {
namespace {

constexpr double ball_radius = 0.002;  // m
constexpr double speed = 5.0;          // m/s
constexpr double pi = 3.14159265358979;

struct Given {
  std::string name;
  Organ organ;
  double time_step = 0.001;  ///< s
};

/// All around the origin, some 30 mm across, edges of 5 mm and less.
std::vector<Given> all_organs() {
  const auto middle = [](Organ organ) {
    for (Vector3& v : organ.mesh.vertices) v.z() += 0.5 * soft_block_size.z();
    for (Vector3& v : organ.solid.vertices) v.z() += 0.5 * soft_block_size.z();
    return organ;
  };
  const auto block = [&](Model model, Integrator integrator) { return middle(soft_block(model, 3, integrator)); };
  std::vector<Given> all;
  for (const Model model : {Model::contact_only, Model::surface}) {
    Given given = {to_string(model), wall_sphere(12, 0.015)};
    given.organ.model = model;
    given.organ.wall_thickness = 0.002;
    given.organ.material.drag = 60.0;
    all.push_back(given);
  }
  all.push_back(all.back());
  all.back().name = "surface by descent";
  all.back().organ.integrator = Integrator::vertex_block_descent;
  all.push_back({"volume", block(Model::volume, Integrator::explicit_substeps)});
  all.push_back({"fem", block(Model::fem, Integrator::explicit_substeps)});
  all.push_back({"fem by descent", block(Model::fem, Integrator::vertex_block_descent)});
  all.push_back({"fem by descent, 50 ms", block(Model::fem, Integrator::vertex_block_descent), 0.05});
  return all;
}

/// 36 x 36 x 12 mm in cells of 2 mm, of which a part is awake.
Given with_levels() {
  const Vector3 size(0.036, 0.036, 0.012);
  Organ organ = solid_organ(make_block(size, {18, 18, 6}), size, Model::fem);
  for (Vector3& v : organ.mesh.vertices) v.z() += 0.5 * size.z();
  for (Vector3& v : organ.solid.vertices) v.z() += 0.5 * size.z();
  organ.integrator = Integrator::explicit_substeps;
  organ.material.drag = 60.0;
  organ.levels_tolerance = 0.2;
  return {"levels", organ};
}

/// Poses in, steps out, and what is seen on the way.
struct Motions {
  Timeline timeline;
  std::vector<Vector3> rest;
  std::int64_t stamp = 1'000'000'000;  // ns
  std::size_t contacts = 0;            ///< in the steps of the last pose
  std::uint64_t recovered_before = 0;  ///< the last pose
  std::uint64_t recovered = 0;         ///< steps that said so
  double farthest = 0.0;               ///< m

  Motions(const Given& given, const std::vector<Instrument>& instruments)
      : timeline([&] {
          Scene scene = scene_of(given.organ, instruments);
          scene.time_step = given.time_step;
          return scene;
        }()) {
    const OrganView organ = timeline.organ(0);
    rest.assign(organ.positions.begin(), organ.positions.end());
  }

  void go(const std::vector<Pose>& poses, double duration) {
    stamp += std::llround(1e9 * duration);
    for (std::size_t i = 0; i < poses.size(); ++i) timeline.add_pose(static_cast<int>(i), {stamp, poses[i]});
    contacts = 0;
    recovered_before = recovered;
    while (timeline.step()) look();
    EXPECT_EQ(timeline.counters().recoveries, recovered);
  }

  /// A contact, or more of it than the organ bears: then the last good state is back, and the report says so.
  bool felt() const { return contacts > 0 || recovered > recovered_before; }

  void look() {
    const StepReport& report = timeline.report();
    contacts += report.contacts.size();
    recovered += report.recovered ? 1 : 0;
    for (const Wrench& wrench : report.wrenches) ASSERT_TRUE(wrench.force.allFinite() && wrench.torque.allFinite());
    for (const OrganContact& contact : report.contacts) {
      ASSERT_TRUE(contact.point.allFinite() && contact.force.allFinite() && std::isfinite(contact.depth));
    }
    const OrganView organ = timeline.organ(0);
    for (std::size_t v = 0; v < rest.size(); ++v) {
      ASSERT_TRUE(organ.positions[v].allFinite());
      farthest = std::max(farthest, (organ.positions[v] - rest[v]).norm());
    }
  }

  double away_from_rest() const {
    const OrganView organ = timeline.organ(0);
    double away = 0.0;
    for (std::size_t v = 0; v < rest.size(); ++v) away = std::max(away, (organ.positions[v] - rest[v]).norm());
    return away;
  }
};

Pose at(const Vector3& place) {
  return {place, Eigen::Quaterniond::Identity()};
}

/// Instruments go far away, and after a while the organ is as it was.
void expect_it_comes_back(Motions& motions, std::size_t instruments, const std::string& what) {
  std::vector<Pose> away;
  for (std::size_t i = 0; i < instruments; ++i) away.push_back(at({0.5, 0.1 * static_cast<double>(i), 0.5}));
  motions.go(away, 0.001);
  motions.go(away, 0.001);
  EXPECT_EQ(motions.contacts, 0u) << what;
  for (int i = 0; i < 400; ++i) motions.go(away, 0.01);
  const std::uint64_t before = motions.recovered;
  for (int i = 0; i < 10; ++i) motions.go(away, 0.01);
  EXPECT_EQ(motions.recovered, before) << what << ": left alone, it goes bad";
  EXPECT_LT(motions.away_from_rest(), 2e-5) << what;
}

/// The same of a solid that was pressed through itself: there are tangled shapes at rest that it does not come out of.
/// It is quiet there, and a reset brings it back.
void expect_it_is_quiet(Motions& motions, std::size_t instruments, const std::string& what) {
  std::vector<Pose> away;
  for (std::size_t i = 0; i < instruments; ++i) away.push_back(at({0.5, 0.1 * static_cast<double>(i), 0.5}));
  for (int i = 0; i < 100; ++i) motions.go(away, 0.01);
  const std::uint64_t before = motions.recovered;
  for (int i = 0; i < 10; ++i) motions.go(away, 0.01);
  EXPECT_EQ(motions.recovered, before) << what << ": left alone, it goes bad";
  motions.timeline.reset(0);
  motions.go(away, 0.01);
  EXPECT_EQ(motions.away_from_rest(), 0.0) << what;
}

void expect_it_comes_back_or_is_quiet(Motions& motions, std::size_t instruments, const Given& given) {
  is_solid(given.organ.model) ? expect_it_is_quiet(motions, instruments, given.name)
                              : expect_it_comes_back(motions, instruments, given.name);
}

bool restores(const Given& given) {
  return given.organ.model != Model::contact_only;
}

/// At 5 m/s through the organ, from all sides, a pose every `period`: contact is there no later than the pose by which
/// the ball's middle is inside. From there on the organ has moved, and nothing is known of its surface.
void fly_through(const Given& given, double period, int passes) {
  Motions motions(given, {ball(ball_radius)});
  Box box;
  for (const Vector3& v : motions.rest) box.add(v);
  Random random(5);
  for (int pass = 0; pass < passes; ++pass) {
    const Vector3 way = random_direction(random);
    const Vector3 through = 0.3 * box.size().cwiseProduct(random_point(random));
    const double start = -0.06 - random_in(random, 0.0, speed * period);
    motions.timeline.reset(0);
    motions.go({at({0.5, 0.5, 0.5})}, 0.001);
    motions.go({at(through + start * way)}, 0.02);
    bool felt = false;
    double reached = start;
    while (!felt && reached < 0.0) {
      reached += speed * period;
      motions.go({at(through + reached * way)}, period);
      felt = motions.felt();
    }
    ASSERT_TRUE(felt) << given.name << ", pass " << pass << ", a pose every " << period << " s";
    for (int i = 0; i < 3; ++i) motions.go({at(through + (reached += speed * period) * way)}, period);
  }
  if (restores(given)) expect_it_comes_back_or_is_quiet(motions, 1, given);
}

TEST(ExtremeMotion, AtFiveMetresASecondNoPassageIsUnfelt) {
  for (const Given& given : all_organs()) {
    for (const double period : {0.2, 0.001, 0.0002}) fly_through(given, period, 12);
  }
  for (const double period : {0.2, 0.001, 0.0002}) fly_through(with_levels(), period, 3);
}

/// A needle and a flat blade are thinner than an edge.
TEST(ExtremeMotion, ThinInstrumentsAreFeltToo) {
  Instrument needle;
  needle.name = "needle";
  needle.parts.push_back({"needle", make_cylinder(0.0005, 0.03, 8), true});
  Instrument blade;
  blade.name = "blade";
  blade.parts.push_back({"blade", make_box({0.01, 0.0005, 0.02}), true});
  Random random(8);
  for (const Given& given : all_organs()) {
    for (const Instrument& instrument : {needle, blade}) {
      Motions motions(given, {instrument});
      for (int pass = 0; pass < 6; ++pass) {
        const Vector3 way = random_direction(random);
        const Pose turned = random_pose(random, 0.0);
        motions.timeline.reset(0);
        motions.go({{Vector3(0.5, 0.5, 0.5), turned.orientation}}, 0.001);
        motions.go({{-0.06 * way, turned.orientation}}, 0.02);
        bool felt = false;
        for (double reached = -0.06; reached < 0.06; reached += 0.001 * speed) {
          motions.go({{reached * way, turned.orientation}}, 0.001);
          felt = felt || motions.felt();
        }
        EXPECT_TRUE(felt) << given.name << ", " << instrument.name << ", pass " << pass;
      }
    }
  }
}

TEST(ExtremeMotion, TeleportsInAndOutAreFeltAndForgotten) {
  for (const Given& given : all_organs()) {
    Motions motions(given, {ball(ball_radius)});
    Random random(6);
    int felt = 0;
    for (int i = 0; i < 40; ++i) {
      motions.timeline.reset(0);
      motions.go({at({0.4, 0.3, 0.2})}, given.time_step);
      motions.go({at({0.4, 0.3, 0.2})}, given.time_step);
      EXPECT_EQ(motions.contacts, 0u) << given.name;
      motions.go({at(0.005 * random_point(random))}, given.time_step);
      motions.go({at(0.005 * random_point(random))}, given.time_step);
      felt += motions.felt() ? 1 : 0;
    }
    EXPECT_GT(felt, 20) << given.name;
    if (restores(given)) expect_it_comes_back_or_is_quiet(motions, 1, given);
  }
}

TEST(ExtremeMotion, TheWholeOrganInsideTheInstrumentIsFeltAndComesBack) {
  for (const Given& given : all_organs()) {
    Motions motions(given, {ball(0.08)});
    motions.go({at({0.0, 0.0, 0.5})}, given.time_step);
    bool felt = false;
    for (int i = 0; i < 20; ++i) {
      motions.go({at({0.0, 0.0, 0.01})}, given.time_step);
      felt = felt || motions.felt();
    }
    EXPECT_TRUE(felt) << given.name;
    if (restores(given)) expect_it_comes_back_or_is_quiet(motions, 1, given);
  }
}

/// One plate comes down on another below the organ: there is no room left at all.
TEST(ExtremeMotion, FlattenedToNothingBetweenTwoPlatesItComesBack) {
  Instrument plate;
  plate.name = "plate";
  plate.parts.push_back({"plate", make_box({0.1, 0.1, 0.02}), true});
  Instrument other = plate;
  other.name = "other";
  for (const Given& given : all_organs()) {
    Motions motions(given, {plate, other});
    double floor = 0.0;
    for (const Vector3& v : motions.rest) floor = std::min(floor, v.z());
    const auto gap = [&](double width) {
      motions.go({at({0, 0, floor + width + 0.01}), at({0, 0, floor - 0.01})}, 0.002);
    };
    motions.go({at({0, 0, 0.5}), at({0, 0, -0.5})}, 0.001);
    bool felt = false;
    for (int i = 0; i <= 100; ++i) {
      gap(0.032 * (100 - i) / 100.0);
      felt = felt || motions.felt();
    }
    EXPECT_TRUE(felt) << given.name;
    for (int i = 0; i < 20; ++i) gap(0.0);
    for (int i = 0; i <= 100; ++i) gap(0.032 * i / 100.0);
    if (restores(given)) expect_it_comes_back_or_is_quiet(motions, 2, given);
  }
}

/// A rod with a square section, pressed into the organ: about its own axis, and end over end.
TEST(ExtremeMotion, SpinningAHundredTimesASecondIsFeltAndStops) {
  Instrument rod;
  rod.name = "rod";
  rod.parts.push_back({"rod", make_box({0.006, 0.006, 0.04}), true});
  const double turn = 2.0 * pi * 100.0;  // rad/s
  std::vector<Given> organs = all_organs();
  organs.push_back(with_levels());
  for (const Given& given : organs) {
    for (const Vector3& axis : {Vector3(0, 0, 1), Vector3(0, 1, 0)}) {
      Motions motions(given, {rod});
      const double top = given.organ.mesh.vertices.empty() ? 0.0 : [&] {
        double highest = -1.0;
        for (const Vector3& v : given.organ.mesh.vertices) highest = std::max(highest, v.z());
        return highest;
      }();
      const double height = top + (axis.z() > 0.0 ? 0.02 : 0.003) - 0.002;
      motions.go({at({0.0, 0.0, top + 0.03})}, 0.001);
      std::size_t contacts = 0;
      double time = 0.0;
      for (int i = 0; i < 60; ++i) {
        time += 0.001;
        const Eigen::Quaterniond turned(Eigen::AngleAxisd(turn * time, axis));
        motions.go({{Vector3(0.0, 0.0, height), turned}}, 0.001);
        contacts += motions.contacts + (motions.felt() ? 1 : 0);
      }
      EXPECT_GT(contacts, 20u) << given.name;
      if (restores(given)) expect_it_comes_back_or_is_quiet(motions, 1, given);
    }
  }
}

/// A thin ball is dragged along by what crosses it, up to ten times its size, and let go in a shape that no number of
/// substeps holds: it goes bad in one step after the other until it is put to rest. In 750 crossings at 30 to 125 m/s
/// that took 31 steps at most; at 5 m/s there was none to recover from.
TEST(ExtremeMotion, AWallThatWasCrossedIsSoonHealthy) {
  Random random(12);
  for (const int slices : {16, 20, 23}) {
    for (const double crossing_speed : {speed, 100.0}) {
      Given given = {std::to_string(slices) + " slices", wall_sphere(slices)};
      given.organ.wall_thickness = 0.001;
      for (int pass = 0; pass < 4; ++pass) {
        Motions motions(given, {ball(0.005)});
        const Vector3 way = random_direction(random);
        const Vector3 through = 0.03 * random_point(random);
        bool felt = false;
        for (double reached = -0.08; reached < 0.12; reached += 0.001 * crossing_speed) {
          motions.go({at(through + reached * way)}, 0.001);
          felt = felt || motions.felt();
        }
        EXPECT_TRUE(felt) << given.name << ", pass " << pass;
        const Pose away = at(5.0 * way);
        for (int step = 0; step < (crossing_speed > speed ? 50 : 5); ++step) motions.go({away}, 0.001);
        const std::uint64_t before = motions.recovered;
        for (int step = 0; step < 200; ++step) motions.go({away}, 0.001);
        EXPECT_EQ(motions.recovered, before) << given.name << " at " << crossing_speed << " m/s, pass " << pass;
        EXPECT_EQ(motions.contacts, 0u);
      }
    }
  }
}

/// Above the organ and then below it, a step apart, with the rod's end passing through it on its way: half a turn end
/// over end in 5 ms.
TEST(ExtremeMotion, AnEndThatSwingsThroughTheOrganIsFelt) {
  Instrument rod;
  rod.name = "rod";
  rod.parts.push_back({"rod", make_cylinder(0.001, 0.1, 8), true});
  for (const Given& given : all_organs()) {
    Motions motions(given, {rod});
    const auto pose = [](double angle) {
      return Pose{{-0.06, 0.0, 0.0}, Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3(0, 1, 0)))};
    };
    motions.go({pose(0.0)}, 0.001);
    EXPECT_EQ(motions.contacts, 0u) << given.name;
    std::size_t contacts = 0;
    for (int i = 1; i <= 5; ++i) {
      motions.go({pose(0.2 * pi * i)}, 0.001);
      contacts += motions.contacts + (motions.felt() ? 1 : 0);
    }
    EXPECT_GT(contacts, 0u) << given.name;
  }
}

}  // namespace
}  // namespace tissue_sim::extreme_motion_test
