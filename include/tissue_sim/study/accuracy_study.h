#pragma once

#include <array>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "tissue_sim/scene/scene.h"
#include "tissue_sim/simulation/pose_track.h"

namespace tissue_sim {

/// What accuracy costs: an organ simulated in every way there is, its time beside its error.

/// An organ as one of the study's meshes has it.
struct StudyMesh {
  std::string name;
  TriangleMesh surface;
  TetrahedralMesh solid;  ///< empty: a surface only
  bool embedded = false;  ///< the surface is carried by the solid
};

/// One way to simulate it.
struct StudyRun {
  int mesh = 0;
  Model model = Model::fem;
  Integrator integrator = Integrator::explicit_substeps;
  double time_step = 0.001;  ///< s
  int finer = 1;             ///< explicit: times the substeps that are stable
  DepthScheme depth = DepthScheme::exact;
  bool restoration = true;
};

/// One organ and one instrument on its way. Stamps in nanoseconds from 0.
struct StudyCase {
  std::string name;
  Instrument instrument;
  double contact_radius = 0.0;  ///< m, of the instrument
  Material material;
  double wall_thickness = 0.0;  ///< m, of `surface`
  std::function<bool(const Vector3&)> attached;
  std::vector<StampedPose> path;
  Vector3 contact{0, 0, 0};       ///< m, around here the mesh counts
  std::int64_t transient_at = 0;  ///< ns, while it is being pressed
  std::int64_t hold = 0;          ///< ns, at the last pose until all is at rest; 0: a recording, errors on its way
  double settling_drag = 0.0;     ///< 1/s, nearly critical: rest comes soonest, and is the same with any drag
  std::vector<StudyMesh> meshes;
  StudyRun reference;  ///< on the finest mesh: its solution is what all are measured by
  /// The mesh is so fine that its vertices alone feel the instrument, and solve_statics() can tell where they rest.
  bool reference_is_proven = false;
  std::vector<StudyRun> runs;
};

/// A row of the study. NaN: not computed.
struct StudyRow {
  std::string case_name;
  std::string mesh;
  StudyRun run;
  int substeps = 0;  ///< the most in a step
  int active_vertices = 0;
  int vertices = 0;  ///< of the surface
  int tetrahedra = 0;
  bool embedded = false;        ///< the surface is carried by the tetrahedra
  double edge = 0.0;            ///< m, mean of the simulated mesh around the contact
  double contact_radius = 0.0;  ///< m
  double ms_per_ms = 0.0;
  double displacement_error = 0.0;
  double force_error = 0.0;
  double depth_error = 0.0;  ///< m
  double displacement_error_same_mesh = 0.0;
  double force_error_same_mesh = 0.0;
  double transient_error = 0.0;
  double force = 0.0;    ///< N, at rest; of a recording the peak
  bool stable = true;    ///< all finite, no recovery by the health check
  bool at_rest = false;  ///< errors after settling; false: of a recording
};

/// Every run of the case, given to `done` as it is made. Errors come out the same each time, bit for bit; the times are
/// those of this machine. `progress` may be null. `timed`: false leaves the times 0.
void run_study(const StudyCase& given, std::FILE* progress, const std::function<void(const StudyRow&)>& done,
               bool timed = true);

}  // namespace tissue_sim
