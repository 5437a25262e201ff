#include "tissue_sim/scene/mesh_file.h"

#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>

#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cctype>
#include <fstream>
#include <iterator>
#include <set>

#include "mesh_formats.h"
#include "one_line.h"
#include "tissue_sim/scene/scene.h"

namespace tissue_sim {
namespace {

/// Volume over the cube of the size below which a closed surface encloses nothing: two sheets back to back.
constexpr double flat_ratio = 1e-9;

[[noreturn]] void fail(const std::string& path, const std::string& problem) {
  throw SceneError(path + ": " + problem);
}

void append(const aiScene& scene, const aiNode& node, const aiMatrix4x4& parent, TriangleMesh& mesh) {
  const aiMatrix4x4 transform = parent * node.mTransformation;
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    const aiMesh& source = *scene.mMeshes[node.mMeshes[m]];
    const int first = static_cast<int>(mesh.vertices.size());
    for (unsigned v = 0; v < source.mNumVertices; ++v) {
      const aiVector3D p = transform * source.mVertices[v];
      mesh.vertices.emplace_back(p.x, p.y, p.z);
    }
    for (unsigned f = 0; f < source.mNumFaces; ++f) {
      const aiFace& face = source.mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      Triangle triangle;
      for (unsigned i = 0; i < 3; ++i) triangle[i] = first + static_cast<int>(face.mIndices[i]);
      mesh.triangles.push_back(triangle);
    }
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c) append(scene, *node.mChildren[c], transform, mesh);
}

std::string count(int n, const std::string& one) {
  const bool vertex = one.size() >= 6 && one.compare(one.size() - 6, 6, "vertex") == 0;
  const std::string many = vertex ? one.substr(0, one.size() - 2) + "ices" : one + "s";
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

/// Faces of more than three corners. Refuses faces that assimp has left unset: cutting those into triangles ends the
/// program in an assertion.
int count_polygons(const std::string& path, const aiScene& scene) {
  int polygons = 0;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      const bool complete = face.mIndices && face.mNumIndices > 0 &&
                            std::all_of(face.mIndices, face.mIndices + face.mNumIndices,
                                        [&](unsigned v) { return v < mesh.mNumVertices; });
      if (!complete) fail(path, "a face names a vertex that is not there, is the file cut short? Export it again");
      polygons += face.mNumIndices > 3;
    }
  }
  return polygons;
}

/// The faults that stand between a mesh and a closed manifold surface: "3 boundary edges, 1 non-manifold edge".
std::string list_faults(const MeshFaults& faults) {
  const std::pair<int, const char*> all[] = {{faults.non_finite_vertices, "non-finite vertex"},
                                             {faults.boundary_edges, "boundary edge"},
                                             {faults.non_manifold_edges, "non-manifold edge"},
                                             {faults.misoriented_edges, "misoriented edge"},
                                             {faults.non_manifold_vertices, "non-manifold vertex"}};
  std::string list;
  for (const auto& [number, name] : all) {
    if (number > 0) list += (list.empty() ? "" : ", ") + count(number, name);
  }
  return list;
}

std::string cure_of(const MeshFaults& faults) {
  if (faults.non_finite_vertices > 0) return "export the mesh again, without NaN or infinity, or at another scale";
  if (faults.boundary_edges > 0) return "an organ is a closed surface, close its holes in a mesh editor";
  if (faults.non_manifold_edges > 0)
    return "an edge of an organ joins two triangles, delete the extra ones in a mesh editor";
  if (faults.non_manifold_vertices > 0)
    return "surfaces of an organ do not touch in one vertex, split it in a mesh editor";
  return "an organ's surface has an inside and an outside, which this one (a Moebius strip, a Klein bottle) has not";
}

double size_of(const TriangleMesh& mesh) {
  Vector3 low = mesh.vertices.front(), high = low;
  for (const Vector3& p : mesh.vertices) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  return (high - low).norm();
}

/// The bytes of a file. resolve_path() has seen to it that it has an end.
std::string read_bytes(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  if (!file) fail(path, "cannot be read, check that it is a file you may read");
  return bytes;
}

/// A text that assimp reads into `importer`; its faces may have more than three corners.
const aiScene& import(const std::string& path, const std::string& text, const char* ending,
                      Assimp::Importer& importer) {
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  const aiScene* scene = importer.ReadFileFromMemory(text.data(), text.size(), 0, ending);
  if (!scene || !scene->mRootNode) throw std::runtime_error(importer.GetErrorString());
  const int polygons = count_polygons(path, *scene);
  if (polygons > 0) scene = importer.ApplyPostProcessing(aiProcess_Triangulate);
  if (!scene) fail(path, "its " + count(polygons, "polygon") + " cannot be cut into triangles, export triangles");
  return *scene;
}

/// The surface in the bytes of a file, in its own units.
TriangleMesh read_surface(const std::string& path, const std::string& ending, std::string bytes) {
  if (ending == ".stl") return read_stl(bytes);
  TriangleMesh mesh;
  const bool dae = ending == ".dae";
  const std::string text = dae ? plain_dae(std::move(bytes)) : ending == ".ply" ? plain_ply(bytes) : plain_obj(bytes);
  if (text.empty()) return mesh;
  Assimp::Importer importer;
  const aiScene& scene = import(path, text, dae ? "dae" : "obj", importer);
  append(scene, *scene.mRootNode, aiMatrix4x4(), mesh);
  return mesh;
}

template <typename Unwanted>
int drop_triangles(TriangleMesh& mesh, Unwanted unwanted) {
  const auto end = std::remove_if(mesh.triangles.begin(), mesh.triangles.end(), unwanted);
  const auto dropped = mesh.triangles.end() - end;
  mesh.triangles.erase(end, mesh.triangles.end());
  return static_cast<int>(dropped);
}

