#include "tissue_sim/study/accuracy_study.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <memory>
#include <tuple>
#include <utility>

#include "tissue_sim/geometry/embedding.h"
#include "tissue_sim/simulation/step.h"
#include "tissue_sim/study/measuring.h"
#include "tissue_sim/study/reference.h"

namespace tissue_sim {

namespace {

using Vectors = std::vector<Vector3>;

constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
constexpr std::int64_t millisecond = 1'000'000;  // ns

/// The reference on a mesh itself factorises a matrix of three rows a vertex some ten times.
constexpr std::size_t most_reference_vertices = 6000;

/// Ten times finer substeps are run on meshes up to this only.
constexpr std::size_t most_transient_tetrahedra = 160'000;
constexpr int finer_in_reference = 10;

/// Times are taken while the instrument slides at this speed in the organ: one that stands still is felt with less
/// work.
constexpr double slide_speed = 0.01;                        // m/s
constexpr std::int64_t slide_turn = 20 * millisecond;       // ns, there and back again
constexpr std::int64_t timed_batch = 20 * millisecond;      // ns
constexpr int timed_batches = 3;                            // of which the median counts
constexpr int timed_rounds = 3;                             // of which the least counts
constexpr std::int64_t recording_batch = 50 * millisecond;  // ns

double median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

Scene scene_of(const StudyCase& given, const StudyRun& run, double drag) {
  const StudyMesh& mesh = given.meshes[static_cast<std::size_t>(run.mesh)];
  Organ organ;
  organ.name = mesh.name;
  organ.mesh = mesh.surface;
  if (is_solid(run.model)) {
    organ.solid = mesh.solid;
    organ.embedded = mesh.embedded;
  }
  organ.model = run.model;
  organ.integrator = run.integrator;
  organ.restoration = run.restoration;
  organ.depth = run.depth;
  organ.material = given.material;
  organ.material.drag = drag;
  organ.wall_thickness = given.wall_thickness;
  const Vectors& held = organ.solid.empty() ? organ.mesh.vertices : organ.solid.vertices;
  for (std::size_t v = 0; v < held.size(); ++v) {
    if (given.attached(held[v])) organ.attached.push_back(static_cast<int>(v));
  }
  Scene scene;
  scene.frame = "world";
  scene.time_step = run.time_step;
  scene.max_substeps = 1'000'000;
  scene.organs.push_back(std::move(organ));
  scene.instruments.push_back(given.instrument);
  return scene;
}

/// A simulation on its way along the case's path.
class Simulation {
 public:
  /// `at_vertices`: the organ touches with its vertices only, as in the static reference.
  Simulation(const StudyCase& given, const StudyRun& run, double drag, bool at_vertices = false)
      : given_(given), time_step_(run.time_step), world_(build_world(scene_of(given, run, drag))) {
    world_.organs[0].rest.stable_substep /= run.finer;
    for (char& sharp : world_.organs[0].sharp) {
      if (at_vertices) sharp = 0;
      pokes_ = pokes_ || sharp != 0;
    }
    state_ = rest_state(world_);
    workspace_ = build_workspace(world_);
    pose_ = given.path.front().pose;
    motion_.instruments.resize(1);
  }

  const RestShape& rest() const { return world_.organs[0].rest; }
  const Vectors& positions() {
    place_surface(world_.organs[0], state_.organs[0]);
    return state_.organs[0].positions;
  }
  const StepReport& report() const { return report_; }
  const Pose& pose() const { return pose_; }
  /// The instrument's vertices touch the organ's triangles too, which the static reference knows nothing of.
  bool pokes() const { return pokes_; }
  bool stable() const { return stable_; }
  int substeps() const { return substeps_; }
  void forget_substeps() { substeps_ = 0; }

  /// In equal steps, no longer than the time step.
  void go(const Pose& to, std::int64_t duration) {
    const double seconds = 1e-9 * static_cast<double>(duration);
    const auto steps = static_cast<int>(std::ceil(seconds / time_step_ - 1e-6));
    const Pose from = pose_;
    motion_.duration = seconds / steps;
    for (int i = 1; i <= steps; ++i) {
      const Pose next = interpolate(from, to, static_cast<double>(i) / steps);
      motion_.instruments[0] = {true, pose_, next};
      ++report_.step;
      step(world_, motion_, state_, workspace_, report_);
      pose_ = next;
      substeps_ = std::max(substeps_, report_.substeps);
      stable_ = stable_ && !report_.recovered && report_.wrenches[0].force.allFinite();
    }
  }

