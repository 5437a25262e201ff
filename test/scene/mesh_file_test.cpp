#include "tissue_sim/scene/mesh_file.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <cstring>
#include <limits>
#include <sstream>

#include "scene/obj_text.h"
#include "tissue_sim/geometry/primitives.h"
#include "tissue_sim/scene/scene.h"
#include "tissue_sim/study/temporary_folder.h"

namespace tissue_sim::mesh_file_test {
namespace {

std::string ply_of(const TriangleMesh& mesh) {
  std::ostringstream text;
  text.precision(9);
  text << "ply\nformat ascii 1.0\nelement vertex " << mesh.vertices.size()
       << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << mesh.triangles.size()
       << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const Vector3& p : mesh.vertices) text << p.transpose() << "\n";
  for (const Triangle& t : mesh.triangles) text << "3 " << t[0] << " " << t[1] << " " << t[2] << "\n";
  return text.str();
}

/// Binary; corner 0 of every triangle moved by `noise` along x.
std::string stl_of(const TriangleMesh& mesh, float noise) {
  std::string bytes(80, ' ');
  const auto put = [&](const auto& value) {
    char raw[sizeof value];
    std::memcpy(raw, &value, sizeof value);
    bytes.append(raw, sizeof value);
  };
  put(static_cast<std::uint32_t>(mesh.triangles.size()));
  for (const Triangle& t : mesh.triangles) {
    for (int i = 0; i < 3; ++i) put(0.0f);
    for (const int v : t) {
      put(static_cast<float>(mesh.vertices[v].x()) + (v == t[0] ? noise : 0.0f));
      put(static_cast<float>(mesh.vertices[v].y()));
      put(static_cast<float>(mesh.vertices[v].z()));
    }
    put(std::uint16_t{0});
  }
  return bytes;
}

/// A tetrahedron with corners 0 and 1 on each axis, its node moved by 5 along x, in centimetres, z up.
const char* const collada = R"(<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
<asset><unit name="centimeter" meter="0.01"/><up_axis>Z_UP</up_axis></asset>
<library_geometries><geometry id="g"><mesh>
<source id="p"><float_array id="a" count="12">0 0 0 1 0 0 0 1 0 0 0 1</float_array><technique_common>
<accessor source="#a" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/>
<param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
<triangles count="4"><input semantic="VERTEX" source="#v" offset="0"/><p>0 2 1 0 1 3 0 3 2 1 2 3</p></triangles>
</mesh></geometry></library_geometries>
<library_visual_scenes><visual_scene id="s"><node><translate>5 0 0</translate><instance_geometry url="#g"/></node>
</visual_scene></library_visual_scenes>
<scene><instance_visual_scene url="#s"/></scene></COLLADA>
)";

std::string error_of(const std::string& path) {
  std::vector<std::string> warnings;
  try {
    load_organ_mesh(path, 1.0, warnings);
  } catch (const SceneError& error) {
    return error.what();
  }
  return "";
}

TEST(OrganMesh, EveryFormatGivesTheSameSurface) {
  const TemporaryFolder folder;
  const TriangleMesh sphere = make_sphere(50.0, 16);
  for (const std::string& path : {folder.write("a.obj", obj_of(sphere, 9)), folder.write("b.PLY", ply_of(sphere)),
                                  folder.write("c.stl", stl_of(sphere, 0.0f))}) {
    std::vector<std::string> warnings;
    const TriangleMesh mesh = load_organ_mesh(path, 0.001, warnings);
    EXPECT_TRUE(warnings.empty()) << path << ": " << warnings[0];
    EXPECT_EQ(mesh.vertices.size(), sphere.vertices.size()) << path;
    EXPECT_EQ(mesh.triangles.size(), sphere.triangles.size()) << path;
    EXPECT_TRUE(inspect(mesh).closed_manifold()) << path;
    EXPECT_NEAR(enclosed_volume(mesh), 1e-9 * enclosed_volume(sphere), 1e-10) << path;
  }
}

TEST(OrganMesh, ColladaKeepsItsUnitAndItsNodes) {
  const TemporaryFolder folder;
  std::vector<std::string> warnings;
  const TriangleMesh mesh = load_organ_mesh(folder.write("t.dae", collada), 1.0, warnings);
  EXPECT_EQ(mesh.triangles.size(), 4u);
  EXPECT_NEAR(enclosed_volume(mesh), 1e-6 / 6.0, 1e-12);
  double high = 0.0, top = 0.0;
  for (const Vector3& p : mesh.vertices) {
    high = std::max(high, p.x());
    top = std::max(top, p.z());
  }
  EXPECT_NEAR(high, 0.06, 1e-7);
  EXPECT_NEAR(top, 0.01, 1e-7);
}

