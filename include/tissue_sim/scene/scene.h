#pragma once

#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tissue_sim/geometry/pose.h"
#include "tissue_sim/geometry/tetrahedral_mesh.h"

namespace tissue_sim {

enum class Model { contact_only, surface, volume, fem };
enum class CollidingSet { flood, paper };  ///< how the vertices inside the instrument are found (doc/contact.md)
enum class DepthScheme { exact, paper };   ///< closest point on the instrument, or Eq. 1-6
enum class Integrator { automatic, explicit_substeps, vertex_block_descent };

/// SI units. What a model does not use may be left out of the scene file and is then zero here.
struct Material {
  double young = 0.0;    ///< Pa
  double poisson = 0.0;  ///< 1
  double density = 0.0;  ///< kg/m^3
  double damping = 0.0;  ///< fraction of the critical damping of each element, along its own gradient (Teschner)
  double drag = 0.0;     ///< 1/s, force per mass and velocity: the tissue around the organ
};

/// One organ as the scene describes it, with every file read: nothing here refers to a file any more.
struct Organ {
  std::string name;
  TriangleMesh mesh;  ///< scene frame, metres; closed, manifold, outward
  /// The solid of `volume` and `fem`, else empty. Its first vertices are those of `mesh`, unless `embedded`.
  TetrahedralMesh solid;
  bool embedded = false;  ///< `mesh` is not the solid's own surface: it is carried by the tetrahedra around it
  Model model = Model::surface;
  Integrator integrator = Integrator::automatic;
  bool restoration = true;  ///< false: plastic, what the instrument moved stays moved
  CollidingSet colliding_set = CollidingSet::flood;
  DepthScheme depth = DepthScheme::exact;
  Material material;
  double wall_thickness = 0.0;  ///< m, `surface` only
  /// Relative error that may be made to simulate less than `mesh` or `solid` have; without, all of it is simulated.
  std::optional<double> levels_tolerance;
  /// Vertices held at their rest place, ascending: of `solid` where there is one, else of `mesh`.
  std::vector<int> attached;
};

/// One rigid piece of an instrument: the collision shape of a URDF link.
struct InstrumentPart {
  std::string link;
  TriangleMesh mesh;   ///< frame of the tip link, metres
  bool closed = true;  ///< false: the source was open or non-manifold and could not be mended
};

/// A rigid instrument, joints at zero.
struct Instrument {
  std::string name;
  std::string tip_link;
  std::string pose_topic;
  std::vector<InstrumentPart> parts;
};

/// What decides the models of the organs that name none: the dial between speed and accuracy.
struct Accuracy {
  enum class Goal {
    none,    ///< every organ names its model
    budget,  ///< the most accurate that costs at most `value` s a step, all organs together
    error    ///< the cheapest whose measured error, relative, is at most `value`
  };
  Goal goal = Goal::none;
  double value = 0.0;
  std::string place;  ///< `file:line:column: key: ` of the goal, for errors about it
};

/// One of the ways to model an organ that names no model: all of the organ, as that model needs it.
struct Alternative {
  Organ organ;
  std::string solid;  ///< the file of its tetrahedra as the scene file names it; empty without
};

struct Scene {
  std::string frame;
  Vector3 gravity = Vector3::Zero();  ///< m/s^2
  double time_step = 0.001;           ///< s, the longest step
  int max_substeps = 100;             ///< a scene that needs more for one step is refused
  std::vector<Organ> organs;
  std::vector<Instrument> instruments;
  Accuracy accuracy;
  /// One list an organ, empty where the organ names its model. As long as there are any, choose_models() has the say:
  /// such an organ is only the first of its alternatives, and a Timeline refuses the scene.
  std::vector<std::vector<Alternative>> alternatives;
};

/// A scene that cannot be used. what() is one line: `file:line:column: key: what was wrong, what is allowed`.
class SceneError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

const char* to_string(Model model);
const char* to_string(CollidingSet set);
const char* to_string(DepthScheme depth);
const char* to_string(Integrator integrator);

inline bool is_solid(Model model) {
  return model == Model::volume || model == Model::fem;
}

}  // namespace tissue_sim