  /// Along the path from `begin` to `end`, ns.
  void follow(std::int64_t begin, std::int64_t end) {
    for (std::size_t i = 1; i < given_.path.size(); ++i) {
      const StampedPose& before = given_.path[i - 1];
      const StampedPose& next = given_.path[i];
      if (next.stamp <= begin || before.stamp >= end) continue;
      const std::int64_t to = std::min(end, next.stamp);
      const double part = static_cast<double>(to - before.stamp) / static_cast<double>(next.stamp - before.stamp);
      go(interpolate(before.pose, next.pose, part), to - std::max(begin, before.stamp));
    }
  }

 private:
  const StudyCase& given_;
  double time_step_;
  World world_;
  State state_;
  Workspace workspace_;
  StepReport report_;
  Motion motion_;
  Pose pose_;
  bool pokes_ = false;
  bool stable_ = true;
  int substeps_ = 0;
};

/// The part of the force on the instrument that counts, N: against its way in; all of it in a recording.
double counted_force(const StudyCase& given, const Vector3& force) {
  if (given.hold == 0) return force.norm();
  return force.dot((given.path.front().pose.position - given.path.back().pose.position).normalized());
}

/// An equilibrium or a moment that others are measured by.
struct Reference {
  const TetrahedralMesh* solid = nullptr;
  Vectors displacements;       ///< m, of the solid's vertices
  Pose pose;                   ///< of the instrument
  double force = 0.0;          ///< N
  std::vector<double> forces;  ///< N, at every pose of a recording
  bool proven = false;         ///< by solve_statics()
};

Vectors displacements_at(const Reference& reference, const Embedding& places) {
  Vectors result;
  for (std::size_t i = 0; i < places.corners.size(); ++i) {
    result.push_back(embedded_point(places, i, reference.displacements));
  }
  return result;
}

/// m^2 a vertex: a third of the triangles around it.
std::vector<double> areas_of(const TriangleMesh& mesh) {
  std::vector<double> areas(mesh.vertices.size(), 0.0);
  for (const Triangle& t : mesh.triangles) {
    const double twice =
        area_normal(mesh.vertices[static_cast<std::size_t>(t[0])], mesh.vertices[static_cast<std::size_t>(t[1])],
                    mesh.vertices[static_cast<std::size_t>(t[2])])
            .norm();
    for (const int v : t) areas[static_cast<std::size_t>(v)] += twice / 6.0;
  }
  return areas;
}

/// Relative L2 over the surface.
double surface_error(const TriangleMesh& mesh, const Vectors& positions, const Vectors& right_displacements) {
  const std::vector<double> areas = areas_of(mesh);
  double wrong = 0.0;
  double all = 0.0;
  for (std::size_t v = 0; v < areas.size(); ++v) {
    wrong += areas[v] * (positions[v] - mesh.vertices[v] - right_displacements[v]).squaredNorm();
    all += areas[v] * right_displacements[v].squaredNorm();
  }
  return all > 0.0 ? std::sqrt(wrong / all) : unknown;
}

/// The instrument as an obstacle. Its pieces overlap; inside several, the deepest counts.
Obstacle obstacle_of(const std::vector<InstrumentSurface>& pieces, const Pose& pose) {
  return [&pieces, pose](const Vector3& point) {
    ObstaclePoint deepest;
    deepest.depth = -1e300;
    for (const InstrumentSurface& piece : pieces) {
      const ClosestFeature feature = closest_feature(piece, pose.apply_inverse(point));
      if (feature.depth <= deepest.depth) continue;
      deepest.depth = feature.depth;
      deepest.direction = pose.orientation * feature.direction;
    }
    return deepest;
  };
}

/// Mean |depth - the reference's depth| of the contacts, m.
double depth_error(const StudyMesh& mesh, const StepReport& report, const Vectors& right, const Obstacle& obstacle) {
  double sum = 0.0;
  int count = 0;
  for (const OrganContact& contact : report.contacts) {
    if (!(contact.depth > 0.0)) continue;
    Vector3 place = Vector3::Zero();
    Vector3 way = Vector3::Zero();
    for (int i = 0; i < 3; ++i) {
      const auto corner = static_cast<std::size_t>(
          mesh.surface.triangles[static_cast<std::size_t>(contact.triangle)][static_cast<std::size_t>(i)]);
      place += contact.barycentric[i] * mesh.surface.vertices[corner];
      way += contact.barycentric[i] * right[corner];
    }
    sum += std::abs(contact.depth - std::max(0.0, obstacle(place + way).direction.dot(way)));
    ++count;
  }
  return count > 0 ? sum / count : unknown;
}

/// Mean length of the edges that are simulated near the contact, m.
double edge_near(const StudyCase& given, const StudyMesh& mesh, Model model) {
  const bool solid = is_solid(model);
  const Vectors& vertices = solid ? mesh.solid.vertices : mesh.surface.vertices;
  for (double within = 2.0 * given.contact_radius;; within *= 2.0) {
    double sum = 0.0;
    int count = 0;
    const auto add = [&](int a, int b) {
      const Vector3& p = vertices[static_cast<std::size_t>(a)];
      const Vector3& q = vertices[static_cast<std::size_t>(b)];
      if ((0.5 * (p + q) - given.contact).norm() > within) return;
      sum += (p - q).norm();
      ++count;
    };
    const auto add_all = [&](const auto& elements) {
      for (const auto& corners : elements) {
        for (std::size_t i = 0; i < corners.size(); ++i) {
          for (std::size_t j = i + 1; j < corners.size(); ++j) add(corners[i], corners[j]);
        }
      }
    };
    if (solid) {
      add_all(mesh.solid.tetrahedra);
    } else {
      add_all(mesh.surface.triangles);
    }
    if (count >= 10) return sum / count;
  }
}

class Study {
 public:
  Study(const StudyCase& given, std::FILE* progress, bool timed) : given_(given), progress_(progress), timed_(timed) {
    for (const InstrumentPart& part : given.instrument.parts) {
      pieces_.push_back(build_instrument_surface(part.mesh, part.closed));
    }
    places_.resize(given.meshes.size());
  }