/// Drops later copies of a triangle, however their corners are turned.
int drop_duplicates(TriangleMesh& mesh) {
  std::set<Triangle> seen;
  return drop_triangles(mesh, [&](Triangle t) {
    std::sort(t.begin(), t.end());
    return !seen.insert(t).second;
  });
}

/// Welds, drops what has no area or stands twice, and turns the rest outward.
MeshFaults mend(const std::string& path, TriangleMesh& mesh, std::vector<std::string>& warnings) {
  const auto warn = [&](int n, const std::string& what) {
    if (n > 0) warnings.push_back(path + ": " + what);
  };
  const int all = static_cast<int>(mesh.triangles.size());
  int collapsed = weld(mesh, 0.0).removed_triangles;
  const int open = inspect(mesh).boundary_edges;
  collapsed += weld(mesh, weld_tolerance).removed_triangles;
  if (mesh.triangles.empty()) {
    fail(path, "every one of its " + count(all, "triangle") +
                   " is smaller than 1e-8 m, is its scale right? (0.001 for a mesh in millimetres)");
  }
  warn(collapsed, "dropped " + count(collapsed, "triangle") + " smaller than 1e-8 m");
  MeshFaults faults = inspect(mesh);
  const int joined = open - faults.boundary_edges;
  warn(joined, "closed " + count(joined, "boundary edge") + " by joining vertices closer than 1e-8 m");
  int dropped = 0;
  if (faults.degenerate_triangles > 0) {
    const int flat = drop_triangles(mesh, [&](const Triangle& t) {
      return inspect(TriangleMesh{{mesh.vertices[t[0]], mesh.vertices[t[1]], mesh.vertices[t[2]]}, {{0, 1, 2}}})
                 .degenerate_triangles > 0;
    });
    warn(flat, "dropped " + count(flat, "triangle") + " without area");
    dropped += flat;
  }
  if (faults.duplicate_triangles > 0) {
    const int doubled = drop_duplicates(mesh);
    warn(doubled, "dropped " + count(doubled, "triangle") + " that stand twice");
    dropped += doubled;
  }
  if (mesh.triangles.empty()) fail(path, "none of its " + count(all, "triangle") + " has an area, export it again");
  if (dropped > 0) {
    weld(mesh, weld_tolerance);  // drops the vertices that are left over
    faults = inspect(mesh);
  }
  if (faults.non_manifold_edges == 0 && faults.non_finite_vertices == 0) {
    const int turned = orient_outward(mesh);
    warn(turned, "turned " + count(turned, "triangle") + " that faced inward");
    if (turned > 0) faults = inspect(mesh);
  }
  return faults;
}

}  // namespace

TriangleMesh read_mesh(const std::string& path, const Vector3& scale) {
  const std::size_t dot = path.rfind('.');
  std::string ending = dot == std::string::npos ? "" : path.substr(dot);
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  const std::array<const char*, 4> known = {".stl", ".obj", ".ply", ".dae"};
  if (std::find(known.begin(), known.end(), ending) == known.end()) {
    fail(path, "is not a mesh that can be read, allowed are .stl, .obj, .ply and .dae");
  }
  TriangleMesh mesh;
  try {
    mesh = read_surface(path, ending, read_bytes(path));
  } catch (const SceneError&) {
    throw;
  } catch (const std::runtime_error& error) {
    fail(path, "cannot be read as a mesh (" + one_line(error.what()) + "), export it again");
  }
  for (Vector3& p : mesh.vertices) p = scale.cwiseProduct(p);
  if (mesh.triangles.empty()) fail(path, "holds no triangles, export the surface, not only its points or lines");
  return mesh;
}

TriangleMesh load_organ_mesh(const std::string& path, double scale, std::vector<std::string>& warnings) {
  return mend_organ_mesh(path, read_mesh(path, Vector3::Constant(scale)), warnings);
}

TriangleMesh mend_organ_mesh(const std::string& path, TriangleMesh mesh, std::vector<std::string>& warnings) {
  const MeshFaults faults = mend(path, mesh, warnings);
  if (!faults.closed_manifold()) fail(path, list_faults(faults) + ": " + cure_of(faults));
  const double size = size_of(mesh);
  if (!(enclosed_volume(mesh) > flat_ratio * size * size * size)) {
    fail(path, "encloses no volume, an organ is a closed surface around one");
  }
  return mesh;
}

InstrumentMesh load_instrument_mesh(const std::string& path, const Vector3& scale, std::vector<std::string>& warnings) {
  InstrumentMesh result{read_mesh(path, scale), true};
  TriangleMesh& mesh = result.mesh;
  const int lost = drop_triangles(mesh, [&](const Triangle& t) {
    return !std::all_of(t.begin(), t.end(), [&](int v) { return mesh.vertices[v].allFinite(); });
  });
  if (lost > 0) warnings.push_back(path + ": dropped " + count(lost, "triangle") + " with non-finite vertices");
  if (mesh.triangles.empty()) fail(path, "has no finite vertices, export it again");
  MeshFaults faults = mend(path, mesh, warnings);
  if (faults.boundary_edges > 0) {
    const int edges = faults.boundary_edges;
    const int holes = close_holes(mesh);
    if (holes > 0) {
      warnings.push_back(path + ": closed " + count(holes, "hole") + " (" + count(edges, "boundary edge") + ")");
      std::vector<std::string> after_closing;
      faults = mend(path, mesh, after_closing);
    }
  }
  result.closed = faults.closed_manifold();
  if (!result.closed) {
    warnings.push_back(path + ": used as it is, with " + list_faults(faults) +
                       ": what is inside it is not defined everywhere");
  }
  return result;
}

}  // namespace tissue_sim