TEST(OrganMesh, ColladaWithAnotherUpAxisIsNotTurned) {
  const TemporaryFolder folder;
  std::string text = collada;
  text.replace(text.find("Z_UP"), 4, "Y_UP");
  const TriangleMesh as_it_is = read_mesh(folder.write("z.dae", collada), Vector3::Ones());
  const TriangleMesh y_up = read_mesh(folder.write("y.dae", text), Vector3::Ones());
  ASSERT_EQ(y_up.vertices.size(), as_it_is.vertices.size());
  for (std::size_t v = 0; v < y_up.vertices.size(); ++v) EXPECT_EQ(y_up.vertices[v], as_it_is.vertices[v]);
}

/// As modelling programs write it: with libraries of other things, empty ones, and what is bound to the mesh.
TEST(OrganMesh, ColladaWithMoreThanAShapeLoads) {
  const TemporaryFolder folder;
  std::string text = collada;
  const auto insert = [&](const char* before, const char* what) { text.insert(text.find(before), what); };
  insert(
      "<library_geometries>",
      "<library_cameras/><library_images/><library_effects><effect id='e'><profile_COMMON><technique sid='t'><lambert>"
      "<diffuse><color>1 1 1 1</color></diffuse></lambert></technique></profile_COMMON></effect></library_effects>"
      "<library_materials><material id='m'><instance_effect url='#e'/></material></library_materials>");
  insert("<library_visual_scenes>",
         "<library_controllers/><library_nodes><node id='n'><instance_geometry url='#g'><bind_material>"
         "<technique_common><instance_material symbol='m' target='#m'/></technique_common></bind_material>"
         "</instance_geometry><extra><technique profile='x'><a b='>'>0</a></technique></extra></node></library_nodes>");
  insert("</visual_scene>",
         "<node><matrix sid='t'>1 0 0 9 0 1 0 0 0 0 1 0 0 0 0 1</matrix><instance_node url='#n'/></node>");
  std::vector<std::string> warnings;
  const TriangleMesh mesh = load_organ_mesh(folder.write("t.dae", text), 1.0, warnings);
  EXPECT_EQ(mesh.triangles.size(), 8u) << "the tetrahedron twice, once as a node of the library";
  EXPECT_NEAR(enclosed_volume(mesh), 2e-6 / 6.0, 1e-12);
}

TEST(OrganMesh, PolygonsAreCut) {
  const TemporaryFolder folder;
  std::vector<std::string> warnings;
  const TriangleMesh cube =
      load_organ_mesh(folder.write("cube.obj",
                                   "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nv 1 0 1\nv 1 1 1\nv 0 1 1\n"
                                   "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"),
                      1.0, warnings);
  EXPECT_EQ(cube.triangles.size(), 12u);
  EXPECT_NEAR(enclosed_volume(cube), 1.0, 1e-12);
}

TEST(OrganMesh, MendsWhatItCanAndSaysWhat) {
  const TemporaryFolder folder;
  TriangleMesh mesh = make_sphere(50.0, 16);
  for (Triangle& t : mesh.triangles) std::swap(t[0], t[1]);
  mesh.triangles.push_back(mesh.triangles[7]);
  std::vector<std::string> warnings;
  const TriangleMesh mended = load_organ_mesh(folder.write("m.obj", obj_of(mesh, 9)), 0.001, warnings);
  EXPECT_TRUE(inspect(mended).closed_manifold());
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_NE(warnings[0].find("dropped 1 triangle that stand"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[1].find("turned 480 triangles"), std::string::npos) << warnings[1];
}

TEST(OrganMesh, CornersThatDifferInTheirLastBitsAreOne) {
  const TemporaryFolder folder;
  const std::string path = folder.write("n.stl", stl_of(make_sphere(0.05, 16), 4e-9f));
  std::vector<std::string> warnings;
  EXPECT_TRUE(inspect(load_organ_mesh(path, 1.0, warnings)).closed_manifold());
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("by joining vertices closer than 1e-8 m"), std::string::npos);
}