  void run(const std::function<void(const StudyRow&)>& done) {
    find_fine_reference();
    for (const StudyRun& each : given_.runs) {
      const StudyRow row = measure(each);
      tell(row);
      done(row);
    }
  }

 private:
  const StudyMesh& mesh(int index) const { return given_.meshes[static_cast<std::size_t>(index)]; }

  void tell(const StudyRow& row) const {
    if (progress_ == nullptr) return;
    std::fprintf(progress_,
                 "%s %s %s %s %g ms x%d: %.3g ms/ms, displacement %.3g %%, force %.3g %%, transient %.3g %%\n",
                 row.case_name.c_str(), row.mesh.c_str(), to_string(row.run.model), to_string(row.run.integrator),
                 1e3 * row.run.time_step, row.run.finer, row.ms_per_ms, 100 * row.displacement_error,
                 100 * row.force_error, 100 * row.transient_error);
    std::fflush(progress_);
  }

  /// The static solution on the mesh of a run that has settled, next to where it has settled.
  Reference settle_exactly(const StudyMesh& own, Simulation& simulation) const {
    ReferenceProblem problem{own.solid, {lame_moduli(given_.material.young, given_.material.poisson)}};
    for (const Vector3& vertex : own.solid.vertices) {
      const bool held = given_.attached(vertex);
      problem.fixed.push_back({held, held, held});
    }
    problem.obstacle = obstacle_of(pieces_, simulation.pose());
    for (std::size_t v = 0; v < own.surface.vertices.size(); ++v) problem.surface.push_back(static_cast<int>(v));
    ReferenceOptions options;
    options.start = simulation.positions();
    const ReferenceSolution solution = solve_statics(problem, options);
    Reference result;
    result.solid = &own.solid;
    result.pose = simulation.pose();
    result.proven = solution.converged;
    result.force = counted_force(given_, solution.contact_force);
    for (std::size_t v = 0; v < own.solid.vertices.size(); ++v) {
      result.displacements.push_back(solution.positions[v] - own.solid.vertices[v]);
    }
    return result;
  }

  Reference as_it_is(const StudyMesh& own, Simulation& simulation) const {
    Reference result;
    result.solid = &own.solid;
    result.pose = simulation.pose();
    result.force = counted_force(given_, simulation.report().wrenches[0].force);
    for (std::size_t v = 0; v < own.solid.vertices.size(); ++v) {
      result.displacements.push_back(simulation.positions()[v] - own.solid.vertices[v]);
    }
    return result;
  }

  void settle(Simulation& simulation) const {
    simulation.follow(0, given_.path.back().stamp);
    simulation.go(simulation.pose(), given_.hold);
  }

