#pragma once

#include <vector>

#include "tissue_sim/contact/instrument_surface.h"
#include "tissue_sim/scene/scene.h"
#include "tissue_sim/simulation/step_report.h"
#include "tissue_sim/tissue/rest_shape.h"

namespace tissue_sim {

/// The paper's step as a textbook would write it, one organ against one rigid piece of an instrument, one substep a
/// step: what the fast step is compared with, for its answers and for its time. It shares the formulas with the fast
/// one (what is known of the organ at rest, each element's C and gradient, edge against triangle, the closest point of a
/// triangle) and none of its loops: every vertex is carried over, every tree refitted and every element evaluated in
/// every step.

/// A binary tree of boxes, one item a leaf.
struct PlainTree {
  struct Node {
    Box box;
    int left = -1;
    int right = -1;
    int item = -1;  ///< of a leaf, else -1
  };
  std::vector<Node> nodes;  ///< children stand behind their parent

  void build(const std::vector<Box>& boxes);
  void refit(const std::vector<Box>& boxes);

  /// Looks at the items below `node` for the one nearest to a point, those in the nearer box first.
  void search(ClosestSearch& closest, int node = 0) const;
};

/// Where an organ edge goes through an instrument triangle. Tip frame.
struct PlainCrossing {
  int triangle = 0;
  double t = 0.0;  ///< along the edge, 0 at its first vertex
  int direction = 0;
  Vector3 point = Vector3::Zero();
};

struct PlainContact {
  int vertex = 0;
  Vector3 direction = Vector3::UnitZ();  ///< scene frame, unit, out of the instrument
  double target = 0.0;                   ///< m: direction . x >= target
  Vector3 instrument_velocity = Vector3::Zero();
  double force = 0.0;  ///< N along direction, on the organ
};

class PlainSimulation {
 public:
  /// The first organ and the first piece of the first instrument of a scene of `contact_only` or `surface`.
  explicit PlainSimulation(const Scene& scene);

  /// One step of dt (s) in which the instrument goes from `before` to `now`.
  void step(const Pose& before, const Pose& now, double dt);

  // What the next step reads; put elsewhere, it goes on from there.
  std::vector<Vector3> positions;   ///< m, scene frame
  std::vector<Vector3> velocities;  ///< m/s
  std::vector<int> touching;        ///< vertices that were in contact in the last step, ascending
  std::vector<char> held;           ///< 1: moved by the instrument and left there; without restoration only

  std::vector<int> colliding;  ///< ascending
  std::vector<PlainContact> contacts;
  StepProfile profile;  ///< s, of the last step
  bool healthy = true;

 private:
  void carry_to_tip(const Pose& now);
  void refit_tree();
  void find_crossings();
  void cross_triangles(int organ_node, int instrument_node);
  void label_border();
  void flood();
  void find_border_depths();
  void propagate_depths();
  ClosestFeature closest_to(int vertex) const;
  void take_closest_feature(int vertex);
  void respond(const Pose& before, const Pose& now, double dt);
  void integrate(double dt);
  void bear();
  void check_health();

  RestShape rest_;
  InstrumentSurface instrument_;
  PlainTree organ_tree_;
  PlainTree instrument_tree_;
  bool restoration_;
  double drag_;
  Vector3 gravity_;

  std::vector<Vector3> local_;                            ///< positions in the tip frame
  std::vector<std::vector<PlainCrossing>> crossings_of_;  ///< per edge
  std::vector<int> side_;                                 ///< per vertex: +1 inside, -1 outside, 0 not known
  std::vector<char> border_;                              ///< per vertex: 1 for colliding border vertices
  std::vector<double> depth_;
  std::vector<Vector3> direction_;  ///< tip frame
  std::vector<Vector3> forces_;
  std::vector<Vector3> gradient_;
  std::vector<Vector3> good_positions_;
  std::vector<Vector3> good_velocities_;
};

}  // namespace tissue_sim
