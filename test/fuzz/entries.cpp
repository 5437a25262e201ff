#include "entries.h"

#include <stdexcept>

#include "tissue_sim/contact/instrument_surface.h"
#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/scene/instrument_file.h"
#include "tissue_sim/scene/mesh_file.h"
#include "tissue_sim/scene/scene_file.h"
#include "tissue_sim/scene/tetrahedral_mesh_file.h"
#include "tissue_sim/simulation/timeline.h"
#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim {
namespace {

constexpr const char* octahedron_obj =
    "v 20 0 0\nv -20 0 0\nv 0 20 0\nv 0 -20 0\nv 0 0 20\nv 0 0 -20\n"
    "f 1 3 5\nf 3 2 5\nf 2 4 5\nf 4 1 5\nf 3 1 6\nf 2 3 6\nf 4 2 6\nf 1 4 6\n";
constexpr const char* octahedron_msh =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n6\n1 20 0 0\n2 -20 0 0\n3 0 20 0\n4 0 -20 0\n5 0 0 20\n6 0 0 -20\n"
    "$EndNodes\n$Elements\n4\n1 4 0 1 3 5 6\n2 4 0 3 2 5 6\n3 4 0 2 4 5 6\n4 4 0 4 1 5 6\n$EndElements\n";
constexpr const char* probe_urdf =
    "<robot name=\"probe\"><link name=\"tip\"><collision><geometry><box size=\"0.006 0.006 0.02\"/></geometry>"
    "</collision></link></robot>\n";

/// What stands beside the file: everything small, so that most of the time goes into the reading.
const TemporaryFolder& folder() {
  static const TemporaryFolder files;
  static const bool written = [] {
    files.write("organ.obj", octahedron_obj);
    files.write("organ.msh", octahedron_msh);
    files.write("probe.urdf", probe_urdf);
    return true;
  }();
  require(written && !files.path.empty(), "no temporary folder");
  return files;
}

/// The line that `load` refuses the file with.
template <typename Load>
std::string refusal(const std::string& path, Load load) {
  try {
    load();
  } catch (const SceneError& error) {
    const std::string line = error.what();
    require(line.compare(0, path.size(), path) == 0, "the error does not name the file: " + line);
    for (const char c : line) require(c == '\t' || static_cast<unsigned char>(c) >= 32, "not one line: " + line);
    return line;
  }
  return "";
}

void require_sound(const TriangleMesh& mesh) {
  require(!mesh.triangles.empty(), "a mesh without triangles");
  const MeshFaults faults = inspect(mesh);
  require(faults.bad_indices == 0, "an index out of range");
  require(faults.non_finite_vertices == 0, "a vertex that is no number");
}

std::string enter_mesh(const std::string& name, const std::string& bytes) {
  const std::string path = folder().write(name, bytes);
  std::vector<std::string> warnings;
  const std::string as_instrument = refusal(path, [&] {
    const InstrumentMesh piece = load_instrument_mesh(path, Vector3::Constant(0.001), warnings);
    require_sound(piece.mesh);
    build_instrument_surface(piece.mesh, piece.closed);
  });
  const std::string as_organ = refusal(path, [&] {
    const TriangleMesh organ = load_organ_mesh(path, 0.001, warnings);
    require_sound(organ);
    require(inspect(organ).closed_manifold(), "an organ that is open");
    require(enclosed_volume(organ) > 0.0, "an organ inside out");
  });
  return as_organ.empty() ? as_instrument : as_organ;
}

/// Two steps with the instruments pressed in; a scene that leaves its models open is left at that.
void step_twice(const Scene& scene) {
  for (const std::vector<Alternative>& alternatives : scene.alternatives) {
    if (!alternatives.empty()) return;
  }
  Timeline timeline(scene);
  const auto step = static_cast<std::int64_t>(1e9 * scene.time_step);
  for (int i = 1; i <= 2; ++i) {
    for (std::size_t k = 0; k < scene.instruments.size(); ++k) {
      timeline.add_pose(static_cast<int>(k), {1'000'000'000 + i * step, {{0.0, 0.0, 0.02 - 0.002 * i}, {1, 0, 0, 0}}});
    }
    while (timeline.step()) {
      for (std::size_t o = 0; o < scene.organs.size(); ++o) {
        for (const Vector3& p : timeline.organ(static_cast<int>(o)).positions) {
          require(p.allFinite(), "a position that is no number");
        }
      }
    }
  }
}

}  // namespace

void require(bool holds, const std::string& what) {
  if (!holds) throw std::logic_error(what);
}

std::string enter_scene(const std::string& bytes) {
  const std::string path = folder().write("scene.yaml", bytes);
  std::vector<std::string> warnings;
  Scene scene;
  const std::string line = refusal(path, [&] { scene = load_scene(path, warnings); });
  if (!line.empty()) return line;
  return refusal("organ ", [&] { step_twice(scene); });
}

std::string enter_urdf(const std::string& bytes) {
  const std::string path = folder().write("tool.urdf", bytes);
  std::vector<std::string> warnings;
  return refusal(path, [&] {
    const std::vector<InstrumentPart> parts = load_instrument(path, "tip", warnings);
    require(!parts.empty(), "an instrument without parts");
    for (const InstrumentPart& part : parts) {
      require_sound(part.mesh);
      build_instrument_surface(part.mesh, part.closed);
    }
  });
}

std::string enter_obj(const std::string& bytes) {
  return enter_mesh("mesh.obj", bytes);
}
std::string enter_stl(const std::string& bytes) {
  return enter_mesh("mesh.stl", bytes);
}
std::string enter_ply(const std::string& bytes) {
  return enter_mesh("mesh.ply", bytes);
}
std::string enter_dae(const std::string& bytes) {
  return enter_mesh("mesh.dae", bytes);
}

std::string enter_msh(const std::string& bytes) {
  const std::string path = folder().write("mesh.msh", bytes);
  std::vector<std::string> warnings;
  return refusal(path, [&] {
    TetrahedralMesh solid = read_tetrahedral_mesh(path, 0.001, warnings);
    require(inspect(solid).sound(), "a solid that is not sound");
    require_sound(take_surface(solid));
  });
}

}  // namespace tissue_sim