  void find_fine_reference() {
    const StudyRun& run = given_.reference;
    const StudyMesh& own = mesh(run.mesh);
    if (given_.hold > 0) {
      Simulation simulation(given_, run, given_.settling_drag, given_.reference_is_proven);
      settle(simulation);
      if (given_.reference_is_proven) fine_ = settle_exactly(own, simulation);
      if (!fine_.proven) {
        if (progress_ != nullptr) {
          std::fprintf(progress_, "%s: the reference on %s is its settled simulation\n", given_.name.c_str(),
                       own.name.c_str());
        }
        fine_ = as_it_is(own, simulation);
      }
    } else {
      Simulation simulation(given_, run, given_.material.drag, given_.reference_is_proven);
      Reference peak;
      std::vector<double> forces;
      std::int64_t before = 0;
      for (const StampedPose& pose : given_.path) {
        simulation.follow(before, pose.stamp);
        before = pose.stamp;
        forces.push_back(pose.stamp > 0 ? counted_force(given_, simulation.report().wrenches[0].force) : 0.0);
        if (forces.back() <= peak.force) continue;
        peak = as_it_is(own, simulation);
        peak_at_ = pose.stamp;
      }
      fine_ = std::move(peak);
      fine_.forces = std::move(forces);
    }
    if (progress_ != nullptr) {
      std::fprintf(progress_, "%s: reference on %s, %zu vertices, %zu tetrahedra: %.6g N\n", given_.name.c_str(),
                   own.name.c_str(), own.solid.vertices.size(), own.solid.tetrahedra.size(), fine_.force);
    }
  }

  /// Where the rest places of a mesh's surface are in the finest solid.
  const Embedding& places(int index) {
    std::unique_ptr<Embedding>& result = places_[static_cast<std::size_t>(index)];
    if (!result) result = std::make_unique<Embedding>(embed(mesh(index).surface.vertices, *fine_.solid));
    return *result;
  }

  StudyRow measure(const StudyRun& run) {
    const StudyMesh& own = mesh(run.mesh);
    StudyRow row;
    row.case_name = given_.name;
    row.mesh = own.name;
    row.run = run;
    row.at_rest = given_.hold > 0;
    row.vertices = static_cast<int>(own.surface.vertices.size());
    row.contact_radius = given_.contact_radius;
    row.edge = edge_near(given_, own, run.model);
    row.displacement_error_same_mesh = unknown;
    row.force_error_same_mesh = unknown;
    row.transient_error = transient_error(run);
    Simulation simulation(given_, run, given_.hold > 0 ? given_.settling_drag : given_.material.drag);
    const RestShape& rest = simulation.rest();
    row.tetrahedra = is_solid(run.model) ? static_cast<int>(own.solid.tetrahedra.size()) : 0;
    row.embedded = is_solid(run.model) && own.embedded;
    row.active_vertices = rest.elastic() ? static_cast<int>(rest.positions.size()) - rest.first_simulated : 0;
    if (given_.hold > 0) {
      measure_rest(simulation, row);
      if (timed_) time_sliding(simulation, row);
    } else {
      measure_recording(simulation, row);
    }
    row.stable = simulation.stable();
    row.substeps = simulation.substeps();
    if (run.mesh == given_.reference.mesh && run.model == Model::fem) {  // nothing but the integrator differs
      row.displacement_error_same_mesh = std::exchange(row.displacement_error, unknown);
      row.force_error_same_mesh = std::exchange(row.force_error, unknown);
    }
    return row;
  }

  void compare(const StudyMesh& own, Simulation& simulation, const Vectors& right, StudyRow& row) const {
    row.displacement_error = surface_error(own.surface, simulation.positions(), right);
    row.depth_error = depth_error(own, simulation.report(), right, obstacle_of(pieces_, fine_.pose));
  }

  void measure_rest(Simulation& simulation, StudyRow& row) {
    const StudyMesh& own = mesh(row.run.mesh);
    settle(simulation);
    row.force = counted_force(given_, simulation.report().wrenches[0].force);
    row.force_error = std::abs(row.force / fine_.force - 1.0);
    compare(own, simulation, displacements_at(fine_, places(row.run.mesh)), row);
    if (!is_solid(row.run.model) || own.embedded || !row.run.restoration || simulation.pokes()) return;
    const bool of_finest = row.run.mesh == given_.reference.mesh && fine_.proven;
    if (own.solid.vertices.size() > most_reference_vertices && !of_finest) return;
    const Reference same = of_finest ? fine_ : settle_exactly(own, simulation);
    if (!same.proven) return;
    const Vectors right(same.displacements.begin(),
                        same.displacements.begin() + static_cast<std::ptrdiff_t>(own.surface.vertices.size()));
    row.displacement_error_same_mesh = surface_error(own.surface, simulation.positions(), right);
    row.force_error_same_mesh = std::abs(row.force / same.force - 1.0);
  }

