#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tissue_sim/scene/scene.h"
#include "tissue_sim/simulation/step_report.h"

namespace tissue_sim {

/// The paper's test objects and motion (its section 4), made exact: two equal spheres, one rigid, one an organ.

constexpr double paper_radius = 0.05;  ///< m

/// Slices and stacks of the spheres with 480, 1984 and 8064 triangles.
constexpr std::array<int, 3> paper_slices = {16, 32, 64};

/// The three approaches of Table 1.
enum class Approach { contact_only, without_restoration, with_restoration };
constexpr int approaches = 3;
const char* to_string(Approach approach);

/// One line of Table 1: slices of the spheres and the published seconds a collision step, one an approach.
struct PaperTest {
  int rigid = 0;
  int deformable = 0;
  std::array<double, approaches> seconds{};
};
extern const std::array<PaperTest, 9> paper_tests;

/// The instrument's centre at every step: along x from 2.2 R to 0.4 R in 200 steps (the cap inside is then 40 % of the
/// organ's area), then at 0.4 R up to 1.131 R, down to -1.131 R (20 % of the area) and back in 400 steps.
std::vector<Vector3> paper_path();

/// The rigid sphere is turned a little, so that no grid lines of the two fall together.
Pose paper_pose(const Vector3& centre);

/// The organ is attached by the 10 % of its area farthest from the instrument's start. Its stiffness is chosen for each
/// mesh so that the elements need one substep of the 1 ms step; only the time of a step is looked at. Depths by Eq.
/// 1-6.
Scene paper_scene(const PaperTest& test, Approach approach);

/// The mean of profiles, from their sum and how many there were.
StepProfile divided(const StepProfile& sum, int steps);

struct PaperResult {
  StepProfile mean;  ///< s, over the steps with contact
  int steps_with_contact = 0;
  std::int64_t contacts = 0;  ///< of all steps
  int substeps = 0;           ///< the most that a step took
  int recoveries = 0;         ///< by the health check
  std::uint64_t hash = 0;
};
PaperResult run_paper_test(const PaperTest& test, Approach approach);

}  // namespace tissue_sim
