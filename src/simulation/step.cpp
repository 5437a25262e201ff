#include "tissue_sim/simulation/step.h"

#include <algorithm>

#include "tissue_sim/simulation/stages.h"

namespace tissue_sim {

namespace {

void step_organ(StepContext& context) {
  recall(context);  // what contacts, centres and levels left: numbers, or the last good state
  const int substeps = count_substeps(context);
  for (int i = 1; i <= substeps && !context.ran_away; ++i) {
    place_instruments(context, i, substeps);  // poses at the end of the substep
    if (looks_again(context)) {
      refit(context);               // the tree of the organ, where an instrument is near
      find_crossings(context);      // stage 1: crossings, border vertices, colliding vertices
      find_border_depths(context);  // stage 2: Eq. 1-3, or exact for all
      propagate_depths(context);    // stage 3: Eq. 4-6
      find_contacts(context);       // colliding vertices, edges and poked triangles: planes to keep out of
    } else {
      follow_instruments(context);  // the contacts of the substep before, with the instruments
    }
    respond(context);  // contacts out of the instrument
    deform(context);   // elements: C, its gradient, k; integration; what is plastic stays
    bear(context);     // the instruments bear the forces of the tissue that they touch
  }
  check_health(context);
  report_contacts(context);
}

}  // namespace

void step(const World& world, const Motion& motion, State& state, Workspace& workspace, StepReport& report) {
  begin_report(world, motion, report);
  for (std::size_t organ = 0; organ < world.organs.size(); ++organ) {
    StepContext context = {world, motion, static_cast<int>(organ), state.organs[organ], workspace, report};
    step_organ(context);
  }
  end_report(report);
}

}  // namespace tissue_sim