  void time_sliding(Simulation& simulation, StudyRow& row) const {
    const Pose middle = simulation.pose();
    Pose aside = middle;
    aside.position.x() += 1e-9 * slide_speed * static_cast<double>(slide_turn);
    simulation.forget_substeps();
    row.ms_per_ms = std::numeric_limits<double>::infinity();
    for (int round = 0; round < timed_rounds; ++round) {
      std::vector<double> batches;
      for (int batch = 0; batch < timed_batches; ++batch) {
        const double before = processor_seconds();
        simulation.go((round * timed_batches + batch) % 2 == 0 ? aside : middle, timed_batch);
        batches.push_back((processor_seconds() - before) * 1e9 / static_cast<double>(timed_batch));
      }
      row.ms_per_ms = std::min(row.ms_per_ms, median(batches));
    }
  }

  void measure_recording(Simulation& simulation, StudyRow& row) {
    const StudyMesh& own = mesh(row.run.mesh);
    double squares = 0.0;
    std::vector<double> batches;
    double spent = 0.0;
    std::int64_t simulated = 0;
    std::int64_t before = 0;
    for (std::size_t i = 1; i < given_.path.size(); ++i) {
      const std::int64_t stamp = given_.path[i].stamp;
      const double start = processor_seconds();
      simulation.follow(before, stamp);
      if (!simulation.report().contacts.empty()) {
        spent += processor_seconds() - start;
        simulated += stamp - before;
        if (simulated >= recording_batch) {
          batches.push_back(spent * 1e9 / static_cast<double>(simulated));
          spent = 0.0;
          simulated = 0;
        }
      }
      before = stamp;
      const double force = counted_force(given_, simulation.report().wrenches[0].force);
      row.force = std::max(row.force, force);
      squares += std::pow(force - fine_.forces[i], 2);
      if (stamp == peak_at_) compare(own, simulation, displacements_at(fine_, places(row.run.mesh)), row);
    }
    row.force_error = std::sqrt(squares / static_cast<double>(given_.path.size() - 1)) / fine_.force;
    if (timed_) row.ms_per_ms = median(batches);
  }

  /// Against ten times finer substeps on the same mesh, while it is being pressed.
  double transient_error(const StudyRun& run) {
    const StudyMesh& own = mesh(run.mesh);
    if (is_solid(run.model) && own.solid.tetrahedra.size() > most_transient_tetrahedra) return unknown;
    Vectors& right = moments_[{run.mesh, run.model, run.depth, run.restoration}];
    if (right.empty()) {
      StudyRun finer = run;
      finer.integrator = Integrator::explicit_substeps;
      finer.time_step = 0.001;
      finer.finer = finer_in_reference;
      if (run.model == Model::contact_only) finer.time_step /= finer_in_reference;
      right = at_moment(finer, own);
      for (std::size_t v = 0; v < right.size(); ++v) right[v] -= own.surface.vertices[v];
    }
    return surface_error(own.surface, at_moment(run, own), right);
  }

  Vectors at_moment(const StudyRun& run, const StudyMesh& own) const {
    Simulation simulation(given_, run, given_.material.drag);
    simulation.follow(0, given_.transient_at);
    return {simulation.positions().begin(),
            simulation.positions().begin() + static_cast<std::ptrdiff_t>(own.surface.vertices.size())};
  }

  using Moment = std::tuple<int, Model, DepthScheme, bool>;

  const StudyCase& given_;
  std::FILE* progress_;
  bool timed_;
  std::vector<InstrumentSurface> pieces_;
  Reference fine_;
  std::int64_t peak_at_ = 0;                        ///< ns, where a recording's force is greatest
  std::vector<std::unique_ptr<Embedding>> places_;  ///< a mesh
  std::map<Moment, Vectors> moments_;               ///< m, displacements of the surface
};

}  // namespace

void run_study(const StudyCase& given, std::FILE* progress, const std::function<void(const StudyRow&)>& done,
               bool timed) {
  Study(given, progress, timed).run(done);
}

}  // namespace tissue_sim
