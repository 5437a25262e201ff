#pragma once

#include "tissue_sim/simulation/step.h"

namespace tissue_sim {

/// What the stages of one organ's step share. Lives as long as the step.
struct StepContext {
  const World& world;
  const Motion& motion;
  int organ;
  OrganState& state;
  Workspace& workspace;
  StepReport& report;
  double dt = 0.0;  ///< s, of the substep
  int substep = 1;  ///< the first is 1
  int substeps = 1;
  bool jumps = false;     ///< an instrument is elsewhere at once: not swept
  bool ran_away = false;  ///< in this substep: what comes after it would only overflow
  bool slept = false;     ///< the organ was asleep when the step began

  const OrganModel& model() const { return world.organs[organ]; }
  OrganWorkspace& work() { return workspace.organs[organ]; }
  /// Of surface vertices that the step does not move: contact asks for those it looks at.
  Placement placement() {
    if (!moves_less_than_it_shows(model())) return {};
    const auto place_some = [](void* context, const int* first, const int* last) {
      StepContext& here = *static_cast<StepContext*>(context);
      place(here.model(), first, last, here.state);
    };
    return {place_some, this};
  }
  OrganSurface surface() {
    const RestShape& rest = model().rest;
    return {state.positions, rest.triangles, rest.topology, rest.component_roots, work().patches, placement()};
  }
};

void begin_report(const World& world, const Motion& motion, StepReport& report);

/// Puts the last good state of the organ back where what it remembers is not numbers: the step would read it.
void recall(StepContext& context);

/// As many as the elements need, and as many as keep an instrument near the organ from moving farther than the motion
/// limit in one.
int count_substeps(StepContext& context);

void place_instruments(StepContext& context, int substep, int substeps);

/// Whether contact is looked for in this substep: in the first of a step, and where an instrument and the organ can
/// have moved too far against each other since it last was, or a contact point has slipped too far. Finds the
/// velocities of the instruments at the contact points.
bool looks_again(StepContext& context);

void refit(StepContext& context);
void find_crossings(StepContext& context);
void find_border_depths(StepContext& context);
void propagate_depths(StepContext& context);
void find_contacts(StepContext& context);

/// The contacts found last go along with their instruments.
void follow_instruments(StepContext& context);

void respond(StepContext& context);
void deform(StepContext& context);
void bear(StepContext& context);

/// Puts the last good state of the organ back, at rest, when a number is not finite or a vertex has run away. What the
/// step works on is looked at in every step, the rest of a large organ in turn.
void check_health(StepContext& context);

void report_contacts(StepContext& context);
void end_report(StepReport& report);

}  // namespace tissue_sim
