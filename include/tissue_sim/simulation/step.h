#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "tissue_sim/contact/response.h"
#include "tissue_sim/simulation/integrator.h"
#include "tissue_sim/simulation/levels.h"
#include "tissue_sim/simulation/state.h"
#include "tissue_sim/simulation/step_report.h"
#include "tissue_sim/simulation/vertex_block_descent.h"

namespace tissue_sim {

/// The way of one instrument in one step. Position goes in a line, rotation by slerp over the shorter arc.
struct InstrumentMotion {
  bool placed = false;  ///< false: it has no pose yet and is not there
  Pose from;
  Pose to;
};

/// What a step is given.
struct Motion {
  double duration = 0.0;  ///< s
  std::vector<InstrumentMotion> instruments;
  bool forces_wanted = true;  ///< false: contacts and wrenches carry none; nothing else differs
};

/// How far an instrument's piece and the organ may have gone since contact was last looked for.
struct LastLook {
  double travel = 0.0;       ///< m, of the organ's patches then
  std::optional<Box> near;   ///< in the tip's frame: what of the piece was near the organ then
  double way_of_near = 0.0;  ///< m, since then
  double way_of_all = 0.0;
};

/// Room for one organ's step. Holds nothing that changes what the next step does: how far the boxes of its patches
/// have been outrun saves work only.
struct OrganWorkspace {
  SurfacePatches patches;                 ///< of the organ's surface
  std::vector<Detection> detections;      ///< per piece
  std::vector<Penetration> penetrations;  ///< per piece
  std::vector<char> near;                 ///< per piece: its box and the organ's overlap
  std::vector<LastLook> last_looks;       ///< per piece
  std::vector<ContactPoint> points;
  std::vector<int> bearers;  ///< of the points, ascending
  ElementRoom elements;
  LevelsRoom levels;
  ResponseRoom response;         ///< of the points
  std::vector<int> pressing_of;  ///< per place, into the state's pressing; -1 between two uses
  DescentRoom descent;
  OrganState last_good;
  int bad_steps = 0;       ///< in a row
  std::uint64_t turn = 0;  ///< of the vertices that the health check looks at

  std::vector<OrganContact> contacts;  ///< of the step, one a place that was pressed in any of its substeps
  std::vector<int> contact_of;         ///< per place, into contacts, where contact_round is the current one
  std::vector<std::uint64_t> contact_round;
  std::uint64_t round = 0;  ///< another one whenever contacts begins anew
};

struct Workspace {
  std::unique_ptr<Threads> threads;  ///< none: one thread
  std::vector<OrganWorkspace> organs;
  std::vector<Pose> before;  ///< poses at the start and the end of the substep, one an instrument
  std::vector<Pose> now;
};

/// `threads`: how many compute the forces of large organs; the states are the same bits for any number. See Threads.
Workspace build_workspace(const World& world, int threads = 1);

/// To be called after an organ was put somewhere from outside the step: its patches no longer hold it.
void forget(OrganWorkspace& organ);

/// One step. `report.step` and `report.stamp` are the caller's; everything else in the report is written.
void step(const World& world, const Motion& motion, State& state, Workspace& workspace, StepReport& report);

}  // namespace tissue_sim