TEST(OrganMesh, SeveralSurfacesAreOneOrgan) {
  const TemporaryFolder folder;
  TriangleMesh mesh = make_sphere(1.0, 8);
  const int first = static_cast<int>(mesh.vertices.size());
  for (const Vector3& p : make_sphere(1.0, 8).vertices) mesh.vertices.push_back(p + Vector3(4, 0, 0));
  for (const Triangle& t : make_sphere(1.0, 8).triangles) {
    mesh.triangles.push_back({t[0] + first, t[1] + first, t[2] + first});
  }
  std::vector<std::string> warnings;
  EXPECT_EQ(inspect(load_organ_mesh(folder.write("two.obj", obj_of(mesh, 9)), 1.0, warnings)).components, 2);
}

TEST(OrganMesh, AHoleIsAnErrorWithItsCount) {
  const TemporaryFolder folder;
  TriangleMesh mesh = make_sphere(1.0, 8);
  mesh.triangles.pop_back();
  const std::string error = error_of(folder.write("hole.obj", obj_of(mesh, 9)));
  EXPECT_NE(error.find("3 boundary edges: an organ is a closed surface, close its holes"), std::string::npos) << error;
}

TEST(OrganMesh, EveryTruncationLoadsOrIsASceneError) {
  const TemporaryFolder folder;
  const TriangleMesh sphere = make_sphere(50.0, 4);
  const std::pair<const char*, std::string> files[] = {
      {"t.obj", obj_of(sphere, 9)}, {"t.ply", ply_of(sphere)}, {"t.stl", stl_of(sphere, 0.0f)}, {"t.dae", collada}};
  for (const auto& [name, text] : files) {
    int refused = 0;
    for (std::size_t length = 0; length < text.size(); length += 7) {
      refused += !error_of(folder.write(name, text.substr(0, length))).empty();
    }
    EXPECT_GT(refused, 0) << name;
    EXPECT_EQ(error_of(folder.write(name, text)), "") << name;
  }
}

TEST(InstrumentMesh, HolesAreClosed) {
  const TemporaryFolder folder;
  TriangleMesh mesh = make_sphere(5.0, 16);
  mesh.triangles.erase(mesh.triangles.end() - 16, mesh.triangles.end());
  std::vector<std::string> warnings;
  const InstrumentMesh loaded =
      load_instrument_mesh(folder.write("i.obj", obj_of(mesh, 9)), Vector3::Constant(0.001), warnings);
  EXPECT_TRUE(loaded.closed);
  EXPECT_TRUE(inspect(loaded.mesh).closed_manifold());
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("closed 1 hole (16 boundary edges)"), std::string::npos) << warnings[0];
}

TEST(InstrumentMesh, WhatCannotBeMendedIsUsed) {
  const TemporaryFolder folder;
  TriangleMesh mesh = make_sphere(5.0, 16);
  mesh.vertices.emplace_back(9, 9, 9);
  mesh.triangles.push_back({0, 1, static_cast<int>(mesh.vertices.size()) - 1});  // a fin
  std::vector<std::string> warnings;
  const InstrumentMesh loaded =
      load_instrument_mesh(folder.write("i.obj", obj_of(mesh, 9)), Vector3::Constant(0.001), warnings);
  EXPECT_FALSE(loaded.closed);
  EXPECT_EQ(loaded.mesh.triangles.size(), 481u);
  ASSERT_FALSE(warnings.empty());
  EXPECT_NE(warnings.back().find("used as it is, with 2 boundary edges, 1 non-manifold edge"), std::string::npos)
      << warnings.back();
}

TEST(InstrumentMesh, AMirroredScaleStillFacesOutward) {
  const TemporaryFolder folder;
  std::vector<std::string> warnings;
  const InstrumentMesh loaded =
      load_instrument_mesh(folder.write("i.obj", obj_of(make_sphere(5.0, 8), 9)), {0.001, -0.001, 0.001}, warnings);
  EXPECT_TRUE(loaded.closed);
  EXPECT_GT(enclosed_volume(loaded.mesh), 0.0);
}

TEST(InstrumentMesh, NonFiniteTrianglesAreDropped) {
  const TemporaryFolder folder;
  TriangleMesh mesh = make_sphere(5.0, 8);
  mesh.vertices[20].x() = std::numeric_limits<double>::quiet_NaN();
  std::vector<std::string> warnings;
  const InstrumentMesh loaded =
      load_instrument_mesh(folder.write("i.stl", stl_of(mesh, 0.0f)), Vector3::Constant(0.001), warnings);
  EXPECT_TRUE(loaded.closed);
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_NE(warnings[0].find("dropped 6 triangles with non-finite vertices"), std::string::npos) << warnings[0];
  EXPECT_NE(warnings[1].find("closed 1 hole (6 boundary edges)"), std::string::npos) << warnings[1];
}

}  // namespace
}  // namespace tissue_sim::mesh_file_test
